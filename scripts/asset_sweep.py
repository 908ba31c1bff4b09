#!/usr/bin/env python3
"""Renders every sample asset below a folder and prints what became of each: the table of docs/assets.md.

    scripts/asset_sweep.py [ASSETS] [--out DIR] [--table FILE.md] [--sheet FILE.png]

ASSETS (default ../shared/assets) is a folder of .gltf, .glb and .obj files, with a manifest.json that says how many errors
the Khronos validator finds in each glTF file (absent: none are known). Every file is rendered by a process of its own, so that
a crash or a hang of one is a row and not the end. Exit 1 if a file that is valid and requires nothing unknown fails, if any
file panics, hangs or gives a sample that is not finite, or if a refusal does not say where it is.
--sheet makes a contact sheet of the files in SHEET; it needs Python's OpenImageIO, which scripts/test.sh brings (.venv).
"""

import argparse
import collections
import json
import os
import re
import struct
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# Extensions that a file may require. The others of the assets are refused by name.
READ = {
    "KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular",
    "KHR_materials_anisotropy", "KHR_materials_clearcoat", "KHR_materials_diffuse_transmission", "KHR_materials_dispersion",
    "KHR_materials_iridescence", "KHR_materials_pbrSpecularGlossiness", "KHR_materials_sheen", "KHR_materials_transmission",
    "KHR_materials_variants", "KHR_materials_volume", "KHR_materials_unlit", "KHR_mesh_quantization", "KHR_node_visibility", "KHR_texture_transform",
    "EXT_mesh_gpu_instancing", "EXT_texture_webp",
    # Without effect on a picture.
    "KHR_xmp", "KHR_xmp_json_ld", "KHR_animation_pointer", "KHR_interactivity",
    "KHR_node_hoverability", "KHR_node_selectability",
}
# Of the contact sheet: folder or file, and what its label says.
SHEET = [
    "NormalTangentTest", "TextureSettingsTest", "VertexColorTest", "MultiUVTest", "OrientationTest", "AlphaBlendModeTest",
    "TextureCoordinateTest", "TextureEncodingTest", "TextureTransformTest", "UnlitTest", "BoxVertexColors",
    "SimpleInstancing", "TwoSidedPlane", "MeshPrimitiveModes", "CompareNormal", "CompareRoughness", "SpecularTest",
    "EmissiveStrengthTest", "Duck", "FlightHelmet", "SheenChair", "Suzanne", "Spot",
]
TIMEOUT = 300
HEADING = """# What becomes of the sample assets

Made by `scripts/asset_sweep.py --table docs/assets.md --sheet docs/assets.png`: every `.gltf`, `.glb` and `.obj` file of a set of
sample assets (Khronos' sample models and asset generator, corpora of malformed files, models of loaders' tests), each
rendered by a process of its own. *Validator errors* are those that the Khronos glTF validator finds. The assets
themselves are not part of this repository.

![contact sheet](assets.png)

64 samples a pixel, the built-in studio, cameras framed on the bounds (TextureSettingsTest with `--cull-backfaces`,
as its first row asks for). The pictured models are by their authors, most from Khronos' glTF-Sample-Assets: CC0
(NormalTangentTest, TextureCoordinateTest, TextureEncodingTest, TextureTransformTest, BoxVertexColors, SimpleInstancing,
TwoSidedPlane, MeshPrimitiveModes, CompareNormal and CompareRoughness, FlightHelmet, SheenChair, Suzanne, and Spot by
Keenan Crane), CC-BY 4.0 (TextureSettingsTest, VertexColorTest, MultiUVTest, OrientationTest, AlphaBlendModeTest,
UnlitTest, SpecularTest, EmissiveStrengthTest), and Duck under the SCEA Shared Source License; glTF is a mark of Khronos.

"""


def document(path):
    """The JSON of a glTF file, or None if it cannot be read as such."""
    try:
        data = open(path, "rb").read()
        if data[:4] == b"glTF":
            length = struct.unpack("<I", data[12:16])[0]
            data = data[20:20 + length]
        return json.loads(data.decode("utf-8-sig"))
    except (OSError, ValueError, struct.error):
        return None


def files(root):
    """All scene files below `root`, sorted, relative to it."""
    found = []
    for folder, _, names in os.walk(root):
        found += [os.path.relpath(os.path.join(folder, n), root) for n in names
                  if n.lower().endswith((".gltf", ".glb", ".obj"))]
    return sorted(found)


def render(binary, path, out, size, spp, more):
    """Renders one file; its image report, and what the process said."""
    command = [binary, path, "--out", out, "--size", f"{size}x{size}", "--spp", str(spp), "--camera", "0", "--json",
               "--progress", "none", "--no-exr", "--force", *more]
    # --force: it is the program that has changed since the last sweep, not the files.
    start = time.time()
    try:
        done = subprocess.run(command, capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return None, f"hangs: no end after {TIMEOUT} s", time.time() - start
    seconds = time.time() - start
    error = done.stderr.decode("utf-8", "replace")
    if done.returncode not in (0, 1, 3) or "panicked" in error:
        return None, f"exit {done.returncode}: {error.strip()[:200]}", seconds
    return json.loads(done.stdout)["images"][0], error, seconds


def judge(row):
    """What is wrong with a row, or nothing."""
    image, required = row["image"], row["required"]
    if image is None:
        return row["said"]
    message = image["error_message"] or ""
    if "internal error" in message:
        return message
    if image["non_finite_samples"]:
        return f"{image['non_finite_samples']} samples are not finite"
    if image["status"] in ("rendered", "empty"):
        return ""
    unread = [e for e in required if e not in READ]
    if unread:
        return "" if any(e in message for e in unread) else f"the refusal does not name {', '.join(unread)}: {message}"
    # OBJ files are not judged by the validator. A file that asks for a later glTF is valid, and not to be read.
    is_obj = row["file"].lower().endswith(".obj")
    if is_obj and re.search(r"\.obj: \d+:\d+: ", message) or "/asset/minVersion" in message:
        return ""
    if row["errors"] == 0:
        return f"valid but refused: {message}"
    return "" if os.path.basename(row["file"]) in message else f"the message does not say where: {message}"


def outcome(row, root):
    """One cell of the table; paths are shown from `root`."""
    image = row["image"]
    if image is None:
        return "**" + row["said"].splitlines()[0] + "**"
    if image["status"] == "failed":
        message = image["error_message"].splitlines()[0].replace(root + os.sep, "")
        return "refused: " + message[message.find(os.path.basename(row["file"])):].replace("|", "\\|")[:150]
    warnings = len(image["warnings"])
    return image["status"] + (f", {warnings} warning{'s' if warnings > 1 else ''}" if warnings else "")


def contact_sheet(rows, out, target, tile):
    """A PNG of the tiles of SHEET with their names."""
    import OpenImageIO as oiio
    chosen = []
    for name in SHEET:
        found = [r for r in rows if r["file"].split(os.sep)[0] == name and r["image"] and r["image"]["outputs"]["png"]]
        if found:
            chosen.append((name, found[0]["image"]["outputs"]["png"]))
    columns = 6
    height = tile + 18
    lines = (len(chosen) + columns - 1) // columns
    sheet = oiio.ImageBuf(oiio.ImageSpec(columns * tile, lines * height, 3, "uint8"))
    for i, (name, picture) in enumerate(chosen):
        x, y = i % columns * tile, i // columns * height
        image = oiio.ImageBufAlgo.resize(oiio.ImageBuf(picture), roi=oiio.ROI(0, tile, 0, tile, 0, 1, 0, 3))
        oiio.ImageBufAlgo.paste(sheet, x, y, 0, 0, image)
        oiio.ImageBufAlgo.render_text(sheet, x + 4, y + tile + 13, name, 11, textcolor=(1, 1, 1))
    sheet.write(target)
    print(f"wrote {target}: {len(chosen)} pictures", file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("assets", nargs="?", default=os.path.join(ROOT, "..", "shared", "assets"))
    parser.add_argument("--binary", default=os.path.join(ROOT, "target", "release", "prt-batch"))
    parser.add_argument("--out", default=os.path.join(ROOT, "target", "assets"))
    parser.add_argument("--only", help="files whose path has this in it")
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--spp", type=int, default=4)
    parser.add_argument("--table", help="write the table here instead of to stdout")
    parser.add_argument("--sheet", help="write a contact sheet here")
    arguments = parser.parse_args()
    root = os.path.normpath(arguments.assets)
    if not os.path.isdir(root):
        print(f"skipped: there is no {root}")
        return 0
    manifest = {}
    if os.path.exists(os.path.join(root, "manifest.json")):
        manifest = {entry["file"]: entry for entry in json.load(open(os.path.join(root, "manifest.json")))}
    rows = []
    for number, file in enumerate(files(root)):
        if arguments.only and arguments.only not in file:
            continue
        path = os.path.join(root, file)
        loaded = document(path) if not file.lower().endswith(".obj") else {}
        errors = str(manifest.get(file, {}).get("validator_errors", "0"))
        wanted = file.split(os.sep)[0] in SHEET and arguments.sheet
        image, said, seconds = render(
            arguments.binary, path, os.path.join(arguments.out, str(number)),
            256 if wanted else arguments.size, 64 if wanted else arguments.spp,
            # Its label asks for it: the cross must not be seen from behind.
            ["--cull-backfaces"] if file.startswith("TextureSettingsTest") else [])
        row = {
            "file": file, "image": image, "said": said, "seconds": seconds,
            "required": (loaded or {}).get("extensionsRequired", []) if isinstance(loaded, dict) else [],
            "errors": int(errors) if errors.isdigit() else -1,
        }
        row["wrong"] = judge(row)
        rows.append(row)
    table = ["| file | validator errors | requires | outcome |", "|---|---|---|---|"]
    for row in rows:
        errors = "?" if row["errors"] < 0 else "-" if row["file"].lower().endswith(".obj") else row["errors"]
        table.append(f"| {row['file']} | {errors} | {', '.join(row['required'])} | {outcome(row, root)} |")
    counts = collections.Counter(r["image"]["status"] if r["image"] else "broken" for r in rows)
    valid = [r for r in rows if r["errors"] == 0 and not [e for e in r["required"] if e not in READ]]
    fine = sum(1 for r in valid if r["image"] and r["image"]["status"] != "failed")
    total = (f"{len(rows)} files: " + ", ".join(f"{n} {status}" for status, n in sorted(counts.items()))
             + f". Valid and requiring nothing unknown: {fine} of {len(valid)} rendered or empty.")
    if arguments.table:
        with open(arguments.table, "w") as file:
            file.write(f"{HEADING}{total}\n\n" + "\n".join(table) + "\n")
    else:
        print("\n".join(table), total, sep="\n\n")
    if arguments.sheet:
        contact_sheet(rows, arguments.out, arguments.sheet, 160)
    wrong = [r for r in rows if r["wrong"]]
    for row in wrong:
        print(f"WRONG {row['file']}: {row['wrong']}", file=sys.stderr)
    print(total, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
