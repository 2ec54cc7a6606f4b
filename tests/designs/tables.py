#!/usr/bin/env python3
"""Measures what the tables of docs/guide/coded-32.md say that its test does not: every part of the design
alone, other lidars, and light from beyond the gate. Prints them as Markdown; takes some minutes.

    cargo build --release && python3 tests/designs/tables.py target/release/macropulse

Sixty rows are simulated, as many to a beam as the whole sensor has: N = 50 880 shots each, seed 1.
"""

import json
import subprocess
import tempfile
from pathlib import Path

from table import PROGRAM, number, share

# Sixty rows about the horizon.
ROWS = {"scan.raster.rows": "60", "scan.raster.vertical_deg": "3.0375"}
BEAMS = {"coded-32": "4", "coded-16": "2"}

ROOM = """version = 1
environment = "clear-day"
[[material]]
name = "paint"
diffuse = {reflectance}
[[object]]
shape.sphere.radius_m = {range}
material = "paint"
"""

# A car 30 m ahead, a house, and a wall that closes the road; the sky beside them is empty.
ROAD = """version = 1
environment = "clear-day"
ground = { material = "asphalt" }
sensor.position_m = [0.0, 0.0, 2.0]
[[object]]
name = "car"
car = {}
position_m = [32.35, 0.0, 0.0]
[[object]]
shape.box.size_m = [30.0, 8.0, 9.0]
position_m = [60.0, 16.0, 0.0]
rest_on_ground = true
material = "plaster"
[[object]]
shape.box.size_m = [1.0, 60.0, 4.0]
position_m = [140.5, 0.0, 0.0]
rest_on_ground = true
material = "concrete"
"""

OTHER = """[[interferers]]
sensor = "{sensor}"
position_m = [{x}, {y}, 2.0]
yaw_deg = {yaw}
phase_ns = {phase}
drift_ppm = {drift}
"""

# The words that the study found for both.
WORDS_OF_THE_STUDY = (
    "[[0,127,158],[0,50,170],[0,21,214],[0,66,142],[0,149,237],"
    "[0,71,132],[0,56,231],[0,81,181],[0,95,203],[0,188,225]]"
)

# One change of coded-16 at a time; words of as many chips as they need.
CHANGES = [
    ("nothing", {}),
    ("amplifier of 24 pA/√Hz", {"detector.photodiode.amplifier_pa_rthz": "24.0"}),
    ("a strip of 6 pF", {"detector.photodiode.capacitance_pf": "6.0"}),
    ("dark current of 20 nA", {"detector.photodiode.dark_current_na": "20.0"}),
    ("no excess noise", {"detector.photodiode.ionisation_ratio": "0.0"}),
    ("own light blinds for 20 ns", {"receiver.blank_ns": "20.0"}),
    ("no stray light", {"receiver.blank_ns": "0.0", "detector.photodiode.isolation_db": "300.0"}),
    (
        "gaps from 0.8 ns",
        {"code.family": "{separated={length=60,weight=3,words=10,gap=2,apart=1,seed=1}}"},
    ),
    ("the words of the study", {"code.family": f"{{list={{length=238,marks={WORDS_OF_THE_STUDY}}}}}"}),
    (
        "two marks",
        {"code.family": "{separated={length=238,weight=2,words=10,gap=20,apart=5,seed=1}}"},
    ),
    (
        "six marks, four must be seen",
        {
            "code.family": "{separated={length=900,weight=6,words=8,gap=20,apart=2,seed=1}}",
            "code.word.modulus": "8",
            "receiver.least_marks": "4",
        },
    ),
    ("waits for 40 ns behind clipped light", {"receiver.recovery_ns": "40.0"}),
]


def simulate(sensor, scene, changes=()):
    """Outcomes of a scan, by name, and the counts of the manifest."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scene.toml")
        file.write_text(scene)
        words = [PROGRAM, "simulate", sensor, str(file), "--format", "none", "--json", "-q"]
        keys = dict(ROWS, **{"scan.raster.beams": BEAMS[sensor]}, **dict(changes))
        for key, value in keys.items():
            words += ["--set", f"{key}={value}"]
        told = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    return told["outcomes"], told["counts"]


def lit(outcomes):
    """Pixels with an echo."""
    return sum(outcomes[name] for name in ("right", "near", "wrong", "missed"))


def wall(sensor, changes):
    """Share right, number wrong, and pixels, of a wall of 10 % at 149 m."""
    outcomes, _ = simulate(sensor, ROOM.format(range=149.0, reflectance=0.1), changes)
    return outcomes["right"] / lit(outcomes), outcomes["wrong"], lit(outcomes)


def ablations():
    print("| `coded-16` but for | Pd | wrong | `street`: right | wrong |\n|---|---|---|---|---|")
    street = subprocess.run(
        [PROGRAM, "scenes", "street"], check=True, capture_output=True, text=True
    ).stdout
    for name, changes in CHANGES:
        pd, wrong, pixels = wall("coded-16", changes)
        outcomes, _ = simulate("coded-16", street, changes)
        print(
            f"| {name} | {pd:.4f} | {share(wrong, pixels)} | {outcomes['right'] / lit(outcomes):.4f} | "
            f"{share(outcomes['wrong'], lit(outcomes))} |",
            flush=True,
        )
    print(f"\nN = {number(pixels)} at the wall and {number(lit(outcomes))} in the street")


def lidars(sensor, count, yaw):
    """So many others along the road, each with a clock of its own."""
    return "".join(
        OTHER.format(
            sensor=sensor,
            yaw=yaw,
            x=15.0 + 9.7 * number,
            y=(-1) ** number * (3.5 + 0.4 * number),
            phase=5012345.678 + 812345.678 * number,
            drift=7.0 * number - 31.0,
        )
        for number in range(count)
    )


def others():
    print("\n| | its shots whose light is seen | right | wrong | false | ghosts |\n|---|---|---|---|---|---|")
    for sensor in BEAMS:
        cases = [("alone", ""), ("one oncoming", lidars(sensor, 1, 180.0))]
        cases += [("ten oncoming", lidars(sensor, 10, 180.0))]
        cases += [("ten that look the same way", lidars(sensor, 10, 0.0))]
        for name, more in cases:
            outcomes, counts = simulate(sensor, ROAD + more)
            empty = outcomes["empty"] + outcomes["false"]
            print(
                f"| `{sensor}`, {name} | {counts.get('interferer_shots', 0)} | "
                f"{outcomes['right'] / lit(outcomes):.4f} of {number(lit(outcomes))} | {outcomes['wrong']} | "
                f"{outcomes['false']} of {number(empty)} | {counts.get('ghosts', 0)} |",
                flush=True,
            )


def beyond():
    print("\n| nothing in the gate, and behind it | `coded-32`: false | `coded-16`: false |\n|---|---|---|")
    walls = [("white at 160 m", 160.0, 1.0), ("white at 200 m", 200.0, 1.0)]
    walls += [("white at 250 m", 250.0, 1.0), ("white at 299 m", 299.0, 1.0)]
    walls += [("10 % at 200 m", 200.0, 0.1), ("nothing", 5000.0, 0.1)]
    for name, at, reflectance in walls:
        told = []
        for sensor in BEAMS:
            outcomes, _ = simulate(sensor, ROOM.format(range=at, reflectance=reflectance))
            told.append(f"{outcomes['false']} of {number(sum(outcomes.values()))}")
        print(f"| {name} | {told[0]} | {told[1]} |", flush=True)


if __name__ == "__main__":
    ablations()
    others()
    beyond()
