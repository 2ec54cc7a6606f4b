"""Columns lend the memory of their scan."""

import gc
import sys

import macropulse as mp
import numpy as np
import pytest


def test_nothing_is_copied(scan):
    for name in scan.columns():
        one, other = getattr(scan, name), getattr(scan, name)
        assert one.base is scan, name
        address = one.__array_interface__["data"][0]
        assert address == other.__array_interface__["data"][0], name
        assert not one.flags.owndata and one.flags.aligned and one.flags.c_contiguous, name
    # The row is called ring as well, in the same memory.
    assert np.shares_memory(scan.row, scan.ring) and not np.shares_memory(scan.x, scan.y)
    assert scan.columns()["x"].base is scan


def test_columns_cannot_be_written_to(scan):
    for name, column in scan.columns().items():
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 1
        with pytest.raises(ValueError, match="WRITEABLE"):
            column.flags.writeable = True
    assert scan.x.copy().flags.writeable


def test_an_array_keeps_its_scan_alive():
    scan = mp.simulate("peregrine", "wall", seed=1)
    ranges, wanted = scan.range, scan.range.copy()
    count = sys.getrefcount(scan)
    view = ranges[10:20]
    assert sys.getrefcount(scan) == count
    del scan
    gc.collect()
    # Other scans would lie where a freed one was.
    others = [mp.simulate("peregrine", "wall", seed=seed) for seed in range(2, 6)]
    np.testing.assert_array_equal(ranges, wanted)
    np.testing.assert_array_equal(view, wanted[10:20])
    assert len(others) == 4


def test_memory_goes_back_with_the_last_array():
    scan = mp.simulate("peregrine", "wall")
    before = sys.getrefcount(scan)
    columns = scan.columns()
    assert sys.getrefcount(scan) == before + len(columns)
    columns.clear()
    gc.collect()
    assert sys.getrefcount(scan) == before


def test_types_are_those_of_files(scan):
    kinds = {name: column.dtype.str for name, column in scan.columns().items()}
    assert kinds["time_ns"] == "<f8" and kinds["x"] == kinds["intensity"] == "<f4"
    assert kinds["row"] == kinds["object"] == "<u2" and kinds["outcome"] == kinds["flags"] == "|u1"


def test_a_file_without_truth_has_none(scan, tmp_path):
    scan.save(tmp_path / "plain.pcd", truth=False)
    plain = mp.load(tmp_path / "plain.pcd")
    assert "outcome" not in plain.columns() and "x" in plain.columns()
    with pytest.raises(mp.Error, match="there is no outcome: the scan has no truth"):
        plain.outcome
