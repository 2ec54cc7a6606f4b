#!/usr/bin/env python3
"""Measures the table of docs/guide/coded-32.md about the ready scenes: what the whole sensor finds by day of the
pixels that a perfect detector sees.

    cargo build --release && python3 tests/designs/scenes.py target/release/macropulse

The perfect detector is that of kim-park-2016, whose rows and columns are the same: it misses no mark. Of its
right points those count whose surface sends back as much as one of 10 % that is square to the view: diffuse
reflectance times the cosine of the angle of incidence, gloss left out.
"""

import csv
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

from table import PROGRAM, number

SENSOR, PERFECT = "coded-32", "kim-park-2016"
LEAST = 0.1

# Diffuse reflectance at 1550 nm of the materials of these scenes: docs/formats.md.
DIFFUSE = {
    "asphalt": 0.139, "concrete": 0.389, "brick": 0.45, "plaster": 0.7, "marble": 0.6, "wood": 0.565,
    "soil": 0.3, "snow": 0.05, "grass": 0.243, "grass-dry": 0.569, "vegetation": 0.253, "conifer": 0.188,
    "skin": 0.1, "fabric": 0.4, "paint-white": 0.8, "paint-silver": 0.45, "paint-red": 0.55,
    "paint-blue": 0.25, "paint-black": 0.05, "rubber": 0.05, "plastic": 0.3, "plastic-black": 0.08,
    "metal": 0.35, "aluminium": 0.813, "chrome": 0.05, "glass": 0.02, "number-plate": 0.5,
    "road-sign": 0.4, "headlamp": 0.1, "tail-lamp": 0.2, "white": 1.0,
}  # fmt: skip


def simulate(sensor, scene, folder):
    """The points of a scan, and the outcomes of its pixels."""
    words = [PROGRAM, "simulate", sensor, scene, "--environment", "clear-day", "--truth", "-q"]
    subprocess.run(words + ["--format", "csv,png", "-o", str(folder)], check=True)
    with open(folder / "scan-000000.csv", newline="") as table:
        points = list(csv.DictReader(table))
    return points, json.loads((folder / "manifest.json").read_text())["outcomes"]


def place(point):
    return int(point["row"]), int(point["column"])


def seen(points):
    """The pixels that count, by their surface."""
    lit = set()
    for point in points:
        sent_back = DIFFUSE[point["material"]] * math.cos(float(point["incidence_rad"]))
        if point["outcome"] == "right" and sent_back >= LEAST:
            lit.add(place(point))
    return lit


def main():
    scenes = [one["name"] for one in json.loads(
        subprocess.run([PROGRAM, "scenes", "--json"], check=True, capture_output=True).stdout
    )["scenes"]]  # fmt: skip
    pictures = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    print("| scene | seen perfectly, 10 % and more | found | wrong | false |\n|---|---|---|---|---|")
    for scene in scenes:
        with tempfile.TemporaryDirectory() as folder:
            folder = pictures / scene if pictures else Path(folder)
            perfect, _ = simulate(PERFECT, scene, folder / "perfect")
            points, outcomes = simulate(SENSOR, scene, folder / "found")
            wanted = seen(perfect)
            found = {place(point) for point in points if point["outcome"] in ("right", "near")}
            empty = outcomes["empty"] + outcomes["false"]
            lit = sum(outcomes.values()) - empty
            print(
                f"| `{scene}` | {number(len(wanted))} | {100 * len(wanted & found) / len(wanted):.2f} % | "
                f"{outcomes['wrong']} of {number(lit)} | {outcomes['false']} of {number(empty)} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
