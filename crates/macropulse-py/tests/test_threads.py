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

ENDS = """
import sys
import macropulse as mp
print("ready", flush=True)
while True:
    mp.simulate("kim-park-2016-fixed", "street", threads=1)
"""


def interrupted(source, after):
    """Exit code, what it printed, and seconds from the signal to the end."""
    child = subprocess.Popen(
        [sys.executable, "-c", HEARS + source],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert child.stdout.readline() == "ready\n"
    time.sleep(after)
    assert child.poll() is None, "it was over before the signal came"
    began = time.monotonic()
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    return child.returncode, out + err, time.monotonic() - began


def test_ctrl_c_in_the_middle_of_a_scan_is_a_keyboard_interrupt():
    code, printed, took = interrupted(ENDS, 0.4)
    assert "KeyboardInterrupt" in printed
    assert code != 0 and took < 1.0, (code, took)


def test_a_program_may_go_on_after_ctrl_c():
    code, printed, took = interrupted(GOES_ON, 0.7)
    assert (code, printed) == (7, "interrupted\n") and took < 1.0, took


def test_other_threads_run_meanwhile():
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        began = time.monotonic()
        before = counted[0]
        mp.simulate("kim-park-2016-fixed", "street", threads=1)
        took, ran = time.monotonic() - began, counted[0] - before
    finally:
        stop.set()
        thread.join()
    # A lock held would let it count some times in all.
    assert took > 0.05 and ran > 50 * took, (took, ran)


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
