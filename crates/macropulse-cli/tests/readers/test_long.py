"""Long runs: in the memory of a short one, and what is finished is whole whenever they end."""

import os
import signal
import subprocess
import time

import laspy
import numpy as np
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory

# Some hundred points a scan.
RUN = "simulate peregrine wall --set scan.flash.rows=8 --format mcap,laz -q".split()
SCANS = 1000


def begin(folder, scans):
    command = [os.environ["MACROPULSE"], *RUN, "--scans", str(scans), "-o", str(folder)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def peak_memory(folder, scans):
    """The most memory that a run has held, bytes, as its system counts."""
    process = begin(folder, scans)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, process.stderr.read()
    process.stderr.close()
    return used.ru_maxrss * 1024


def points_of(folder, scan):
    """The points of a LAZ, in the order of its pixels."""
    las = laspy.read(folder / f"scan-{scan:06}.laz", laz_backend=laspy.LazBackend.Lazrs)
    order = np.lexsort((las["column"], las["row"]))
    return np.stack([las.x, las.y, las.z], axis=1)[order]


def messages(reader):
    """Number and points of each cloud of an MCAP, as far as the file goes."""
    try:
        for _, channel, message, cloud in reader.iter_decoded_messages(log_time_order=False):
            if channel.topic == "/points":
                data = np.frombuffer(bytes(cloud.data), np.uint8).reshape(-1, cloud.point_step)
                points = data[:, :12].copy().view("<f4").astype(float)
                yield message.sequence, points[np.isfinite(points[:, 0])]
    except Exception:
        return


def same(points, others):
    assert len(points) == len(others) > 100
    np.testing.assert_allclose(points, others, rtol=0, atol=5.001e-7)


def test_a_thousand_scans_take_the_memory_of_a_few(tmp_path):
    few = peak_memory(tmp_path / "few", 10)
    many = peak_memory(tmp_path / "many", SCANS)
    # All points of the run would be 20 MB more.
    assert many - few < 8e6, (few, many)
    files = sorted((tmp_path / "many").glob("scan-*.laz"))
    assert len(files) == SCANS
    with open(tmp_path / "many" / "scans.mcap", "rb") as file:
        found = 0
        for number, points in messages(make_reader(file, decoder_factories=[DecoderFactory()])):
            assert number == found
            if number % 50 == 49:
                same(points_of(tmp_path / "many", number), points)
            found += 1
    assert found == SCANS


def test_what_is_finished_when_a_run_is_killed_is_whole(tmp_path):
    process = begin(tmp_path, SCANS)
    try:
        until = time.monotonic() + 120
        while not (tmp_path / "scan-000150.laz").exists():
            assert process.poll() is None and time.monotonic() < until
            time.sleep(0.01)
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    # What was being written has another name.
    files = sorted(tmp_path.glob("*.laz"))
    assert 150 < len(files) < SCANS
    assert [file.name for file in files] == [f"scan-{scan:06}.laz" for scan in range(len(files))]
    with open(tmp_path / "scans.mcap", "rb") as file:
        reader = NonSeekingReader(file, decoder_factories=[DecoderFactory()])
        found = dict(messages(reader))
    # A scan is in one of both files first.
    assert list(found) == list(range(len(found))) and abs(len(found) - len(files)) <= 1
    for scan in range(min(len(found), len(files))):
        if scan % 10 == 0 or scan > len(files) - 10:
            same(points_of(tmp_path, scan), found[scan])
