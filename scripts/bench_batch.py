#!/usr/bin/env python3
"""What a batch costs beyond rendering: many tiny scenes in one run.

  scripts/bench_batch.py [--program target/release/prt-batch] [--count 500] [--repeat 5]

Prints the wall time per image beyond its rendering (median of the repeats) for a first run, which renders all, and for a
second one, which finds all of it up to date; and memory after a fifth and after all of the images.
"""

import argparse
import json
import pathlib
import shutil
import statistics
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent


def run(program, folder, out):
    command = [program, "scenes", "-o", out, "--size", "16x16", "-s", "1", "--accel", "bvh", "--json", "-q"]
    start = time.perf_counter()
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    return time.perf_counter() - start, json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(ROOT / "target/release/prt-batch"))
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    scene = (ROOT / "tests/data/triangle.gltf").read_text()
    with tempfile.TemporaryDirectory() as folder:
        scenes = pathlib.Path(folder, "scenes")
        scenes.mkdir()
        for i in range(options.count):
            (scenes / f"s{i:05}.gltf").write_text(scene)
        first, second, peaks = [], [], []
        for _ in range(options.repeat):
            shutil.rmtree(pathlib.Path(folder, "out"), ignore_errors=True)
            wall, report = run(options.program, folder, "out")
            rendering = sum(image["seconds"]["render"] for image in report["images"])
            first.append((wall - rendering) / options.count)
            peaks.append([report["images"][options.count // 5]["peak_rss_bytes"], report["images"][-1]["peak_rss_bytes"]])
            wall, report = run(options.program, folder, "out")
            second.append(wall / options.count)
        kept = report["counts"]["up-to-date"]
    print(f"{options.count} images, median of {options.repeat} runs")
    print(f"  beyond rendering  {1e3 * statistics.median(first):.2f} ms an image")
    print(f"  up to date        {1e3 * statistics.median(second):.2f} ms an image ({kept} kept)")
    print(f"  peak memory       {peaks[-1][0] / 2**20:.1f} MiB after a fifth, {peaks[-1][1] / 2**20:.1f} MiB after all")


if __name__ == "__main__":
    main()
