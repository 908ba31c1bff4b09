#!/usr/bin/env python3
"""Writes two large files for timing the loader: make_big.py FOLDER [MB] [NODES].

FOLDER/big.glb    one mesh of about MB megabytes (default 190): a wavy grid with normals, coordinates, 32-bit indices
FOLDER/nodes.gltf NODES nodes (default 200000, 14 MB of JSON) that place one triangle
"""
import array
import base64
import json
import math
import struct
import sys
import zlib
from pathlib import Path

JSON, BIN = 0x4E4F534A, 0x004E4942


def big(path, megabytes):
    # A vertex takes 32 bytes and two triangles 24.
    side = max(2, math.isqrt(int(megabytes * 1e6 / 56)))
    positions, normals, uvs, indices = (array.array(t) for t in "fffI")
    height = [0.02 * math.sin(0.05 * i) for i in range(side)]
    for y in range(side):
        for x in range(side):
            positions.extend((x / side, height[x] + height[y], y / side))
            uvs.extend((x / side, y / side))
    normals.extend((0.0, 1.0, 0.0) * (side * side))
    for y in range(side - 1):
        row = y * side
        for x in range(row, row + side - 1):
            indices.extend((x, x + side, x + 1, x + 1, x + side, x + side + 1))
    parts = [p.tobytes() for p in (positions, normals, uvs, indices)]
    views, offset = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
        offset += len(part)
    n = side * side
    accessor = lambda view, component, kind, count: {
        "bufferView": view, "componentType": component, "type": kind, "count": count}
    root = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "data:image/png;base64," + pixel()}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3,
                                    "material": 0}]}],
        "accessors": [accessor(0, 5126, "VEC3", n), accessor(1, 5126, "VEC3", n), accessor(2, 5126, "VEC2", n),
                      accessor(3, 5125, "SCALAR", len(indices))],
        "bufferViews": views, "buffers": [{"byteLength": offset}],
    }
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as out:
        out.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + offset, len(text), JSON) + text)
        out.write(struct.pack("<II", offset, BIN))
        out.writelines(parts)


def nodes(path, count):
    points = base64.b64encode(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)).decode()
    root = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": list(range(count))}],
        "nodes": [{"name": f"n{i}", "mesh": 0, "translation": [i % 100, i // 100, 0.5]} for i in range(count)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64," + points}],
    }
    path.write_text(json.dumps(root))


def pixel():
    """A PNG of one white pixel, base64."""
    chunk = lambda kind, data: (struct.pack(">I", len(data)) + kind + data
                                + struct.pack(">I", zlib.crc32(kind + data)))
    header = struct.pack(">IIBBBBB", 1, 1, 8, 0, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0\xff"))
    return base64.b64encode(png + chunk(b"IEND", b"")).decode()


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    big(folder / "big.glb", float(sys.argv[2]) if len(sys.argv) > 2 else 190)
    nodes(folder / "nodes.gltf", int(sys.argv[3]) if len(sys.argv) > 3 else 200_000)
