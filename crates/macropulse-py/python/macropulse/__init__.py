"""Macropulse, the workbench for pulse-coded lidar.

Design a code, fire it into a 3-D scene, detect it, decode it, get a point cloud::

    import macropulse as mp

    scan = mp.simulate("kim-park-2016", mp.Scene.car(30.0), seed=1)
    print(len(scan), scan.x, scan.intensity, scan.ring, scan.time_ns)

Sensors and scenes are names, files, or objects (`Sensor`, `Scene`); columns of a `Scan` are NumPy
arrays that lend its memory. Ranges are in metres, times in the unit that their name ends in.
"""

from ._native import (
    OUTCOMES,
    Error,
    Fault,
    Mesh,
    Records,
    Scan,
    Scans,
    Scene,
    Sensor,
    StoredScans,
    __version__,
    budget,
    code_words,
    codes,
    correlation,
    decode,
    decode_scans,
    encode,
    environments,
    load,
    load_scans,
    record,
    scans,
    scenes,
    score,
    sensors,
    simulate,
    sweep,
)

__all__ = [
    "OUTCOMES",
    "Error",
    "Fault",
    "Mesh",
    "Records",
    "Scan",
    "Scans",
    "Scene",
    "Sensor",
    "StoredScans",
    "__version__",
    "budget",
    "code_words",
    "codes",
    "correlation",
    "decode",
    "decode_scans",
    "encode",
    "environments",
    "load",
    "load_scans",
    "record",
    "scans",
    "scenes",
    "score",
    "sensors",
    "simulate",
    "sweep",
]
