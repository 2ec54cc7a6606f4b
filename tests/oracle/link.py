"""The link: photons that come back, and sunlight (docs/physics.md, "Link equation", "Background")."""

import numpy as np

LIGHT = 299_792_458.0  # m/s
PLANCK = 6.626_070_15e-34  # J s


def extinction(visibility_km, wavelength_m):
    """Extinction of clear air or fog, 1/m, by Kim."""
    v = visibility_km
    if v > 50.0:
        q = 1.6
    elif v > 6.0:
        q = 1.3
    elif v > 1.0:
        q = 0.16 * v + 0.34
    elif v > 0.5:
        q = v - 0.5
    else:
        q = 0.0
    return 3.912 / v * (wavelength_m / 550e-9) ** -q / 1e3


def photons(energy_j, wavelength_m, reflectance, range_m, aperture_m, transmission, visibility_km):
    """Photons of a shot that reach the detector, from an extended Lambertian target square on."""
    area = np.pi * aperture_m**2 / 4.0
    there_and_back = np.exp(-2.0 * extinction(visibility_km, wavelength_m) * range_m)
    received = energy_j * reflectance * area * transmission * there_and_back / (np.pi * range_m**2)
    return received * wavelength_m / (PLANCK * LIGHT)


def field(horizontal_deg, vertical_deg, steps=2000):
    """Solid angle, sr, of all directions of such azimuths and elevations, summed up in steps."""
    elevations = np.deg2rad((np.arange(steps) + 0.5) / steps * vertical_deg - vertical_deg / 2.0)
    return np.deg2rad(horizontal_deg) * np.cos(elevations).sum() * np.deg2rad(vertical_deg) / steps


def sunlight(irradiance_w_m2_nm, filter_nm, albedo, field_sr, aperture_m, transmission, wavelength_m):
    """Photons of sunlight per second."""
    area = np.pi * aperture_m**2 / 4.0
    power = irradiance_w_m2_nm * filter_nm * albedo / np.pi * area * field_sr * transmission
    return power * wavelength_m / (PLANCK * LIGHT)
