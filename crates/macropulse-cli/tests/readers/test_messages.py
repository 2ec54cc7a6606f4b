"""Files with all scans of a run as messages."""

import math
import os
import signal
import subprocess
import time

import betterosi
import numpy as np
import pytest
from conftest import EPOCH_NS, SCANS, begin_ns, same
from mcap.reader import NonSeekingReader, make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufFactory
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from rosbags.highlevel import AnyReader

DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def decoded(path, factory):
    """Topic, time and message, in the order of the file's index."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[factory])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            yield channel.topic, message.log_time, decoded


def array(message):
    """A PointCloud2 as a structured array of height × width."""
    fields = message.fields
    dtype = np.dtype(
        {
            "names": [field.name for field in fields],
            "formats": ["<" + DATATYPES[field.datatype] for field in fields],
            "offsets": [field.offset for field in fields],
            "itemsize": message.point_step,
        }
    )
    assert not message.is_bigendian and message.row_step == message.point_step * message.width
    data = np.frombuffer(bytes(message.data), dtype)
    return data.reshape(message.height, message.width)


def clouds(path):
    return [m for topic, _, m in decoded(path, Ros2Factory()) if topic == "/points"]


def returns(message, run):
    """The returns of a cloud, in the order of its pixels where it is organised."""
    data = array(message)
    if message.height > 1:
        assert data.shape in [(24, 40), (40, 24)] and not message.is_dense
        assert np.isnan(data["x"]).any()
    return data[np.isfinite(data["x"])]


def ordered(message, points):
    """The points in the order in which the message has them."""
    if message.height == 1:
        return points
    return points[np.lexsort((points["column"], points["row"]))]


def test_extended(run, scan, points):
    message = clouds(run / "scans.mcap")[scan]
    data = returns(message, run)
    assert message.header.frame_id == "lidar"
    same(data, ordered(message, points))
    if run.name == "single":
        assert message.height == 24


def test_stamps(run):
    messages = list(decoded(run / "scans.mcap", Ros2Factory()))
    assert [topic for topic, _, _ in messages].count("/points") == len(SCANS)
    for scan, message in enumerate(clouds(run / "scans.mcap")):
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        # 1e-3 ns: a time of 64 bits may fall short of the whole ns that it stands for.
        assert -1e-3 <= begin_ns(run, scan) + EPOCH_NS - stamp < 1
    for topic, log_time, message in messages:
        if topic == "/points":
            stamp = message.header.stamp
            assert log_time == stamp.sec * 10**9 + stamp.nanosec


def test_velodyne(run, scan, points):
    message = clouds(run / "scans-velodyne.mcap")[scan]
    data = returns(message, run)
    if message.height > 1:
        # A line for each firing, with the lasers from the lowest one up.
        assert message.width == 24
        assert (array(message)["ring"] == np.arange(24)).all()
        points = points[np.lexsort((-points["row"].astype(int), points["column"]))]
    assert data.dtype.names == ("x", "y", "z", "intensity", "ring", "time")
    assert message.point_step == 22
    same(data, points, ["x", "y", "z"])
    # Ring 0 is the lowest laser, row 0 the highest.
    np.testing.assert_array_equal(data["ring"], 23 - points["row"])
    np.testing.assert_allclose(data["intensity"], points["intensity"] * 100, rtol=1e-6)
    np.testing.assert_allclose(data["time"] * 1e9, offset(message, points), rtol=1e-6, atol=1e-3)


def offset(message, points):
    """Time of the points since the stamp, ns."""
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    return points["time_ns"] - (stamp - EPOCH_NS)


def test_ouster(run, scan, points):
    message = clouds(run / "scans-ouster.mcap")[scan]
    data = returns(message, run)
    points = ordered(message, points)
    same(data, points, ["x", "y", "z", "ring"])
    np.testing.assert_array_equal(data["t"], np.round(offset(message, points)))
    np.testing.assert_array_equal(data["range"], np.round(points["range"].astype(float) * 1e3))
    percent = np.clip(np.round(points["intensity"].astype(float) * 100), 0, 255)
    np.testing.assert_array_equal(data["reflectivity"], percent)
    assert (data["ambient"] == 0).all() and message.point_step == 48


def test_livox(run, scan, points):
    message = clouds(run / "scans-livox.mcap")[scan]
    data = array(message)[0]
    same(data, points, ["x", "y", "z"])
    np.testing.assert_array_equal(data["line"], points["ring"])
    np.testing.assert_array_equal(data["tag"], np.minimum(points["return_number"], 3) << 4)
    np.testing.assert_allclose(data["timestamp"] - EPOCH_NS, points["time_ns"], atol=1e-6)
    white = np.clip(points["intensity"].astype(float) * 150, 0, 255)
    np.testing.assert_allclose(data["intensity"], white, atol=0.5)
    assert (data["intensity"] == np.round(data["intensity"])).all()


def test_autoware(run, scan, points):
    message = clouds(run / "scans-autoware.mcap")[scan]
    data = array(message)[0]
    assert message.point_step == 32 and message.is_dense
    assert [(field.name, field.offset) for field in message.fields] == [
        ("x", 0),
        ("y", 4),
        ("z", 8),
        ("intensity", 12),
        ("return_type", 13),
        ("channel", 14),
        ("azimuth", 16),
        ("elevation", 20),
        ("distance", 24),
        ("time_stamp", 28),
    ]
    same(data, points, ["x", "y", "z"])
    np.testing.assert_array_equal(data["channel"], points["ring"])
    np.testing.assert_array_equal(data["distance"], points["range"])
    np.testing.assert_array_equal(data["time_stamp"], np.round(offset(message, points)))
    percent = np.clip(np.round(points["intensity"].astype(float) * 100), 0, 255)
    np.testing.assert_array_equal(data["intensity"], percent)
    x, y, z = (points[axis].astype(float) for axis in "xyz")
    np.testing.assert_allclose(data["azimuth"], np.arctan2(-y, x) % (2 * np.pi), atol=1e-6)
    np.testing.assert_allclose(data["elevation"], np.arctan2(z, np.hypot(x, y)), atol=1e-6)
    if run.name == "single":
        assert (data["return_type"] == 1).all()
    else:
        alone = points["number_of_returns"] == 1
        assert (data["return_type"][alone] == 7).all() and set(data["return_type"]) > {7}


def test_transforms(run):
    import json

    poses = json.loads((run / "manifest.json").read_text())["scans"]
    messages = list(decoded(run / "scans.mcap", Ros2Factory()))
    fixed = [m for topic, _, m in messages if topic == "/tf_static"]
    pairs = [(t.header.frame_id, t.child_frame_id) for m in fixed for t in m.transforms]
    assert pairs == [("map", "odom"), ("base_link", "lidar")]
    moving = [m.transforms[0] for topic, _, m in messages if topic == "/tf"]
    assert len(moving) == len(SCANS)
    for transform, pose in zip(moving, poses):
        assert (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_link")
        at = transform.transform.translation
        np.testing.assert_allclose([at.x, at.y, at.z], pose["position_m"], atol=1e-12)
        turn = transform.transform.rotation
        yaw = 2 * math.degrees(math.atan2(turn.z, turn.w))
        assert abs(yaw - pose["yaw_deg"]) < 1e-9
    assert poses[2]["position_m"][0] > poses[0]["position_m"][0]


def test_rosbags(run):
    """The tools for bags know the types by the schemas that the file carries."""
    with AnyReader([run / "scans.mcap"]) as reader:
        topics = {connection.topic: connection.msgtype for connection in reader.connections}
        assert topics == {
            "/points": "sensor_msgs/msg/PointCloud2",
            "/tf": "tf2_msgs/msg/TFMessage",
            "/tf_static": "tf2_msgs/msg/TFMessage",
        }
        seen = 0
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/points":
                points = np.load(run / f"scan-{seen:06}.npy")
                read = returns(message, run)
                same(read, ordered(message, points), ["x", "intensity", "time_ns", "outcome"])
                seen += 1
        assert seen == len(SCANS)


def test_foxglove(run, scan, points):
    numbers = [None, "u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]
    path = run / "scans-foxglove.mcap"
    messages = list(decoded(path, ProtobufFactory()))
    cloud = [m for topic, _, m in messages if topic == "/points"][scan]
    assert type(cloud).DESCRIPTOR.full_name == "foxglove.PointCloud"
    dtype = np.dtype(
        {
            "names": [field.name for field in cloud.fields],
            "formats": ["<" + numbers[field.type] for field in cloud.fields],
            "offsets": [field.offset for field in cloud.fields],
            "itemsize": cloud.point_stride,
        }
    )
    same(np.frombuffer(cloud.data, dtype), points)
    stamp = cloud.timestamp.seconds * 10**9 + cloud.timestamp.nanos
    assert 0 <= begin_ns(run, scan) + EPOCH_NS - stamp < 1
    transforms = [m for topic, _, m in messages if topic == "/tf"][scan].transforms
    children = [transform.child_frame_id for transform in transforms]
    assert children == ["odom", "base_link", "lidar"] and cloud.frame_id == "lidar"


def test_osi(run, scan, points):
    messages = list(betterosi.read(run / "scans-osi.mcap"))
    data = [m for m in messages if type(m).__name__ == "SensorData"]
    views = [m for m in messages if type(m).__name__ == "SensorView"]
    assert len(data) == len(views) == len(SCANS)
    (lidar,) = data[scan].feature_data.lidar_sensor
    assert lidar.header.number_of_valid_detections == len(points) == len(lidar.detection)
    assert lidar.header.cycle_counter == scan
    version = data[scan].version
    assert (version.version_major, version.version_minor) == (3, 7)

    def column(value):
        return np.array([value(detection) for detection in lidar.detection])

    np.testing.assert_array_equal(column(lambda d: d.position.distance), points["range"])
    x, y, z = (points[axis].astype(float) for axis in "xyz")
    azimuth, elevation = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
    np.testing.assert_allclose(column(lambda d: d.position.azimuth), azimuth, atol=1e-12)
    np.testing.assert_allclose(column(lambda d: d.position.elevation), elevation, atol=1e-12)
    np.testing.assert_array_equal(column(lambda d: d.reflectivity), points["intensity"])
    percent = np.clip(points["intensity"].astype(float) * 100, 0, 100)
    np.testing.assert_allclose(column(lambda d: d.intensity), percent, rtol=1e-12)
    np.testing.assert_array_equal(column(lambda d: d.beam_id.value), points["row"])
    # Right and near are surfaces (1, other), wrong is invalid (2), false is clutter (3).
    kinds = np.array([3, 1, 1, 2, 3, 3])[points["outcome"]]
    np.testing.assert_array_equal(column(lambda d: int(d.classification)), kinds)
    objects = np.where(points["object"] == 65535, 2**64 - 1, points["object"].astype("u8"))
    np.testing.assert_array_equal(column(lambda d: d.object_id.value), objects)
    (reflections,) = [view.reflection for view in views[scan].lidar_sensor_view]
    known = np.isfinite(points["true_range"])
    flight = 2 * points["true_range"][known].astype(float) / 299_792_458
    found = np.array([reflection.time_of_flight for reflection in reflections])
    np.testing.assert_allclose(found, flight, rtol=1e-12)


@pytest.mark.parametrize("keep", [0.5, 0.9, 0.999])
def test_a_file_that_was_cut_short_has_its_finished_scans(run, tmp_path, keep):
    whole = (run / "scans.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(keep * len(whole))])
    found = 0
    with open(cut, "rb") as file:
        reader = NonSeekingReader(file, decoder_factories=[Ros2Factory()])
        try:
            for _, channel, _, _ in reader.iter_decoded_messages(log_time_order=False):
                found += channel.topic == "/points"
        except Exception:
            pass
    assert found >= (1 if keep == 0.5 else 2)


def test_a_run_that_was_killed_has_its_finished_scans(tmp_path):
    command = [os.environ["MACROPULSE"], "simulate", "--sensor", "hdl-64e", "--scene", "street"]
    command += ["--scans", "10000", "--format", "mcap", "-o", str(tmp_path)]
    path = tmp_path / "scans.mcap"
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + 240
        # A scan takes 8 MB: with 16 the first one is whole, whatever of the next one is there.
        while not (path.exists() and path.stat().st_size > 16_000_000):
            assert process.poll() is None and time.monotonic() < until
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    scans = []
    with open(path, "rb") as file:
        reader = NonSeekingReader(file, decoder_factories=[Ros2Factory()])
        try:
            for _, channel, message, cloud in reader.iter_decoded_messages(log_time_order=False):
                if channel.topic == "/points":
                    scans.append((message.sequence, len(array(cloud))))
        except Exception:
            pass
    assert len(scans) >= 1 and [scan for scan, _ in scans] == list(range(len(scans)))
