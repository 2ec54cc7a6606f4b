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
    # Files do not keep the photons.
    truth = {"true_range", "object", "material", "incidence", "outcome"}
    assert set(scan.columns()) - set(plain.columns()) == truth | {"photons"}


def test_a_file_of_another_program_has_its_own_columns_digits_and_losses(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,red\n494428.61,4877455.58,123.456,7\n3,4,12,8\n")
    with pytest.warns(UserWarning, match="a.csv: left out: field red$"):
        scan = mp.load(tmp_path / "a.csv")
    assert list(scan.columns()) == ["x", "y", "z"]
    assert scan.x.dtype == scan.xyz().dtype == np.float64
    np.testing.assert_array_equal(scan.xyz()[0], [494428.61, 4877455.58, 123.456])
    # The range is not the file's: the distance from the origin stands for it.
    assert scan.range[1] == 13.0 and scan.range.dtype == np.float32
    for name in ("intensity", "time_ns", "flags", "photons"):
        with pytest.raises(mp.Error, match=f"there is no {name}: the file of the scan does not have it"):
            getattr(scan, name)
    with pytest.raises(mp.Error, match="a.csv: has no topics"):
        mp.load(tmp_path / "a.csv", topic="/points")
    with pytest.raises(mp.Error, match="there is no outcome: the scan has no truth"):
        scan.outcome
