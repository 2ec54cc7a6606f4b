"""Mistakes that are made, and what is said of them: the place, and what to do."""

import errno
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import macropulse as mp
import numpy as np
import pytest

CORNERS = [[0, -1, -1], [0, 1, -1], [0, 1, 1]]


def plate(**keys):
    return mp.Scene.from_dict({"object": [{"name": "plate", "shape": {"box": {"size_m": [1, 1, 1]}},
                                           "position_m": [9, 0, 0], "material": "grey50", **keys}]})


def sweep(vary, **options):
    return mp.sweep("peregrine", "wall", vary, folder=NOWHERE, **options)


# A folder that no mistake makes.
NOWHERE = Path(tempfile.gettempdir()) / f"macropulse-nowhere-{os.getpid()}"

MISTAKES = [
    # What is done, and the beginning and the end of what is said.
    (lambda: mp.simulate("perigrine", "wall"), "perigrine: no such sensor; did you mean `peregrine`", ""),
    (lambda: mp.simulate("peregrine", "wal"), 'there is no scene "wal"', ""),
    (lambda: mp.simulate("peregrine", "wall", scan=10**9), "scan 1000000000: scans of peregrine are", ""),
    (lambda: mp.simulate("peregrine", "wall", threads=5000), "threads is 5000", "from 0 to 1024"),
    (lambda: mp.Sensor("peregrine", {"scan.max_rnage_m": 4}), "scan.max_rnage_m: unknown key",
     "did you mean `max_range_m`?"),
    (lambda: mp.Sensor("peregrine", {"scan.max_range_m": -1}), "scan.max_range_m: is -1", ""),
    (lambda: mp.Sensor("peregrine", {"scan.max_range_m": "far"}), "scan.max_range_m: ", ""),
    (lambda: mp.Sensor("peregrine", {"scan.max_range_m": None}),
     "scan.max_range_m: a value cannot be of type NoneType", "or leave the key out"),
    (lambda: mp.Sensor("peregrine", {"scan.max_range_m": 10**30}), "scan.max_range_m: 1", "can hold"),
    (lambda: mp.Sensor("peregrine", {3: 4}), "changes: the key 3 is no text", ""),
    (lambda: mp.Sensor("peregrine", {"without": ["sunlihgt"]}), "peregrine:8:1: idealised: `sunlihgt` is no effect", ""),
    (lambda: mp.Sensor.from_dict({"extends": "peregrin"}), "the dictionary: extends: ", ""),
    (lambda: mp.Sensor.from_dict({"extends": "peregrine", "scan": {"max_range_m": "x"}}),
     "the dictionary: scan.max_range_m: ", ""),
    (lambda: mp.Sensor.from_dict({}), "", ""),
    (lambda: mp.Scene("wall", {"object.wal.position_m.x": 3}), "object.wal.position_m.x: nothing in it",
     "there are wall"),
    (lambda: mp.Scene("wall", {"environment": "fog"}), "environment", ""),
    (lambda: plate(materail="grey50"), "the dictionary: object[0].materail: unknown key",
     "did you mean `material`?"),
    (lambda: plate(material="gray50"), "the dictionary: object[0].material: there is no material",
     'did you mean "grey50"?'),
    (lambda: plate(position_m=[1, 2]), "the dictionary: object[0].position_m: ", ""),
    (lambda: plate(yaw_deg=float("nan")), "the dictionary: object[0].yaw_deg: yaw_deg must be a number from", "36000"),
    (lambda: plate(position_m=lambda: 3), "object[0].position_m: a value cannot be of type function", ""),
    (lambda: mp.Mesh(np.zeros((4, 2)), [[0, 1, 2]]), "vertices has shape (4, 2); it must be (n, 3)", ""),
    (lambda: mp.Mesh(CORNERS, [0, 1, 2]), "triangles has shape (3,); it must be (m, 3)", ""),
    (lambda: mp.Mesh(CORNERS, [[0, 1, 3]]), "triangles names the corner 3, but there are 3, from 0", ""),
    (lambda: mp.Mesh(CORNERS, [[0, 1, -1]]), "triangles names the corner -1", ""),
    (lambda: mp.Mesh(CORNERS, [[0.0, 1.0, 2.5]]), "triangles are of type float64", "whole numbers"),
    (lambda: mp.Mesh([["0", "1", "2"]] * 3, [[0, 1, 2]]), "vertices are of type <U1", "numbers"),
    (lambda: mp.Mesh(CORNERS, [[0, 1, 2]], [-1], ["a"]), "material_of_triangle names the material -1", ""),
    (lambda: mp.Scene.from_mesh([[1e11, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2]]),
     "the dictionary: object[0].mesh: mesh: its mesh reaches farther than 1e10 m", ""),
    (lambda: mp.simulate("peregrine", "wall", seed=-1), "-1: seeds, scans, shots and threads are", ""),
    (lambda: mp.simulate("peregrine", "wall", seed=2**64), "18446744073709551616: seeds, scans,", ""),
    (lambda: mp.scans("peregrine", "wall", -3), "-3: seeds, scans,", ""),
    (lambda: mp.Sensor("peregrine", {".".join(["a"] * 10_000): 1}), "`a.a.", "no key of a sensor has as many"),
    (lambda: mp.Mesh(CORNERS, [[0, 1, 2]], [0, 0]), "material_of_triangle has 2 entries", ""),
    (lambda: mp.Mesh(CORNERS, [[0, 1, 2]], [1], ["a"]), "material_of_triangle names the material 1", ""),
    (lambda: mp.Scene.from_mesh([[np.nan, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2]]),
     "mesh in memory: vertex 0 is", ""),
    (lambda: mp.Scene.from_mesh(CORNERS, np.zeros((0, 3), int)), "mesh in memory: holds no triangles", ""),
    (lambda: mp.Scene.car(-3), "range_m is -3; it must be from 1 to 10000", ""),
    (lambda: mp.codes("prim=29"), "prim=29: ", ""),
    (lambda: mp.codes("prime=28"), "prime=28: ", ""),
    (lambda: mp.codes(), "no family is named", ""),
    (lambda: mp.code_words("sparse={length=60000, weight=3, words=60000, seed=1}"), "", ""),
    (lambda: mp.correlation("prime=5", 0, 5), "word 5: the words of ", "are 0 to 4"),
    (lambda: mp.encode("peregrine", 0, 4000), "pixel 0,4000: peregrine has rows 0 to", ""),
    (lambda: mp.budget("coded-practical", "fogg"), "environment: ", ""),
    (lambda: mp.budget("coded-practical", pd=2), "pd is 2; it must be from", ""),
    (lambda: mp.scans("peregrine", "wall", 10**9), "1000000000 scans from number 0 on last longer", ""),
    (lambda: mp.simulate("wall", "peregrine"), "wall: is a scene, where a sensor is wanted", "then the scene"),
    (lambda: mp.Scene("peregrine"), "peregrine: is a sensor, where a scene is wanted", ""),
    (lambda: mp.Sensor("vlp"), "vlp: no such sensor; did you mean `vlp-16`?", ""),
    (lambda: mp.Sensor("peregrine", {"max_range_m": 3}), "max_range_m: unknown key", "it belongs in [scan]"),
    (lambda: mp.Sensor("peregrine", {"scan": {"max_rnage_m": 3}}), "scan.max_rnage_m: unknown key",
     "did you mean `max_range_m`?"),
    (lambda: mp.Sensor("peregrine", {"scan.max_range_m": "3"}), 'scan.max_range_m: is the text "3"',
     "take the quotes away"),
    (lambda: mp.Sensor("peregrine", {"scan.max_range_m": np.array([3])}), "scan.max_range_m: is a list",
     "a number from 0.01 to 100000"),
    (lambda: mp.Sensor("peregrine", {"scan.flash.rows": 1.5}), "scan.flash.rows: is 1.5",
     "a whole number from 1 to 16384"),
    (lambda: mp.Sensor("peregrine", {"light.wavelength_nm": 905e-9}), "light.wavelength_nm: is 0.000000905",
     "between 200 and 20000"),
    (lambda: mp.Sensor("peregrine", {"scan.max_range_m": float("nan")}), "scan.max_range_m: is NaN", ""),
    (lambda: mp.Sensor.from_dict({"name": "mine"}), "the dictionary: ", "from a ready sensor"),
    (lambda: mp.Sensor.from_dict({"extends": "peregrine", "code": "prime"}), "the dictionary: code: is the text", ""),
    (lambda: mp.Sensor.from_toml('name = mine'), "", 'text stands in quotes, as "street"'),
    (lambda: mp.Scene.car(float("nan")), "range_m is NaN; it must be from 1 to 10000", ""),
    (lambda: mp.Scene.car(30_000), "range_m is 30000; it must be from 1 to 10000", ""),
    (lambda: mp.Scene.from_dict({"object": {"car": {}}}), "the dictionary: object", ""),
    (lambda: mp.Scene.from_dict({"objects": [{"car": {}}]}), "the dictionary: objects", "did you mean `object`?"),
    (lambda: mp.Scene.from_dict({"object": [{"shape": "box"}]}), "the dictionary: object[0].shape: must be { plane", ""),
    (lambda: plate(position_m=9), "the dictionary: object[0].position_m: is 9", "as [1.0, 2.0, 3.0]"),
    (lambda: plate(position_m="9, 0, 0"), "the dictionary: object[0].position_m: is the text", ""),
    (lambda: plate(position=[9, 0, 0]), "the dictionary: object[0].position: unknown key", "did you mean `position_m`?"),
    (lambda: plate(yaw=90), "the dictionary: object[0].yaw: unknown key", "did you mean `yaw_deg`?"),
    (lambda: mp.Scene.from_dict({"material": [{"name": "m", "diffuse": 10}], "object": [{"car": {}}]}),
     "the dictionary: material[0].diffuse: diffuse is 10; it must be from 0 to 1", ""),
    (lambda: mp.Scene("wall", {"environment": "foggy"}), "environment: there is no environment `foggy`", ""),
    (lambda: mp.Scene("wall", {"object.wall.positon_m.x": 3}), "object.wall.positon_m.x: ", "did you mean `position_m`?"),
    (lambda: mp.Mesh(CORNERS, [[1, 2, 3]]), "triangles names the corner 3, but there are 3, from 0",
     "take 1 from each"),
    (lambda: mp.Mesh(CORNERS, [[0, 1, 2, 0]]), "triangles has shape (1, 4)", "cut each quadrangle into two triangles"),
    (lambda: mp.Mesh(np.zeros((3, 8)), [[0, 1, 2]]), "vertices has shape (3, 8); it must be (n, 3)", ""),
    (lambda: mp.Mesh([0, 0, 0], [[0, 1, 2]]), "vertices has shape (3,); it must be (n, 3)", ""),
    (lambda: mp.Mesh(CORNERS, [[True, False, True]]), "triangles are of type bool", "whole numbers"),
    (lambda: mp.encode("kim-park-2016", -1, 0), "pixel -1,0: kim-park-2016 has rows 0 to 479", "0 to 847"),
    (lambda: mp.codes("prime"), "prime: write it as in a sensor file, as prime=29", ""),
    (lambda: mp.code_words("kim-park-2016"), "kim-park-2016: write it as in a sensor file", ""),
    (lambda: mp.budget("wall"), "wall: is a scene, where a sensor is wanted", ""),
    (lambda: mp.budget("coded-practical", pd=90), "pd is 90; it must be from", ""),
    (lambda: mp.budget("coded-practical", reflectance=-0.1), "reflectance is -0.1; it must be from", ""),
    (lambda: mp.budget("coded-practical", {"visibility_km": "a"}), 'environment.visibility_km: is the text "a"',
     "a number from 0.01 to 1000"),
    (lambda: mp.budget("coded-practical", {"visibility_m": 50}), "environment.visibility_m: unknown key",
     "did you mean `visibility_km`?"),
    (lambda: sweep({}), "nothing is varied; give a key with its values", ""),
    (lambda: sweep({"scan.max_range_m": []}), "scan.max_range_m", ""),
    (lambda: sweep({"scan.max_rnage_m": [3, 4]}), "with scan.max_rnage_m = 3: ", "did you mean `max_range_m`?"),
    (lambda: sweep({"scan.max_range_m": np.array([3.0, -4.0])}), "with scan.max_range_m = -4", "between 0.01 and 100000"),
    (lambda: sweep({"scan.max_range_m": ["a", "b"]}), "with scan.max_range_m = ", "a number from 0.01 to 100000"),
    (lambda: sweep({"scan.max_range_m": [3, 4]}, score=["pdd"]), "unknown score `pdd`", ""),
    (lambda: sweep({"scan.max_range_m": [3, 4]}, seeds=0), "seeds is 0; it must be from 1 to 10000", ""),
    (lambda: sweep({"scan.max_range_m": [3, 4]}, shard="3/2"), "there is no shard 3/2", ""),
]


@pytest.mark.parametrize("at", range(len(MISTAKES)))
def test_a_mistake_is_answered_with_place_and_remedy(at):
    mistake, begins, ends = MISTAKES[at]
    with pytest.raises(mp.Error) as raised:
        mistake()
    said = str(raised.value)
    assert said.startswith(begins) and said.endswith(ends) and len(said) > 20, said
    # No words of the language that it is written in.
    for word in ("Err(", "None`", "Option", "unwrap", "panick", "i64", "u16", "f64", "u32", "variant", "struct ",
                 "unknown field", "invalid type", "os error", "--set"):
        assert word not in said, said
    assert not NOWHERE.exists()
    assert isinstance(raised.value, ValueError)


@pytest.mark.parametrize("mistake", [
    lambda: mp.simulate("nowhere.toml", "wall"),
    lambda: mp.Sensor.open("nowhere.toml"),
    lambda: mp.Scene("nowhere/scene.toml"),
    lambda: mp.Scene.open("nowhere.toml"),
    lambda: mp.load("nowhere.pcd"),
])
def test_a_file_that_is_not_there(mistake):
    with pytest.raises(FileNotFoundError) as raised:
        mistake()
    assert raised.value.errno == errno.ENOENT and "nowhere" in str(raised.value)


def test_a_folder_and_a_place_that_cannot_be_written_to(scan, tmp_path):
    with pytest.raises(IsADirectoryError):
        mp.Sensor(tmp_path / ".." / tmp_path.name)
    with pytest.raises(FileNotFoundError, match="there-is-none"):
        scan.save(tmp_path / "there-is-none" / "scan.pcd")
    with pytest.raises(mp.Error, match="no ending that says a format"):
        scan.save(tmp_path / "scan")
    with pytest.raises(mp.Error, match="unknown format `hologram`"):
        scan.save(tmp_path / "scan.hologram")
    assert list(tmp_path.iterdir()) == []


def test_arguments_of_a_wrong_kind():
    for mistake in (lambda: mp.simulate(3, "wall"), lambda: mp.simulate("peregrine", {"version": 1}),
                    lambda: mp.simulate("peregrine"), lambda: mp.Sensor.from_dict("peregrine")):
        with pytest.raises(TypeError):
            mistake()
    with pytest.raises(TypeError, match="a scene is changed where it is opened"):
        mp.Scene(mp.Scene("wall"), {"object.wall.position_m.x": 30})


def test_a_sensor_is_changed_further():
    sensor = mp.Sensor("peregrine", {"scan.max_range_m": 30})
    assert mp.Sensor(sensor) == sensor
    changed = mp.Sensor(sensor, {"scan.flash.rows": 16})
    assert changed == mp.Sensor("peregrine", {"scan.max_range_m": 30, "scan.flash.rows": 16})
    with pytest.raises(mp.Error, match="max_range_m: unknown key"):
        mp.Sensor(sensor, {"max_range_m": 3})


def test_a_package_that_cannot_be_imported_says_why(scan, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "open3d", raising=False)
    (tmp_path / "open3d.py").write_text('raise OSError("libusb-1.0.so.0: cannot open it")')
    with pytest.raises(ImportError, match="open3d is there, but cannot be imported: OSError: libusb") as told:
        scan.to_open3d()
    assert isinstance(told.value.__cause__, OSError)
    (tmp_path / "open3d.py").write_text("import no_such_package_of_anybody")
    with pytest.raises(ImportError, match="no_such_package_of_anybody"):
        scan.to_open3d()


def test_columns_and_images_that_are_not_there(scan):
    with pytest.raises(mp.Error, match="no column `rnage`; did you mean `range`?"):
        scan.image("rnage")
    with pytest.raises(mp.Error, match='must be "first", "strongest" or "last"'):
        scan.image("range", pick="nearest")
    with pytest.raises(AttributeError):
        scan.rnage


def test_sentences_are_those_of_the_program(program):
    """But for what only a command line has."""
    for changes in ({"scan.max_rnage_m": "4"}, {"scan.max_range_m": "-1"}):
        words = [f"{key}={value}" for key, value in changes.items()]
        theirs = program.complaint("budget", "peregrine", "--set", *words)
        numbers = {key: int(value) for key, value in changes.items()}
        with pytest.raises(mp.Error) as raised:
            mp.Sensor("peregrine", numbers)
        assert str(raised.value) == theirs.removeprefix("--set: ")
    theirs = program.complaint("simulate", "--sensor", "peregrine", "--scene", "wal", "--format", "none")
    with pytest.raises(mp.Error) as raised:
        mp.Scene("wal")
    assert str(raised.value) == theirs


def test_a_dictionary_that_holds_itself():
    endless = {}
    endless["scan"] = endless
    with pytest.raises(mp.Error, match="deeper than 32"):
        mp.Sensor.from_dict(endless)


def test_instructions_that_are_misspelt_are_refused():
    done = subprocess.run([sys.executable, "-c", "import macropulse"], capture_output=True, text=True,
                          env={**os.environ, "MACROPULSE_KERNELS": "sse9"})
    told = done.stderr
    assert done.returncode != 0 and "macropulse.Error" in told and "sse9" in told, told
