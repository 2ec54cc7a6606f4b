#!/usr/bin/env python3
"""Kills runs at random moments, and asks what they have left.

Every file with a name of its own must be the same, byte for byte, as that of a run that nothing has
disturbed; and the run after it, into the same folder, must leave the whole and nothing else."""

import argparse
import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import soak

SCAN = ["simulate", soak.SENSOR, "street", *soak.SMALL, "-q"]
LINES = {
    "simulate": [*SCAN, "--scans", "3", "--format", "pcd,ply,las,npy,csv,e57,ticks", "-o", "out"],
    "simulate, samples": ["simulate", *soak.SAMPLED, "street", "-q", "--scans", "3", "--format", "pcd,samples",
                          "-o", "out"],
    "sweep": ["sweep", soak.SENSOR, "street", *soak.SMALL, "-q", "--seeds", "4",
              "--vary", "detector.photon-counting.missed_marks=0,0.4,0.8", "-o", "out"],
    "convert": ["convert", "../in/scan-000000.pcd", "../in/scan-000001.pcd", "../in/scan-000002.pcd",
                "--format", "ply", "-o", "out", "-q"],
    "design": ["design", "../requirements.toml", "-o", "out", "-q"],
}

# Of so many kills one is of a search, which takes as long as fifty of the others.
OF_SEARCH = 25


def whole(words, folder):
    """The files of an undisturbed run, and how long it takes, s."""
    took = []
    for _ in range(3):
        shutil.rmtree(folder / "out", ignore_errors=True)
        began = time.monotonic()
        code, told = soak.run(words, cwd=folder)
        took.append(time.monotonic() - began)
        assert code == 0, told
    return soak.files(folder / "out"), sorted(took)[1]


def is_finished(name, data):
    """Whether a file says of itself that its run has ended: a manifest is written at the beginning
    already."""
    return name != "manifest.json" or json.loads(data).get("state", "finished") == "finished"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=60, help="of all commands together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    arguments = parser.parse_args()
    draw = random.Random(arguments.seed)
    short = [name for name in LINES if name != "design"]
    counts = {name: {"kills": 0, "late": 0, "files": 0, "wrong": 0} for name in LINES}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        code, told = soak.run([*SCAN, "--scans", "3", "--format", "pcd", "-o", "in"], cwd=folder)
        assert code == 0, told
        (folder / "requirements.toml").write_text(soak.REQUIREMENTS)
        for name in LINES:
            (folder / name).mkdir()
        expected = {name: whole(words, folder / name) for name, words in LINES.items()}
        for turn in range(arguments.kills):
            name = short[turn % len(short)] if turn % OF_SEARCH else "design"
            files, took = expected[name]
            count, place = counts[name], folder / name
            # Into a new folder, or onto the files of the run before.
            if draw.random() < 0.7:
                shutil.rmtree(place / "out", ignore_errors=True)
            child = subprocess.Popen([soak.program(), *LINES[name]], cwd=place,
                                     stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(draw.uniform(0, 1.1 * took))
            count["late"] += child.poll() is not None
            child.kill()
            child.wait()
            count["kills"] += 1
            left = soak.files(place / "out")
            left = {file: data for file, data in left.items() if is_finished(file, data)}
            count["files"] += len(left)
            wrong = soak.differing(left, files)
            code, told = soak.run(LINES[name], cwd=place)
            after = soak.files(place / "out")
            wrong += soak.differing(after, files) + [file for file in files if file not in after]
            wrong += [str(path) for path in (place / "out").rglob(".macropulse-*.part")]
            if turn % 100 == 99:
                print(f"{turn + 1} kills", file=sys.stderr, flush=True)
            if code or wrong:
                print(f"{name}: kill {turn}: {told.strip()} {wrong}", flush=True)
                count["wrong"] += 1
    lines = ["| command | kills | of these after its end | whole files left | wrong or missing |",
             "|---|---|---|---|---|"]
    for name, count in counts.items():
        lines.append(f"| `{name}` | {count['kills']} | {count['late']} | {count['files']} | {count['wrong']} |")
    soak.report("kill.py", lines, arguments.keep)
    return any(count["wrong"] for count in counts.values())


if __name__ == "__main__":
    raise SystemExit(main())
