"""What the files are held against: the points as NumPy reads them.

`MACROPULSE_FILES` names a folder with two runs of three scans with the truth in every format: `single`,
a return of each shot, and `several`, three of each. `MACROPULSE` names the program.
"""

import os
from pathlib import Path

import numpy as np
import pytest

FILES = Path(os.environ["MACROPULSE_FILES"])
SCANS = range(3)
RUNS = ["single", "several"]

MEASURED = (
    "x y z intensity range time_ns row column ring peak marks margin return_number "
    "number_of_returns flags"
).split()
TRUE = "true_range object material incidence outcome".split()
OUTCOMES = ["empty", "right", "near", "wrong", "missed", "false"]

# Time that stands for the beginning of the first scan in files of messages.
EPOCH_NS = 1_000_000_000


@pytest.fixture(params=RUNS)
def run(request):
    return FILES / request.param


@pytest.fixture(params=SCANS)
def scan(request):
    return request.param


@pytest.fixture
def points(run, scan):
    """The returns of a scan, all attributes, as a structured array."""
    points = np.load(run / f"scan-{scan:06}.npy")
    assert points.dtype.names == tuple(MEASURED + TRUE)
    assert len(points) > 100
    return points


def same(read, points, names=None):
    """Holds every attribute against a reader's columns; NaN is equal to NaN."""
    for name in names or points.dtype.names:
        np.testing.assert_array_equal(np.asarray(read[name]), points[name], err_msg=name)


def begin_ns(run, scan):
    """When the first shot of a scan was fired: pixels without a return are in the PCD alone."""
    import pypcd4

    return pypcd4.PointCloud.from_path(run / f"scan-{scan:06}.pcd").pc_data["time_ns"].min()
