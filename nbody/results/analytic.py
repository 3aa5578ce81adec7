"""What is known without integration: limits of the impact speed, the beam model of angle against latitude, isotropic
encounters."""

from __future__ import annotations

import math

import numpy as np

from nbody.masses.system import Body, load


def escape_speed(gm: float, radius: float) -> float:
    """v = sqrt(2 GM / r) [m/s] (Winter 2017, eq. 14)."""
    return math.sqrt(2.0 * gm / radius)


def orbital_speed(moon: Body) -> float:
    """Speed of a moon on its circle [m/s]."""
    return math.sqrt(load(moon.around).gm / moon.semi_major_axis)


def speed_limits(moon: Body, quadrature: bool) -> tuple[float, float]:
    """Smallest and largest impact speed [m/s] of a particle that falls to the moon's orbit from far away.

    Printed (Winter 2017, eqs. 15, 16): v = v_esc,planet(a) -+ v_orbit + v_esc,moon. In ``quadrature`` the moon's own
    pull adds to the square, v^2 = (v_p -+ v_orbit)^2 + v_esc,moon^2, with v_p^2 = 2 GM_p / a.
    """
    planet, orbit, own = load(moon.around), orbital_speed(moon), escape_speed(moon.gm, moon.radius)
    fall = escape_speed(planet.gm, moon.semi_major_axis)
    if quadrature:
        return math.hypot(fall - orbit, own), math.hypot(fall + orbit, own)
    return fall - orbit + own, fall + orbit + own


def beam_angles(bands: np.ndarray, sigma: float = math.radians(22.0)) -> tuple[np.ndarray, np.ndarray]:
    """Mean impact angle [rad] and fraction of impacts in bands of |latitude| [rad] under straight beams near the
    equatorial plane.

    Radiants have a Gaussian elevation b of width ``sigma`` and any longitude; a position of latitude phi sees
    cos(gamma) = sin(phi) sin(b) + cos(phi) cos(b) cos(lambda) and receives the flux cos(gamma). ``bands`` has shape
    (n, 2).
    """
    # nearest pole's half of the sphere is enough: the distribution of b is symmetric
    phi = np.radians(np.arange(0.25, 90.0, 0.5))
    b = np.radians(np.arange(-89.5, 90.0, 1.0))
    lam = np.radians(np.arange(0.5, 180.0, 1.0))
    p, e, l = np.meshgrid(phi, b, lam, indexing="ij")
    cosine = np.sin(p) * np.sin(e) + np.cos(p) * np.cos(e) * np.cos(l)
    flux = np.maximum(cosine, 0.0) * np.cos(p) * np.exp(-0.5 * (e / sigma) ** 2)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    received, moment = flux.sum(axis=(1, 2)), (flux * angle).sum(axis=(1, 2))
    mean, fraction = np.empty(len(bands)), np.empty(len(bands))
    for index, (low, high) in enumerate(bands):
        inside = (phi >= low) & (phi < high)
        mean[index], fraction[index] = (
            moment[inside].sum() / received[inside].sum(),
            received[inside].sum() / received.sum(),
        )
    return mean, fraction
