#!/usr/bin/env python3
"""Variance at equal samples, renderer beside renderer, each against its own expectation.

usage: variance.py SCENE.gltf... [--prt target/release/prt-batch] [--spp 64] [--seeds 8] [--size 160x90] [--bounces 12]
                   [--peers cycles,cycles-area] [--brdf full|appendix-b] [--keep DIR] [--threads 2]

Each renderer renders each scene once per seed. A picture's error is its relMSE (compare_exr.py) against the mean of the
same renderer's other seeds, times (n-1)/n, which takes that mean's own variance off: the expectation is the variance of
one picture over the squared mean, whatever the renderer's idea of the material is. `trim` leaves the worst 0.1 % of the
pixels out. +- is the standard error of the mean over the seeds. ratio = ours / the peer's: at most 1 is the bar.

Peers: `cycles` with its light tree, `cycles-area` with emissive triangles chosen by area. Both with Blender's multiple-scattering
GGX where --brdf is `full`. Pictures in --keep are used again.
"""
import argparse
import math
import os
import statistics
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from compare_exr import read_exr, relmse  # noqa: E402


def picture(folder, scene, name, seed):
    return os.path.join(folder, f"{scene}_{name}_{seed}.exr")


def render(options, file, scene, name, folder):
    """The missing pictures of one renderer."""
    seeds = [s for s in range(1, options.seeds + 1) if not os.path.exists(picture(folder, scene, name, s))]
    if not seeds:
        return
    if name == "prt":
        for seed in seeds:
            adapter = [sys.executable, os.path.join(HERE, "render_prt.py"), options.prt, file, picture(folder, scene, name, seed), str(options.spp),
                       options.size, str(options.bounces), str(seed), "--brdf", options.brdf, "--threads", str(options.threads)]
            subprocess.run(adapter, check=True, stdout=subprocess.DEVNULL)
        return
    command = [sys.executable, os.path.join(HERE, "render_cycles.py"), file, picture(folder, scene, name, "{seed}"), "--spp", str(options.spp),
               "--size", options.size, "--bounces", str(options.bounces), "--seeds", f"{seeds[0]}-{seeds[-1]}", "--threads", str(options.threads)]
    command += ["--multiscatter"] if options.brdf == "full" else []
    command += ["--no-light-tree"] if name == "cycles-area" else []
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def errors(pictures, trim):
    """Mean and standard error of the leave-one-out relMSE."""
    n, total = len(pictures), sum(pictures)
    each = [relmse(p, (total - p) / (n - 1), trim) * (n - 1) / n for p in pictures]
    return statistics.mean(each), statistics.stdev(each) / math.sqrt(n)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="SCENE")
    parser.add_argument("--prt", default="target/release/prt-batch")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--size", default="160x90")
    parser.add_argument("--bounces", type=int, default=12)
    parser.add_argument("--peers", default="cycles")
    parser.add_argument("--brdf", default="full", choices=["full", "appendix-b"])
    parser.add_argument("--keep", metavar="DIR")
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    folder = options.keep or tempfile.mkdtemp(prefix="prt-variance-")
    os.makedirs(folder, exist_ok=True)
    print("| scene | renderer | relMSE | +- | trim | +- | ratio | ratio trim |\n|---|---|---|---|---|---|---|---|")
    for file in options.scenes:
        scene = os.path.splitext(os.path.basename(file))[0]
        ours = None
        for name in ["prt"] + [p for p in options.peers.split(",") if p]:
            render(options, file, scene, name, folder)
            pictures = [read_exr(picture(folder, scene, name, s)).astype("float64") for s in range(1, options.seeds + 1)]
            (whole, e), (trimmed, et) = errors(pictures, 0.0), errors(pictures, 1e-3)
            ours = ours or (whole, trimmed)
            ratios = "- | -" if name == "prt" else f"{ours[0] / whole:.2f} | {ours[1] / trimmed:.2f}"
            print(f"| {scene} | {name} | {whole:.4g} | {e:.2g} | {trimmed:.4g} | {et:.2g} | {ratios} |", flush=True)


if __name__ == "__main__":
    main()
