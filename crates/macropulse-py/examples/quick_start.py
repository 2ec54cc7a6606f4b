"""A car 30 m ahead, scanned by a lidar that sends codes: a cloud in ten lines."""

import macropulse as mp

scan = mp.simulate("kim-park-2016-fixed", mp.Scene.car(30.0), seed=1)
print(scan)

car = scan.object == scan.objects.index("car")
print(f"{car.sum()} points on the car, the nearest at x = {scan.x[car].min():.2f} m")
print(f"rings {scan.ring[car].min()} to {scan.ring[car].max()}, "
      f"fired within {(scan.time_ns[car].max() - scan.time_ns[car].min()) / 1e6:.2f} ms")
