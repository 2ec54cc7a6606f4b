"""Scans over time in Rerun: writes street.rrd, for `rerun street.rrd`.

Needs `pip install rerun-sdk`.
"""

import macropulse as mp
import numpy as np
import rerun as rr

rr.init("macropulse")
rr.save("street.rrd")
for scan in mp.scans("hdl-64e", "street", 5, seed=1):
    rr.set_time("scan", duration=float(scan.time_ns.min()) * 1e-9)
    grey = np.clip(255 * np.sqrt(scan.intensity), 40, 255).astype(np.uint8)
    rr.log("lidar", rr.Points3D(scan.xyz(), colors=np.repeat(grey[:, None], 3, axis=1), radii=0.03))
print("street.rrd written")
