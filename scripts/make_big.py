#!/usr/bin/env python3
"""Writes large files: make_big.py FOLDER [MB] [NODES] for timing the loader, make_big.py FOLDER placed [INSTANCES] for
instances.

FOLDER/big.glb    one mesh of about MB megabytes (default 190): a wavy grid with normals, coordinates, 32-bit indices
FOLDER/nodes.gltf NODES nodes (default 200000, 14 MB of JSON) that place one triangle
FOLDER/placed.glb INSTANCES (default 1000000) of one mesh of 10,000 triangles, by EXT_mesh_gpu_instancing
"""
import array
import base64
import json
import math
import random
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


def placed(path, count):
    """Bumpy balls on a wavy field, turned and scaled at random."""
    rows, columns = 50, 100
    balls, indices = (array.array(t) for t in "fI")
    for row in range(rows + 1):
        theta = math.pi * row / rows
        for column in range(columns):
            phi = 2 * math.pi * column / columns
            r = 0.4 * (1 + 0.12 * math.sin(7 * phi) * math.sin(9 * theta))
            balls.extend((r * math.sin(theta) * math.cos(phi), r * math.cos(theta), -r * math.sin(theta) * math.sin(phi)))
    for row in range(rows):
        for column in range(columns):
            a, b = row * columns + column, row * columns + (column + 1) % columns
            indices.extend((a, a + columns, b + columns, a, b + columns, b))
    rng, side = random.Random(5), max(1, math.isqrt(count))
    moves, turns, sizes = (array.array("f") for _ in range(3))
    for i in range(count):
        x, z = i % side + rng.random(), i // side + rng.random()
        moves.extend((x, 3 * math.sin(0.02 * x) * math.cos(0.017 * z), z))
        half = math.pi * rng.random()
        turns.extend((0.0, math.sin(half), 0.0, math.cos(half)))
        s = 0.6 + rng.random()
        sizes.extend((s, s * (0.7 + 0.6 * rng.random()), s))
    parts = [p.tobytes() for p in (balls, indices, moves, turns, sizes)]
    views, offset = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
        offset += len(part)
    accessor = lambda view, component, kind, n: {"bufferView": view, "componentType": component, "type": kind, "count": n}
    root = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}], "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {
                      "attributes": {"TRANSLATION": 2, "ROTATION": 3, "SCALE": 4}}}},
                  {"camera": 0, "translation": [side / 2, 25, side + 20], "rotation": [-0.17, 0, 0, 0.98545]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
        "meshes": [{"name": "ball", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [accessor(0, 5126, "VEC3", len(balls) // 3), accessor(1, 5125, "SCALAR", len(indices)),
                      accessor(2, 5126, "VEC3", count), accessor(3, 5126, "VEC4", count),
                      accessor(4, 5126, "VEC3", count)],
        "bufferViews": views, "buffers": [{"byteLength": offset}],
    }
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as out:
        out.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + offset, len(text), JSON) + text)
        out.write(struct.pack("<II", offset, BIN))
        out.writelines(parts)


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
    if sys.argv[2:3] == ["placed"]:
        placed(folder / "placed.glb", int(sys.argv[3]) if len(sys.argv) > 3 else 1_000_000)
        sys.exit()
    big(folder / "big.glb", float(sys.argv[2]) if len(sys.argv) > 2 else 190)
    nodes(folder / "nodes.gltf", int(sys.argv[3]) if len(sys.argv) > 3 else 200_000)
