#!/usr/bin/env python3
"""Time and error beside Blender Cycles and Mitsuba 3 (llvm), on the same files, bounces and filter, without denoising.

usage: compare_peers.py SCENE.gltf... [--prt target/release/prt-batch] [--peers mitsuba,cycles] [--size 256x256]
                        [--bounces 32] [--spp 64] [--seeds 4] [--threads 2] [--clock wall|cpu] [--keep DIR] [--json FILE]
       compare_peers.py --setup           makes .peers, a virtual environment with the peers (2.5 GB), by pip

Each renderer renders each scene with several seeds at --spp, and once or more at 1 and 4 samples; one process at a time.
relMSE is that of a picture against the mean of the same renderer's other seeds, times (n-1)/n: its variance, whatever its
idea of the material (peers/variance.py says more); `trim` leaves the worst 0.1 % of the pixels out. Times are medians.
`x time` is trimmed relMSE times render seconds; `of best` our figures over the better peer's: the aim is 0.33 at most, and
0.15 of the whole process's time at 1 and 4 samples. --clock cpu takes the processor's seconds in place of the clock's, for
machines with other work: the difference of two runs stands for rendering. A scene that a peer cannot read is said so and
left out for it. Pictures and times in --keep are used again.
"""
import argparse
import json
import math
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent / "peers"
VENV = Path(__file__).resolve().parent.parent / ".peers"
PYTHON = VENV / "bin" / "python"
FEW = (1, 4)
STEPS = (["bpy==4.5.15", "numpy<2"], ["mitsuba==3.9.1", "openimageio", "OpenEXR", "scipy", "pillow", "flip-evaluator"], ["numpy<2"])


def setup():
    subprocess.run([sys.executable, "-m", "venv", VENV], check=True)
    for packages in STEPS:
        subprocess.run([PYTHON, "-m", "pip", "install", *packages], check=True)
    print(f"done: {PYTHON} {__file__} SCENE.gltf...")


def command(options, name, scene, out, spp, seed):
    common = ["--spp", str(spp), "--size", options.size, "--seed", str(seed), "--threads", str(options.threads)]
    if name == "prt":
        return [options.prt, scene, "--out", out.parent / out.stem, *common, "--max-bounces", str(options.bounces), "--filter", "box",
                "--default-light", "off", "--no-png", "--no-report", "--force", "--progress", "none"]
    adapter = [sys.executable, HERE / f"render_{name}.py", scene, out, *common, "--bounces", str(options.bounces)]
    return [*adapter, "--multiscatter"] if name == "cycles" else adapter


def run(options, name, scene, spp, seed, folder):
    """Times of one run, or why there is none."""
    out = folder / f"{scene.stem}_{name}_{spp}_{seed}.exr"
    kept = out.with_suffix(".json")
    if out.exists() and kept.exists():
        return json.loads(kept.read_text())
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command(options, name, scene, out, spp, seed), capture_output=True, text=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        return {"failed": (done.stderr.strip().splitlines() or ["no picture"])[-1][:200]}
    if name == "prt":
        made = folder / out.stem
        render = json.loads((made / f"{scene.stem}.json").read_text())["seconds"]["render"]
        (made / f"{scene.stem}.exr").rename(out)
        shutil.rmtree(made)
    else:
        render = json.loads(done.stdout.strip().splitlines()[-1])["render_s"]
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    times = {"wall": wall, "cpu": cpu, "render": render}
    kept.write_text(json.dumps(times))
    return times


def measure(options, name, scene, folder):
    """One renderer at one scene."""
    from compare_exr import read_exr
    from variance import errors
    seeds = range(1, options.seeds + 1)
    times = {}
    for spp in (*FEW, options.spp):
        times[spp] = [run(options, name, scene, spp, seed, folder) for seed in seeds]
        failed = next((t["failed"] for t in times[spp] if "failed" in t), None)
        if failed:
            return {"renderer": name, "failed": failed}
    pictures = [read_exr(str(folder / f"{scene.stem}_{name}_{options.spp}_{seed}.exr")).astype("float64") for seed in seeds]
    (error, _), (trimmed, spread) = errors(pictures, 0.0), errors(pictures, 1e-3)
    clock = options.clock
    total = {spp: statistics.median(t[clock] for t in times[spp]) for spp in times}
    render = statistics.median(t["render"] for t in times[options.spp])
    if clock == "cpu":
        # A millisecond at least: what is shorter than the noise of two runs is not known better.
        render = max((total[options.spp] - total[1]) * options.spp / (options.spp - 1), 1e-3)
    return {"renderer": name, "relmse": error, "relmse_trim": trimmed, "relmse_trim_se": spread, "render_s": render,
            "total_s": {str(spp): s for spp, s in total.items()}, "product": trimmed * render}


def ratios(rows):
    """Ours over the better peer's: relMSE x time, and the whole time at few samples."""
    ours, peers = rows[0], [r for r in rows[1:] if "failed" not in r]
    if "failed" in ours or not peers:
        return None
    best = {"product": ours["product"] / min(p["product"] for p in peers)}
    for spp in map(str, FEW):
        best[f"total_{spp}"] = ours["total_s"][spp] / min(p["total_s"][spp] for p in peers)
    return best


def geomean(values):
    return math.exp(statistics.mean(map(math.log, values)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE")
    parser.add_argument("--setup", action="store_true")
    parser.add_argument("--prt", default="target/release/prt-batch")
    parser.add_argument("--peers", default="mitsuba,cycles")
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--bounces", type=int, default=32)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--clock", choices=["wall", "cpu"], default="wall")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.setup:
        return setup()
    if not options.scenes:
        parser.error("which scenes? Such as scenes/*.gltf")
    missing = [str(s) for s in options.scenes if not s.exists()]
    if missing:
        parser.error(f"no such file: {', '.join(missing)}")
    if options.seeds < 2 or options.spp < 2:
        parser.error("a variance needs 2 seeds, and more than 1 sample")
    sys.path.insert(0, str(HERE))
    try:
        import compare_exr  # noqa: F401
    except ImportError as error:
        sys.exit(f"{error}: run `{Path(__file__).name} --setup` once, and then this with {PYTHON}")
    options.prt = Path(options.prt).resolve()
    folder = options.keep or Path(tempfile.mkdtemp(prefix="prt-peers-"))
    folder.mkdir(parents=True, exist_ok=True)
    found = []
    print(f"| scene | renderer | total s, 1 spp | 4 spp | {options.spp} spp: render s | relMSE trim | +- | relMSE | x time |\n|" + "---|" * 9)
    for scene in options.scenes:
        rows = [measure(options, name, scene, folder) for name in ("prt", *filter(None, options.peers.split(",")))]
        for r in rows:
            if "failed" in r:
                print(f"| {scene.stem} | {r['renderer']} | not read: {r['failed']} |")
                continue
            t = r["total_s"]
            print(f"| {scene.stem} | {r['renderer']} | {t['1']:.3f} | {t['4']:.3f} | {r['render_s']:.3f} | {r['relmse_trim']:.3g} | "
                  f"{r['relmse_trim_se']:.1g} | {r['relmse']:.3g} | {r['product']:.3g} |")
        best = ratios(rows)
        if best:
            print(f"| {scene.stem} | of best | {best['total_1']:.3f} | {best['total_4']:.3f} | | | | | **{best['product']:.2f}** |", flush=True)
        found.append({"scene": str(scene), "rows": rows, "of_best": best})
    compared = [f["of_best"]["product"] for f in found if f["of_best"]]
    if compared:
        print(f"\nrelMSE x time over the better peer's: {geomean(compared):.2f} (geometric mean), {max(compared):.2f} at worst; "
              f"{sum(p <= 0.33 for p in compared)} of {len(compared)} scenes at 0.33 or less")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
