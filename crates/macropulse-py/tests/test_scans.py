"""Scans: the same as the program's, whole or one after the other."""

import csv
import warnings

import macropulse as mp
import numpy as np
import pytest

SET = ["--set", "scan.raster.rows=12"]


def test_ten_lines_make_a_cloud():
    scan = mp.simulate("peregrine", "car-30m", seed=1)
    assert len(scan) > 100
    for name in ("x", "y", "z", "range", "intensity", "ring", "time_ns"):
        column = getattr(scan, name)
        assert isinstance(column, np.ndarray) and column.shape == (len(scan),), name
    square = np.hypot(np.hypot(scan.x, scan.y), scan.z)
    np.testing.assert_allclose(square, scan.range, rtol=1e-5)


@pytest.mark.parametrize("ending", ["csv", "pcd", "ply"])
@pytest.mark.parametrize("truth", [False, True])
def test_files_are_those_of_the_program_to_the_byte(program, scan, tmp_path, ending, truth):
    options = ["--truth"] if truth else []
    program.run(
        "simulate", "--sensor", "kim-park-2016-fixed", "--scene", "street", *SET, "--seed", 7,
        "--format", ending, *options, "-o", tmp_path / "program", "-q",
    )
    ours = tmp_path / f"ours.{ending}"
    scan.save(ours, truth=truth)
    theirs = tmp_path / "program" / f"scan-000000.{ending}"
    assert ours.read_bytes() == theirs.read_bytes()
    assert ours.stat().st_size > 100_000


def test_columns_are_those_of_the_text(program, scan, tmp_path):
    """The CSV of the program, read by a reader that others wrote."""
    program.run(
        "simulate", "--sensor", "kim-park-2016-fixed", "--scene", "street", *SET, "--seed", 7,
        "--format", "csv", "--truth", "-o", tmp_path, "-q",
    )
    with open(tmp_path / "scan-000000.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(scan)
    names = {"x_m": "x", "range_m": "range", "intensity": "intensity", "time_ns": "time_ns",
             "row": "row", "column": "column", "margin": "margin", "true_range_m": "true_range",
             "incidence_rad": "incidence", "return_number": "return_number", "flags": "flags"}
    for heading, name in names.items():
        column = getattr(scan, name)
        text = np.array([row[heading] for row in rows], dtype="f8").astype(column.dtype)
        np.testing.assert_array_equal(column, text, err_msg=name)
    objects = [scan.objects[at] for at in scan.object[:50]]
    assert objects == [row["object"] for row in rows[:50]]


def test_counts_are_those_of_the_program(program, scan):
    told = program.json(
        "simulate", "--sensor", "kim-park-2016-fixed", "--scene", "street", *SET, "--seed", 7,
        "--format", "none",
    )
    manifest = scan.manifest
    assert manifest.pop("scan") == 0 and manifest.pop("schema_version") >= 1
    for key, value in manifest.items():
        if key != "times_s":
            assert told[key] == value, key
    assert set(told) - set(manifest) == {"scans", "files", "speed", "folder"}
    assert scan.score["outcomes"] == told["outcomes"]
    assert scan.score["points_on_target"] == told["counts"]["points_on_target"]
    assert scan.counts["rejects"] == told["rejects"]
    assert scan.counts["returns"] == len(scan)


def test_a_scan_does_not_depend_on_the_number_of_threads(sensor, scan):
    for threads in (1, 3):
        again = mp.simulate(sensor, "street", seed=7, threads=threads)
        for name, column in scan.columns().items():
            np.testing.assert_array_equal(column, getattr(again, name), err_msg=name)
    other = mp.simulate(sensor, "street", seed=8)
    assert len(other) != len(scan) or (other.range != scan.range).any()


def test_scans_come_one_after_the_other():
    scans = mp.scans("peregrine", "wall", 3, seed=5, first=2)
    assert len(scans) == 3 and iter(scans) is scans
    found = list(scans)
    assert [scan.number for scan in found] == [2, 3, 4] and len(scans) == 0
    alone = mp.simulate("peregrine", "wall", seed=5, scan=3)
    np.testing.assert_array_equal(found[1].range, alone.range)
    assert not np.array_equal(found[0].range, alone.range)
    assert np.diff([scan.time_ns.min() for scan in found]).min() > 0


def test_an_empty_scan_says_where_the_light_was_lost():
    far = mp.Scene("wall", {"object.wall.position_m.x": 500})
    with pytest.warns(UserWarning, match="not a single point: no ray met a surface"):
        scan = mp.simulate("peregrine", far)
    assert len(scan) == 0 and np.isnan(scan.image()).all()
    assert "0 points" in repr(scan) and "<img" in scan._repr_html_()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mp.simulate("peregrine", "wall")


def test_images_have_the_shape_of_the_sensor(scan, sensor):
    image = scan.image("range")
    assert image.shape == sensor.shape == scan.shape and image.dtype == np.float32
    shown = ~np.isnan(image)
    # One return of each pixel: where it has a single one, that.
    single = scan.number_of_returns == 1
    np.testing.assert_array_equal(image[scan.row[single], scan.column[single]], scan.range[single])
    pixels = set(zip(scan.row.tolist(), scan.column.tolist()))
    assert shown.sum() == len(pixels) < image.size
    ints = scan.image("peak", pick="first")
    assert ints.dtype == np.uint16 and (ints[~shown] == 0).all()
    outcomes = np.bincount(scan.image("outcome").ravel(), minlength=7)
    told = [scan.score["outcomes"][name] for name in mp.OUTCOMES]
    assert outcomes.tolist() == told
    missed = scan.image("outcome") == mp.OUTCOMES.index("missed")
    assert missed.any() and (scan.image("object")[missed] != 65535).all()
    assert np.isfinite(scan.image("true_range")[missed]).all()


def test_points_as_one_array(scan):
    points = scan.xyz()
    assert points.shape == (len(scan), 3) and points.dtype == np.float32
    np.testing.assert_array_equal(points[:, 2], scan.z)


def test_a_score_is_counted_from_the_truth(scan, tmp_path):
    told = mp.score(scan)
    assert told["outcomes"] == scan.score["outcomes"]
    right = scan.outcome == mp.OUTCOMES.index("right")
    image = scan.image("outcome") == mp.OUTCOMES.index("right")
    assert told["count"] == image.sum()
    error = (scan.image("range").astype("f8") - scan.image("true_range"))[image]
    assert told["mean_m"] == pytest.approx(error.mean(), abs=1e-9)
    assert told["deviation_m"] == pytest.approx(error.std(ddof=1), rel=1e-9)
    assert right.sum() >= image.sum()
    scan.save(tmp_path / "with.pcd")
    assert mp.score(mp.load(tmp_path / "with.pcd"))["outcomes"] == told["outcomes"]
    scan.save(tmp_path / "without.pcd", truth=False)
    with pytest.raises(mp.Error, match="no truth"):
        mp.score(mp.load(tmp_path / "without.pcd"))


def test_a_file_is_read_back(scan, tmp_path):
    scan.save(tmp_path / "scan.pcd")
    again = mp.load(tmp_path / "scan.pcd")
    for name, column in scan.columns().items():
        if name != "photons":
            np.testing.assert_array_equal(column, getattr(again, name), err_msg=name)
    assert again.sensor is None and again.score is None and again.counts is None and again.manifest is None and again.shape == scan.shape


def test_a_table_of_pandas(scan):
    table = scan.to_pandas()
    assert list(table) == list(scan.columns()) and len(table) == len(scan)
    assert table["range"].dtype == np.float32
    np.testing.assert_array_equal(table["time_ns"], scan.time_ns)


def test_what_is_shown_of_a_scan(scan):
    assert repr(scan).startswith("<macropulse.Scan 0 of kim-park-2016-fixed: ")
    assert f"{len(scan)} points, 12 x 848 pixels" in repr(scan)
    html = scan._repr_html_()
    assert "data:image/png;base64,iVBOR" in html and f"{len(scan)} points" in html
    assert f"right {scan.score['outcomes']['right']}" in html
    assert "<script" not in html
