#!/usr/bin/env python3
"""Compares two builds of prt-batch by CPU time for whole pictures: bench_native.py A B SCENE... [--rounds N] [--spp N]

Such as a portable one and one of
  RUSTFLAGS="-C target-cpu=native" cargo build --release --target-dir target/native
One thread, both builds in turn, median and quartiles of the paired ratios A/B with each backend, and whether the EXRs
have the same bytes. Set EMBREE_DIR where the builds do not find Embree by themselves.
"""
import argparse
import math
import resource
import statistics
import subprocess
import tempfile
from pathlib import Path


def seconds(binary, scene, accel, out, spp):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    options = ["--size", "256x144", "--spp", str(spp), "--accel", accel, "--threads", "1", "--force", "-q", "--no-report"]
    subprocess.run([binary, scene, "-o", out, *options], check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("a", type=Path)
    parser.add_argument("b", type=Path)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--spp", type=int, default=16)
    args = parser.parse_args()
    medians = []
    with tempfile.TemporaryDirectory() as out:
        for scene in args.scenes:
            for accel in ("bvh", "embree"):
                ratios = []
                for i in range(args.rounds):
                    order = ("a", "b") if i % 2 else ("b", "a")
                    took = {k: seconds(getattr(args, k).resolve(), scene, accel, f"{out}/{k}", args.spp) for k in order}
                    ratios.append(took["a"] / took["b"])
                low, middle, high = statistics.quantiles(ratios, n=4) if len(ratios) > 1 else ratios * 3
                same = len({Path(out, k, scene.stem + ".exr").read_bytes() for k in "ab"}) == 1
                print(f"{scene.stem:12} {accel:7} A/B {middle:.3f} ({low:.3f}-{high:.3f})  {'same bytes' if same else 'DIFFERENT'}")
                medians.append(middle)
    print(f"geometric mean {math.exp(sum(map(math.log, medians)) / len(medians)):.3f}")


if __name__ == "__main__":
    main()
