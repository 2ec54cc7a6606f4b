#!/usr/bin/env python3
"""Builds the fuzzers with AddressSanitizer, lets each run in its turn, and counts executions.

Wants a nightly compiler and a C++ compiler. What a fuzzer finds lies in fuzz/artifacts/TARGET, and
`fuzz/target/…/TARGET FILE` shows it. Counts add up over runs in fuzz/target/executions.json."""

import argparse
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import soak

FUZZ = soak.ROOT / "fuzz"
TRIPLE = "x86_64-unknown-linux-gnu"
# As cargo-fuzz has them.
FLAGS = """--cfg fuzzing -Zsanitizer=address -Cpasses=sancov-module
-Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters
-Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares
-Cllvm-args=-simplifycfg-branch-fold-threshold=0"""


def built():
    """Builds the fuzzers; their folder."""
    flags = " ".join(FLAGS.split())
    command = ["cargo", "+nightly", "build", "--target", TRIPLE]
    done = subprocess.run(command, cwd=FUZZ, env={**os.environ, "RUSTFLAGS": flags})
    if done.returncode:
        sys.exit("the fuzzers cannot be built here")
    target = os.environ.get("CARGO_TARGET_DIR", FUZZ / "target")
    return Path(target) / TRIPLE / "debug"


def turn(target, folder, arguments):
    """Lets one fuzzer run; its executions, and whether it found something."""
    own = FUZZ / "target" / "corpus" / target
    found = FUZZ / "artifacts" / target
    for path in (own, found):
        path.mkdir(parents=True, exist_ok=True)
    source = (soak.ROOT / "crates/macropulse-fuzz/src/lib.rs").read_text()
    longest = eval(re.search(rf"^    {target}, .*, ([^,]*);$", source, re.M)[1])
    command = [
        str(folder / target), str(own), str(FUZZ / "corpus" / target),
        f"-max_total_time={arguments.seconds}", f"-artifact_prefix={found}/", f"-max_len={longest}",
        "-timeout=120", "-rss_limit_mb=3000", "-malloc_limit_mb=1500", "-print_final_stats=1",
        "-verbosity=1", "-reload=0", f"-seed={arguments.seed}",
    ]
    options = {"ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=0"}
    done = subprocess.run(command, capture_output=True, env={**os.environ, **options})
    told = done.stderr.decode(errors="replace")
    count = re.search(r"stat::number_of_executed_units:\s*(\d+)", told)
    count = int(count[1]) if count else max(map(int, re.findall(r"^#(\d+)", told, re.M)), default=0)
    if done.returncode:
        log = found / f"log-{int(time.time())}.txt"
        log.write_text(told[-20_000:])
    return count, done.returncode != 0


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=10, help="of each turn")
    parser.add_argument("--rounds", type=int, default=1, help="turns of each target")
    parser.add_argument("--seed", type=int, default=0, help="of libFuzzer; 0 is another each time")
    parser.add_argument("--target", action="append", help="only this one; repeatable")
    parser.add_argument("--until", type=int, help="ends at this second of the epoch")
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    parser.add_argument("--built", type=Path, help="folder of fuzzers that are built already")
    arguments = parser.parse_args()
    targets = arguments.target or soak.fuzz_targets()
    folder = arguments.built or built()
    counted = FUZZ / "target" / "executions.json"
    counts = json.loads(counted.read_text()) if counted.exists() else {}
    for _ in range(arguments.rounds):
        for target in targets:
            if arguments.until and time.time() > arguments.until:
                break
            count, has_found = turn(target, folder, arguments)
            before = counts.get(target, {"executions": 0, "open": 0})
            counts[target] = {"executions": before["executions"] + count, "open": int(has_found)}
            counted.write_text(json.dumps(counts, indent=1))
            print(f"{target}: {count}{' and a finding' if has_found else ''}", file=sys.stderr, flush=True)
    lines = ["| target | executions | open findings |", "|---|---|---|"]
    for target in sorted(counts):
        lines.append(f"| `{target}` | {counts[target]['executions']:,} | {counts[target]['open']} |")
    total = sum(one["executions"] for one in counts.values())
    lines.append(f"| all | {total:,} | {sum(one['open'] for one in counts.values())} |")
    soak.report("fuzz.py", lines, arguments.keep)


if __name__ == "__main__":
    main()
