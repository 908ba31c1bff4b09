#!/usr/bin/env python3
"""Writes the example scenes into scenes/.

usage: make_scenes.py            write scenes/
       make_scenes.py --check    write nothing; exit 1 if scenes/ differs from what would be written
       make_scenes.py --list     triangles, lights and sizes
       make_scenes.py --out DIR  write elsewhere

Python's standard library only. The same bytes every time: fixed seeds, coordinates rounded to six decimals.
"""
import argparse
import sys
from pathlib import Path

from scene_kit import forest, lights, objects, rooms, seed, surfaces

SCENES = (rooms.cornell, rooms.wall, rooms.knot, lights.lights, lights.punctual, objects.metals, objects.stilllife,
          forest.forest, seed.seed)
# Written into the folder surfaces/.
SURFACES = (surfaces.brushed, surfaces.lacquer, surfaces.cloth_scene, surfaces.frosted, surfaces.gloss)
FOLDER = Path(__file__).resolve().parent.parent / "scenes"
KEPT = {"README.md"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="DIR")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--list", action="store_true")
    args = parser.parse_args()
    made = {}
    for build in SCENES + SURFACES:
        scene = build()
        files = {("surfaces/" if build in SURFACES else "") + name: data for name, data in scene.files().items()}
        made.update(files)
        if args.list:
            size = sum(map(len, files.values())) / 1e6
            print(f"{scene.stem}: {scene.triangles} triangles, {scene.emitters} emissive meshes, {len(scene.lights)} punctual lights, {size:.2f} MB")
    if args.list:
        return 0
    if args.check:
        found = {p.relative_to(args.out).as_posix(): p.read_bytes() for p in args.out.rglob("*") if p.is_file() and p.name not in KEPT} if args.out.is_dir() else {}
        wrong = [f"{name}: {'missing' if name not in found else 'not made by this script' if name not in made else 'differs'}"
                 for name in sorted(made.keys() | found.keys()) if made.get(name) != found.get(name)]
        for line in wrong:
            print(f"{args.out.name}/{line}", file=sys.stderr)
        return 1 if wrong else 0
    (args.out / "surfaces").mkdir(parents=True, exist_ok=True)
    for name, data in made.items():
        (args.out / name).write_bytes(data)
    print(f"{len(made)} files, {sum(map(len, made.values())) / 1e6:.2f} MB in {args.out.name}/")
    return 0


if __name__ == "__main__":
    sys.exit(main())
