#!/usr/bin/env python3
"""What showing progress costs: the same picture with each --progress style, bars on a pseudo terminal.

  scripts/bench_progress.py [--program target/release/prt-batch] [--scene scenes/cornell.gltf] [--rounds 10] [--spp 96]

Prints CPU seconds (user and system, median and least over interleaved rounds) and what they are more than with `none`.
"""

import argparse
import os
import pathlib
import pty
import resource
import statistics
import subprocess
import tempfile
import threading

ROOT = pathlib.Path(__file__).resolve().parent.parent
STYLES = ["none", "plain", "json", "auto"]


def cpu(command, style):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    if style == "auto":
        ours, theirs = pty.openpty()
        environment = dict(os.environ, TERM="xterm-256color", COLUMNS="100")
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=theirs, env=environment)
        os.close(theirs)

        def drain():
            try:
                while os.read(ours, 65536):
                    pass
            except OSError:
                pass

        reader = threading.Thread(target=drain)
        reader.start()
        code = child.wait()
        reader.join()
        os.close(ours)
    else:
        code = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode
    if code != 0:
        raise SystemExit(f"error: {' '.join(command)} ended with {code}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(ROOT / "target/release/prt-batch"))
    parser.add_argument("--scene", default=str(ROOT / "scenes/cornell.gltf"))
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--spp", type=int, default=96)
    options = parser.parse_args()
    seconds = {style: [] for style in STYLES}
    with tempfile.TemporaryDirectory() as out:
        command = [options.program, options.scene, "-o", out, "--force", "--size", "640x360", "--spp", str(options.spp)]
        cpu(command, "none")
        for _ in range(options.rounds):
            for style in STYLES:
                seconds[style].append(cpu(command + ["--progress", style], style))
    for style in STYLES:
        # Each round's own `none`, so that a slow minute slows both.
        ratio = statistics.median(a / b for a, b in zip(seconds[style], seconds["none"]))
        least = min(seconds[style]) / min(seconds["none"])
        median = statistics.median(seconds[style])
        print(f"{style:6} median {median:.3f} s  paired {100 * (ratio - 1):+.2f} %  of the least {100 * (least - 1):+.2f} %")


if __name__ == "__main__":
    main()
