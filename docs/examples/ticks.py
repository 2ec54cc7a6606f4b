#!/usr/bin/env python3
"""Shots and ticks of made-up hardware that looks at a wall, for `macropulse decode`.

The lidar sends one bare prime code word a shot: mark j of word w lies on chip 29 j + (w j mod 29).
Each shot's echo comes from the same range; a few ticks more are noise. Who has real hardware writes
the same two files from what it recorded.
"""

import random
import sys

RANGE_M = 42.0
CHIP_FS = TICK_FS = 2500
ROWS, COLUMNS, EVERY_FS = 4, 64, 50_000_000
SPEED_OF_LIGHT = 299_792_458.0

folder = sys.argv[1] if len(sys.argv) > 1 else "."
delay_fs = round(2.0 * RANGE_M / SPEED_OF_LIGHT * 1e15)
ticks = set()
with open(f"{folder}/shots.csv", "w") as shots:
    print("# macropulse shots 1", "shot,fired_fs,row,column,word", sep="\n", file=shots)
    for shot in range(ROWS * COLUMNS):
        fired_fs, word = shot * EVERY_FS, 1 + shot % 28
        print(shot, fired_fs, shot // COLUMNS, shot % COLUMNS, word, sep=",", file=shots)
        chips = [29 * j + word * j % 29 for j in range(29)]
        ticks.update((fired_fs + delay_fs + chip * CHIP_FS) // TICK_FS for chip in chips)
noise = random.Random(1)
ticks.update(noise.randrange(ROWS * COLUMNS * EVERY_FS // TICK_FS) for _ in range(500))
with open(f"{folder}/ticks.csv", "w") as file:
    print(f"# macropulse ticks 1, tick_fs={TICK_FS}", "tick", sep="\n", file=file)
    print(*sorted(ticks), sep="\n", file=file)
