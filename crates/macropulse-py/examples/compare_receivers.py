"""Three receivers on the same light: as the paper prints it, bit by bit, and matched."""

import macropulse as mp

scene = mp.Scene.car(50.0)
print(f"{'receiver':10} {'right':>8} {'wrong':>7} {'missed':>7} {'on the car':>11}")
for kind in ("literal", "blind", "matched"):
    sensor = mp.Sensor("kim-park-2016", {"receiver.kind": kind})
    score = mp.simulate(sensor, scene, seed=1).score
    outcomes = score["outcomes"]
    print(f"{kind:10} {100 * score['right_fraction']:6.2f} % {outcomes['wrong']:7} "
          f"{outcomes['missed']:7} {score['points_on_target']:5} of {score['samples_on_target']}")
