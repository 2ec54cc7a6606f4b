#!/usr/bin/env python3
"""Starts two runs into one folder, some moments apart, and asks what becomes of them.

One is done, and the other done too, when it came late, or refused with exit code 2; the files are those
of a run alone. Two shards of a sweep are both done, and what they measure together is the whole."""

import argparse
import random
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import soak

SCAN = ["simulate", soak.SENSOR, "street", *soak.SMALL, "-q", "--scans", "2", "--format", "pcd,ply,npy",
        "-o", "out"]
SWEEP = ["sweep", soak.SENSOR, "street", *soak.SMALL, "-q", "--seeds", "4",
         "--vary", "detector.photon-counting.missed_marks=0,0.5", "-o", "out"]


def started(words, folder):
    return subprocess.Popen([soak.program(), *words], cwd=folder, stdout=subprocess.DEVNULL,
                            stderr=subprocess.PIPE, text=True)


def pair(first, second, later, folder):
    """Both runs, the second so much later, s: how each ended, and what it said."""
    one = started(first, folder)
    time.sleep(later)
    other = started(second, folder)
    told = [run.communicate()[1].strip() for run in (one, other)]
    return [(one.returncode, told[0]), (other.returncode, told[1])]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=40, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    arguments = parser.parse_args()
    draw = random.Random(arguments.seed)
    kinds = {"two `simulate`": (SCAN, SCAN),
             "two shards of a `sweep`": ([*SWEEP, "--shard", "1/2"], [*SWEEP, "--shard", "2/2"])}
    lines = ["| runs | pairs | both done | one refused | wrong |", "|---|---|---|---|---|"]
    is_wrong = False
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for name, (first, second) in kinds.items():
            alone = SCAN if first is SCAN else SWEEP
            assert soak.run(alone, cwd=folder)[0] == 0
            whole = soak.files(folder / "out")
            counts = [0, 0, 0]
            for _ in range(arguments.pairs):
                shutil.rmtree(folder / "out", ignore_errors=True)
                ended = pair(first, second, draw.choice([0, draw.uniform(0, 0.1)]), folder)
                if alone is SWEEP:
                    ended.append(soak.run(SWEEP, cwd=folder))
                left = soak.files(folder / "out")
                differs = soak.differing(left, whole) + [one for one in whole if one not in left]
                codes = sorted(code for code, _ in ended)
                is_refused = alone is SCAN and codes == [0, 2]
                counts[0] += not any(codes)
                counts[1] += is_refused
                if differs or (any(codes) and not is_refused):
                    print(f"{name}: {ended} {differs}", flush=True)
                    counts[2] += 1
            is_wrong |= counts[2] > 0
            lines.append(f"| {name} | {arguments.pairs} | {counts[0]} | {counts[1]} | {counts[2]} |")
            shutil.rmtree(folder / "out")
    soak.report("together.py", lines, arguments.keep)
    return is_wrong


if __name__ == "__main__":
    raise SystemExit(main())
