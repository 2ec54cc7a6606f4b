"""The examples run as they stand, each in a folder of its own."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).resolve().parent.parent / "examples").glob("*.py"))

# What an example needs beside the package.
NEEDS = {"open3d_view.py": "open3d", "rerun_log.py": "rerun"}

# What it says at its end, and what it leaves.
LEAVES = {
    "quick_start.py": ("points", []),
    "own_mesh.py": ("on the pyramid", ["pyramid.pcd"]),
    "compare_receivers.py": ("matched", []),
    "labelled_set.py": ("labelled", ["scan-000000.npz", "scan-000003.npz"]),
    "code_length.py": ("clear-day", ["code-length.csv"]),
}


def test_every_example_is_known():
    assert {path.name for path in EXAMPLES} == set(NEEDS) | set(LEAVES)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_runs(path, tmp_path):
    package = NEEDS.get(path.name)
    if package and importlib.util.find_spec(package) is None:
        pytest.skip(f"{path.name} needs {package}, which is not installed")
    done = subprocess.run([sys.executable, path], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said, files = LEAVES.get(path.name, ("", []))
    assert said in done.stdout, done.stdout
    for file in files:
        assert (tmp_path / file).stat().st_size > 0, file
