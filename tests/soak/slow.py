"""Processor time of every test by itself, the slowest first.

    python3 tests/soak/slow.py [--of NAME] [--most 20]

Builds all tests, runs each in a process of its own, and prints seconds of user and system time, its
children among them. What tests of one program share, as a run of the paper's experiment, counts for each
that uses it. `--of` measures the test programs whose name has NAME in it alone.
"""

import argparse
import json
import resource
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def programs():
    """Test programs with the folder that each is run in."""
    build = ["cargo", "test", "--workspace", "--no-run", "--message-format=json", "--quiet"]
    printed = subprocess.run(build, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for line in printed.splitlines():
        message = json.loads(line)
        if message.get("profile", {}).get("test") and message.get("executable"):
            yield Path(message["executable"]), Path(message["manifest_path"]).parent


def tests(program):
    listed = subprocess.run([program, "--list", "--format", "terse"], capture_output=True, text=True)
    return [line.removesuffix(": test") for line in listed.stdout.splitlines() if line.endswith(": test")]


def seconds(program, folder, test):
    """Processor time of a test, and whether it passed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ran = subprocess.run([program, "--exact", test], cwd=folder, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, ran.returncode == 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--of", default="")
    parser.add_argument("--most", type=int, default=20)
    options = parser.parse_args()
    rows = []
    for program, folder in programs():
        if options.of in program.name:
            for test in tests(program):
                spent, passed = seconds(program, folder, test)
                rows.append((spent, f"{folder.name}: {test}{'' if passed else ' FAILED'}"))
    for spent, name in sorted(rows, reverse=True)[: options.most]:
        print(f"{spent:8.1f} s  {name}")
    print(f"{sum(spent for spent, _ in rows):8.1f} s  of {len(rows)} tests")


if __name__ == "__main__":
    main()
