#!/usr/bin/env python3
"""Writes the scenes on which `prt-batch bench rays` is measured: make_bench_scenes.py FOLDER [NAME...]

  flock     a closed room of unevenly meshed objects, about 1 million triangles
  terrain   open land, 2,097,152 triangles
  organic   a single mesh in the open, 69,312 triangles
  interior  a furnished room, large and tiny triangles, about 300,000
  drone     a machine of about 33,000 triangles in a small closed box
  rafters   a timber hall askew: 111,000 triangles, nearly half of them long, thin and diagonal

One .glb each, 67 MB together, in about ten seconds. Python's standard library only; the same bytes every time.
"""
import sys
from pathlib import Path

from scene_kit import measured

SCENES = {build.__name__: build for build in (measured.flock, measured.terrain, measured.organic, measured.interior, measured.drone, measured.rafters)}


def main():
    names = sys.argv[2:] or list(SCENES)
    if len(sys.argv) < 2 or sys.argv[1].startswith("-") or not all(name in SCENES for name in names):
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        scene = SCENES[name]()
        for file, data in scene.files().items():
            (folder / file).write_bytes(data)
            print(f"{folder / file}: {scene.triangles:,} triangles, {len(data) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
