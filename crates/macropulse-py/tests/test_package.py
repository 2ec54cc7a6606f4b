"""The package itself: its files, its types, what `help()` shows."""

import inspect
import subprocess
import sys
from pathlib import Path

import macropulse as mp
import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = Path(__file__).resolve().parent.parent


def test_both_project_files_make_one_package():
    own = tomllib.loads((HERE / "pyproject.toml").read_text())
    root = tomllib.loads((HERE.parent.parent / "pyproject.toml").read_text())
    prefix = "crates/macropulse-py/"
    for key in ("manifest-path", "python-source"):
        assert root["tool"]["maturin"].pop(key) == prefix + own["tool"]["maturin"].pop(key)
    assert own == root


def test_the_version_is_that_of_the_program(program):
    assert program.run("--version").split() == ["macropulse", mp.__version__]


def test_all_names_are_listed_and_explained():
    public = {name for name in dir(mp) if not name.startswith("_")} - {"cluster"}
    assert public | {"__version__"} == set(mp.__all__)
    for name in sorted(public - {"OUTCOMES"}):
        thing = getattr(mp, name)
        assert inspect.getdoc(thing), f"{name} is not explained"
        assert thing.__module__ == "macropulse" or inspect.isbuiltin(thing), name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and not issubclass(thing, Exception):
                    assert inspect.getdoc(value), f"{name}.{member} is not explained"


def test_help_shows_arguments_and_defaults():
    assert str(inspect.signature(mp.simulate)) == (
        "(sensor, scene, *, seed=1, scan=0, threads=0)"
    )
    assert "Args:" in mp.simulate.__doc__ and "Raises:" in mp.simulate.__doc__


def test_the_stub_says_what_the_module_does():
    """Names, arguments and defaults, compared by mypy's own tool."""
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "macropulse", "--ignore-disjoint-bases",
         "--ignore-unused-allowlist", "--allowlist", str(HERE / "tests" / "stubtest.txt")],
        capture_output=True, text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


# Lines of code, and the complaint of a type checker about each, if any.
CHECKED = [
    ("mp.simulate('peregrine', mp.Scene.car(30.0), seed=1).x.mean()", None),
    ("for scan in mp.scans('a', 'b', 3): print(scan.image('range').shape)", None),
    ("for scan in mp.load_scans('out'): print(mp.score(scan))", None),
    ("mp.decode('a', 'shots.mps', 'ticks.mpt').x", None),
    ("mp.decode('a', 'shots.mps', {'tick': [1]})", "No overload variant"),
    ("mp.simulate('peregrine')", "Missing positional argument"),
    ("mp.simulate('peregrine', 'wall', sed=1)", "Unexpected keyword argument"),
    ("mp.load('a.pcd').rnage", '"Scan" has no attribute "rnage"'),
    ("mp.load('a.pcd').image(pick='nearest')", "incompatible type"),
]


def test_types_are_checked(tmp_path):
    files = [tmp_path / f"script_{at}.py" for at in range(len(CHECKED))]
    for file, (source, _) in zip(files, CHECKED, strict=True):
        file.write_text(f"import macropulse as mp\n\n{source}\n")
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", tmp_path / "cache",
                           *files], capture_output=True, text=True)
    for file, (source, wrong) in zip(files, CHECKED, strict=True):
        said = [line for line in done.stdout.splitlines() if line.startswith(str(file))]
        if wrong is None:
            assert not said, source
        else:
            assert any(wrong in line for line in said), (source, done.stdout)
