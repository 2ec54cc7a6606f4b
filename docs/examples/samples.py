#!/usr/bin/env python3
"""The mean signal behind each shot of recorded samples, and from how far it is strongest.

    python3 samples.py shots-000000.mps samples-000000.mpw

Reads with NumPy, and nothing else, what `macropulse simulate --format samples` writes: see docs/formats.md.
"""

import json
import sys

import numpy as np

SHOT = np.dtype([("fired_fs", "<i8"), *((name, "<u2") for name in ("row", "column", "label", "word", "channel"))])
HEADER = np.dtype({
    "names": ["magic", "version", "length", "blocks", "tick_fs", "channels", "lowest", "highest", "step_photons"],
    "formats": ["S8", "<u4", "<u4", "<u8", "<i8", "<u4", "<i2", "<i2", "<f8"],
    "offsets": [0, 8, 12, 16, 24, 56, 60, 62, 64],
    "itemsize": 128,
})
BLOCK = np.dtype([("first", "<i8"), ("count", "<u4"), ("channel", "<u2"), ("zero", "<u2")])


def blocks(data, header):
    """First tick, channel and codes of each block."""
    at = int(header["length"])
    while at < len(data):
        block = data[at : at + 16].view(BLOCK)[0]
        end = at + 16 + 2 * int(block["count"])
        yield int(block["first"]), int(block["channel"]), data[at + 16 : end].view("<i2")
        at = end


shots = np.fromfile(sys.argv[1], SHOT, offset=128)
data = np.fromfile(sys.argv[2], np.uint8)
header = data[:128].view(HEADER)[0]
tick_fs = int(header["tick_fs"])
total, heard, codes, found = np.zeros(1500), 0, 0, 0
for first, channel, code in blocks(data, header):
    found, codes = found + 1, codes + len(code)
    fired = shots["fired_fs"][shots["channel"] == channel] // tick_fs - first
    for start in fired[(fired >= 0) & (fired + len(total) <= len(code))]:
        total += code[start : start + len(total)]
        heard += 1
mean = total / max(heard, 1) * float(header["step_photons"])
# Behind the stray light of the sensor's own marks, which all leave within 144 ns.
behind = int(1.5e8 / tick_fs)
lag = behind + int(np.argmax(mean[behind:]))
print(json.dumps({
    "blocks": found,
    "blocks_said": int(header["blocks"]),
    "codes": codes,
    "shots": heard,
    "range_m": lag * tick_fs * 1e-15 * 299_792_458.0 / 2.0,
    "photons": float(mean[lag]),
}))
