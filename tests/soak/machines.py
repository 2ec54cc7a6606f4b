#!/usr/bin/env python3
"""Makes a small scan on other machines, and asks for the same bytes as on this one.

The others are emulated by qemu-user: x86-64 without AVX, which runs the program of this machine, and
aarch64, for which it is built. Wants, of Debian, qemu-user, gcc-aarch64-linux-gnu and
libc6-dev-arm64-cross; and `rustup target add aarch64-unknown-linux-gnu`. What is missing is said."""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import soak

ARM = "aarch64-unknown-linux-gnu"
LINES = [
    ["simulate", soak.SENSOR, "street", *soak.SMALL, "-q", "-j", "1", "--format", "pcd,ply,las,csv,ticks",
     "--truth"],
    ["simulate", "coded-360", "crossing", "--set", "scan.raster.rows=8", "-q", "-j", "1",
     "--format", "pcd,ticks"],
    ["simulate", "vlp-16", "car-30m", "--set", "scan.spinning.azimuth_step_deg=15", "-q", "-j", "1",
     "--format", "pcd,e57"],
]


def made(before, folder, variables=None):
    """The files of all lines, made by a program with `before` it; and the time it took, s."""
    found = {}
    began = time.monotonic()
    for number, words in enumerate(LINES):
        out = folder / "out"
        shutil.rmtree(out, ignore_errors=True)
        done = subprocess.run([*before, *words, "-o", "out"], cwd=folder, capture_output=True, text=True,
                              env={**os.environ, **(variables or {})})
        if done.returncode:
            sys.exit(f"{' '.join(before)}: {done.stderr}")
        found.update({f"{number}/{name}": data for name, data in soak.files(out).items()})
    return found, time.monotonic() - began


def arm():
    """The program built for aarch64, or why there is none."""
    variables = {
        **os.environ,
        "CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER": "aarch64-linux-gnu-gcc",
        "CC_aarch64_unknown_linux_gnu": "aarch64-linux-gnu-gcc",
    }
    # Emulated, the program is slow however it is built: this is sooner built.
    quick = ["profile.dev.opt-level=1", 'profile.dev.package."*".opt-level=1', "profile.dev.debug=0"]
    command = ["cargo", "build", "-p", "macropulse-cli", "--no-default-features", "--target", ARM]
    command += [word for setting in quick for word in ("--config", setting)]
    if subprocess.run(command, cwd=soak.ROOT, env=variables).returncode:
        return None, "cannot be built here"
    target = Path(os.environ.get("CARGO_TARGET_DIR", soak.ROOT / "target"))
    return str(target / ARM / "debug" / "macropulse"), None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--without-arm", action="store_true", help="build nothing")
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    arguments = parser.parse_args()
    machines = {
        "this one, plain kernels": ([soak.program()], {"MACROPULSE_KERNELS": "plain"}),
        "x86-64 without AVX (Nehalem)": (["qemu-x86_64", "-cpu", "Nehalem", soak.program()], None),
    }
    lines = ["| machine | files | that differ |", "|---|---|---|"]
    if not arguments.without_arm:
        built, missing = arm()
        if missing:
            lines.append(f"| aarch64 | {missing} | |")
        else:
            machines["aarch64 (Cortex-A57)"] = (
                ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu", "-cpu", "cortex-a57", built], None)
    is_wrong = False
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        own, _ = made([soak.program()], folder)
        for name, (before, variables) in machines.items():
            if shutil.which(before[0]) is None:
                lines.append(f"| {name} | {before[0]} is not here | |")
                continue
            found, took = made(before, folder, variables)
            differs = soak.differing(found, own) + [one for one in own if one not in found]
            is_wrong |= bool(differs)
            print(f"{name}: {took:.0f} s {differs}", file=sys.stderr)
            lines.append(f"| {name} | {len(found)} | {len(differs)} |")
    soak.report("machines.py", lines, arguments.keep)
    return is_wrong


if __name__ == "__main__":
    raise SystemExit(main())
