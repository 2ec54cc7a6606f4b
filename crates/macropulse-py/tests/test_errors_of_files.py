"""Mistakes with recordings and files of points: `decode`, `load`, `save` and `score`."""

import io
import warnings

import macropulse as mp
import numpy as np
import pytest

SENSOR = {"scan.raster.rows": 4, "scan.raster.columns": 64}


@pytest.fixture(scope="module")
def sensor():
    return mp.Sensor("kim-park-2016-fixed", SENSOR)


@pytest.fixture(scope="module")
def scan(sensor):
    return mp.simulate(sensor, "car-30m", seed=2)


@pytest.fixture(scope="module")
def band(sensor):
    """Shots and ticks of the band with most of them, as columns."""
    bands = mp.record(sensor, "car-30m", seed=2)
    shots, ticks = max(bands, key=lambda band: len(band[1]["tick"]))
    assert len(shots["row"]) > 1 and len(ticks["tick"]) > 100
    return shots, ticks


def but(columns, **changed):
    """Columns of which some are others, or left out where they are None."""
    merged = {**columns, **changed}
    return {name: column for name, column in merged.items() if column is not None}


# What is decoded instead of the sensor's `s`hots and `t`icks, and the beginning and the end of what is
# said of it.
DECODED = [
    (lambda s, t: (t, s), "shots: has a column `tick`; the shots come first, then the ticks", ""),
    (lambda s, t: ("shots.mps", t), "shots and ticks, samples, histograms, taps or beats: give two dictionaries", "the paths of two files"),
    (lambda s, t: (s, t["tick"]), "shots and ticks, samples, histograms, taps or beats: give two dictionaries", ""),
    (lambda s, t: (s, None), "shots and ticks, samples, histograms, taps or beats: give two dictionaries", ""),
    (lambda s, t: (but(s, lable=s["label"]), t), "shots: unknown column `lable`; did you mean `label`?", ""),
    (lambda s, t: (s, but(t, amplitudes=[1.0])), "ticks: unknown column `amplitudes`", "`amplitude`?"),
    (lambda s, t: (but(s, fired_at_fs=None), t), "shots: there is no column `fired_at_fs`", ""),
    (lambda s, t: (but(s, row=None), t), "shots: there is no column `row`", ""),
    (lambda s, t: (s, but(t, tick=None)), "ticks: there is no column `tick`", ""),
    (lambda s, t: (but(s, fired_at_fs=s["fired_at_fs"] * 1e-15 + 0.5), t),
     "shots: the column `fired_at_fs` must be whole numbers, in a list or array; entry 0 is 0.5", ""),
    (lambda s, t: (but(s, row=["a"] * len(s["row"])), t),
     "shots: the column `row` must be whole numbers from 0 to 65535, in a list or array; its first", "'a')"),
    (lambda s, t: (but(s, row=[None] * len(s["row"])), t), "shots: the column `row` must be whole", "None"),
    (lambda s, t: (but(s, row=s["row"][:-1]), t), "the column `", "give one for each"),
    (lambda s, t: (but(s, row=s["row"] + 4), t), "shots: row has ", "that they were recorded with?"),
    (lambda s, t: (but(s, column=s["column"] + 64), t), "shots: column has ", "that they were recorded with?"),
    (lambda s, t: (but(s, channel=s["channel"] + 1), t), "shots: channel has 1, and kim-park-2016-fixed has 0 to 0", ""),
    (lambda s, t: (but(s, word=s["word"] + 60), t), "shot ", "decode with the codebook that was sent with"),
    (lambda s, t: (but(s, label=s["label"] + 5000), t), "shot ", "that was sent with"),
    (lambda s, t: (but(s, fired_at_fs=s["fired_at_fs"][::-1]), t), "shot", ""),
    (lambda s, t: (but(s, owned=5), t), "shots: owned is 5; it must be two whole numbers", "(0, 3400)"),
    (lambda s, t: (but(s, owned=(0, 10**6)), t), "the owned shots 0 to 1000000 are not within", ""),
    (lambda s, t: (but(s, first=-1), t), "shots: first is -1; it must be a whole number, 0 or more", ""),
    (lambda s, t: (s, but(t, tick=t["tick"].reshape(-1, 1))), "ticks: the column `tick` must be", ", 1)"),
    (lambda s, t: (s, but(t, tick=3)), "ticks: the column `tick` must be whole numbers", "its shape is ()"),
    (lambda s, t: (s, but(t, tick=[[1, 2], [3]])), "ticks: the column `tick` must be", "its entries are lists"),
    (lambda s, t: (s, but(t, tick=np.full(3, np.nan))), "ticks: the column `tick` must be", "entry 0 is nan"),
    (lambda s, t: (s, but(t, tick=[1, -5])), "ticks: the column `tick` must be", "entry 1 is -5"),
    (lambda s, t: (s, but(t, tick=[1, 2**40])), "ticks: the column `tick` must be", "entry 1 is 1099511627776"),
    (lambda s, t: (s, but(t, tick=t["tick"][::-1])), "tick number 1 is ", "give no tick twice"),
    (lambda s, t: (s, but(t, tick=np.repeat(t["tick"], 2))), "tick number 1 is ", "give no tick twice"),
    (lambda s, t: (s, but(t, amplitude=[1.0])), "the column `amplitude` has 1 entries for ", "or none at all"),
    (lambda s, t: (s, but(t, amplitude=[np.inf] * len(t["tick"]))), "ticks: the column `amplitude` must be", "entry 0 is inf"),
    (lambda s, t: (s, but(t, channel=np.full(len(t["tick"]), 7))), "ticks: channel has 7, and ", "recorded with?"),
    (lambda s, t: (s, but(t, epoch=1.5)), "ticks: epoch is 1.5; it must be a whole number", "of ticks"),
    (lambda s, t: (s, but(t, epoch=10**30)), "ticks: epoch is 1000000", ""),
]


@pytest.mark.parametrize("at", range(len(DECODED)))
def test_what_cannot_be_decoded_is_said_with_place_and_remedy(sensor, band, at):
    given, begins, ends = DECODED[at]
    with pytest.raises(mp.Error) as raised, warnings.catch_warnings():
        warnings.simplefilter("error")
        mp.decode(sensor, *given(*band))
    said = str(raised.value)
    assert said.startswith(begins) and said.endswith(ends), said
    for word in ("int64", "uint", "float32", "astype", "int()"):
        assert word not in said, said


def test_the_control_is_decoded(sensor, band):
    """Also where amplitudes are numbers of eight bytes, and columns are lists."""
    shots, ticks = band
    whole = mp.decode(sensor, shots, ticks)
    assert len(whole) > 0
    amplitudes = [0.1] * len(ticks["tick"])
    lists = {name: column.tolist() for name, column in shots.items() if hasattr(column, "tolist")}
    again = mp.decode(sensor, but(shots, **lists), but(ticks, amplitude=amplitudes))
    np.testing.assert_array_equal(again.range, whole.range)


def test_a_recording_of_nothing_is_not_silent(sensor, band):
    shots, ticks = band
    with pytest.warns(UserWarning, match="not a single point: there are no ticks"):
        assert len(mp.decode(sensor, shots, {"tick": []})) == 0
    none = {"fired_at_fs": [], "row": [], "column": []}
    with pytest.warns(UserWarning, match="not a single point: there are no shots"):
        assert len(mp.decode(sensor, none, ticks)) == 0


OTHER = [
    (lambda b: mp.decode("wall", *b), "wall: is a scene, where a sensor is wanted", ""),
    (lambda b: mp.decode("kim", *b), "kim: no such sensor; did you mean `kim-park-2016`?", ""),
    (lambda b: mp.decode("hdl-64e", *b), "", ""),
    (lambda b: mp.decode("kim-park-2016-fixed", *b, environment="fog"), "environment: ", ""),
    (lambda b: mp.decode("kim-park-2016-fixed", *b, environment=3), "environment: must be the name", ""),
    (lambda b: mp.decode("kim-park-2016-fixed", *b, environment={"visibility": 3}),
     "environment.visibility: unknown key `visibility`; did you mean `visibility_km`?", ""),
]


@pytest.mark.parametrize("at", range(len(OTHER)))
def test_another_sensor_or_sky(band, at):
    mistake, begins, ends = OTHER[at]
    with pytest.raises(mp.Error) as raised:
        mistake(band)
    said = str(raised.value)
    assert said.startswith(begins) and said.endswith(ends) and len(said) > 20, said


# A file, what is in it, and the words of what is said when it is loaded.
LOADED = [
    ("empty.pcd", b"", ["is not a pcd file", "no DATA line"]),
    ("text.ply", b"hello\n", ["is not a ply file", "no header from `ply`"]),
    ("empty.ply", b"", ["is not a ply file"]),
    ("names.csv", b"a,b,c\n1,2,3\n", ["no field `x`", "as `x,y,z,intensity`"]),
    ("headless.csv", b"1,2\n4,5\n", ["no field `y`", "its first line names the columns"]),
    ("words.csv", b"x_m,y_m,z_m\n1,2,far\n", ["words.csv", "far"]),
    ("short.csv", b"x_m,y_m,z_m\n1,2\n", ["short.csv", "2"]),
    ("empty.csv", b"", ["empty.csv"]),
    ("cut.las", b"LASF" + bytes(60), ["ends within its header"]),
    ("text.laz", b"hello", ["does not begin with LASF"]),
    ("text.e57", b"hello", ["is not a e57 file"]),
    ("text.npy", b"hello", ["does not begin as NumPy files do"]),
    ("odd.bin", b"12345", ["odd.bin", "neither points of four floats", ".pcd.bin"]),
    ("text.mcap", b"hello", ["text.mcap"]),
    ("points.npz", b"PK", ["no point cloud is read from such a file", ".pcd, .ply"]),
    ("points.xyz", b"1 2\n", ["points.xyz", "no field `z`"]),
    ("points.asc", b"1 2 3\n", ["no point cloud is read from such a file"]),
    ("range.png", b"\x89PNG", ["no point cloud is read from such a file"]),
    ("manifest.json", b"{}", ["no point cloud is read from such a file"]),
    ("points", b"1 2 3\n", ["no point cloud is read from such a file"]),
]


@pytest.mark.parametrize("name, content, words", LOADED, ids=[row[0] for row in LOADED])
def test_a_file_that_holds_no_cloud(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    for load in (mp.load, lambda path: list(mp.load_scans(path))):
        with pytest.raises(mp.Error) as raised:
            load(tmp_path / name)
        said = str(raised.value)
        assert name in said and all(word in said for word in words), said


def test_arrays_that_are_no_clouds(tmp_path, scan):
    np.save(tmp_path / "plain.npy", np.zeros((5, 2)))
    with pytest.raises(mp.Error, match="structured arrays with fields x, y and z"):
        mp.load(tmp_path / "plain.npy")
    scan.save(tmp_path / "whole.npy")
    whole = (tmp_path / "whole.npy").read_bytes()
    (tmp_path / "cut.npy").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(mp.Error, match="ends after .* points; the file was cut short"):
        mp.load(tmp_path / "cut.npy")


def test_a_cloud_is_held_to_a_limit_of_memory(tmp_path):
    np.save(tmp_path / "points.npy", np.ones((100_000, 3), "f4"))
    for load in (mp.load, lambda path, **limit: list(mp.load_scans(path, **limit))):
        with pytest.raises(mp.Error, match="its 100000 points take about 13 MB of memory"):
            load(tmp_path / "points.npy", memory_limit=40_000_000)
    assert len(mp.load(tmp_path / "points.npy", memory_limit=80_000_000)) == 100_000


def test_what_is_no_path(scan, tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        mp.load("nowhere")
    for wrong in (3, None, ["a.pcd"], io.BytesIO(b""), scan):
        with pytest.raises(TypeError):
            mp.load(wrong)
        with pytest.raises(TypeError):
            scan.save(wrong)
    with pytest.raises(TypeError):
        mp.load("a.pcd", "pcd")
    with pytest.raises(TypeError):
        scan.save()
    with pytest.raises(TypeError):
        scan.save(tmp_path / "a.pcd", truth="yes")
    with pytest.raises(TypeError):
        scan.save(tmp_path / "a.pcd", "ply")


# The name that a scan is saved by, the format, and the words of what is said.
SAVED = [
    ("scan", None, ["no ending that says a format", ".pcd"]),
    ("scan.", None, ["no ending that says a format"]),
    (".pcd", None, ["no ending that says a format"]),
    (".", None, ["no ending that says a format"]),
    ("scan.holograms", None, ["unknown format `holograms`; known: pcd, ply"]),
    ("scan.pdc", None, ["did you mean `pcd`?"]),
    ("scan.plyy", None, ["did you mean `ply`?"]),
    ("scan.npz", None, ["unknown format `npz`"]),
    ("scan.docx", None, ["unknown format `docx`"]),
    ("scan.json", None, ["unknown format `json`"]),
    ("scan.html", None, ["unknown format `html`"]),
    ("scan.bag", None, ["unknown format `bag`"]),
    ("scan.jpg", None, ["unknown format `jpg`"]),
    ("scan.zip", None, ["unknown format `zip`"]),
    ("scan.pcd", "plyy", ["did you mean `ply`?"]),
    ("scan.pcd", "", ["unknown format ``"]),
    ("scan.pcd", ".pcd", ["did you mean `pcd`?"]),
    ("scan.pcd", "mcap-vlp", ["unknown format `mcap-vlp`"]),
    ("scan.pcd", "ros2", ["unknown format `ros2`"]),
    ("scan.pcd", "las,laz", ["unknown format `las,laz`"]),
]


@pytest.mark.parametrize("name, format, words", SAVED)
def test_a_file_that_cannot_be_saved(scan, tmp_path, name, format, words):
    with pytest.raises(mp.Error) as raised:
        scan.save(f"{tmp_path}/{name}", format=format)
    assert all(word in str(raised.value) for word in words), raised.value
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("place, kind", [
    ("nowhere/scan.pcd", FileNotFoundError), ("file/scan.pcd", NotADirectoryError),
    ("folder.pcd", IsADirectoryError), ("\0.pcd", OSError), ("/proc/scan.pcd", OSError),
    ("/sys/scan.pcd", OSError),
])
def test_a_place_that_takes_no_file(scan, tmp_path, place, kind):
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.pcd").mkdir()
    with pytest.raises(kind) as raised:
        scan.save(f"{tmp_path}/{place}" if place[0] != "/" else place)
    assert "os error" not in str(raised.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.pcd"]


@pytest.mark.parametrize("wrong", [
    lambda scan: "scan.pcd", lambda scan: None, lambda scan: 3, lambda scan: [scan], lambda scan: (scan, scan),
    lambda scan: scan.columns(), lambda scan: scan.manifest, lambda scan: scan.xyz(), lambda scan: mp.Scan,
    lambda scan: mp.scans("peregrine", "wall", 2), lambda scan: mp.record("peregrine", "wall"),
    lambda scan: scan.sensor, lambda scan: scan.score, lambda scan: scan.to_pandas(), lambda scan: iter([scan]),
    lambda scan: "street", lambda scan: scan.image("range"),
])
def test_what_is_no_scan_cannot_be_scored(scan, wrong):
    with pytest.raises(TypeError, match=r"scan: a macropulse.Scan is wanted, not of type .*; .*load\(path\)"):
        mp.score(wrong(scan))


def test_a_scan_without_truth_cannot_be_scored(scan, sensor, band, tmp_path):
    scan.save(tmp_path / "bare.npy", truth=False)
    scan.save(tmp_path / "scan.bin")
    for bare in (mp.load(tmp_path / "bare.npy"), mp.load(tmp_path / "scan.bin"), mp.decode(sensor, *band)):
        with pytest.raises(mp.Error, match="no truth to be judged by; simulate it, or write its file with truth"):
            mp.score(bare)
    for wrong in (lambda: mp.score(), lambda: mp.score(scan, scan), lambda: mp.score(scan, seed=1)):
        with pytest.raises(TypeError):
            wrong()
