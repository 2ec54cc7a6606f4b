"""Scans out of files: of points, and of shots and ticks."""

import re
import shutil

import macropulse as mp
import numpy as np
import pytest

NAME, ROWS = "kim-park-2016-fixed", {"scan.raster.rows": 6}
MEASURED = ("x", "y", "z", "range", "intensity", "row", "column", "time_ns", "peak", "margin",
            "return_number", "number_of_returns")


@pytest.fixture(scope="session")
def sensor():
    return mp.Sensor(NAME, ROWS)


@pytest.fixture(scope="module")
def run(program, tmp_path_factory):
    """The folder of a run of three scans, with ticks in both forms and clouds in two formats."""
    folder = tmp_path_factory.mktemp("run")
    for ticks in ("ticks", "ticks-csv"):
        program.run("simulate", NAME, "car-30m", "--scans", 3, "--seed", 4, "--set",
                    "scan.raster.rows=6", "--format", f"pcd,mcap,csv,{ticks}", "-o", folder)
    return folder


@pytest.fixture(scope="module")
def expected(sensor):
    return list(mp.scans(sensor, "car-30m", 3, seed=4))


def same(one, other, columns=MEASURED):
    assert len(one) == len(other) > 500
    for name in columns:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("shots, ticks", [("shots-000001.mps", "ticks-000001.mpt"),
                                          ("shots-000001.csv", "ticks-000001.csv"),
                                          ("shots-000001.mps", "ticks-000001.csv")])
def test_files_decode_to_the_points_of_the_simulation(sensor, run, expected, shots, ticks):
    scan = mp.decode(sensor, str(run / shots), run / ticks, environment="vacuum-dark")
    same(scan, expected[1])
    assert scan.number == 1 and scan.sensor == sensor and "outcome" not in scan.columns()


def test_what_decode_does_the_program_does(program, sensor, run, tmp_path):
    files = [run / "shots-000002.mps", run / "ticks-000002.mpt"]
    program.run("decode", "--sensor", NAME, "--set", "scan.raster.rows=6", *files, "--format", "pcd",
                "-o", tmp_path)
    mp.decode(sensor, *files).save(tmp_path / "mine.pcd")
    assert (tmp_path / "mine.pcd").read_bytes() == (tmp_path / "scan-000002.pcd").read_bytes()


def concatenated(run, kind, folder):
    """One text file of all three scans: shots, or ticks without those that a later file repeats."""
    files = [(run / f"{kind}-{scan:06}.csv").read_text().splitlines() for scan in range(3)]
    heads = [[line for line in lines if line.startswith("#")] for lines in files]
    rows = [lines[len(head) + 1:] for lines, head in zip(files, heads)]
    names = files[0][len(heads[0])]
    key = names.split(",").index("shot" if kind == "shots" else "tick")
    merged = {}
    for row in (row for part in rows for row in part):
        merged.setdefault(int(row.split(",")[key]), row)
    path = folder / f"{kind}.csv"
    # How many they are, and which are owned: now all of them.
    said = re.sub(r", (count|owned_from|owned_until)=\d+", "", heads[0][0])
    path.write_text("\n".join([said, names, *(merged[at] for at in sorted(merged))]) + "\n")
    return path


def test_several_scans_in_one_recording_come_one_after_the_other(sensor, run, expected, tmp_path):
    shots, ticks = (concatenated(run, kind, tmp_path) for kind in ("shots", "ticks"))
    scans = mp.decode_scans(sensor, shots, ticks, environment="vacuum-dark")
    assert iter(scans) is scans and "shots.csv and" in repr(scans)
    decoded = list(scans)
    # Behind the last scan its guard shots make the beginning of another one.
    assert [scan.number for scan in decoded[:3]] == [0, 1, 2]
    for one, other in zip(decoded, expected):
        same(one, other)
    assert next(scans, None) is None
    with pytest.raises(mp.Error, match="holds several scans; iterate .*decode_scans"):
        mp.decode(sensor, shots, ticks)


def test_what_cannot_be_decoded_is_one_sentence(sensor, run, tmp_path):
    shots, ticks = run / "shots-000000.mps", run / "ticks-000000.mpt"

    def told(*given, kind=mp.Error):
        with pytest.raises(kind) as raised:
            mp.decode(sensor, *given)
        return str(raised.value)

    assert "give two dictionaries of columns, or the paths of two files" in told({}, ticks)
    assert "No such file" in told("nowhere.mps", ticks, kind=FileNotFoundError)
    assert "Is a directory" in told(run, ticks, kind=IsADirectoryError)
    assert "MPTICKS" in told(ticks, ticks) or "shot" in told(ticks, ticks)
    cut = tmp_path / "cut.mpt"
    cut.write_bytes(ticks.read_bytes()[:-3])
    assert str(cut) in told(shots, cut) and "byte" in told(shots, cut)
    with pytest.raises(mp.Error, match="is of another sensor.*name the sensor"):
        mp.decode("kim-park-2016", shots, ticks)


def test_a_folder_gives_each_scan_once(run, expected):
    scans = mp.load_scans(run)
    assert str(run) in repr(scans)
    loaded = list(scans)
    assert [scan.number for scan in loaded] == [0, 1, 2]
    for one, other in zip(loaded, expected):
        same(one, other)
    with pytest.raises(mp.Error, match="holds several scans; iterate .*load_scans"):
        mp.load(run)
    assert len(mp.load(run / "scan-000001.pcd")) == len(expected[1])


def test_a_file_gives_all_of_its_scans(run, expected, tmp_path):
    for one, other in zip(mp.load_scans(run / "scans.mcap"), expected, strict=True):
        same(one, other)
    with pytest.raises(mp.Error, match="holds several scans"):
        mp.load(run / "scans.mcap")
    expected[0].save(tmp_path / "one.mcap")
    same(mp.load(tmp_path / "one.mcap"), expected[0])


def test_names_are_read_with_the_scan(scan, tmp_path):
    scan.save(tmp_path / "with.pcd")
    again = mp.load(tmp_path / "with.pcd")
    assert again.objects == scan.objects and again.materials == scan.materials


def test_a_folder_that_holds_no_scan_says_so(run, tmp_path):
    with pytest.raises(mp.Error, match="holds no point cloud that can be read"):
        mp.load_scans(tmp_path)
    shutil.copy(run / "scan-000000.pcd", tmp_path)
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(mp.Error, match="is not the manifest of a run"):
        mp.load_scans(tmp_path)
    with pytest.raises(OSError):
        mp.load_scans(tmp_path / "nowhere.pcd")
