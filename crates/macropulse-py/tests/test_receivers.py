"""The receiver's side alone: ticks or samples to points."""

import macropulse as mp
import numpy as np
import pytest

SENSORS = {
    "literal": ("kim-park-2016", {"receiver.kind": "literal", "scan.raster.rows": 6}),
    "blind": ("kim-park-2016", {"receiver.kind": "blind", "scan.raster.rows": 6}),
    "matched": ("kim-park-2016-fixed", {"scan.raster.rows": 6}),
    "direct": ("hdl-64e", {}),
}


@pytest.mark.parametrize("kind", SENSORS)
def test_ticks_decode_to_the_points_of_the_simulation(kind):
    name, changes = SENSORS[kind]
    sensor, scene = mp.Sensor(name, changes), mp.Scene("car-30m")
    whole = mp.simulate(sensor, scene, seed=5)
    bands = mp.record(sensor, scene, seed=5)
    count = len(bands)
    assert count > 1 and iter(bands) is bands
    decoded = [mp.decode(sensor, shots, ticks, environment="vacuum-dark") for shots, ticks in bands]
    assert len(decoded) == count and sum(map(len, decoded)) == len(whole) > 500
    for column in ("x", "y", "z", "range", "intensity", "row", "column", "time_ns", "peak", "margin",
                   "return_number", "number_of_returns"):
        joined = np.concatenate([getattr(band, column) for band in decoded])
        np.testing.assert_array_equal(joined, getattr(whole, column), err_msg=column)
    assert decoded[0].score is None and "outcome" not in decoded[0].columns()


SAMPLED = {
    "scan.scans_per_s": 1250.0, "scan.raster.rows": 64, "scan.raster.columns": 106, "scan.raster.beams": 8,
    "scan.raster.vertical_deg": 3.24, "scan.raster.horizontal_deg": 5.4, "scan.raster.duty": 1.0,
    "scan.raster.mirror": "uniform",
    "light.energy": {"shot_nj": 6.0},
}


def test_samples_decode_to_the_points_of_the_simulation():
    sensor, scene = mp.Sensor("coded-32", SAMPLED), mp.Scene("street")
    whole = mp.simulate(sensor, scene, seed=5)
    decoded = []
    for shots, samples in mp.record(sensor, scene, seed=5):
        assert sorted(samples) == ["channel", "code", "epoch"]
        code = samples["code"]
        assert code.dtype == np.int16 and code.shape[0] == 8 and code.shape[1] > 100_000
        assert not code.flags.owndata, "the rows are of one array"
        np.testing.assert_array_equal(samples["channel"], np.arange(8))
        decoded.append(mp.decode(sensor, shots, samples, environment="clear-day"))
    for column in ("x", "range", "intensity", "row", "column", "peak", "margin", "photons"):
        joined = np.concatenate([getattr(band, column) for band in decoded])
        np.testing.assert_array_equal(joined, getattr(whole, column), err_msg=column)
    assert sum(map(len, decoded)) == len(whole) > 1000
    # Without channels the rows are all of them; half of the samples have no echo from far away.
    less = {key: samples[key] for key in ("epoch", "code")}
    assert len(mp.decode(sensor, shots, less)) == len(decoded[-1])

    def told(sensor=sensor, **changed):
        with pytest.raises(mp.Error) as raised:
            mp.decode(sensor, shots, {**samples, **changed})
        return str(raised.value)

    assert "8 rows for 7 channels" in told(channel=np.arange(7))
    assert "channel has 8" in told(channel=np.arange(1, 9))
    assert "3 dimensions" in told(code=code[None])
    assert "whole numbers from -32768 to 32767" in told(code=code.astype(float) + 0.5)
    assert "entry 0 is 40000" in told(code=np.full(code.shape, 40_000))
    assert "is sampled" in told(tick=[1])
    assert "did you mean `code`" in told(cod=code)
    assert "is it the sensor that" in told(sensor="kim-park-2016-fixed")
    with pytest.raises(mp.Error, match="then the samples"):
        mp.decode(sensor, samples, shots)


FLASH = """version = 1
name = "flash"
idealised = ["footprint", "mirror-motion", "eye-safety"]
scan = { scans_per_s = 10.0, max_range_m = 30.0, flash = { rows = 6, columns = 8, \
horizontal_deg = 8.0, vertical_deg = 6.0 } }
light = { wavelength_nm = 940.0, beam_diameter_mm = 3.0, pulse_ps = 1000.0, \
energy = { shot_nj = 4000.0 } }
optics = { aperture_mm = 3.0, transmission = 0.7, filter_nm = 20.0, field = "descanned" }
detector.geiger = { efficiency = 0.15 }
burst = { pulses = 2000, interval_ns = 250.0 }
histogram = { bin_ps = 250.0, bins = 820 }
receiver = { kind = "histogram", right_within_m = 0.05 }
"""


def test_histograms_decode_to_the_points_of_the_simulation(tmp_path):
    (tmp_path / "flash.toml").write_text(FLASH.replace("\\\n", ""))
    sensor, scene = mp.Sensor(str(tmp_path / "flash.toml")), mp.Scene("wall")
    whole = mp.simulate(sensor, scene, seed=5)
    [(shots, histograms)] = mp.record(sensor, scene, seed=5)
    assert sorted(histograms) == ["bin_fs", "counts", "cycles", "offset_fs"]
    counts = histograms["counts"]
    assert counts.dtype == np.uint32 and counts.shape == (48, 820)
    decoded = mp.decode(sensor, shots, histograms, environment="clear-day")
    for column in ("x", "range", "intensity", "row", "column", "margin", "photons"):
        np.testing.assert_array_equal(getattr(decoded, column), getattr(whole, column))
    assert len(mp.decode(sensor, shots, {"counts": counts})) == len(whole) > 20

    def told(**changed):
        with pytest.raises(mp.Error) as raised:
            mp.decode(sensor, shots, {**histograms, **changed})
        return str(raised.value)

    assert "1 dimensions" in told(counts=counts.ravel())
    assert "bin_fs is 1000, and 250000 of flash" in told(bin_fs=1000)
    assert "cycles" in told(cycles=[1, 2])
    assert "did you mean `counts`" in told(count=counts)


def test_taps_decode_to_the_points_of_the_simulation():
    sensor = mp.Sensor("itof-camera", {"scan.flash.rows": 6, "scan.flash.columns": 8})
    scene = mp.Scene("wall", {"object.wall.position_m.x": 3.0, "environment": "night"})
    whole = mp.simulate(sensor, scene, seed=5)
    [(shots, taps)] = mp.record(sensor, scene, seed=5)
    codes = taps["codes"]
    assert sorted(taps) == ["codes"] and codes.dtype == np.uint16 and codes.shape == (48, 8)
    decoded = mp.decode(sensor, shots, taps, environment="night")
    for column in ("x", "range", "intensity", "row", "column", "margin", "photons"):
        np.testing.assert_array_equal(getattr(decoded, column), getattr(whole, column))
    assert len(whole) > 20

    def told(**changed):
        with pytest.raises(mp.Error) as raised:
            mp.decode(sensor, shots, {**taps, **changed})
        return str(raised.value)

    assert "1 dimensions; give it a row for each shot and a column for each tap" in told(codes=codes.ravel())
    assert "`codes` has 7 columns, and itof-camera has 8 taps" in told(codes=codes[:, 1:])
    assert "did you mean `codes`" in told(code=codes)


def test_beats_decode_to_the_points_of_the_simulation():
    ideal = {"chirp.linewidth_khz": 0.0, "spectrum.fidelity": "spectrum"}
    sensor = mp.Sensor("fmcw-1550", {"scan.raster.rows": 4, "scan.raster.columns": 60, **ideal})
    scene = mp.Scene("wall", {"object.wall.position_m.x": 30.0, "object.wall.velocity_m_s": [-4.0, 0.0, 0.0]})
    whole = mp.simulate(sensor, scene, seed=5)
    [(shots, beats)] = mp.record(sensor, scene, seed=5)
    frequency, power = beats["frequency"], beats["power"]
    assert sorted(beats) == ["frequency", "power"] and frequency.shape == power.shape == (240, 16)
    decoded = mp.decode(sensor, shots, beats)
    for column in ("x", "range", "intensity", "row", "column", "margin", "photons", "radial_velocity"):
        np.testing.assert_array_equal(getattr(decoded, column), getattr(whole, column))
    right = whole.outcome == 1
    assert right.sum() > 20
    error = whole.radial_velocity[right] - whole.true_radial_velocity[right]
    assert abs(error.mean()) < 0.02 and whole.radial_velocity[right].mean() > 3.0

    # The receiver again, from its definition: the strongest peak of each ramp, in hertz.
    up, down = (frequency[:, place] / 5e-6 for place in (0, 8))
    slope = 0.64e9 / 5e-6
    ranges = 299_792_458.0 / 2.0 * (up + down) / (2.0 * slope)
    speeds = 1550e-9 * (down - up) / 4.0
    once = (whole.number_of_returns == 1) & (whole.return_number == 1)
    shot = whole.row[once].astype(int) * 60 + whole.column[once]
    order = {place: at for at, place in enumerate(shots["row"].astype(int) * 60 + shots["column"])}
    at = np.array([order[place] for place in shot])
    np.testing.assert_allclose(ranges[at], whole.range[once], rtol=1e-6)
    np.testing.assert_allclose(speeds[at], whole.radial_velocity[once], atol=1e-4)

    def told(**changed):
        with pytest.raises(mp.Error) as raised:
            mp.decode(sensor, shots, {**beats, **changed})
        return str(raised.value)

    assert "1 dimensions" in told(frequency=frequency.ravel())
    assert "`frequency` has 15 columns" in told(frequency=frequency[:, 1:])
    assert "`power` has 15 columns, and fmcw-1550 has 16 peaks" in told(power=power[:, 1:])
    assert "`power` has 239 rows, and the column before it 240" in told(power=power[1:])
    assert "did you mean `power`" in told(powers=power)


def test_ticks_that_were_made_by_hand():
    """A single echo, laid out mark by mark here: its range is known."""
    sensor = mp.Sensor("kim-park-2016-fixed")
    shot = mp.encode(sensor, 240, 424)
    text = sensor.to_toml()
    chip_fs = 2_500 if "chip_ps = 2.5" in text else None
    assert chip_fs and sensor.tick_fs <= chip_fs
    metres = 42.0
    away = round(2 * metres / 299_792_458 * 1e15)
    light = shot["fired_at_fs"] + away + shot["marks"].astype(np.int64) * chip_fs
    epoch = shot["fired_at_fs"] // sensor.tick_fs - 10
    ticks = np.unique(light // sensor.tick_fs) - epoch
    shots = {"fired_at_fs": [shot["fired_at_fs"]], "row": [240], "column": [424],
             "label": [shot["label"]], "word": [shot["code_word"]]}
    scan = mp.decode(sensor, shots, {"epoch": epoch, "tick": ticks})
    assert len(scan) == 1 and abs(scan.range[0] - metres) < 0.001
    assert (scan.row[0], scan.column[0]) == (240, 424) and scan.peak[0] == scan.marks[0]
    # Labels and words are those that the sensor would send.
    less = {key: shots[key] for key in ("fired_at_fs", "row", "column")}
    assert mp.decode(sensor, less, {"epoch": epoch, "tick": ticks}).range[0] == scan.range[0]


def test_what_cannot_be_decoded_is_refused():
    sensor = mp.Sensor("kim-park-2016-fixed", {"scan.raster.rows": 6})
    *_, (shots, ticks) = mp.record(sensor, "car-30m")
    assert len(ticks["tick"]) > 1000

    def told(shots=shots, ticks=ticks, **changed):
        with pytest.raises(mp.Error) as raised:
            mp.decode(sensor, {**shots, **changed}, ticks)
        return str(raised.value)

    assert "sort the ticks" in told(ticks={**ticks, "tick": ticks["tick"][::-1]})
    assert told(ticks={}) == "ticks: there is no column `tick`"
    numbers = "the column `tick` must be whole numbers from 0 to 4294967295"
    assert numbers in told(ticks={**ticks, "tick": ticks["tick"] - 0.5})
    assert numbers in told(ticks={**ticks, "tick": [-1, 2]})
    told_of_row = told(row=shots["row"] + 6)
    assert "row has " in told_of_row and "kim-park-2016-fixed has 0 to 5" in told_of_row
    assert "label" in told(label=shots["label"][:-1])
    assert "first is" in told(first=2**61)
    assert "owned" in told(owned=(3, 2)) and "owned is (1,)" in told(owned=(1,))
    assert told(word=np.full_like(shots["word"], 60000))
