"""Files as other programs write them, which `macropulse convert` reads."""

import os
import subprocess

import numpy as np
import plyfile
import pypcd4
import pytest

COUNT = 500


@pytest.fixture(scope="module")
def cloud():
    """Points with an intensity and a ring, in 32-bit floats."""
    random = np.random.default_rng(11)
    cloud = np.empty(COUNT, [(name, "f4") for name in "xyz"] + [("intensity", "f4"), ("ring", "u2")])
    for name in "xyz":
        cloud[name] = random.uniform(-50, 50, COUNT)
    cloud["intensity"] = random.uniform(0, 255, COUNT).round()
    cloud["ring"] = random.integers(0, 32, COUNT)
    return cloud


def pcd(path, cloud, encoding):
    fields = tuple(cloud.dtype.names)
    kinds = tuple(cloud.dtype[name] for name in fields)
    written = pypcd4.PointCloud.from_points([cloud[name] for name in fields], fields, kinds)
    written.save(path, encoding=encoding)


def ply(path, cloud, **how):
    columns = [("x", "f8"), ("y", "f8"), ("z", "f8"), ("scalar_Intensity", "f4")]
    # Beside lists, plyfile 1.1.5 writes numbers in the order of the machine.
    has_lists = how.get("byte_order") != ">"
    vertices = np.empty(COUNT, columns + ([("seen", object)] if has_lists else []))
    for name, own in zip(vertices.dtype.names, cloud.dtype.names):
        vertices[name] = cloud[own]
    if has_lists:
        vertices["seen"] = [np.arange(at % 3, dtype="u1") for at in range(COUNT)]
    faces = np.array([([0, 1, 2],)], [("vertex_indices", "i4", (3,))])
    camera = np.array([(1.0, 2.0)], [("focal", "f8"), ("width", "f4")])
    elements = [(camera, "camera"), (vertices, "vertex"), (faces, "face")]
    described = [plyfile.PlyElement.describe(data, name) for data, name in elements]
    plyfile.PlyData(described, **how).write(path)


def rows(cloud, columns):
    return np.column_stack([cloud[name] for name in cloud.dtype.names[:columns]])


# How each file is written, and which columns it holds.
WRITERS = {
    "ascii.pcd": (lambda path, cloud: pcd(path, cloud, pypcd4.Encoding.ASCII), 5),
    "binary.pcd": (lambda path, cloud: pcd(path, cloud, pypcd4.Encoding.BINARY), 5),
    "packed.pcd": (lambda path, cloud: pcd(path, cloud, pypcd4.Encoding.BINARY_COMPRESSED), 5),
    "text.ply": (lambda path, cloud: ply(path, cloud, text=True), 4),
    "big.ply": (lambda path, cloud: ply(path, cloud, byte_order=">"), 4),
    "little.ply": (lambda path, cloud: ply(path, cloud, byte_order="<"), 4),
    "three.npy": (lambda path, cloud: np.save(path, rows(cloud, 3)), 3),
    "four.npy": (lambda path, cloud: np.save(path, rows(cloud, 4).astype(">f8")), 4),
    "columns.npy": (lambda path, cloud: np.save(path, np.asfortranarray(rows(cloud, 4))), 4),
    "structured.npy": (lambda path, cloud: np.save(path, cloud), 5),
    "numpy.csv": (
        lambda path, cloud: np.savetxt(
            path, cloud, fmt="%.9g", delimiter=";", header="X;Y;Z;Intensity;Laser_ID"
        ),
        5,
    ),
    "plain.xyz": (lambda path, cloud: np.savetxt(path, rows(cloud, 3), fmt="%.9g"), 3),
    "counted.pts": (
        lambda path, cloud: np.savetxt(
            path, rows(cloud, 4), fmt="%.9g", header=str(COUNT), comments=""
        ),
        4,
    ),
    "nuscenes.pcd.bin": (lambda path, cloud: rows(cloud, 5).astype("f4").tofile(path), 5),
    "kitti.bin": (lambda path, cloud: rows(cloud, 4).astype("f4").tofile(path), 4),
}


@pytest.fixture(scope="module")
def read(cloud, tmp_path_factory):
    """The points of each file after `convert`."""
    folder = tmp_path_factory.mktemp("foreign")
    for name, (write, _) in WRITERS.items():
        write(folder / name, cloud)
    inputs = [folder / name for name in WRITERS]
    out = folder / "out"
    subprocess.run(
        [os.environ["MACROPULSE"], "convert", *inputs, "--format", "npy", "-o", out, "-q"],
        check=True,
    )
    return {name: np.load(out / (name.rsplit(".", 1)[0] + ".npy")) for name in WRITERS}


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_of_others_is_read(name, cloud, read):
    points = read[name]
    _, columns = WRITERS[name]
    for own in cloud.dtype.names[:columns]:
        # A text has more digits than the floats that it was written from.
        found = points[own].astype(cloud.dtype[own])
        np.testing.assert_array_equal(found, cloud[own], err_msg=own)
