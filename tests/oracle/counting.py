"""Photons counted (docs/physics.md, "Photon counting", "Geiger cells")."""

import numpy as np


def seen(photons, missed):
    """Probability that a mark of so many photons on average is seen."""
    return (1.0 - missed) * -np.expm1(-photons)


def of_sensitivity(pd, reflectance, range_m, at_reflectance, at_range_m):
    """Photons of a mark, if the same sensor sees a mark with `pd` in the declared place."""
    return -np.log1p(-pd) * reflectance / at_reflectance * (at_range_m / range_m) ** 2


def fired(rate_hz, cells, dead_s):
    """Firings per second of cells that are blind for a while after each, by the law of renewal."""
    return rate_hz / (1.0 + rate_hz * dead_s / cells)


def seen_by_cells(photons, rate_hz, cells, dead_s):
    """Probability that a mark fires one cell at least, each of which waits for its share of it."""
    waiting = 1.0 / (1.0 + rate_hz * dead_s / cells)
    fires = waiting * -np.expm1(-photons / cells)
    return 1.0 - (1.0 - fires) ** cells


def fired_drawn(rate_hz, cells, dead_s, lasts_s, seed):
    """The same, count by count: each falls on a cell, which fires if it has waited long enough."""
    chance = np.random.default_rng(seed)
    firings = 0
    for _ in range(cells):
        counts = chance.poisson(rate_hz / cells * lasts_s)
        blind_until = 0.0
        for moment in np.sort(chance.uniform(0.0, lasts_s, counts)):
            if moment >= blind_until:
                firings += 1
                blind_until = moment + dead_s
    return firings / lasts_s
