"""Ranges and radial velocities from the peaks of chirps (docs/physics.md, "Chirped light").

Each pair of a peak of the rising ramp and one of the falling ramp is two linear equations in time of flight and
Doppler shift. The pair with the most power that lies within the gate is the return.
"""

import numpy as np

from link import LIGHT

HEADER = 128


def false_returns(power, trials, least):
    """Pairs of noise in all that exceed `least` each and `power` together."""
    return trials * np.exp(-power) * (1.0 + power - 2.0 * least)


def beats(file, places, bandwidth_hz, seconds, wavelength_m, gate_m, max_speed_m_s, least_share, false_alarm):
    """Range, radial velocity and power of the strongest return of each shot that has one."""
    peak = np.dtype([("bins", "<i4"), ("power", "<u4")])
    read = np.fromfile(file, np.dtype([("shot", "<u8"), ("peaks", peak, (2, places))]), offset=HEADER)
    slope = bandwidth_hz / seconds
    equations = np.array([[slope, -1.0], [slope, 1.0]])
    found = []
    for shot, peaks in zip(read["shot"], read["peaks"]):
        hz = peaks["bins"] / 65536.0 / seconds
        power = peaks["power"] / 256.0
        is_there = (power > 0.0) & (power >= least_share * power[:, :1])
        best = None
        for up in np.flatnonzero(is_there[0]):
            for down in np.flatnonzero(is_there[1]):
                tof, doppler = np.linalg.solve(equations, [hz[0, up], hz[1, down]])
                range_m, speed = LIGHT / 2.0 * tof, wavelength_m / 2.0 * doppler
                both = power[0, up] + power[1, down]
                if gate_m[0] <= range_m < gate_m[1] and abs(speed) <= max_speed_m_s:
                    if best is None or both > best["power"]:
                        best = {"shot": int(shot), "range_m": range_m, "radial_velocity": speed, "power": both}
        if best is not None:
            found.append(best)
    # The power from which on noise makes few enough returns, by steps. The least recorded peak stands for the
    # least power that is recorded.
    powers = read["peaks"]["power"]
    least = powers[powers > 0].min() / 256.0
    gate_s = 2.0 * (gate_m[1] - gate_m[0]) / LIGHT
    trials = gate_s * 4.0 * max_speed_m_s / wavelength_m * 2.0 * bandwidth_hz * seconds
    steps = 2.0 * least + np.arange(0.0, 100.0, 0.001)
    threshold = steps[np.argmax(false_returns(steps, trials, least) <= false_alarm)]
    return {"found": found, "threshold": threshold}
