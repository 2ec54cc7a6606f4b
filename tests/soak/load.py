#!/usr/bin/env python3
"""Loads meshes that hierarchies are slow with, many copies, and a large mesh, and measures.

Times are those of the processor, s. `ratio` is that of four times as many triangles to one time: 4 is
linear, and 4.4 n log n. With --embree FOLDERS, in which (with colons between them) Python finds embreex
and NumPy, Embree builds the same large mesh."""

import argparse
import math
import os
import random
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import soak

SCENE = """version = 1
[[object]]
name = "thing"
mesh = "thing.stl"
unit = "m"
up = "z"
forward = "x"
material = "white"
{more}
"""

# The same hills as below, sooner than in plain Python.
OF_HILLS = """
import sys
sys.path[:0] = sys.argv[2].split(":")
import numpy as np
count = int(sys.argv[3])
side = int((count / 2) ** 0.5)
number = np.arange(count)
row, column = np.divmod(number // 2, side)
corner = lambda r, c: np.stack([r, c, r * c % 7], axis=1)
a, b, c, d = corner(row, column), corner(row + 1, column), corner(row + 1, column + 1), corner(row, column + 1)
is_odd = (number % 2 == 1)[:, None]
stl = np.zeros(count, dtype=np.dtype([("n", "<3f4"), ("v", "<9f4"), ("a", "<u2")]))
stl["v"] = np.concatenate([a, np.where(is_odd, b, c), np.where(is_odd, c, d)], axis=1)
with open(sys.argv[1], "wb") as file:
    file.write(bytes(80) + np.uint32(count).tobytes())
    stl.tofile(file)
"""

OF_EMBREE = """
import resource, sys
sys.path[:0] = sys.argv[2].split(":")
import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
data = np.fromfile(sys.argv[1], dtype=np.dtype([("n", "<3f4"), ("v", "<9f4"), ("a", "<u2")]), offset=84)
corners = np.ascontiguousarray(data["v"].reshape(-1, 3, 3))
del data
before = resource.getrusage(resource.RUSAGE_SELF)
scene = rtcore_scene.EmbreeScene()
mesh = TriangleMesh(scene, corners)
scene.run(np.float32([[0, 0, 50]]), np.float32([[0, 0, -1]]))
after = resource.getrusage(resource.RUSAGE_SELF)
print(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, after.ru_maxrss, before.ru_maxrss)
"""


def coincident(number, _):
    return [5, -1, -1, 5, 1, -1, 5, 0, 1]


def fan(number, count):
    """Triangles of one corner, ever larger."""
    angle = 2 * math.pi * number / count
    reach = 1 + 20 * number / count
    return [0, 0, 0, reach * math.cos(angle), reach * math.sin(angle), 1,
            reach * math.cos(angle + 1), reach * math.sin(angle + 1), 2]


def slivers(number, count):
    """Thin triangles across the whole scene, in all directions."""
    draw = random.Random(number)
    one, other = ([draw.uniform(-50, 50) for _ in range(3)] for _ in range(2))
    return [*one, *other, other[0], other[1] + 1e-3, other[2]]


def hills(number, count):
    """A field of low hills."""
    side = int(math.sqrt(count / 2))
    row, column = divmod(number // 2, side)
    corner = lambda r, c: (r, c, (r * c) % 7)
    a, b, c, d = corner(row, column), corner(row + 1, column), corner(row + 1, column + 1), corner(row, column + 1)
    return [*a, *b, *c] if number % 2 else [*a, *c, *d]


def write(path, shape, count):
    with open(path, "wb") as file:
        file.write(bytes(80) + struct.pack("<I", count))
        one = struct.Struct("<12fH")
        part = []
        for number in range(count):
            part.append(one.pack(0, 0, 0, *shape(number, count), 0))
            if len(part) == 10_000:
                file.write(b"".join(part))
                part.clear()
        file.write(b"".join(part))


def loaded(folder, more=""):
    """Time of the processor, s, and most memory, MB, of a check of the scene."""
    (folder / "scene.toml").write_text(SCENE.format(more=more))
    child = subprocess.Popen([soak.program(), "-j", "2", "check", "scene.toml"], cwd=folder,
                             stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    told = child.stderr.read()
    _, status, used = os.wait4(child.pid, 0)
    assert status == 0, told
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1000


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, default=50_000)
    parser.add_argument("--large", type=int, default=1_000_000)
    parser.add_argument("--embree", help="folders with embreex and NumPy")
    parser.add_argument("--keep", action="store_true", help="into docs/hardening.md")
    arguments = parser.parse_args()
    count = arguments.triangles
    lines = ["| mesh | triangles | time, s | four times as many, s | ratio |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for shape in (coincident, fan, slivers, hills):
            times = []
            for number in (count, 4 * count):
                write(folder / "thing.stl", shape, number)
                times.append(min(loaded(folder)[0] for _ in range(2)))
            lines.append(f"| {shape.__name__} | {count:,} | {times[0]:.2f} | {times[1]:.2f} | "
                         f"{times[1] / times[0]:.1f} |")
        write(folder / "thing.stl", hills, 200)
        copies = ",".join(f"{{position_m=[{n % 300 * 30},{n // 300 * 30},0]}}" for n in range(100_000))
        time, memory = loaded(folder, f"copies = [{copies}]")
        lines += ["", f"100,000 copies of a mesh of 200 triangles: {time:.1f} s, {memory:.0f} MB."]
        if arguments.embree:
            words = [sys.executable, "-c", OF_HILLS, folder / "thing.stl", arguments.embree]
            subprocess.run([*words, str(arguments.large)], check=True)
        else:
            write(folder / "thing.stl", hills, arguments.large)
        time, memory = loaded(folder)
        lines += ["", f"{arguments.large:,} triangles from STL, read and built: {time:.1f} s, {memory:.0f} MB."]
        if arguments.embree:
            done = subprocess.run([sys.executable, "-c", OF_EMBREE, folder / "thing.stl", arguments.embree],
                                  capture_output=True, text=True)
            if done.returncode:
                print(done.stderr)
            else:
                used, most, before = map(float, done.stdout.split())
                lines[-1] += (f" Embree's build of them alone: {used:.1f} s, {most / 1000:.0f} MB at most, "
                              f"{before / 1000:.0f} MB before it began.")
    soak.report("load.py", lines, arguments.keep)


if __name__ == "__main__":
    main()
