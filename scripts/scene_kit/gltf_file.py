"""Writes glTF 2.0 (.gltf + .bin + .png, or one .glb). Open this to change how the example scenes are encoded."""
import json
import math
import re
import struct
import sys
from array import array

from .vector import aim

INDEX_TYPES = {"u8": (5121, "B", 254), "u16": (5123, "H", 65534), "u32": (5125, "I", 2**32 - 2)}
WIDTHS = {"POSITION": 3, "NORMAL": 3, "TANGENT": 4, "TEXCOORD_0": 2}
TYPES = {2: "VEC2", 3: "VEC3", 4: "VEC4"}
# Six decimals hide the last-bit differences between maths libraries, so the files are the same everywhere.
DECIMALS = 6


def tidy(numbers):
    return [round(float(x), DECIMALS) + 0.0 for x in numbers]


def f32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


class GltfFile:
    """One scene. `files()` gives {file name: bytes}."""

    def __init__(self, stem, binary=False):
        self.stem, self.binary = stem, binary
        self.blob, self.pictures, self.used = bytearray(), {}, set()
        self.scene = {"name": stem, "nodes": []}
        self.doc = {"asset": {"version": "2.0", "generator": "prt-batch scripts/make_scenes.py"}, "scene": 0, "scenes": [self.scene]}
        self.lights, self.stored, self.triangles, self.emitters = [], {}, 0, 0

    def _put(self, key, value):
        rows = self.doc.setdefault(key, [])
        rows.append(value)
        return len(rows) - 1

    def _view(self, data, **more):
        self.blob.extend(b"\0" * (-len(self.blob) % 4))
        view = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), **more}
        self.blob.extend(data)
        return self._put("bufferViews", view)

    def geometry(self, shape, index="u16", layout="planar"):
        """Stores a shape once and returns its attributes and indices for any number of primitives.

        `layout`: "planar" = a view per attribute; "interleaved" = one strided view for all of them;
        "padded" = a view per attribute with 4 bytes of padding after each element.
        """
        key = (id(shape), index, layout)
        if key in self.stored:
            return self.stored[key][1]
        columns = {"POSITION": shape.positions, "NORMAL": shape.normals, "TANGENT": shape.tangents, "TEXCOORD_0": shape.uvs}
        columns = {name: [tidy(row) for row in rows] for name, rows in columns.items() if rows}
        count, attributes = len(shape.positions), {}

        def accessor(name, view, offset):
            rows, width = columns[name], WIDTHS[name]
            entry = {"bufferView": view, "byteOffset": offset, "componentType": 5126, "count": count, "type": TYPES[width]}
            if name == "POSITION":
                for word, pick in (("min", min), ("max", max)):
                    entry[word] = [f32(pick(row[i] for row in rows)) for i in range(width)]
            attributes[name] = self._put("accessors", entry)

        if layout == "interleaved":
            stride = 4 * sum(WIDTHS[name] for name in columns)
            data = b"".join(struct.pack(f"<{stride // 4}f", *(x for name in columns for x in columns[name][i])) for i in range(count))
            view, offset = self._view(data, byteStride=stride, target=34962), 0
            for name in columns:
                accessor(name, view, offset)
                offset += 4 * WIDTHS[name]
        else:
            pad = b"\0\0\0\0" if layout == "padded" else b""
            for name, rows in columns.items():
                data = b"".join(struct.pack(f"<{WIDTHS[name]}f", *row) + pad for row in rows)
                more = {"byteStride": 4 * WIDTHS[name] + 4} if pad else {}
                accessor(name, self._view(data, target=34962, **more), 0)
        component, letter, largest = INDEX_TYPES[index]
        flat = [i for triangle in shape.triangles for i in triangle]
        assert max(flat) <= largest, f"{self.stem}: {max(flat) + 1} vertices do not fit {index} indices"
        view = self._view(struct.pack(f"<{len(flat)}{letter}", *flat), target=34963)
        indices = self._put("accessors", {"bufferView": view, "componentType": component, "count": len(flat), "type": "SCALAR"})
        made = (attributes, indices, len(shape.triangles))
        self.stored[key] = (shape, made)  # the shape is kept so that its id is not used again
        return made

    def dense(self, mesh):
        """Stores a `dense.Dense` (positions only, flat arrays) and returns what `geometry` returns."""
        places = array("f", [round(x, DECIMALS) + 0.0 for x in mesh.positions])
        indices = array("I", mesh.indices)
        if sys.byteorder == "big":
            places.byteswap()
            indices.byteswap()
        count = len(places) // 3
        entry = {"bufferView": self._view(places.tobytes(), target=34962), "componentType": 5126, "count": count, "type": "VEC3"}
        for word, pick in (("min", min), ("max", max)):
            entry[word] = [pick(places[i::3]) for i in range(3)]
        position = self._put("accessors", entry)
        view = self._view(indices.tobytes(), target=34963)
        index = self._put("accessors", {"bufferView": view, "componentType": 5125, "count": len(indices), "type": "SCALAR"})
        return {"POSITION": position}, index, mesh.triangles

    def mesh(self, name, *parts):
        """Mesh of (geometry, material) pairs, one primitive each."""
        primitives = [{"attributes": g[0], "indices": g[1], "material": m} for g, m in parts]
        return self._put("meshes", {"name": name, "primitives": primitives})

    def material(self, name, color=(1.0, 1.0, 1.0), metallic=0.0, roughness=1.0, specular=None, emission=None, double_sided=False, more=None, **textures):
        """Metallic-roughness material. `color` is linear; `emission` is radiance in nits per channel.

        `textures`: base, metal_rough, normal, emissive = texture numbers. `more`: further extensions, as the file has them.
        """
        pbr = {"metallicFactor": metallic, "roughnessFactor": roughness}
        if tuple(color) != (1.0, 1.0, 1.0):
            pbr["baseColorFactor"] = tidy(color) + [1.0]
        for key, where in (("base", "baseColorTexture"), ("metal_rough", "metallicRoughnessTexture")):
            if key in textures:
                pbr[where] = {"index": textures[key]}
        entry, extensions = {"name": name, "pbrMetallicRoughness": pbr}, dict(more or {})
        for key, where in (("normal", "normalTexture"), ("emissive", "emissiveTexture")):
            if key in textures:
                entry[where] = {"index": textures[key]}
        if emission:
            peak = max(emission)
            entry["emissiveFactor"] = tidy(e / peak for e in emission)
            if peak != 1.0:
                extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": round(peak, DECIMALS)}
        if specular is not None:
            extensions["KHR_materials_specular"] = {"specularFactor": specular}
        if double_sided:
            entry["doubleSided"] = True
        if extensions:
            entry["extensions"] = extensions
            self.used.update(extensions)
        return self._put("materials", entry)

    def matte(self, name, color, **more):
        """Exactly Lambertian material."""
        return self.material(name, color, specular=0.0, **more)

    def lamp(self, name, emission, **more):
        """Black surface that emits `emission` nits from its front."""
        return self.material(name, (0.0, 0.0, 0.0), specular=0.0, emission=emission, **more)

    def texture(self, name, png):
        """Texture of a PNG: a file beside a .gltf, a buffer view inside a .glb."""
        if self.binary:
            image = {"name": name, "bufferView": self._view(png), "mimeType": "image/png"}
        else:
            file = f"{self.stem}_{name}.png"
            self.pictures[file] = png
            image = {"name": name, "uri": file, "mimeType": "image/png"}
        if "samplers" not in self.doc:
            self._put("samplers", {"magFilter": 9729, "minFilter": 9729, "wrapS": 10497, "wrapT": 10497})
        return self._put("textures", {"name": name, "sampler": 0, "source": self._put("images", image)})

    def node(self, name, mesh=None, at=None, turn=None, size=None, matrix=None, parent=None, **more):
        """Node under `parent` or the scene. `turn` is a quaternion, `matrix` 16 numbers, column after column."""
        entry = {"name": name}
        if mesh is not None:
            entry["mesh"] = mesh
            for primitive in self.doc["meshes"][mesh]["primitives"]:
                faces = self.doc["accessors"][primitive["indices"]]["count"] // 3
                self.triangles += faces
                self.emitters += "emissiveFactor" in self.doc["materials"][primitive["material"]]
        for key, value in (("translation", at), ("rotation", turn), ("matrix", matrix)):
            if value is not None:
                entry[key] = tidy(value)
        if size is not None:
            entry["scale"] = tidy(size if isinstance(size, (tuple, list)) else (size,) * 3)
        index = self._put("nodes", {**entry, **more})
        where = self.scene["nodes"] if parent is None else self.doc["nodes"][parent].setdefault("children", [])
        where.append(index)
        return index

    def camera(self, name, eye, target, yfov, aspect=16 / 9):
        """Perspective camera; `yfov` in degrees."""
        lens = {"yfov": round(math.radians(yfov), DECIMALS), "aspectRatio": round(aspect, DECIMALS), "znear": 0.01, "zfar": 100.0}
        camera = self._put("cameras", {"name": name, "type": "perspective", "perspective": lens})
        return self.node(name, at=eye, turn=aim(eye, target), camera=camera)

    def light(self, name, kind, intensity, color=(1.0, 1.0, 1.0), at=None, target=None, spot=None, up=(0.0, 1.0, 0.0)):
        """Punctual light: cd for point and spot, lux for directional. `spot` = (inner, outer) in degrees."""
        entry = {"name": name, "type": kind, "color": tidy(color), "intensity": round(intensity, DECIMALS)}
        if spot:
            entry["spot"] = {"innerConeAngle": round(math.radians(spot[0]), DECIMALS), "outerConeAngle": round(math.radians(spot[1]), DECIMALS)}
        self.lights.append(entry)
        self.used.add("KHR_lights_punctual")
        rotation = None if target is None else aim(at, target, up)
        return self.node(name, at=at, turn=rotation, extensions={"KHR_lights_punctual": {"light": len(self.lights) - 1}})

    def animation(self, name, node, path, times, values, tangents=None):
        """Moves `node`: LINEAR, or CUBICSPLINE with an (in, out) pair of `tangents` a key."""
        rows = list(values)
        if tangents:
            rows = [row for value, (into, out) in zip(values, tangents) for row in (into, value, out)]
        width = len(rows[0])

        def accessor(rows, kind, **more):
            data = struct.pack(f"<{len(rows) * len(rows[0])}f", *(x for row in rows for x in tidy(row)))
            return self._put("accessors", {"bufferView": self._view(data), "componentType": 5126, "count": len(rows), "type": kind, **more})

        keys = accessor([(t,) for t in times], "SCALAR", min=[f32(min(times))], max=[f32(max(times))])
        sampler = {"input": keys, "output": accessor(rows, TYPES[width]), "interpolation": "CUBICSPLINE" if tangents else "LINEAR"}
        target = {"node": node, "path": path}
        return self._put("animations", {"name": name, "samplers": [sampler], "channels": [{"sampler": 0, "target": target}]})

    def files(self):
        self.blob.extend(b"\0" * (-len(self.blob) % 4))
        buffer = {"byteLength": len(self.blob)}
        if not self.binary:
            buffer["uri"] = f"{self.stem}.bin"
        doc = {**self.doc, "buffers": [buffer]}
        if self.lights:
            doc["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        if self.used:
            doc["extensionsUsed"] = sorted(self.used)
        if self.binary:
            text = json.dumps(doc, separators=(",", ":")).encode()
            text += b" " * (-len(text) % 4)
            body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(self.blob), 0x004E4942) + bytes(self.blob)
            return {f"{self.stem}.glb": struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body}
        text = json.dumps(doc, indent=1)
        text = re.sub(r"\[([-+\d.e,\s]+)\]", lambda m: "[" + " ".join(m.group(1).split()) + "]", text)
        return {f"{self.stem}.gltf": (text + "\n").encode(), f"{self.stem}.bin": bytes(self.blob), **self.pictures}
