#!/usr/bin/env python3
"""Measures the tables of docs/guide/coded-32.md where neighbouring pixels have nothing to do with each other.

    cargo build --release && python3 tests/designs/mixed.py target/release/macropulse

Every pixel has a tile of its own, of which this program alone knows range and reflectance: what is found is
judged by that, and not by what the simulator says. In `street` tiles come in runs of twelve pixels of a row on
average, a quarter of them sky; in `mixed` each stands for itself, a fifth are sky. A fifth are targets, at one
of four ranges and of one of four reflectances. The other tiles are 4 m (3 m) to 300 m away, half of them
farther than the range gate is long, and have 5 (10) to 100 %.
"""

import csv
import math
import random
import struct
import subprocess
import tempfile
from pathlib import Path

from table import PROGRAM, number, share

ROWS, COLUMNS = 480, 848
WIDTH, HEIGHT = math.radians(43.2) / COLUMNS, math.radians(24.3) / ROWS
GATE = 150.0
RIGHT_WITHIN = 0.3

RANGES, SHARES = (5.0, 20.0, 75.0, 149.0), (0.05, 0.1, 0.3, 1.0)
TARGETS = [(at, share_of) for at in RANGES for share_of in SHARES]

# What the study found of 10 % at 149 m: Pd, and rms where it says so.
STUDY = {
    ("`coded-32`, street", 149.0): "0.993, 7.9 mm",
    ("`coded-32`, mixed", 149.0): "0.990, 8.2 mm",
    ("`coded-16`, street", 149.0): "0.972",
    ("`coded-16`, mixed", 149.0): "0.964",
}

# Tiles of the same material are one mesh: as many steps from 5 % to white.
MATERIALS = [0.05 * 20 ** (step / 24) for step in range(25)] + [0.1, 0.3]

SKY, OTHER = -1, -2


def street(rng):
    """Range, reflectance and kind, that of a target or one of the others, of every pixel of a row."""
    row = []
    while len(row) < COLUMNS:
        length, drawn = 1 + int(math.log(1 - rng.random()) / math.log(1 - 1 / 12)), rng.random()
        if drawn < 0.25:
            row += [(0.0, 0.0, SKY)] * length
        elif drawn < 0.45:
            target = rng.randrange(len(TARGETS))
            at, share = TARGETS[target]
            row += [(at + rng.uniform(-0.4, 0.4), share, target)] * length
        else:
            at, slope = math.exp(rng.uniform(math.log(4), math.log(300))), rng.gauss(0, 0.003)
            share = math.exp(rng.uniform(math.log(0.05), 0))
            clip = lambda at: min(max(at, 3.0), 300.0)
            row += [(clip(at * (1 + place * slope)), share, OTHER) for place in range(length)]
    return row[:COLUMNS]


def mixed(rng):
    """The same, where every pixel stands for itself."""
    row = []
    for _ in range(COLUMNS):
        drawn = rng.random()
        if drawn < 0.2:
            target = rng.randrange(len(TARGETS))
            at, share = TARGETS[target]
            row.append((at + rng.uniform(-0.4, 0.4), share, target))
        elif drawn < 0.36:
            row.append((0.0, 0.0, SKY))
        else:
            share = math.exp(rng.uniform(math.log(0.1), 0))
            row.append((rng.uniform(3.0, 300.0), share, OTHER))
    return row


def corner(row, column, at):
    """A corner of a pixel, so far away."""
    azimuth, elevation = (COLUMNS / 2 - column) * WIDTH, (ROWS / 2 - row) * HEIGHT
    level = at * math.cos(elevation)
    return level * math.cos(azimuth), level * math.sin(azimuth), at * math.sin(elevation)


def write(folder, pixels):
    """The scene of these pixels."""
    tiles = {}
    for row, line in enumerate(pixels):
        for column, (at, share, kind) in enumerate(line):
            if kind != SKY:
                nearest = min(range(len(MATERIALS)), key=lambda m: abs(math.log(MATERIALS[m] / share)))
                tiles.setdefault(nearest, []).append((row, column, at))
    scene = 'version = 1\nenvironment = "clear-day"\nsensor.position_m = [0.0, 0.0, 0.0]\n'
    for material in tiles:
        scene += f'[[material]]\nname = "tile-{material}"\ndiffuse = {MATERIALS[material]}\n'
    for material, places in tiles.items():
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {4 * len(places)}\n"
        head += "".join(f"property float {axis}\n" for axis in "xyz")
        head += f"element face {len(places)}\nproperty list uchar int vertex_indices\nend_header\n"
        with open(folder / f"{material}.ply", "wb") as mesh:
            mesh.write(head.encode())
            for row, column, at in places:
                for down, right in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    mesh.write(struct.pack("<3f", *corner(row + down, column + right, at)))
            for place in range(len(places)):
                mesh.write(struct.pack("<B4i", 4, *range(4 * place, 4 * place + 4)))
        scene += f'[[object]]\nmesh = "{material}.ply"\nmaterial = "tile-{material}"\n'
    (folder / "scene.toml").write_text(scene)


def simulate(folder, sensor, more):
    """The range told of each pixel that has a point."""
    words = [PROGRAM, "simulate", sensor, str(folder / "scene.toml"), "--format", "csv", "-q"]
    subprocess.run(words + ["-o", str(folder / "out")] + more, check=True)
    with open(folder / "out" / "scan-000000.csv", newline="") as table:
        rows = csv.DictReader(table)
        return {(int(row["row"]), int(row["column"])): float(row["range_m"]) for row in rows}


def measure(name, scenery, sensor, more):
    """Prints what is found of the targets; the row of what is wrong and what is false."""
    rng = random.Random(2026)
    pixels = [scenery(rng) for _ in range(ROWS)]
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder), pixels)
        found = simulate(Path(folder), sensor, more)
    # Of each target: how many, right, errors squared. Of all: in the gate, wrong; empty, false.
    of = {target: [0, 0, 0.0] for target in TARGETS}
    inside = wrong = empty = false = 0
    for row, line in enumerate(pixels):
        for column, (at, _, kind) in enumerate(line):
            told = found.get((row, column))
            if GATE < at < GATE + 2 * RIGHT_WITHIN:
                continue
            is_right = told is not None and abs(told - at) < RIGHT_WITHIN
            if kind >= 0:
                counts = of[TARGETS[kind]]
                counts[0] += 1
                counts[1] += is_right
                counts[2] += (told - at) ** 2 if is_right else 0.0
            if kind == SKY or at > GATE:
                empty += 1
                false += told is not None
            else:
                inside += 1
                wrong += told is not None and not is_right
    for at in RANGES:
        pds = [f"{of[at, share_of][1] / of[at, share_of][0]:.4f}" for share_of in SHARES]
        _, right, squares = of[at, 0.1]
        rms = 1e3 * math.sqrt(squares / right) if right else math.nan
        study = STUDY.get((name, at))
        found = f"| {name} | {at:.0f} m | {' | '.join(pds)} | {rms:.1f} mm |"
        print(found + (f" {study} |" if study else " |"), flush=True)
    return (
        f"| {name} | {wrong} of {number(inside)} = {share(wrong, inside)} | "
        f"{false} of {number(empty)} = {share(false, empty)} |"
    )


def main():
    print("| | at | 5 % | 10 % | 30 % | white | 10 %: rms | study, 10 % |")
    print("|---|---|---|---|---|---|---|---|")
    rows = []
    for sensor in ("coded-32", "coded-16"):
        for name, scenery in (("street", street), ("mixed", mixed)):
            # As the study has it: a beam of no width.
            rows.append(measure(f"`{sensor}`, {name}", scenery, sensor, ["--without", "footprint"]))
        rows.append(measure(f"`{sensor}`, mixed, wide beam", mixed, sensor, []))
    print("\n| | wrong | false |\n|---|---|---|\n" + "\n".join(rows))


if __name__ == "__main__":
    main()
