"""The first lines of the guide, in an environment with nothing but the package."""

import re
from pathlib import Path

import numpy as np

page = Path(__file__).resolve().parents[3] / "docs" / "guide" / "python.md"
exec(re.search(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)[1])

# What they leave: columns of NumPy, one value for each point.
for name, kind in [("x", "f4"), ("intensity", "f4"), ("ring", "u2"), ("time_ns", "f8")]:
    column = getattr(scan, name)
    assert isinstance(column, np.ndarray) and column.dtype == kind and column.shape == (len(scan),)
    assert np.isfinite(column).all() and len(np.unique(column)) > 10, name
assert scan.ring.max() == 479 and np.all(np.diff(scan.time_ns) >= 0)
assert np.all(scan.intensity[car] >= 0)
