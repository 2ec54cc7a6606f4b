"""Which code, how long, at which reflectance and sunlight?

The same energy a shot, sent as few strong marks or many weak ones: how far is a target seen with a
probability of 0.9? In closed form; a simulation beside one of the forecasts shows what they are
worth. Writes a table, and a picture where matplotlib is installed.
"""

import csv

import macropulse as mp

# Marks stand six chips apart at least, so that the amplifier tells them apart.
CODES = [(1 + 9 * marks, marks) for marks in (4, 6, 8, 12, 16)]
REFLECTANCES = (0.05, 0.1, 0.3, 0.8)
SUNLIGHT = ("clear-day", "night")
PD = 0.9


def sensor(chips, marks):
    """Eye-safe with every one of these codes: 100 nJ a shot."""
    family = {"sparse": {"length": chips, "weight": marks, "words": 64, "gap": 6, "seed": 1}}
    return mp.Sensor("coded-practical", {"code.family": family, "light.energy": {"shot_nj": 100.0}})


rows = []
for chips, marks in CODES:
    lidar = sensor(chips, marks)
    for environment in SUNLIGHT:
        budget = mp.budget(lidar, environment, pd=PD)
        ranges = {one["reflectance"]: one["range_of_pd_m"] for one in budget["by_reflectance"]}
        rows.append([chips, marks, environment, *(ranges[one] for one in REFLECTANCES)])

heading = ["chips", "marks", "sunlight", *(f"range_m_at_{one}" for one in REFLECTANCES)]
with open("code-length.csv", "w", newline="") as file:
    csv.writer(file).writerows([heading, *rows])
print(f"farthest range, m, with a probability of {PD}\n" + " ".join(f"{one:>16}" for one in heading))
for row in rows:
    cells = (f"{one:.1f}" if isinstance(one, float) else "-" if one is None else one for one in row)
    print(" ".join(f"{cell:>16}" for cell in cells))

# A plate of a tenth across the line of sight, where the forecast says 0.9, within the range gate; `-` is
# never: too few marks to stand out of the dark counts.
chips, marks, _, _, farthest, *_ = next(row for row in rows if row[4] is not None and row[4] < 150.0)
corners = [[0, -12, -12], [0, 12, -12], [0, 12, 12], [0, -12, 12]]
plate = mp.Scene.from_mesh(corners, [[0, 1, 2], [0, 2, 3]], material="grey10",
                           position_m=[farthest, 0, 0])
outcomes = mp.simulate(sensor(chips, marks), plate, seed=1).score["outcomes"]
met = sum(outcomes[one] for one in ("right", "near", "wrong", "missed"))
print(f"\nsimulated, {marks} marks, a tenth at {farthest:.1f} m, clear-day: "
      f"{(outcomes['right'] + outcomes['near']) / met:.3f}")

try:
    import matplotlib.pyplot as plt
except ImportError:
    print("no picture: matplotlib is not installed")
else:
    figure, axes = plt.subplots()
    for environment, style in zip(SUNLIGHT, ("-", "--")):
        for at, reflectance in enumerate(REFLECTANCES):
            of = [row for row in rows if row[2] == environment]
            axes.plot([row[1] for row in of], [row[3 + at] or float("nan") for row in of], style,
                      marker="o", color=f"C{at}", label=f"{reflectance}, {environment}")
    axes.set(xscale="log", xlabel="marks of a word", ylabel=f"farthest range of Pd {PD}, m")
    axes.legend(title="reflectance, sunlight")
    figure.savefig("code-length.png", dpi=150)
