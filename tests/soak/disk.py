#!/usr/bin/env python3
"""Fills the disk at every write of a run, one after the other, and asks how it ends.

A library put before that of the system (enospc.c, compiled here) makes the n-th call that writes, makes
or renames a file fail as a full disk does. The run must end with exit code 1 and one line, and leave
whole files alone: those of a run that nothing has disturbed."""

import argparse
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import soak

SCAN = ["simulate", soak.SENSOR, "street", *soak.SMALL, "-q"]
LINES = {
    "simulate": [*SCAN, "--scans", "2", "--format", "pcd,ply,las,laz,npy,csv,e57,mcap,png,ticks", "--truth",
                 "-o", "out"],
    "simulate, samples": ["simulate", *soak.SAMPLED, "street", "-q", "--scans", "2", "--format", "pcd,samples",
                          "-o", "out"],
    "sweep": ["sweep", soak.SENSOR, "street", *soak.SMALL, "-q", "--seeds", "2",
              "--vary", "detector.photon-counting.missed_marks=0,0.5", "-o", "out"],
    "convert": ["convert", "in/scan-000000.pcd", "-o", "out/cloud.laz", "-q"],
    "view": ["view", "in", "-o", "out/page.html", "-q"],
    "decode": ["decode", "--sensor", soak.SENSOR, *soak.SMALL, "in/shots-000000.mps", "in/ticks-000000.mpt",
               "--format", "pcd,csv", "-o", "out", "-q"],
    "decode, samples": ["decode", "--sensor", *soak.SAMPLED, "sampled/shots-000000.mps",
                        "sampled/samples-000000.mpw", "--format", "pcd", "-o", "out", "-q"],
    "design": ["design", "requirements.toml", "-o", "out", "-q"],
}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=30, help="calls that fail, of each command")
    parser.add_argument("--every", action="store_true", help="every call there is")
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    arguments = parser.parse_args()
    lines = ["| command | calls made to fail | ended in a sentence and exit code 1 | done all the same | wrong |",
             "|---|---|---|---|---|"]
    is_wrong = False
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        shim = folder / "enospc.so"
        source = Path(__file__).with_name("enospc.c")
        subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", shim, source, "-ldl"], check=True)
        made = soak.run([*SCAN, "--scans", "1", "--format", "pcd,ticks", "-o", "in"], cwd=folder)
        assert made[0] == 0, made
        made = soak.run(["simulate", *soak.SAMPLED, "street", "-q", "--format", "samples", "-o", "sampled"], cwd=folder)
        assert made[0] == 0, made
        (folder / "requirements.toml").write_text(soak.REQUIREMENTS)
        for name, words in LINES.items():
            (folder / "out").mkdir()
            code, told = soak.run(words, cwd=folder)
            assert code == 0, (name, told)
            whole = soak.files(folder / "out")
            shutil.rmtree(folder / "out")
            (folder / "out").mkdir()
            counted = folder / "calls"
            base = {**os.environ, "LD_PRELOAD": str(shim), "ENOSPC_UNDER": str(folder / "out")}
            soak.run(words, cwd=folder, env={**base, "ENOSPC_COUNT": str(counted)})
            calls = int(counted.read_text())
            step = 1 if arguments.every else max(1, calls // arguments.most)
            ended = done = wrong = 0
            tried = range(1, calls + 1, step)
            for call in tried:
                shutil.rmtree(folder / "out")
                (folder / "out").mkdir()
                code, told = soak.run(words, cwd=folder, env={**base, "ENOSPC_AT": str(call)})
                left = soak.files(folder / "out")
                left = {file: data for file, data in left.items()
                        if b'"state": "running"' not in data}
                differs = [file for file in soak.differing(left, whole) if not file.endswith(".mcap")]
                ended += code == 1
                done += code == 0
                if code not in (0, 1) or differs or (code == 1 and len(told.splitlines()) != 1):
                    print(f"{name}: call {call} of {calls}: exit {code}: {told.strip()!r} {differs}")
                    wrong += 1
            is_wrong |= wrong > 0
            lines.append(f"| `{name}` | {len(tried)} of {calls} | {ended} | {done} | {wrong} |")
            shutil.rmtree(folder / "out")
    soak.report("disk.py", lines, arguments.keep)
    return is_wrong


if __name__ == "__main__":
    raise SystemExit(main())
