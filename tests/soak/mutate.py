#!/usr/bin/env python3
"""Gives each target of the fuzzers what a seeded mutator makes of its corpus, and counts.

This wants no nightly compiler, and is faster than `fuzz.py`, but sees no address that is wrong. A target
that panics is a finding: its input lies in the target folder, and the seed is told. Counts add up over
runs in fuzz/target/mutated.json; an open finding is closed by a later turn of the same seed."""

import argparse
import json
import os
import re
import subprocess
import sys
import time

import soak

COUNTED = soak.ROOT / "fuzz" / "target" / "mutated.json"
TEST = "every_target_puts_up_with_its_corpus_and_what_is_made_of_it"

# A turn has so many inputs at first, and then as many as take it its time, but no more than so many times
# as many as before.
FIRST, MORE = 200, 8


def built():
    """The program of the test, built."""
    command = ["cargo", "test", "-p", "macropulse-fuzz", "--test", "corpus", "--no-run"]
    done = subprocess.run(command, cwd=soak.ROOT, capture_output=True, text=True)
    program = re.search(r"\((.*corpus-[0-9a-f]+)\)", done.stderr)
    if done.returncode or not program:
        sys.exit("the targets cannot be built here")
    return soak.ROOT / program[1]


def turn(program, target, seed, cases):
    """Runs one target; how long that takes, and whether it found something."""
    env = {
        **os.environ,
        "MACROPULSE_FUZZ_TARGET": target,
        "MACROPULSE_FUZZ_SEED": str(seed),
        "MACROPULSE_FUZZ_CASES": str(cases),
    }
    began = time.monotonic()
    # The test reads its corpus from the sources, and runs where it likes.
    done = subprocess.run([program, TEST], env=env, capture_output=True)
    return time.monotonic() - began, done.returncode != 0


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10, help="of each turn, about")
    parser.add_argument("--rounds", type=int, default=2, help="turns of each target")
    parser.add_argument("--seed", type=int, default=1, help="of the first turn")
    parser.add_argument("--target", action="append", help="only this one; repeatable")
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    arguments = parser.parse_args()
    targets = arguments.target or soak.fuzz_targets()
    program = built()
    counts = json.loads(COUNTED.read_text()) if COUNTED.exists() else {}
    cases = dict.fromkeys(targets, FIRST)
    for seed in range(arguments.seed, arguments.seed + arguments.rounds):
        for target in targets:
            took, has_found = turn(program, target, seed, cases[target])
            one = counts.setdefault(target, {"inputs": 0, "open": []})
            one["open"] = [known for known in one["open"] if known != seed]
            if has_found:
                one["open"].append(seed)
                print(f"{target}: a finding, seed {seed}, {cases[target]} inputs", file=sys.stderr)
            else:
                one["inputs"] += cases[target]
            faster = min(MORE, arguments.seconds / max(took, 0.05))
            cases[target] = max(FIRST, int(cases[target] * faster))
            COUNTED.parent.mkdir(parents=True, exist_ok=True)
            COUNTED.write_text(json.dumps(counts, indent=1))
    lines = ["| target | inputs | open findings |", "|---|---|---|"]
    for target in sorted(counts):
        one = counts[target]
        lines.append(f"| `{target}` | {one['inputs']:,} | {len(one['open'])} |")
    inputs = sum(one["inputs"] for one in counts.values())
    still_open = sum(len(one["open"]) for one in counts.values())
    lines.append(f"| all | {inputs:,} | {still_open} |")
    soak.report("mutate.py", lines, arguments.keep)
    return still_open > 0


if __name__ == "__main__":
    raise SystemExit(main())
