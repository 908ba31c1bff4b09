#!/usr/bin/env python3
"""Makes docs/seed/*.png and the speed table of docs/seed.md from scenes/seed.gltf.

usage: seed_report.py pictures [--spp N]       the features' pictures, before and after, into docs/seed/
       seed_report.py speed [--spp N]          brute force against the hierarchies, seconds per sample: a table on stdout

`--prt PATH` names the program (else target/release/prt-batch). Python's standard library only.
"""
import argparse
import copy
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCENES, OUT = ROOT / "scenes", ROOT / "docs" / "seed"
# Of the picture that crops are taken from.
SIZE = (960, 540)
# Frame 3 of 24 a second: the ball rises at 3.7 m/s.
FRAME = "3"
# Brute force is timed on windows of 24 x 16 pixels, one in each of 8 rows and columns: 1/675 of the picture.
FULL, PARTS, WINDOW = (1920, 1080), 8, (24, 16)


def node(doc, name):
    return next(n for n in doc["nodes"] if n.get("name") == name)


def material(doc, name):
    return next(m for m in doc["materials"] if m["name"] == name)


def primitives(doc, name):
    return doc["meshes"][node(doc, name)["mesh"]]["primitives"]


# Changes of the scene for the pictures of what was before.
def untextured(doc):
    del material(doc, "tiles")["pbrMetallicRoughness"]["baseColorTexture"]


def without_normal_map(doc):
    del material(doc, "bricks")["normalTexture"]


def flat(doc):
    still(doc)
    # The ball, 2,208 triangles: on the knot's 72,960 hardly anything shows.
    for primitive in primitives(doc, "flying ball"):
        primitive["attributes"] = {k: v for k, v in primitive["attributes"].items() if k != "NORMAL"}


def matte(doc):
    m = material(doc, "glossy principled")
    m.pop("extras", None)
    m["extensions"] = {"KHR_materials_specular": {"specularFactor": 0.0}}
    m["pbrMetallicRoughness"]["metallicFactor"] = 0.0


def still(doc):
    node(doc, "camera")["extras"]["prt_shutter"] = 0.0


def pinhole(doc):
    for key in ("prt_f_stop", "prt_focus_distance"):
        node(doc, "camera")["extras"].pop(key, None)


def tessellated(doc):
    del node(doc, "bottle")["extensions"]


def point_light(doc):
    lamp = material(doc, "ceiling lamp")
    lamp.pop("emissiveFactor", None)
    lamp.pop("extensions", None)
    doc["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 28.0}]}}
    doc["nodes"].append({"name": "point", "translation": [0, 2.6, -0.1], "extensions": {"KHR_lights_punctual": {"light": 0}}})
    doc["scenes"][0]["nodes"].append(len(doc["nodes"]) - 1)
    doc["extensionsUsed"] = sorted(set(doc.get("extensionsUsed", [])) | {"KHR_lights_punctual"})


def opened(doc):
    # In a closed room no direction is open.
    names = {"ceiling", "ceiling lamp", "left wall", "right wall", "front wall"}
    scene = doc["scenes"][0]
    scene["nodes"] = [i for i in scene["nodes"] if doc["nodes"][i].get("name") not in names]


KNOT, FLOOR, WALL, BALL = "190,130,240,180", "120,400,240,140", "470,120,240,180", "640,200,240,180"
MIRROR, TOP = "360,300,240,180", "300,0,240,180"
# name: the change of the scene, the window, further options. Two of a kind are before and after.
PICTURES = {
    "whole": (None, None, []),
    "principled-before": (matte, KNOT, []), "principled": (None, KNOT, []),
    "texture-before": (untextured, FLOOR, []), "texture": (None, FLOOR, []),
    "normal-map-before": (without_normal_map, WALL, []), "normal-map": (None, WALL, []),
    "normals-before": (flat, BALL, []), "normals": (still, BALL, []),
    "motion-before": (still, BALL, []), "motion": (None, BALL, []),
    "lens-before": (pinhole, KNOT, []), "lens": (None, KNOT, []),
    "revolution-before": (tessellated, "490,215,120,90", []), "revolution": (None, "490,215,120,90", []),
    "ideal": (None, MIRROR, []),
    "area-light-before": (point_light, FLOOR, []), "area-light": (None, FLOOR, []),
    "next-event": (None, TOP, ["--integrator", "direct"]),
    "cosine": (opened, None, ["--integrator", "ao"]),
    "tent-before": (None, "490,215,60,45", ["--filter", "box:0.01", "--spp", "1"]), "tent": (None, "490,215,60,45", []),
}


def run(prt, *args):
    done = subprocess.run([str(prt), *map(str, args)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, args))}\n{done.stderr}")
    return done


def pictures(prt, spp, only):
    doc = json.loads((SCENES / "seed.gltf").read_text())
    OUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for file in SCENES.glob("seed*"):
            shutil.copy(file, folder / file.name)
        for name, (change, window, options) in PICTURES.items():
            if only and name not in only:
                continue
            changed = copy.deepcopy(doc)
            if change:
                change(changed)
            scene = folder / f"{name}.gltf"
            scene.write_text(json.dumps(changed))
            size = f"{SIZE[0]}x{SIZE[1]}" if window else "480x270"
            crop = ["--crop", window] if window else []
            spp_option = [] if "--spp" in options else ["--spp", spp]
            run(prt, scene, "--out", folder / "out", "--frames", FRAME, "--size", size, *crop, *spp_option, *options, "--no-exr", "--no-report", "--name", "{stem}", "--progress", "none")
            shutil.copy(folder / "out" / f"{name}.png", OUT / f"{name}.png")
            print(name)


def speed(prt, spp):
    scene = SCENES / "seed.gltf"
    width, height = FULL
    w, h = width // PARTS, height // PARTS
    with tempfile.TemporaryDirectory() as folder:
        def seconds(accel, window, samples):
            crop = ["--crop", ",".join(map(str, window))] if window else []
            run(prt, scene, "--out", folder, "--frames", FRAME, "--size", f"{width}x{height}", *crop, "--spp", samples, "--accel", accel, "--force", "--no-png", "--no-exr", "--no-report", "--name", "seed", "--progress", "none")
            report = json.loads((Path(folder) / "seed.json").read_text())
            return report["seconds"]["render"] / samples, report["seconds"]["build"], report["mrays_per_s"], report["triangles"]

        # One in every row and column, so that no part of the picture counts more.
        tiles = [((3 * k + 1) % PARTS * w + w // 2, k * h + h // 2, *WINDOW) for k in range(PARTS)]
        share = width * height / (PARTS * WINDOW[0] * WINDOW[1])
        print("| rays by | build, s | a sample of 1920 x 1080, s | Mrays/s | gain over brute force in the same windows |\n|---|---|---|---|---|")
        rows = {}
        for accel in ("linear", "bvh", "embree"):
            parts = [seconds(accel, tile, 1 if accel == "linear" else 16 * spp) for tile in tiles]
            part = sum(p[0] for p in parts)
            whole = None if accel == "linear" else seconds(accel, None, spp)
            rows[accel] = part
            shown = f"{whole[0]:.3f}" if whole else f"({part * share:.0f}, from {part:.1f} s for the windows)"
            rate = whole[2] if whole else sum(p[2] for p in parts) / len(parts)
            print(f"| `{accel}` | {parts[0][1]:.3f} | {shown} | {rate:.2f} | {rows['linear'] / part:.0f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("pictures", "speed"))
    parser.add_argument("--spp", type=int)
    parser.add_argument("--only", nargs="*", help="of the pictures, these")
    parser.add_argument("--prt", type=Path, default=ROOT / "target" / "release" / "prt-batch")
    args = parser.parse_args()
    if args.what == "pictures":
        pictures(args.prt, args.spp or 256, args.only)
    else:
        speed(args.prt, args.spp or 4)


if __name__ == "__main__":
    main()
