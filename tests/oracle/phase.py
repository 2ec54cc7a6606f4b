"""Ranges from taps of modulated light (docs/physics.md, "Modulated light"), by trying every time of flight.

The phase of each modulation frequency is looked up in a table of the phases that light would measure, so that
no harmonic is worked out. The time of flight is the one of a fine grid that fits all phases best.
"""

import numpy as np

from link import LIGHT

HEADER, STEP_M = 128, 0.5e-3


def wrapped(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def triangle(phase):
    """Correlation of a square wave with itself, whose fundamental is 1 high."""
    return np.pi**2 / 8.0 * (1.0 - 2.0 / np.pi * np.abs(wrapped(phase)))


def phases(codes, wave):
    """Phases and squared lengths of the phasors of taps, one row of `codes` for each shot."""
    taps = codes.shape[1]
    turns = 2.0 * np.pi * np.arange(taps) / taps
    phasor = codes @ np.exp(1j * turns)
    angle = np.angle(phasor)
    if wave == "square":
        true = np.linspace(-np.pi, np.pi, 20001)
        measured = np.angle(triangle(true[:, None] - turns) @ np.exp(1j * turns))
        angle = np.interp(angle, np.unwrap(measured), true, period=2.0 * np.pi)
    return angle, np.abs(phasor) ** 2


def phase_ranges(file, frequencies_hz, taps, gate_m, electrons_per_code, dark_code, read_noise_e, wave="sine"):
    """Number and range, m, of every shot of a file of taps."""
    count = len(frequencies_hz) * taps
    record = np.dtype([("shot", "<u8"), ("codes", "<u2", count)])
    read = np.fromfile(file, record, offset=HEADER)
    codes = read["codes"].astype(float).reshape(-1, len(frequencies_hz), taps)
    tof = np.arange(2.0 * gate_m[0] / LIGHT, 2.0 * gate_m[1] / LIGHT, 2.0 * STEP_M / LIGHT)
    angles, weights = [], []
    for tone in range(len(frequencies_hz)):
        angle, power = phases(codes[:, tone], wave)
        electrons = (codes[:, tone].mean(1) - dark_code) * electrons_per_code
        noise = electrons + read_noise_e**2 + electrons_per_code**2 / 12.0
        angles.append(angle)
        weights.append(power / noise)
    angles, weights = np.array(angles).T, np.array(weights).T
    turn = 2.0 * np.pi * np.array(frequencies_hz)
    found = []
    for shot, angle, weight in zip(read["shot"], angles, weights):
        error = wrapped(angle - turn * tof[:, None])
        at = int(np.argmin((weight * error**2).sum(1)))
        # A straight line from there on: all errors are small.
        moved = (weight * turn * error[at]).sum() / (weight * turn**2).sum()
        found.append({"shot": int(shot), "range_m": LIGHT / 2.0 * (tof[at] + moved)})
    return found
