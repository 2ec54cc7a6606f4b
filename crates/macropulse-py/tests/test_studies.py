"""What is asked for beside scans: the same as the program says."""

import macropulse as mp
import numpy as np
import pytest


def test_a_shot_is_the_one_that_the_program_prints(program):
    told = program.json("encode", "--sensor", "kim-park-2016", "--pixel", "3,711", "--scan", 2)
    shot = mp.encode("kim-park-2016", 3, 711, scan=2)
    assert isinstance(shot["marks"], np.ndarray)
    assert {**shot, "marks": shot["marks"].tolist()} == told
    assert mp.encode("hdl-64e", 0, 0)["payload"] is None


def test_budgets_are_those_of_the_program(program):
    for name in ("kim-park-2016-physical", "coded-practical", "hdl-64e"):
        assert mp.budget(name) == program.json("budget", name)
    told = program.json("budget", "coded-practical", "--environment", "overcast", "--range", 80,
                        "--reflectance", 0.1, "--pd", 0.5, "--false-points", 1e-3,
                        "--set", "environment.visibility_km=2")
    ours = mp.budget("coded-practical", {"base": "overcast", "visibility_km": 2}, range_m=80,
                     reflectance=0.1, pd=0.5, false_points=1e-3)
    assert ours == told
    assert ours["pd_wanted"] == 0.5 and ours["range_m"] == 80


def test_families_are_those_of_the_program(program):
    families = ["prime=29", "gold=7", "sparse={length=841, weight=29, words=64, seed=1}",
                "m-sequence=7"]
    told = program.json("codes", *families)["families"]
    ours = mp.codes(*families)
    matrices = [family.pop("matrix") for family in ours]
    for one, other in zip(ours, told):
        for key in set(one) | set(other):
            assert one[key] == other[key] or (one[key] != one[key] and other[key] is None), key
    assert [matrix.shape[0] for matrix in matrices] == [one["words_compared"] for one in ours]


@pytest.mark.parametrize("family", ["prime=11", "gold=5", "extended-quadratic-congruence=7"])
def test_correlations_are_those_of_numpy(family):
    """By the convolution theorem, which shares no code with counting coincidences."""
    words = mp.code_words(family).astype(float)
    spectra = np.fft.rfft(words, axis=1)
    count, chips = words.shape
    matrix = mp.codes(family)[0]["matrix"]
    for i in range(count):
        for j in range(count):
            lags = np.fft.irfft(spectra[i].conj() * spectra[j], chips).round().astype(int)
            ours = mp.correlation(family, i, j)
            assert sorted(lags) == sorted(ours.tolist())
            found = (lags.tolist() == ours.tolist(), lags[-np.arange(chips)].tolist() == ours.tolist())
            assert any(found), (i, j)
            assert matrix[i, j] == (lags[1:].max() if i == j else lags.max())


def test_a_sweep_is_that_of_the_program(program, tmp_path):
    program.run("sweep", "peregrine", "--scene", "wall", "--vary",
                "scene:object.wall.position_m.x=20,45", "--seeds", 2, "--set",
                "scan.flash.rows=8", "-o", tmp_path / "program", "-q")
    told = mp.sweep("peregrine", "wall", {"scene:object.wall.position_m.x": [20, 45]}, seeds=2,
                    changes={"scan.flash.rows": 8}, folder=tmp_path / "ours")
    for name in ("sweep.csv", "sweep.svg", "sweep.png", "manifest.json", "sweep.json"):
        ours, theirs = [(tmp_path / who / name).read_bytes() for who in ("ours", "program")]
        assert ours == theirs, name
    assert [row["scene:object.wall.position_m.x"] for row in told["rows"]] == [20, 45]
    assert told["rows"][0]["pd"]["value"] > 0.9


def test_a_sweep_without_a_return_says_so(tmp_path):
    with pytest.warns(UserWarning, match="1 of 2 rows of the table are without a single return: no ray"):
        mp.sweep("peregrine", "wall", {"scan.max_range_m": [20, 60]}, seeds=1, folder=tmp_path)


def test_a_score_is_named_alone_or_among_others(tmp_path):
    asked = dict(vary={"scan.max_range_m": [60, 70]}, seeds=1, folder=tmp_path)
    (row, _) = mp.sweep("peregrine", "wall", score="pd", **asked)["rows"]
    assert "pd" in row and "wrong" not in row
    (row, _) = mp.sweep("peregrine", "wall", score=["pd", "wrong"], **asked)["rows"]
    assert "pd" in row and "wrong" in row
    with pytest.raises(mp.Error, match="unknown score `pdd`"):
        mp.sweep("peregrine", "wall", score="pdd", **asked)
    with pytest.raises(TypeError, match="a list of texts"):
        mp.sweep("peregrine", "wall", score=3, **asked)


def test_a_sweep_in_shards_goes_on_where_it_was(tmp_path):
    asked = dict(vary={"scan.max_range_m": "40..60:3"}, seeds=2, folder=tmp_path / "out",
                 changes={"scan.flash.rows": 8}, score=["pd"])
    first = mp.sweep("peregrine", "wall", shard="1/2", **asked)
    assert first["missing"] == 3 and first["missing_shards"] == ["2/2"]
    jobs = {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "jobs").iterdir()}
    assert len(jobs) == 3
    second = mp.sweep("peregrine", "wall", shard="2/2", **asked)
    assert len(second["rows"]) == 3
    assert all(path.stat().st_mtime_ns == time for path, time in jobs.items())
    with pytest.raises(mp.Error, match="holds another sweep"):
        mp.sweep("peregrine", "wall", **{**asked, "seeds": 3})


def test_a_sweep_of_own_sensors(tmp_path):
    sensors = [mp.Sensor.from_dict({"extends": "peregrine", "name": name, "scan":
               {"flash": {"rows": 8}, "max_range_m": far}}) for name, far in
               [("near", 40), ("far", 60)]]
    scene = mp.Scene("wall", {"object.wall.position_m.x": 45})
    told = mp.sweep(sensors, scene, folder=tmp_path / "out", seeds=1, score=["pd", "missed"])
    assert told["sensors"] == ["near", "far"] and len(told["rows"]) == 2
    near, far = told["rows"]
    assert near["empty"] and not far["empty"] and far["pd"]["value"] > 0.9
