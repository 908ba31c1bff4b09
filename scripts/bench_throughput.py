#!/usr/bin/env python3
"""How fast: the Cornell box by our two backends, beside Mitsuba 3 where a Python that has it is given.

usage: bench_throughput.py [--prt target/release/prt-batch] [--mitsuba-python PATH] [--repeat 5] [--starts 20]
                           [--threads N] [--json OUT.json]

Three tables:
  1. 256x256, 64 spp, 32 bounces, box filter: paths/s and Mray/s of `--accel embree`, `--accel bvh` and Mitsuba
     llvm_ad_rgb (kernels warm: a pass in the same process that is not counted).
  2. the same at 1280x720 (ours only).
  3. start to exit of `prt-batch` for 64x64, 1 spp, `--accel bvh --no-report`: wall clock, CPU seconds and peak
     memory of the whole process.
Render seconds are seconds.render of the program's own JSON (Mitsuba: the script's time around mi.render). Runs are
interleaved, one round after another with another seed each; the median is printed, and the spread as MAD / median:
above 3 % the machine was not quiet. Rounds run one process at a time. Only the standard library is needed here.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)
SCENE = os.path.join(ROOT, "tests", "data", "reference", "cornell", "cornell.gltf")
BOUNCES = 32


def run(command):
    """Runs to the end; (wall seconds, CPU seconds, peak bytes, stdout, returncode, stderr), the process's own."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        start = time.perf_counter()
        process = subprocess.Popen(command, stdout=out, stderr=err, stdin=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        return wall, usage.ru_utime + usage.ru_stime, peak, out.read(), process.returncode, err.read()


def prt(options, accel, size, spp, seed, extra=()):
    """One render by prt-batch; its JSON, or None with the reason on stderr."""
    folder = tempfile.mkdtemp(prefix="prt-bench-")
    try:
        command = [options.prt, SCENE, "--out", folder, "--accel", accel, "--size", size, "--spp", str(spp),
                   "--seed", str(seed), "--max-bounces", str(BOUNCES), "--filter", "box", "--brdf", "appendix-b",
                   "--no-png", "--no-report", "--progress", "none", *extra]
        if options.threads:
            command += ["--threads", str(options.threads)]
        *_, code, err = run(command)
        if code:
            print(f"prt-batch --accel {accel} failed ({code}): {err.strip()[-400:]}", file=sys.stderr)
            return None
        with open(os.path.join(folder, "cornell.json")) as file:
            return json.load(file)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def ours(accel, size, spp):
    """A measurement: seed -> (render seconds, Mray/s or None), or None."""
    def measure(options, seed):
        result = prt(options, accel, size, spp, seed)
        if result is None:
            return None
        seconds = result["seconds"]["render"]
        return seconds, result["rays"]["total"] / seconds / 1e6
    return measure


def mitsuba(size, spp):
    """The same by Mitsuba: three passes in one process, the first warms the kernels up; the last is taken."""
    def measure(options, seed):
        with tempfile.TemporaryDirectory(prefix="prt-bench-") as folder:
            command = [options.mitsuba_python, os.path.join(HERE, "peers", "render_mitsuba.py"), SCENE,
                       os.path.join(folder, "out.exr"), "--spp", str(spp), "--size", size, "--bounces", str(BOUNCES),
                       "--seed", str(seed), "--passes", "3", "--threads", str(options.threads or cores())]
            *_, out, code, err = run(command)
        if code:
            print(f"Mitsuba failed ({code}): {err.strip()[-400:]}", file=sys.stderr)
            return None
        return json.loads(out.strip().splitlines()[-1])["pass_s"][-1], None
    return measure


def cores():
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def median_and_spread(values):
    """(median, MAD / median)."""
    median = statistics.median(values)
    return median, statistics.median(abs(x - median) for x in values) / median


def table(title, size, spp, contenders, options):
    """Interleaved rounds of all contenders, then one row each; the rows."""
    width, height = map(int, size.split("x"))
    paths = width * height * spp
    times = {name: [] for name in contenders}
    for measure in contenders.values():  # warms the file cache and the clock up; not counted
        measure(options, 99)
    for seed in range(options.repeat):
        for name, measure in contenders.items():
            result = measure(options, seed)
            if result:
                times[name].append(result)
    print(f"\n{title}: {size}, {spp} spp, {BOUNCES} bounces, {options.threads or cores()} threads, "
          f"median of {options.repeat}\n")
    print("| renderer | render s | spread | M paths/s | Mray/s | x Mitsuba |\n|---|---|---|---|---|---|")
    peer = median_and_spread([s for s, _ in times["mitsuba llvm_ad_rgb"]])[0] if times.get("mitsuba llvm_ad_rgb") else None
    rows = []
    for name, results in times.items():
        if not results:
            print(f"| {name} | failed | - | - | - | - |")
            continue
        seconds, spread = median_and_spread([s for s, _ in results])
        rays = [r for _, r in results if r is not None]
        row = {"table": title, "renderer": name, "size": size, "spp": spp, "render_s": seconds, "spread": spread,
               "paths_per_s": paths / seconds, "mrays_per_s": statistics.median(rays) if rays else None,
               "speed_over_mitsuba": peer / seconds if peer else None, "all_s": [s for s, _ in results]}
        show = lambda x, form: "-" if x is None else format(x, form)
        print(f"| {name} | {seconds:.4f} | {100 * spread:.1f} % | {paths / seconds / 1e6:.2f} | "
              f"{show(row['mrays_per_s'], '.1f')} | {show(row['speed_over_mitsuba'], '.2f')} |")
        rows.append(row)
    return rows


def start_to_exit(options):
    """The third table; its row."""
    walls, cpus, peaks = [], [], []
    for seed in range(options.starts + 1):
        folder = tempfile.mkdtemp(prefix="prt-bench-")
        wall, cpu, peak, _, code, err = run([options.prt, SCENE, "--out", folder, "--size", "64x64", "--spp", "1",
                                             "--seed", str(seed), "--accel", "bvh", "--no-report", "--progress", "none"])
        shutil.rmtree(folder, ignore_errors=True)
        if code:
            print(f"prt-batch failed ({code}): {err.strip()[-400:]}", file=sys.stderr)
            return []
        if seed:  # the first warms the file cache up
            walls.append(wall)
            cpus.append(cpu)
            peaks.append(peak)
    median, spread = median_and_spread(walls)
    print(f"\nstart to exit: 64x64, 1 spp, --accel bvh --no-report, median of {options.starts}\n")
    print("| wall ms | spread | best ms | CPU ms | peak MiB |\n|---|---|---|---|---|")
    print(f"| {1e3 * median:.1f} | {100 * spread:.1f} % | {1e3 * min(walls):.1f} | {1e3 * statistics.median(cpus):.1f} | "
          f"{max(peaks) / 2**20:.1f} |")
    return [{"table": "start to exit", "wall_s": median, "spread": spread, "best_s": min(walls),
             "cpu_s": statistics.median(cpus), "peak_bytes": max(peaks)}]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--prt", default=os.path.join(ROOT, "target", "release", "prt-batch"))
    parser.add_argument("--mitsuba-python", help="a Python interpreter that can import mitsuba")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--threads", type=int, help="default: the cores this process may use")
    parser.add_argument("--json", help="also write the rows here")
    options = parser.parse_args()
    if options.repeat < 1 or options.starts < 1:
        parser.error("--repeat and --starts must be at least 1")
    if not os.access(options.prt, os.X_OK):
        sys.exit(f"{options.prt}: not there; build it with `cargo build --release`, or name it with --prt")
    if hasattr(os, "getloadavg") and os.getloadavg()[0] > 0.3:
        print(f"warning: load average {os.getloadavg()[0]:.2f}; the figures are good for a quiet machine only", file=sys.stderr)
    small = {"prt embree": ours("embree", "256x256", 64), "prt bvh": ours("bvh", "256x256", 64)}
    if options.mitsuba_python:
        small["mitsuba llvm_ad_rgb"] = mitsuba("256x256", 64)
    rows = table("cornell", "256x256", 64, small, options)
    large = {"prt embree": ours("embree", "1280x720", 64), "prt bvh": ours("bvh", "1280x720", 64)}
    rows += table("cornell, large", "1280x720", 64, large, options)
    rows += start_to_exit(options)
    if options.json:
        with open(options.json, "w") as file:
            json.dump(rows, file, indent=1)
    done = {row["renderer"] for row in rows if row["table"] == "cornell"}
    sys.exit(0 if set(small) == done and any(row["table"] == "start to exit" for row in rows) else 1)


if __name__ == "__main__":
    main()
