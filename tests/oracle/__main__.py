"""Answers one question: `python tests/oracle NAME JSON`, the arguments of a function by name."""

import json
import sys

import beat
import correlate
import counting
import link
import phase
import words

QUESTIONS = {
    "photons": link.photons,
    "sunlight": link.sunlight,
    "field": link.field,
    "seen": counting.seen,
    "of-sensitivity": counting.of_sensitivity,
    "seen-by-cells": counting.seen_by_cells,
    "fired": counting.fired,
    "fired-drawn": counting.fired_drawn,
    "payloads": lambda labels, **how: [words.payload(label, **how) for label in labels],
    "macropulses": lambda shots, **how: [words.macropulse(*shot, **how) for shot in shots],
    "family": words.compared,
    "gold": words.gold,
    "ranges": correlate.ranges,
    "phase-ranges": phase.phase_ranges,
    "beats": beat.beats,
}

if __name__ == "__main__":
    question, given = sys.argv[1:]
    # Long questions come from a file.
    text = open(given[1:], encoding="utf-8").read() if given.startswith("@") else given
    answer = QUESTIONS[question](**json.loads(text))
    print(json.dumps(answer, default=float))
