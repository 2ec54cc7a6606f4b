"""What the tests share."""

import json
import os
import shutil
import subprocess

import macropulse as mp
import pytest


class Program:
    """The program of the same source."""

    def __init__(self, path):
        self.path = path

    def run(self, *words):
        done = subprocess.run([self.path, *map(str, words)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def json(self, *words):
        """What it prints as JSON, without the version of its keys."""
        told = json.loads(self.run(*words, "--json"))
        assert told.pop("schema_version") >= 1
        return told

    def complaint(self, *words):
        """What it says of wrong input, without its name."""
        done = subprocess.run([self.path, *map(str, words)], capture_output=True, text=True)
        assert done.returncode == 2, done
        return " ".join(done.stderr.split()).removeprefix("macropulse: ").removeprefix("error: ")


@pytest.fixture(scope="session")
def program():
    """`MACROPULSE_PROGRAM`, or the one on the path."""
    path = os.environ.get("MACROPULSE_PROGRAM") or shutil.which("macropulse")
    if path is None:
        pytest.skip("there is no program to compare with; name it in MACROPULSE_PROGRAM")
    return Program(path)


FEWER = {"scan.raster.rows": 12}


@pytest.fixture(scope="session")
def sensor():
    """A coded sensor with few rows."""
    return mp.Sensor("kim-park-2016-fixed", FEWER)


@pytest.fixture(scope="session")
def scan(sensor):
    """Its scan of the street."""
    return mp.simulate(sensor, "street", seed=7)
