"""The range of every shot, by trying every lag (docs/physics.md, "Range" and "Thresholds").

Nothing is known but what was sent when, and which ticks came: no threshold, no cancellation of other
shots, no tracking. For each shot the marks that are lit are counted at every lag of the gate.
"""

import csv

import numpy as np

import words
from link import LIGHT


def read(path):
    """First line and columns of a file of shots or ticks."""
    with open(path, newline="", encoding="utf-8") as file:
        head = file.readline().strip().lstrip("# ")
        said = dict(pair.strip().split("=", 1) for pair in head.split(",")[1:])
        names = next(csv.reader(file))
        table = np.loadtxt(file, delimiter=",", dtype=np.int64, ndmin=2)
    return said, {name: table[:, place] for place, name in enumerate(names)}


def ranges(shots, ticks, every=1, chip_fs=2500, gate_m=150.0, start=7, sync=True):
    """Range, marks lit at it, marks lit at the next best place, and marks sent, shot by shot.

    The next best place is the best at least three ticks away.
    """
    said, shot = read(shots)
    stream, tick = read(ticks)
    tick_fs = int(stream["tick_fs"])
    first, owned = int(said.get("first", 0)), len(shot["fired_fs"])
    from_, until = int(said.get("owned_from", first)), int(said.get("owned_until", first + owned))
    lags = int(np.ceil(2.0 * gate_m / LIGHT * 1e15 / tick_fs))
    found = []
    for at in range(from_ - first, until - first, every):
        label, word = int(shot["label"][at]), int(shot["word"][at])
        marks = np.array(words.macropulse(label, word, start=start, sync=sync), dtype=np.int64)
        places = (int(shot["fired_fs"][at]) + marks * chip_fs) // tick_fs
        if len(places) == 0:
            continue
        low, high = np.searchsorted(tick["tick"], [places[0], places[-1] + lags])
        near = tick["tick"][low:high]
        apart = near[None, :] - places[:, None]
        lit = np.bincount(apart[(apart >= 0) & (apart < lags)], minlength=lags)
        best = int(lit.argmax())
        others = np.delete(lit, slice(max(best - 2, 0), best + 3))
        found.append(
            {
                "row": int(shot["row"][at]),
                "column": int(shot["column"][at]),
                "range_m": LIGHT / 2.0 * (best + 0.5) * tick_fs * 1e-15,
                "lit": int(lit[best]),
                "next": int(others.max()),
                "marks": len(marks),
            }
        )
    return found
