#!/usr/bin/env python3
"""What materials cost: CPU time of variants of scenes/cornell.gltf, paired and interleaved, one thread.

usage: bench_materials.py [--prt target/release/prt-batch] [--rounds 9] [--spp 64] [--size 256x256] [--brdf full]
                          [--accel bvh] [--only texture|null]

texture: every material Lambertian, against metallic 0.3, roughness 0.4 and a base colour texture on every one, the lamp
         included. ns/path = difference of the user CPU times over the camera paths; the two also differ in how long paths
         get, so the same is given at the Lambertian's number of vertices.
null:    metallic-roughness with a texture, against the same file with an extension that says nothing on every material:
         median of the paired ratios with its quartiles, and whether the EXRs are equal but for their fingerprint.
         `same file` is the noise.
Python's standard library only.
"""
import argparse
import base64
import copy
import json
import random
import resource
import statistics
import struct
import subprocess
import tempfile
from pathlib import Path

from scene_kit.pictures import png

SCENE = Path(__file__).resolve().parent.parent / "scenes" / "cornell.gltf"
NULL = {
    "KHR_materials_specular": {"specularFactor": 1.0, "specularColorFactor": [1, 1, 1]},
    "KHR_materials_ior": {"ior": 1.5},
    "KHR_materials_emissive_strength": {"emissiveStrength": 1.0},
    "KHR_materials_clearcoat": {"clearcoatFactor": 0.0, "clearcoatRoughnessFactor": 0.3},
    "KHR_materials_sheen": {"sheenColorFactor": [0, 0, 0], "sheenRoughnessFactor": 0.5},
    "KHR_materials_anisotropy": {"anisotropyStrength": 0.0, "anisotropyRotation": 0.7},
    "KHR_materials_iridescence": {"iridescenceFactor": 0.0, "iridescenceIor": 1.8},
    "KHR_materials_transmission": {"transmissionFactor": 0.0},
    "KHR_materials_volume": {"thicknessFactor": 0.0, "attenuationDistance": 0.2, "attenuationColor": [0.5, 0.6, 0.7]},
    "KHR_materials_dispersion": {"dispersion": 0.0},
    "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.0, "diffuseTransmissionColorFactor": [0.2, 0.5, 0.9]},
}


def cornell():
    """The file with its buffer inside."""
    doc = json.loads(SCENE.read_text())
    data = (SCENE.parent / doc["buffers"][0]["uri"]).read_bytes()
    doc["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return doc, data


def textured():
    """The same with metal, gloss and a texture of 256 x 256 light greys on every surface, mapped by position."""
    doc, data = cornell()
    rng, extra = random.Random(1), bytearray()
    rows = [bytes(c for _ in range(256) for c in [rng.randrange(245, 256)] * 3) for _ in range(256)]
    uri = "data:image/png;base64," + base64.b64encode(png(256, 256, rows)).decode()
    doc.update(images=[{"uri": uri}], textures=[{"source": 0}])
    for material in doc["materials"]:
        pbr = material["pbrMetallicRoughness"]
        pbr.update(metallicFactor=0.3, roughnessFactor=0.4, baseColorTexture={"index": 0})
        material.get("extensions", {}).pop("KHR_materials_specular", None)
    for mesh in doc["meshes"]:
        for primitive in mesh["primitives"]:
            accessor = doc["accessors"][primitive["attributes"]["POSITION"]]
            start = doc["bufferViews"][accessor["bufferView"]].get("byteOffset", 0) + accessor.get("byteOffset", 0)
            uvs = b""
            for i in range(accessor["count"]):
                x, y, z = struct.unpack_from("<3f", data, start + 12 * i)
                uvs += struct.pack("<2f", x + 0.37 * y, z + 0.61 * y)
            doc["bufferViews"].append({"buffer": 1, "byteOffset": len(extra), "byteLength": len(uvs)})
            doc["accessors"].append({"bufferView": len(doc["bufferViews"]) - 1, "componentType": 5126, "count": accessor["count"], "type": "VEC2"})
            primitive["attributes"]["TEXCOORD_0"] = len(doc["accessors"]) - 1
            extra.extend(uvs)
    doc["buffers"].append({"byteLength": len(extra), "uri": "data:application/octet-stream;base64," + base64.b64encode(bytes(extra)).decode()})
    return doc


def with_extension(doc, name):
    doc = copy.deepcopy(doc)
    for material in doc["materials"]:
        material.setdefault("extensions", {}).setdefault(name, NULL[name])
    doc["extensionsUsed"] = sorted({name, *doc.get("extensionsUsed", [])})
    return doc


class Bench:
    def __init__(self, options, folder):
        self.options, self.folder = options, Path(folder)

    def write(self, name, doc):
        file = self.folder / f"{name}.gltf"
        file.write_text(json.dumps(doc))
        return file

    def run(self, file):
        """User CPU seconds."""
        o = self.options
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run([o.prt, file, "--out", self.folder, "--size", o.size, "--spp", str(o.spp), "--brdf", o.brdf, "--accel", o.accel, "--threads", "1",
                        "--default-light", "off", "--no-png", "--no-report", "--force", "-q"], check=True)
        return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before

    def pairs(self, a, b):
        rounds = []
        for i in range(self.options.rounds):
            order = (a, b) if i % 2 else (b, a)
            took = [self.run(file) for file in order]
            rounds.append(tuple(took) if i % 2 else (took[1], took[0]))
        return rounds

    def rays(self, file):
        return json.loads((self.folder / f"{file.stem}.json").read_text())["rays"]

    def pixels(self, file):
        """The EXR's bytes without the value of prt:fingerprint, which names the files."""
        data = (self.folder / f"{file.stem}.exr").read_bytes()
        head = b"prt:fingerprint\0string\0"
        at = data.index(head) + len(head)
        size = struct.unpack_from("<I", data, at)[0]
        return data[:at] + data[at + 4 + size:]


def quartiles(values):
    return statistics.quantiles(values, n=4)


def texture(bench):
    lambert, rich = bench.write("lambert", cornell()[0]), bench.write("textured", textured())
    rounds = bench.pairs(lambert, rich)
    paths = bench.rays(lambert)["camera"]
    vertices = [1 + bench.rays(f)["bounce"] / paths for f in (lambert, rich)]
    low, middle, high = quartiles([(b - a) / paths * 1e9 for a, b in rounds])
    per_path = [statistics.median(r[i] for r in rounds) / paths * 1e9 for i in (0, 1)]
    print("| materials | ns/path | vertices/path | ns/vertex |\n|---|---|---|---|")
    for name, ns, v in zip(("Lambert", "metallic-roughness, texture"), per_path, vertices):
        print(f"| {name} | {ns:.0f} | {v:.2f} | {ns / v:.1f} |")
    level = [(b / vertices[1] * vertices[0] - a) / paths * 1e9 for a, b in rounds]
    print(f"\nmore: {middle:.0f} ns/path ({low:.0f}-{high:.0f}); at equal numbers of vertices {quartiles(level)[1]:.0f} ns/path")


def null(bench):
    plain = textured()
    for name in NULL:
        for material in plain["materials"]:
            material.get("extensions", {}).pop("KHR_materials_specular", None)
    base = bench.write("base", plain)
    print("\n| extension, null | time with / without | quartiles | picture |\n|---|---|---|---|")
    for name in ["same file", *NULL]:
        doc = plain if name == "same file" else with_extension(plain, name)
        other = bench.write("other", doc)
        low, middle, high = quartiles([b / a for a, b in bench.pairs(base, other)])
        same = "the same bits" if bench.pixels(base) == bench.pixels(other) else "DIFFERENT"
        print(f"| {name.removeprefix('KHR_materials_')} | {middle:.3f} | {low:.3f}-{high:.3f} | {same} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--prt", default="target/release/prt-batch", type=Path)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--brdf", default="full")
    parser.add_argument("--accel", default="bvh")
    parser.add_argument("--only", choices=["texture", "null"])
    options = parser.parse_args()
    options.prt = options.prt.resolve()
    with tempfile.TemporaryDirectory(prefix="prt-materials-") as folder:
        bench = Bench(options, folder)
        if options.only != "null":
            texture(bench)
        if options.only != "texture":
            null(bench)


if __name__ == "__main__":
    main()
