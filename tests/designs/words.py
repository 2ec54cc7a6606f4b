#!/usr/bin/env python3
"""Chooses the words of coded-32 and coded-16: of every seed, how many shots lose two marks of three to own light.

    cargo build --release && python3 tests/designs/words.py target/release/macropulse coded-16 260

A channel tells nothing from 6 ticks before a mark of its own leaves, as its stray light already shows, to 16 behind
it: `budget` says so at single ranges, and walls in steps of half a tick about them have been simulated. Marks and
when they leave are those that the program sends. Told are the share of shots that is lost at the worst range from 5 m
to 150 m, that range, the share over all of them, and the last mark; the best seeds first.
"""

import json
import subprocess
import sys

from table import PROGRAM

BEFORE, BEHIND = 6, 16
TICK_FS, C = 400_000, 299_792_458.0
FROM_M, TO_M = 5.0, 150.0

# Shots that are looked at, and beside them those whose marks may blind them.
SHOTS, BESIDE = 40, 8


def sent(sensor, changes):
    """When the marks leave of shots that follow each other, in ticks; none where words have no room."""
    words = [PROGRAM, "encode", sensor, "--json"]
    for column in range(SHOTS + 2 * BESIDE):
        words += ["--pixel", f"0,{column}"]
    for change in changes:
        words += ["--set", change]
    run = subprocess.run(words, capture_output=True, text=True)
    if run.returncode:
        return None
    shots = json.loads(run.stdout)
    first = shots[0]["fired_at_fs"]
    # A chip is a tick.
    return [[round((shot["fired_at_fs"] - first) / TICK_FS) + mark for mark in shot["marks"]] for shot in shots]


def lost(shots):
    """Worst share, range and mean share of shots that lose two marks or more, and the last mark of a word."""
    blind = bytearray(max(map(max, shots)) + 1)
    for mark in (mark for shot in shots for mark in shot):
        for tick in range(max(mark - BEFORE, 0), mark + BEHIND + 1):
            if tick < len(blind):
                blind[tick] = 1
    looked_at = shots[BESIDE : BESIDE + SHOTS]
    step = TICK_FS * 1e-15 * C / 2
    lags = range(round(FROM_M / step), round(TO_M / step))
    share = {
        lag: sum(sum(blind[mark + lag] for mark in shot) > 1 for shot in looked_at) / SHOTS for lag in lags
    }
    worst = max(lags, key=lambda lag: share[lag])
    longest = max(shot[-1] - shot[0] for shot in looked_at)
    return share[worst], worst * step, sum(share.values()) / len(lags), longest


def main():
    sensor = sys.argv[2] if len(sys.argv) > 2 else "coded-32"
    seeds = int(sys.argv[3]) if len(sys.argv) > 3 else 100
    changes = sys.argv[4:]
    told = []
    for seed in range(1, seeds + 1):
        shots = sent(sensor, changes + [f"code.family.separated.seed={seed}"])
        if shots:
            told.append((*lost(shots), seed))
    told.sort(key=lambda one: (one[0], one[2]))
    print("| seed | lost at worst | at | lost on average | last mark |\n|---|---|---|---|---|")
    for worst, at, mean, longest, seed in told[:10]:
        print(f"| {seed} | {worst:.3f} | {at:.2f} m | {mean:.5f} | {longest} |")


if __name__ == "__main__":
    main()
