#!/usr/bin/env python3
"""Makes many scans in one run, and asks whether its memory stays as it is.

The memory of the process is looked at ten times a second. What it has at most in the last half of the
scans must be no more than in the first tenth, but for the page of the run, which takes scans until 32 MiB
of points are in it, and a little: an allocator settles. A run that tells must be long enough to fill
the page: some 6000 small scans. Behind the last scan the page and the manifest are written, which name
every scan: that is told by itself."""

import argparse
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import soak

# What may come with settling, and the page of the run, kB.
SETTLING = 4096 + 32 * 1024


def resident(process):
    try:
        text = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return None
    line = next((line for line in text.splitlines() if line.startswith("VmRSS")), None)
    return int(line.split()[1]) if line else None


def looked_at(words, scans, folder):
    """The memory of a run while it scans, and while it ends, kB."""
    child = subprocess.Popen([soak.program(), *words], cwd=folder, stdout=subprocess.DEVNULL)
    seen, end = [], []
    while child.poll() is None:
        now = resident(child.pid)
        is_over = any((folder / "out").glob(f"scan-{scans - 1:06}*"))
        if now:
            (end if is_over else seen).append(now)
        # What is written would fill the disk.
        for old in sorted((folder / "out").glob("scan-*"))[:-50]:
            old.unlink(missing_ok=True)
        time.sleep(0.1)
    assert child.returncode == 0
    return seen, end


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--small", type=int, default=9000, help="scans of 8 by 24 pixels")
    parser.add_argument("--full", type=int, default=20, help="scans of a whole sensor")
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    arguments = parser.parse_args()
    scan = ["simulate", soak.SENSOR, "street", "-q", "-j", "1", "-o", "out", "--format"]
    runs = {
        f"{arguments.small:,} small": (arguments.small, [*scan, "pcd", *soak.SMALL]),
        f"{arguments.full:,} full": (arguments.full, [*scan, "pcd,laz"]),
    }
    lines = ["| scans | most of the first tenth, MB | median, MB | most of the last half, MB | within that | "
             "at the end, MB |", "|---|---|---|---|---|---|"]
    is_wrong = False
    for name, (scans, words) in runs.items():
        with tempfile.TemporaryDirectory() as folder:
            words = [*words, "--scans", str(scans)]
            seen, end = looked_at(words, scans, Path(folder))
        first, last = max(seen[: max(1, len(seen) // 10)]), max(seen[len(seen) // 2 :])
        is_flat = last <= 1.02 * first + SETTLING
        is_wrong |= not is_flat
        numbers = [f"{kb / 1000:.1f}" for kb in (first, statistics.median(seen), last)]
        numbers += ["yes" if is_flat else "NO", f"{max(end, default=0) / 1000:.1f}"]
        lines.append(f"| {name} | {' | '.join(numbers)} |")
    soak.report("memory.py", lines, arguments.keep)
    return is_wrong


if __name__ == "__main__":
    raise SystemExit(main())
