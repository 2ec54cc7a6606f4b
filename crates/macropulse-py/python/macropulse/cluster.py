"""Sweeps and long series of scans on several machines, by Ray.

Needs `pip install macropulse[ray]`. Ray hands the work out, starts again what a machine that fails has
left undone, and brings the results back; this module says only what the pieces are: those of
`macropulse sweep --shard`, and single scans. Each is decided by its seed and its number alone, so it may
be done anywhere, in any order, and twice does no harm: the results are those of one machine, to the byte.

The machines have to have the same version of Macropulse. Sensors and scenes travel to them, but files
that they name (meshes, sensors of other lidars) must lie at the same place everywhere.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _native

try:
    import ray  # type: ignore[import-not-found, import-untyped, unused-ignore]
except ImportError as missing:
    raise ImportError(
        "macropulse.cluster needs Ray: pip install macropulse[ray]"
    ) from missing

if TYPE_CHECKING:
    from os import PathLike

__all__ = ["scans", "sweep"]

_RETRIES = 5
"""How often what a machine that fails has left undone is begun again."""


def _remote(function: Any, threads: int) -> Any:
    # A task that ends with a sentence of ours would end so everywhere: only lost machines are retried.
    return ray.remote(num_cpus=threads, max_retries=_RETRIES)(function)


def _sweep_shard(sensor: Any, scene: Any, vary: Any, asked: dict[str, Any]) -> dict[str, bytes]:
    """Does one shard in a folder of its own, and gives the files of its jobs."""
    with tempfile.TemporaryDirectory() as folder:
        _native.sweep(sensor, scene, vary, folder=folder, **asked)
        jobs = Path(folder, "jobs")
        return {job.name: job.read_bytes() for job in jobs.iterdir()}


def sweep(
    sensor: Any,
    scene: Any,
    vary: dict[str, Any] | None = None,
    *,
    folder: str | PathLike[str],
    tasks: int = 32,
    threads: int = 1,
    **asked: Any,
) -> dict[str, Any]:
    """As `macropulse.sweep`, on the machines of Ray.

    What is in `folder` is not measured again, so that the same call goes on where it was stopped; what
    comes back is put there at once.

    Args:
        sensor: As `macropulse.sweep`.
        scene: As `macropulse.sweep`.
        vary: As `macropulse.sweep`.
        folder: Folder for the results, on this machine.
        tasks: Into how many tasks the work is cut.
        threads: Threads that a task computes with: Ray gives it as many processors.
        asked: `changes`, `score`, `seeds`, `seed` and `shots`, as `macropulse.sweep`.

    Returns:
        What `macropulse.sweep` returns.

    Raises:
        Error: As `macropulse.sweep`.
    """
    folder = Path(folder)
    # Refuses what is wrong, claims the folder, and says which shards have something to be done.
    found = _native.sweep(
        sensor, scene, vary, folder=folder, shard=f"1/{tasks}", dry=True, **asked
    )
    if "rows" in found:
        return found
    shard = _remote(_sweep_shard, threads)
    pending = [
        shard.remote(sensor, scene, vary, {**asked, "shard": one, "threads": threads})
        for one in found["missing_shards"]
    ]
    while pending:
        done, pending = ray.wait(pending)
        for name, text in ray.get(done[0]).items():
            _put(folder / "jobs" / name, text)
    return _native.sweep(sensor, scene, vary, folder=folder, threads=threads, **asked)


def _put(path: Path, text: bytes) -> None:
    """Writes a file whole or not at all."""
    if not path.exists():
        beside = path.with_suffix(".part")
        beside.write_bytes(text)
        shutil.move(beside, path)


def _scan(sensor: Any, scene: Any, number: int, seed: int, threads: int) -> dict[str, Any]:
    scan = _native.simulate(sensor, scene, seed=seed, scan=number, threads=threads)
    return scan.columns()


def scans(
    sensor: Any,
    scene: Any,
    n: int,
    *,
    seed: int = 1,
    first: int = 0,
    threads: int = 1,
    ahead: int | None = None,
) -> Iterator[dict[str, Any]]:
    """As `macropulse.scans`, each on one of the machines of Ray.

    Args:
        sensor: A `Sensor`, the name of a ready one, or a TOML file.
        scene: A `Scene`, the name of a ready one, or a TOML file.
        n: How many scans.
        seed: Seed of the random numbers of all of them.
        first: Number of the first scan.
        threads: Threads that a scan is computed with: Ray gives it as many processors.
        ahead: How many scans are under way at once; twice as many as there are processors if left
            out.

    Yields:
        The columns of a scan by name, in the order of the scans.

    Raises:
        Error: As `macropulse.scans`.
    """
    # Refuses what is wrong before anything travels.
    numbers = iter(range(first, first + len(_native.scans(sensor, scene, n, seed=seed, first=first))))
    task = _remote(_scan, threads)
    if ahead is None:
        ahead = max(1, 2 * int(ray.cluster_resources().get("CPU", 1)) // max(1, threads))
    pending: list[Any] = []
    for number in numbers:
        pending.append(task.remote(sensor, scene, number, seed, threads))
        if len(pending) >= ahead:
            yield ray.get(pending.pop(0))
    while pending:
        yield ray.get(pending.pop(0))
