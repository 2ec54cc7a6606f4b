"""Sensors and scenes: names, files, dictionaries, arrays."""

import pickle

import macropulse as mp
import numpy as np
import pytest

CORNERS = np.array([[0, -5, -5], [0, 5, -5], [0, 5, 5], [0, -5, 5]], dtype=float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_mesh_of_arrays_is_met_where_it_stands():
    """A plate across the line of sight: x of all points is its distance."""
    scene = mp.Scene.from_mesh(CORNERS, TRIANGLES, material="grey50", position_m=[25, 0, 0])
    scan = mp.simulate("peregrine", scene, seed=4)
    assert len(scan) > 100
    assert abs(np.median(scan.x) - 25) < 0.02
    assert set(scan.object.tolist()) == {0} and scan.objects == ["mesh"]
    assert scan.score["samples_on_target"] > 0
    # What the plate hides and what it does not, by its corners.
    directions = mp.Sensor("peregrine").directions()
    at = directions * (25 / directions[..., :1])
    inside = (np.abs(at[..., 1]) < 5) & (np.abs(at[..., 2]) < 5) & (directions[..., 0] > 0)
    met = scan.image("object") == 0
    assert (met == inside).mean() > 0.999


def test_an_own_mesh_in_a_dictionary(tmp_path):
    mesh = mp.Mesh(CORNERS, TRIANGLES, np.array([0, 1]), ["asphalt", "paint-white"])
    assert repr(mesh) == "<macropulse.Mesh: 2 triangles, 4 corners, 0.000 x 10.000 x 10.000>"
    scene = mp.Scene.from_dict({
        "name": "plate",
        "environment": "vacuum-dark",
        "object": [{"name": "plate", "mesh": mesh, "unit": "m", "position_m": [30, 0, 0]}],
    })
    assert scene.materials == ["asphalt", "paint-white"] and scene.triangles == 2
    # The same as a file.
    (tmp_path / "plate.mtl").write_text("newmtl asphalt\nnewmtl paint-white\n")
    lines = ["mtllib plate.mtl", *(f"v {x} {y} {z}" for x, y, z in CORNERS)]
    lines += ["usemtl asphalt", "f 1 2 3", "usemtl paint-white", "f 1 3 4"]
    (tmp_path / "plate.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "plate.toml").write_text(
        'version = 1\nname = "plate"\nenvironment = "vacuum-dark"\n[[object]]\nname = "plate"\n'
        'mesh = "plate.obj"\nunit = "m"\nposition_m = [30, 0, 0]\n'
    )
    file = mp.Scene.open(tmp_path / "plate.toml")
    assert file.digest == mp.Scene(tmp_path / "plate.toml").digest
    ours, theirs = (mp.simulate("peregrine", one, seed=2) for one in (scene, file))
    assert len(ours) > 100 and set(ours.material.tolist()) >= {0, 1}
    for name in ("range", "intensity", "outcome"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    names = [[scan.materials[at] for at in scan.material if at < 2] for scan in (ours, theirs)]
    assert names[0] == names[1]
    again = pickle.loads(pickle.dumps(scene))
    assert again.digest == scene.digest and again.to_toml() == scene.to_toml()
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(mesh)).vertices, mesh.vertices)


def test_what_a_mesh_names_and_what_is_left_out_of_it(tmp_path):
    folder = tmp_path / "yard"
    folder.mkdir()
    (tmp_path / "paint.mtl").write_text("newmtl paint\nKd 0.25\n")
    lines = ["mtllib ../paint.mtl", *(f"v {x} {y} {z}" for x, y, z in CORNERS)]
    lines += ["usemtl paint", "f 1 2 3", "l 1 2"]
    (folder / "plate.obj").write_text("\n".join(lines) + "\n")
    text = (
        'version = 1\n[[object]]\nname = "plate"\nmesh = "plate.obj"\nposition_m = [25, 0, 0]\n'
    )
    (folder / "plate.toml").write_text(text)
    with pytest.raises(mp.Error, match="names ../paint.mtl, which lies outside the folder"):
        mp.Scene(folder / "plate.toml")
    allowed = mp.Scene(folder / "plate.toml", {"outside_files": True})
    assert allowed.materials == ["plate/paint"]
    left_out = ["plate: 1 line is no surface, and is left out"]
    assert allowed.warnings == left_out
    assert mp.Scene.from_toml("outside_files = true\n" + text, folder).digest == allowed.digest
    table = {"outside_files": True, "object": [{"name": "plate", "mesh": "plate.obj"}]}
    assert mp.Scene.from_dict(table, folder).warnings == left_out
    again = pickle.loads(pickle.dumps(allowed))
    assert again.digest == allowed.digest and again.warnings == left_out
    assert mp.simulate("peregrine", again, seed=1).manifest["warnings"] == left_out


def test_a_car_at_any_range():
    for range_m in (12.5, 30, 41):
        scan = mp.simulate("kim-park-2016-fixed", mp.Scene.car(range_m), seed=1)
        car = scan.object == scan.objects.index("car")
        assert car.any() and abs(scan.x[car].min() - range_m) < 0.05
    assert mp.Scene.car(30.0).digest == mp.Scene("car-30m").digest
    assert mp.Scene.car(30, environment="night").environment.startswith("night")


def test_sensors_by_name_file_and_dictionary(tmp_path):
    named = mp.Sensor("peregrine", {"scan.max_range_m": 40, "scan": {"min_range_m": 2.0}})
    # The gate is open 5 m beyond the rated range.
    assert named.range_gate_m == (2.0, 45.0)
    file = tmp_path / "mine.toml"
    file.write_text(named.to_toml())
    assert mp.Sensor(file) == mp.Sensor(str(file)) == mp.Sensor.open(file) == named
    assert hash(mp.Sensor(file)) == hash(named) and mp.Sensor("peregrine") != named
    made = mp.Sensor.from_dict(
        {"extends": "peregrine", "summary": named.summary, "scan": {"max_range_m": np.int64(40),
         "min_range_m": np.float32(2)}}
    )
    assert made.range_gate_m == (2.0, 45.0) and made.name == "peregrine"
    assert pickle.loads(pickle.dumps(named)) == named


def test_effects_are_switched_by_name(tmp_path):
    assert mp.Sensor("coded-practical").idealised == []
    without = mp.Sensor("coded-practical", {"without": ["eye-safety", "mirror-motion"]})
    assert set(without.idealised) == {"eye-safety", "mirror-motion"}
    (tmp_path / "sensor.toml").write_text(without.to_toml())
    again = mp.Sensor(tmp_path / "sensor.toml", {"with": "mirror-motion"})
    assert set(again.idealised) == {"eye-safety"}


def test_sun_and_air_are_changed_with_the_scene():
    clear = mp.simulate("hdl-64e", mp.Scene("street"), seed=1)
    fog = mp.simulate("hdl-64e", mp.Scene("street", {"environment": "fog-50m"}), seed=1)
    assert len(fog) < 0.9 * len(clear)
    half = mp.Scene("street", {"environment.visibility_km": 0.5})
    assert "0.5 km" in half.environment or "500 m" in half.environment, half.environment


def test_directions_are_unit_vectors():
    for name in mp.sensors():
        directions = mp.Sensor(name).directions()
        assert directions.shape == (*mp.Sensor(name).shape, 3)
        np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1, atol=1e-12)


def test_ready_ones_can_all_be_opened(program):
    sensors, scenes = program.run("sensors"), program.run("scenes")
    for name in mp.sensors():
        assert mp.Sensor(name).name == name and name in sensors
    for name in mp.scenes():
        assert mp.Scene(name).name and name in scenes
    for name in mp.environments():
        assert name in mp.Scene("wall", {"environment": name}).environment


def test_what_is_shown_of_sensors_and_scenes():
    assert repr(mp.Sensor("kim-park-2016")).startswith(
        "<macropulse.Sensor kim-park-2016: 480 x 848 pixels in "
    )
    assert repr(mp.Scene("car-30m")).startswith("<macropulse.Scene car-30m: ground, car; ")
    assert "more; " in repr(mp.Scene("street"))
