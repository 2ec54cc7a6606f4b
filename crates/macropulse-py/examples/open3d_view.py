"""A scan as a cloud of Open3D: normals, a file, and a window where there is a screen.

Needs `pip install macropulse[open3d]`.
"""

import sys

import macropulse as mp
import open3d as o3d

scan = mp.simulate("hdl-64e", "street", seed=1)
cloud = scan.to_open3d()
cloud.estimate_normals(max_nn=20, radius=1.0)
print(cloud)
o3d.t.io.write_point_cloud("street.ply", cloud)
if "--show" in sys.argv:
    o3d.visualization.draw([cloud])
