#!/usr/bin/env python3
"""Works out again, from the equations alone, what `macropulse design` says of mirrors and of single pulses in flight.

    macropulse design docs/examples/requirements.toml -o lidars
    python3 tests/designs/mirrors.py docs/examples/requirements.toml lidars/design.json

It takes nothing from the program but the parts that were found (apertures, times between shots, blind times) and ends
with exit code 1 where a number differs by more than 0.1 %, or a polygon by more than its step of 1 mm.
"""

import json
import math
import sys
import tomllib

C = 299_792_458.0


def main():
    with open(sys.argv[1], "rb") as file:
        wanted = tomllib.load(file)["wanted"]
    with open(sys.argv[2]) as file:
        found = json.load(file)
    field = math.radians(wanted["horizontal_deg"])
    rate = wanted["rows"] * wanted["columns"] * wanted["scans_per_s"]
    wrong = []

    def hold(what, said, right, within=1e-3):
        if abs(said - right) > within * abs(right):
            wrong.append(f"{what}: {said}, but {right}")

    def period(channels, facets):
        return channels / rate * field * facets / (4 * math.pi)

    coded, waiting, flying = found["coded"], found["waiting"], found["in_flight"]
    needs = {
        "coded": (coded["aperture_mm"], period(coded["channels"], coded["facets"])),
        "waiting": (waiting["aperture_mm"], 2 * wanted["clutter_m"] / C),
        "in_flight": (flying["aperture_mm"], flying["least_period_ns"] * 1e-9),
    }
    print("facets   duty  " + "".join(f"{name:>28}" for name in needs))
    for mirror in found["mirrors"]:
        facets = mirror["facets"]
        hold(f"duty of {facets}", mirror["duty"], field * facets / (4 * math.pi))
        row = f"{facets:>6} {mirror['duty']:6.2f}  "
        for name, (aperture, time) in needs.items():
            channels = time / period(1, facets)
            diameter = aperture / math.sin(math.pi / facets - field / 4)
            lines = wanted["rows"] / channels * wanted["scans_per_s"]
            speed = math.pi * diameter * 1e-3 * lines / facets
            said = mirror[name]
            hold(f"{name} channels behind {facets}", said["channels"], channels)
            hold(f"{name} polygon of {facets}", said["polygon_mm"], diameter, 1.0 / diameter + 1e-6)
            hold(f"{name} corners of {facets}", said["tip_m_per_s"], speed, 1.0 / diameter + 1e-3)
            row += f"{channels:10.1f} {diameter:8.0f} mm {speed:4.0f} m/s"
        print(row)
    for one in (coded, waiting, flying):
        marks, bill = one["marks"], one["bill"]
        peak = one["channels"] * one["energy_nj"] * 1e-9 / (marks * one["pulse_ps"] * 1e-12)
        hold(one["name"] + " peak", bill["peak_w"], peak * math.sqrt(4 * math.log(2) / math.pi))
        hold(one["name"] + " mean", bill["mean_w"], one["energy_nj"] * 1e-9 * rate)
    hold("in flight", flying["period_ns"] * 1e-9, period(flying["channels"], flying["facets"]))
    hold("hidden", flying["hidden"], flying["least_period_ns"] * (1 - wanted["pd"]) / flying["period_ns"])
    pulses = math.ceil(2 * wanted["clutter_m"] / C / (flying["period_ns"] * 1e-9))
    hold("pulses in flight", flying["pulses"], pulses)
    chance = 6 * math.sqrt(2) * wanted["precision_m"] / (0.5 * flying["period_ns"] * 1e-9 * C / 2)
    accepted = min(wanted["false_points"], wanted["wrong_points"])
    enough = next(n for n in range(99) if pulses * chance**n <= accepted)
    hold("neighbours", flying["neighbours"], enough)
    print("\n".join(wrong) or "all as the equations say")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
