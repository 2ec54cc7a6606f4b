"""Sweeps and scans on a local cluster of Ray, of which a worker is killed."""

import os
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import macropulse as mp
import numpy as np
import pytest
import ray
from macropulse import cluster

VARY = {"scene:object.wall.position_m.x": "20..50:4"}
ASKED = dict(seeds=3, changes={"scan.flash.rows": 16}, score=["pd", "precision"])


pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="workers are found in /proc")


@pytest.fixture(scope="module")
def two_workers():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def files(folder):
    """All files of a sweep, but the folder's own name."""
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_sweep_is_that_of_one_machine(two_workers, tmp_path):
    alone = mp.sweep("peregrine", "wall", VARY, folder=tmp_path / "alone", **ASKED)
    together = cluster.sweep("peregrine", "wall", VARY, folder=tmp_path / "ray", tasks=5, **ASKED)
    assert together == alone
    assert files(tmp_path / "ray") == files(tmp_path / "alone")
    assert len(files(tmp_path / "ray")) == 12 + 6


def at_work():
    """Process numbers of the workers in the middle of a shard: Ray names them by their task."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                if b"ray::_sweep_shard" in (entry / "cmdline").read_bytes():
                    found.append(int(entry.name))
            except OSError:
                pass
    return found


def test_a_killed_worker_loses_nothing(two_workers, tmp_path):
    # Tasks long enough to be met in the middle.
    asked = dict(seeds=2, changes={}, score=["pd"], shots=40_000)
    vary = {"detector.photon-counting.missed_marks": [0.5, 0.8, 0.9]}
    alone = mp.sweep("kim-park-2016-fixed", "wall", vary, folder=tmp_path / "alone", **asked)
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(cluster.sweep, "kim-park-2016-fixed", "wall", vary,
                              folder=tmp_path / "ray", tasks=6, **asked)
        killed = None
        for _ in range(600):
            time.sleep(0.05)
            if busy := at_work():
                killed = busy[0]
                os.kill(killed, signal.SIGKILL)
                break
        assert killed is not None, "no worker was met at work"
        assert not running.done(), "the sweep was over before"
        table = running.result(timeout=240)
    assert not Path(f"/proc/{killed}").exists()
    assert table == alone and files(tmp_path / "ray") == files(tmp_path / "alone")


def test_scans_come_in_their_order(two_workers):
    found = list(cluster.scans("peregrine", mp.Scene("wall"), 5, seed=3, first=1))
    wanted = list(mp.scans("peregrine", "wall", 5, seed=3, first=1))
    for columns, scan in zip(found, wanted, strict=True):
        for name, column in scan.columns().items():
            np.testing.assert_array_equal(columns[name], column, err_msg=name)


def test_what_is_wrong_is_said_before_anything_travels(two_workers, tmp_path):
    with pytest.raises(mp.Error, match="did you mean `peregrine`"):
        cluster.sweep("perigrine", "wall", VARY, folder=tmp_path / "out", **ASKED)
    with pytest.raises(mp.Error, match="no scene"):
        next(cluster.scans("peregrine", "wal", 2))
