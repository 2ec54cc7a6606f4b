"""A labelled training set: clouds with the object of every point, a file of NumPy for each."""

import macropulse as mp
import numpy as np

SCANS = 4
chance = np.random.default_rng(7)
for number in range(SCANS):
    # A car somewhere ahead, turned somehow.
    scene = mp.Scene("car-30m", {
        "environment": str(chance.choice(["clear-day", "overcast", "night"])),
        "object.car.position_m": [chance.uniform(12, 45), chance.uniform(-4, 4), 0.0],
        "object.car.yaw_deg": chance.uniform(-180, 180),
    })
    scan = mp.simulate("hdl-64e", scene, seed=number)
    is_car = scan.object == scan.objects.index("car")
    np.savez_compressed(
        f"scan-{number:06}.npz",
        points=np.column_stack([scan.xyz(), scan.intensity]),
        ring=scan.ring,
        time_ns=scan.time_ns,
        label=is_car.astype(np.uint8),
        # What no measurement knows: which points are ghosts, and what was missed.
        outcome=scan.outcome,
        true_range=scan.true_range,
    )
    print(f"scan {number}: {len(scan)} points labelled, {is_car.sum()} of the car, "
          f"{(scan.image('outcome') == mp.OUTCOMES.index('missed')).sum()} pixels missed")
