"""Other threads run meanwhile, Ctrl-C ends, and nothing depends on who asks."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import macropulse as mp
import numpy as np
import pytest

# A program that is started in the background, as tests may be, is told to ignore Ctrl-C, and so are those it starts.
HEARS = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"

# What a thorough receiver takes for this is minutes: a scan that ends sooner was interrupted.
LONG = {"receiver.effort": "thorough", "detector.photon-counting.dark_counts_hz": 1e10}

GOES_ON = """
import sys
import macropulse as mp
print("ready", flush=True)
try:
    for scan in mp.scans("kim-park-2016-fixed", "street", 10_000, threads=1):
        pass
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(7)
"""

ENDS = f"""
import macropulse as mp
sensor = mp.Sensor("kim-park-2016-fixed", {LONG})
print("ready", flush=True)
mp.simulate(sensor, "street", threads=1)
print("over", flush=True)
"""


def interrupted(source, after):
    """Exit code, and what it printed."""
    child = subprocess.Popen(
        [sys.executable, "-c", HEARS + source],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert child.stdout.readline() == "ready\n"
    time.sleep(after)
    assert child.poll() is None, "it was over before the signal came"
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    return child.returncode, out + err


def test_ctrl_c_in_the_middle_of_a_scan_is_a_keyboard_interrupt():
    code, printed = interrupted(ENDS, 0.4)
    assert "KeyboardInterrupt" in printed and "over" not in printed
    assert code != 0


def test_a_program_may_go_on_after_ctrl_c():
    assert interrupted(GOES_ON, 0.7) == (7, "interrupted\n")


def test_other_threads_run_meanwhile():
    sensor = mp.Sensor("kim-park-2016-fixed", LONG)
    heard = signal.signal(signal.SIGINT, signal.default_int_handler)

    def interrupt():
        for _ in range(100):
            time.sleep(0.001)
        signal.raise_signal(signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    try:
        # Were a lock held, the signal would not come before the scan is over.
        with pytest.raises(KeyboardInterrupt):
            thread.start()
            mp.simulate(sensor, "street", threads=1)
    finally:
        thread.join()
        signal.signal(signal.SIGINT, heard)


def test_several_threads_may_simulate_at_once(sensor, scan):
    with ThreadPoolExecutor(4) as pool:
        scans = list(pool.map(lambda _: mp.simulate(sensor, "street", seed=7), range(4)))
    for again in scans:
        np.testing.assert_array_equal(again.range, scan.range)


def _simulated(seed):
    return mp.simulate("peregrine", "wall", seed=seed).range.copy()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own():
    """As the loaders of training data do."""
    wanted = _simulated(3)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        found = pool.map_async(_simulated, [3, 3, 3]).get(timeout=60)
    for ranges in found:
        np.testing.assert_array_equal(ranges, wanted)


def test_sensors_and_scenes_travel_to_other_processes():
    sensor = mp.Sensor("peregrine", {"scan.max_range_m": 60})
    corners = [[0, -3, -3], [0, 3, -3], [0, 3, 3], [0, -3, 3]]
    scene = mp.Scene.from_mesh(corners, [[0, 1, 2], [0, 2, 3]], position_m=[20, 0, 0])
    wanted = mp.simulate(sensor, scene, seed=2).range
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.apply(_ranges, (sensor, scene))
    assert len(wanted) > 100
    np.testing.assert_array_equal(found, wanted)


def _ranges(sensor, scene):
    return mp.simulate(sensor, scene, seed=2).range.copy()
