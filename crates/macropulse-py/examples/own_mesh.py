"""A mesh of your own, as arrays: a pyramid on asphalt, scanned and written to a file."""

import macropulse as mp
import numpy as np

# Corners in metres, x forward, y left, z up; four sides without a floor.
corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 2]], dtype=float)
sides = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
pyramid = mp.Mesh(corners, sides, material_of_triangle=[0, 0, 0, 1],
                  materials=["concrete", "paint-white"])

scene = mp.Scene.from_dict({
    "name": "pyramid",
    "environment": "overcast",
    "ground": {"material": "asphalt"},
    "sensor": {"position_m": [0, 0, 1.7]},
    "object": [{"name": "pyramid", "mesh": pyramid, "unit": "m", "up": "z", "forward": "x",
                "position_m": [12, 0, 0], "yaw_deg": 30, "target": True}],
})
scan = mp.simulate("hdl-64e", scene, seed=1)

on_it = scan.object == scan.objects.index("pyramid")
for material in np.unique(scan.material[on_it]):
    its = on_it & (scan.material == material)
    print(f"{its.sum()} points on the pyramid's {scan.materials[material]}, "
          f"intensity {np.median(scan.intensity[its]):.2f}")
scan.save("pyramid.pcd")
