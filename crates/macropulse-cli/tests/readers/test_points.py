"""Files with a scan each, attribute by attribute."""

import csv
import math
import os
import shutil
import subprocess

import laspy
import numpy as np
import plyfile
import pyarrow.parquet
import pye57
import pypcd4
import pytest
from conftest import OUTCOMES, same


def test_csv(run, scan, points):
    with open(run / f"scan-{scan:06}.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(points)
    names = pypcd_names(run, scan)
    for row, point in zip(rows, points):
        for name in points.dtype.names:
            unit = {"x": "_m", "y": "_m", "z": "_m", "range": "_m", "true_range": "_m"}
            unit["incidence"] = "_rad"
            cell = row[name + unit.get(name, "")]
            if name == "outcome":
                assert cell == OUTCOMES[point[name]]
            elif name in ("object", "material"):
                assert cell == names[name].get(point[name], "")
            elif cell == "":
                assert math.isnan(point[name])
            else:
                assert point.dtype[name].type(cell) == point[name], name


def pypcd_names(run, scan):
    """Names of objects and materials in the comments of a PCD."""
    names = {"object": {}, "material": {}}
    with open(run / f"scan-{scan:06}.pcd", "rb") as file:
        for line in iter(file.readline, b"DATA binary\n"):
            words = line.decode().split(maxsplit=3)
            if len(words) == 4 and words[0] == "#" and words[1] in names:
                names[words[1]][int(words[2])] = words[3].strip()
    return names


def test_pcd(run, scan, points):
    cloud = pypcd4.PointCloud.from_path(run / f"scan-{scan:06}.pcd")
    data = cloud.pc_data
    if run.name == "single":
        assert (cloud.metadata.height, cloud.metadata.width) == (24, 40)
        rows, columns = np.divmod(np.arange(24 * 40), 40)
        np.testing.assert_array_equal(data["row"], rows)
        np.testing.assert_array_equal(data["column"], columns)
        # No return is NaN, never 0.
        empty = np.isnan(data["range"])
        assert empty.any() and np.isnan(data["x"][empty]).all()
        data = data[~empty]
        order = np.lexsort((points["column"], points["row"]))
        points = points[order]
    assert len(data) == len(points)
    same(data, points)


def test_ply(run, scan, points):
    vertices = plyfile.PlyData.read(run / f"scan-{scan:06}.ply")["vertex"].data
    same(vertices, points)
    # Types that other readers drop are not used.
    kinds = {vertices.dtype[name].str for name in vertices.dtype.names}
    assert kinds == {"<f4", "<f8", "<i4", "|u1"}


def test_ply_for_cloudcompare(run, scan, points):
    vertices = plyfile.PlyData.read(run / f"scan-{scan:06}-cloudcompare.ply")["vertex"].data
    plain = {"x", "y", "z", "intensity"}
    named = {name: name if name in plain else f"scalar_{name}" for name in points.dtype.names}
    assert list(vertices.dtype.names) == list(named.values())
    same({name: vertices[called] for name, called in named.items()}, points)


@pytest.mark.skipif(shutil.which("CloudCompare") is None, reason="there is no CloudCompare here")
def test_cloudcompare_has_all_attributes(run, points, tmp_path):
    """Without asking anybody, and all of them as scalar fields."""
    shutil.copy(run / "scan-000000-cloudcompare.ply", tmp_path / "cloud.ply")
    points = np.load(run / "scan-000000.npy")
    command = "CloudCompare -SILENT -O cloud.ply -C_EXPORT_FMT ASC -PREC 12 -ADD_HEADER -SAVE_CLOUDS"
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    subprocess.run(command.split(), cwd=tmp_path, env=environment, check=True, capture_output=True)
    (written,) = tmp_path.glob("cloud*.asc")
    header, *lines = written.read_text().splitlines()
    names = header.removeprefix("//").lower().split()
    assert sorted(names) == sorted(points.dtype.names)
    read = np.array([line.split() for line in lines], float)
    assert len(read) == len(points)
    for column, name in enumerate(names):
        # It keeps scalar fields as floats of four bytes.
        np.testing.assert_allclose(read[:, column], points[name].astype("f4"), rtol=1e-6, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("ending, unpacked_by", [("las", "Laszip"), ("laz", "Lazrs"), ("laz", "Laszip")])
def test_las(run, scan, points, ending, unpacked_by):
    """Also by LASzip, the reference, which shares no code with what compresses ours; lazrs does."""
    las = laspy.read(run / f"scan-{scan:06}.{ending}", laz_backend=laspy.LazBackend[unpacked_by])
    assert str(las.header.version) == "1.4" and las.header.point_format.id == 6
    extra = set(points.dtype.names) - set("x y z intensity time_ns".split())
    extra -= {"return_number", "number_of_returns"}
    assert set(las.point_format.extra_dimension_names) == extra | {"reflectance"}
    same(las, points, extra)
    same(las, points, ["return_number", "number_of_returns"])
    np.testing.assert_array_equal(las["reflectance"], points["intensity"])
    grey = np.clip(np.round(points["intensity"].astype(float) * 10_000), 0, 65_535)
    np.testing.assert_array_equal(las["intensity"], grey)
    for axis in "xyz":
        np.testing.assert_allclose(las[axis], points[axis].astype(float), rtol=0, atol=5.001e-7)
    np.testing.assert_allclose(las["gps_time"] * 1e9, points["time_ns"], rtol=1e-15)
    np.testing.assert_array_equal(las["user_data"], points["ring"])
    bounds = [points[axis].astype(float).max() for axis in "xyz"]
    np.testing.assert_allclose(las.header.maxs, bounds, rtol=0, atol=1e-6)
    assert las.header.point_count == len(points)


def test_e57(run, scan, points):
    file = pye57.E57(str(run / f"scan-{scan:06}.e57"))
    assert file.scan_count == 1
    header = file.get_header(0)
    assert header.point_count == len(points)
    # Fields that are not of the standard, and some that are, pye57 reads on demand alone.
    read = file.read_scan_raw(0, ignore_unsupported_fields=True)
    columns = {
        "x": read["cartesianX"],
        "y": read["cartesianY"],
        "z": read["cartesianZ"],
        "intensity": read["intensity"],
        "row": read["rowIndex"],
        "column": read["columnIndex"],
    }
    same(columns, points, columns)
    np.testing.assert_allclose(header.translation, [2.0 * scan_seconds(run, scan), 0.0, 2.0])


def scan_seconds(run, scan):
    import json

    return json.loads((run / "manifest.json").read_text())["scans"][scan]["start_ns"] * 1e-9


def test_e57_fields(run, scan, points):
    """What pye57 does not name is read by the reader under it."""
    file = pye57.E57(str(run / f"scan-{scan:06}.e57"))
    header = file.get_header(0)
    prefix = "macropulse:"
    ours = [name for name in header.point_fields if name.startswith(prefix)]
    names = [name.removeprefix(prefix) for name in ours]
    expected = "range peak marks margin flags true_range object material incidence outcome"
    assert names == expected.split()
    read = fields(file, header, ours)
    same({name: read[prefix + name] for name in names}, points, names)
    read = fields(file, header, ["timeStamp", "returnIndex", "returnCount"])
    np.testing.assert_allclose(read["timeStamp"] * 1e9, points["time_ns"], rtol=1e-15)
    np.testing.assert_array_equal(read["returnIndex"] + 1, points["return_number"])
    np.testing.assert_array_equal(read["returnCount"], points["number_of_returns"])


def fields(file, header, names):
    lib = pye57.libe57
    buffers = lib.VectorSourceDestBuffer()
    columns = {}
    for name in names:
        columns[name] = np.empty(header.point_count, "float64")
        args = (file.image_file, name, columns[name], header.point_count, True, True)
        buffers.append(lib.SourceDestBuffer(*args))
    header.points.reader(buffers).read()
    return columns


def test_parquet(run, scan, points):
    file = pyarrow.parquet.ParquetFile(run / f"scan-{scan:06}.parquet")
    table = file.read()
    assert table.column_names == list(points.dtype.names) and table.num_rows == len(points)
    for column in table.columns:
        assert column.null_count == 0
    read = {name: table[name].to_numpy() for name in table.column_names}
    assert {name: column.dtype for name, column in read.items()} == {
        name: points.dtype[name] for name in points.dtype.names
    }
    same(read, points)
    # Scan, image, pose and names, as a PCD has them.
    lines = file.schema_arrow.metadata[b"macropulse"].decode().splitlines()
    assert lines[0] == f"macropulse scan {scan}" and lines[1].startswith("macropulse list 24 40 ")
    pose = [float(word) for word in lines[2].removeprefix("macropulse viewpoint ").split()]
    np.testing.assert_allclose(pose[:3], [2.0 * scan_seconds(run, scan), 0.0, 2.0])
    names = {"object": {}, "material": {}}
    for line in lines[3:]:
        what, number, name = line.split(maxsplit=2)
        names[what][int(number)] = name
    assert names == pypcd_names(run, scan) and names["object"]


def test_kitti(run, scan, points):
    read = np.fromfile(run / f"scan-{scan:06}.bin", "<f4").reshape(-1, 4)
    for column, name in enumerate(["x", "y", "z", "intensity"]):
        np.testing.assert_array_equal(read[:, column], points[name])


def test_xyz(run, scan, points):
    read = np.loadtxt(run / f"scan-{scan:06}.xyz", np.float32)
    for column, name in enumerate(["x", "y", "z", "intensity"]):
        np.testing.assert_array_equal(read[:, column], points[name])


def test_range_image(run, scan, points):
    image = np.load(run / f"range-{scan:06}.npy")
    assert image.shape == (24, 40) and image.dtype == np.dtype("<f4")
    shown = {}
    for point in points:
        pixel = (point["row"], point["column"])
        best = shown.get(pixel)
        # The strongest: most marks, of several the nearest. No two here have as many.
        if best is None or point["peak"] > best["peak"]:
            shown[pixel] = point
    assert np.isfinite(image).sum() == len(shown)
    agree = sum(image[pixel] == point["range"] for pixel, point in shown.items())
    assert agree >= len(shown) - (0 if run.name == "single" else 5)
