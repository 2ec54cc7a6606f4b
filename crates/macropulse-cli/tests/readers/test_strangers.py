"""Clouds of other writers, converted to every format that holds their digits, and read by others again.

A national grid has coordinates of six and seven digits before the point: 32-bit floats, which a
simulation needs, keep 0.5 m of them.
"""

import csv
import os
import subprocess
from unittest import mock

import laspy
import numpy as np
import plyfile
import pye57
import pypcd4
import pytest
from conftest import FILES
from mcap_ros2.writer import Writer
from test_messages import array, clouds, decoded

# Step of the coordinates, m, in every file.
STEP = 1e-3
FORMATS = ["las", "laz", "e57", "ply", "pcd", "npy", "csv", "mcap"]
STAMPS = [1_715_964_782_123_456_789, 1_715_964_782_223_456_788]


def far(count=50, seed=7):
    """Points of a national grid, some corners of it among them."""
    random = np.random.default_rng(seed)
    points = np.array([494428.61, 4877455.58, 123.456]) + random.uniform(-400, 400, (count, 3))
    points = np.round(points, 3)
    points[0] = [494428.61, 4877455.58, 123.456]
    points[1] = [-1_500_000.001, 6_999_999.999, -0.001]
    return points


def convert(*words):
    command = [os.environ["MACROPULSE"], "convert", *map(str, words)]
    ran = subprocess.run(command, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return ran


def write_las(path, points, version="1.2", point_format=3):
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales, header.offsets = [STEP] * 3, [494000.0, 4877000.0, 0.0]
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.write(path)


def write_las_1_4(path, points):
    write_las(path, points, "1.4", 7)


def write_e57(path, points):
    write_scans(path, [(points, {})])


def write_scans(path, scans):
    """pye57 writes 32-bit floats; the library under it writes 64 bits as well."""
    axes = ["cartesianX", "cartesianY", "cartesianZ"]
    with mock.patch.object(pye57.libe57, "E57_SINGLE", pye57.libe57.E57_DOUBLE):
        with pye57.E57(str(path), mode="w") as file:
            for points, pose in scans:
                file.write_scan_raw(dict(zip(axes, points.T.copy())), **pose)


def structured(points):
    data = np.empty(len(points), [(name, "f8") for name in "xyz"])
    for at, name in enumerate("xyz"):
        data[name] = points[:, at]
    return data


def write_ply(path, points):
    plyfile.PlyData([plyfile.PlyElement.describe(structured(points), "vertex")]).write(path)


def write_ply_text(path, points):
    vertices = plyfile.PlyElement.describe(structured(points), "vertex")
    plyfile.PlyData([vertices], text=True).write(path)


def write_pcd(path, points):
    fields, types = ("x", "y", "z"), (np.float64,) * 3
    pypcd4.PointCloud.from_points(points, fields, types).save(path)


def write_npy(path, points):
    np.save(path, structured(points))


def write_csv(path, points):
    with open(path, "w", newline="") as file:
        csv.writer(file).writerows([["x", "y", "z"], *points.tolist()])


def write_mcap(path, points, stamps=STAMPS[:1], topics=("/lidar",)):
    """Messages whose sequence is 0, as rosbag2 writes them, in chunks by Zstandard."""
    schema = next(
        schema.data.decode()
        for schema in summary(FILES / "single" / "scans.mcap").schemas.values()
        if schema.name == "sensor_msgs/msg/PointCloud2"
    )
    field = lambda at: {"name": "xyz"[at], "offset": 8 * at, "datatype": 8, "count": 1}
    with Writer(str(path)) as writer:
        schema = writer.register_msgdef("sensor_msgs/msg/PointCloud2", schema)
        for at, stamp in enumerate(stamps):
            data = points[at % len(points) :].astype("<f8").tobytes()
            message = {
                "header": {
                    "stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9},
                    "frame_id": "lidar",
                },
                "height": 1,
                "width": len(data) // 24,
                "fields": [field(0), field(1), field(2)],
                "is_bigendian": False,
                "point_step": 24,
                "row_step": len(data),
                "data": data,
                "is_dense": True,
            }
            topic = topics[at % len(topics)]
            writer.write_message(topic, schema, message, stamp, stamp, sequence=0)


def summary(path):
    from mcap.reader import make_reader

    with open(path, "rb") as file:
        return make_reader(file).get_summary()


WRITERS = {
    "las": (write_las, "las"),
    "las-1.4": (write_las_1_4, "las"),
    "laz": (write_las, "laz"),
    "e57": (write_e57, "e57"),
    "ply": (write_ply, "ply"),
    "ply-text": (write_ply_text, "ply"),
    "pcd": (write_pcd, "pcd"),
    "npy": (write_npy, "npy"),
    "csv": (write_csv, "csv"),
    "mcap": (write_mcap, "mcap"),
}


def read_las(path):
    return np.asarray(laspy.read(path).xyz)


def read_e57(path, scan=0):
    data = pye57.E57(str(path)).read_scan_raw(scan, ignore_unsupported_fields=True)
    assert set(data) == {"cartesianX", "cartesianY", "cartesianZ"}
    return np.stack([data[f"cartesian{axis}"] for axis in "XYZ"], 1)


def columns(data):
    # No attribute is there that the file did not have.
    assert data.dtype.names == ("x", "y", "z")
    return np.stack([data[name] for name in "xyz"], 1)


def read_csv(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return np.array([[float(row[name]) for name in ("x_m", "y_m", "z_m")] for row in rows])


READERS = {
    "las": read_las,
    "laz": read_las,
    "e57": read_e57,
    "ply": lambda path: columns(plyfile.PlyData.read(path)["vertex"].data),
    "pcd": lambda path: columns(pypcd4.PointCloud.from_path(path).pc_data),
    "npy": lambda path: columns(np.load(path)),
    "csv": read_csv,
    "mcap": lambda path: columns(array(clouds(path)[0])[0]),
}


@pytest.mark.parametrize("writer", WRITERS)
def test_coordinates_survive_from_every_writer_to_every_reader(writer, tmp_path):
    write, ending = WRITERS[writer]
    points = far()
    path = tmp_path / f"in.{ending}"
    write(path, points)
    convert(path, "--format", ",".join(FORMATS), "-o", tmp_path / "out")
    for name in FORMATS:
        found = sorted((tmp_path / "out").glob(f"*.{name}"))
        assert len(found) == 1, found
        read = READERS[name](found[0])
        assert read.shape == points.shape, name
        assert np.abs(read - points).max() <= 0.5 * STEP, name
    # The same by 32-bit floats is metres off, so the bound can fail; the program says so.
    told = convert(path, "-o", tmp_path / "out" / "float.bin").stderr
    assert "kitti cannot hold" in told and "digits of coordinates beyond 32-bit floats" in told
    floats = np.fromfile(tmp_path / "out" / "float.bin", "<f4").reshape(-1, 4)[:, :3]
    assert np.abs(floats - points).max() > 0.1


def test_every_scan_of_an_e57_survives_with_its_pose(tmp_path):
    scans = [far(20, 1), far(30, 2), far(40, 3)]
    turns = [[1.0, 0, 0, 0], [0.6, 0, 0, 0.8], [0, 1.0, 0, 0]]
    poses = [
        {"rotation": np.array(turn), "translation": np.array([at, 10.5, 0])}
        for at, turn in enumerate(turns)
    ]
    write_scans(tmp_path / "in.e57", zip(scans, poses))
    ran = convert(tmp_path / "in.e57", "--format", "e57,mcap", "-o", tmp_path / "out")
    files = sorted((tmp_path / "out").glob("*.e57"))
    assert len(files) == 3 and ran.stdout.startswith("3 scans, 90 points, 4 files")
    for at, path in enumerate(files):
        np.testing.assert_array_equal(read_e57(path), scans[at])
        file = pye57.E57(str(path))
        header = file.get_header(0)
        np.testing.assert_allclose(header.rotation, turns[at])
        np.testing.assert_allclose(header.translation, [at, 10.5, 0])
    (bag,) = (tmp_path / "out").glob("*.mcap")
    assert [message.width for message in clouds(bag)] == [20, 30, 40]


def test_every_message_of_a_bag_survives_with_its_stamp(tmp_path):
    bag = tmp_path / "bag.mcap"
    write_mcap(bag, far(), STAMPS)
    ran = convert(bag, "--format", "ply,mcap", "-o", tmp_path / "out")
    files = sorted((tmp_path / "out").glob("*.ply"))
    assert len(files) == 2 and ran.stdout.startswith("2 scans, 99 points, 3 files")
    assert [len(plyfile.PlyData.read(file)["vertex"]) for file in files] == [50, 49]
    (again,) = (tmp_path / "out").glob("*.mcap")
    stamps = [message.header.stamp for message in clouds(again)]
    assert [stamp.sec * 10**9 + stamp.nanosec for stamp in stamps] == STAMPS


def test_files_without_stamps_get_distinct_ones(tmp_path):
    for at in range(3):
        write_pcd(tmp_path / f"{at}.pcd", far(10, at))
    inputs = [tmp_path / f"{at}.pcd" for at in range(3)]
    ran = convert(*inputs, "-o", tmp_path / "drive.mcap")
    assert "2 scans begin no later than the one before" in ran.stderr
    stamps = [m.header.stamp for m in clouds(tmp_path / "drive.mcap")]
    times = [stamp.sec * 10**9 + stamp.nanosec for stamp in stamps]
    assert np.diff(times).tolist() == [10**8, 10**8]
    logged = [time for topic, time, _ in messages(tmp_path / "drive.mcap") if topic == "/points"]
    assert logged == times


def messages(path):
    from mcap_ros2.decoder import DecoderFactory

    return list(decoded(path, DecoderFactory()))


def test_a_topic_is_chosen(tmp_path):
    bag = tmp_path / "bag.mcap"
    write_mcap(bag, far(), STAMPS, ["/left", "/right"])
    both = convert(bag, "--format", "csv", "-o", tmp_path / "both")
    assert both.stdout.startswith("2 scans") and "clouds on /left, /right" in both.stderr
    right = convert(bag, "--topic", "/right", "-o", tmp_path / "right.csv")
    assert right.stdout.startswith("1 scan, 49 points") and "--topic" not in right.stderr
    command = [os.environ["MACROPULSE"], "convert", bag, "--topic", "/top", "-o", tmp_path / "t.csv"]
    ran = subprocess.run(command, capture_output=True, text=True)
    assert ran.returncode == 2 and "no clouds on the topic `/top`, but on /left, /right" in ran.stderr
    assert not (tmp_path / "t.csv").exists()


def test_losses_are_told_and_what_is_no_point_is_none(tmp_path):
    points = far(4)
    header = laspy.LasHeader(version="1.4", point_format=7)
    header.scales, header.offsets = [STEP] * 3, [494000.0, 4877000.0, 0.0]
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.red, las.classification = [1, 2, 3, 4], [2, 2, 6, 6]
    las.withheld = [0, 1, 0, 0]
    las.add_extra_dim(laspy.ExtraBytesParams("echo_width", "f4"))
    las.write(tmp_path / "in.las")
    told = convert(tmp_path / "in.las", "-o", tmp_path / "out.csv").stderr
    line = "left out: fields echo_width, classification, red; 1 point marked as withheld"
    assert line in told and told.count("\n") == 1
    np.testing.assert_allclose(read_csv(tmp_path / "out.csv"), points[[0, 2, 3]], rtol=0, atol=1e-6)
    with open(tmp_path / "out.csv") as file:
        assert file.readline() == "x_m,y_m,z_m\n"
