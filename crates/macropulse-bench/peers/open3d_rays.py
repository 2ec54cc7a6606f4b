"""What Open3D takes to load a mesh, and for rays against it, on one thread.

    python open3d_rays.py mesh.stl rows.f32 shuffled.f32

The mesh is a binary STL. A file of rays has little-endian 32-bit floats: where all rays start, and the directions.
Prints what `embree.c` prints, of one way. Rays are given all at once, as Open3D wants them: that they are put into
one array of origins and directions is not timed. Times are those for which the process was on a processor, rates
the best of several rounds.
"""

import sys
from time import process_time

import numpy as np
import open3d as o3d

ROUNDS = 5
CORNERS = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def peak_bytes():
    """The most memory of this process so far."""
    with open("/proc/self/status") as status:
        return next(1024 * int(line.split()[1]) for line in status if line.startswith("VmHWM:"))


def load(path):
    """The mesh at `path`, ready for rays."""
    began = process_time()
    corners = np.fromfile(path, CORNERS, offset=84)["corners"].reshape(-1, 3)
    indices = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    if len(corners) > 0:
        scene.add_triangles(o3d.core.Tensor(corners), o3d.core.Tensor(indices))
    # It is built when the first ray is cast.
    scene.cast_rays(o3d.core.Tensor(np.ones((1, 6), np.float32)), nthreads=1)
    print("load", process_time() - began, peak_bytes())
    return scene


def cast(scene, path):
    """Casts the rays in the file at `path`, and prints how many a second and how many hit."""
    values = np.fromfile(path, "<f4").reshape(-1, 3)
    origins = np.broadcast_to(values[0], values[1:].shape)
    rays = o3d.core.Tensor(np.ascontiguousarray(np.hstack([origins, values[1:]])))
    least = float("inf")
    for _ in range(ROUNDS):
        began = process_time()
        found = scene.cast_rays(rays, nthreads=1)
        least = min(least, process_time() - began)
    hits = int(np.isfinite(found["t_hit"].numpy()).sum())
    print("rays", "open3d", len(origins) / least, hits)


mesh = load(sys.argv[1])
for file in sys.argv[2:]:
    cast(mesh, file)
