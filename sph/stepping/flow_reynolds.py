"""Reynolds number of the flow that opens a crater, in matter that artificial viscosity makes viscous.

Smooth flow sees the artificial viscosity as a kinematic one of nu = alpha c hbar / 20, hbar = h / 2
(``sph.viscosity``), so that

    Re = v R / nu = 20 v R / (alpha c hbar)

R : radius of the crater: the half ball of 1.26 R below the impact point is half full (matter at its density, at rest
where it has expanded) v : rms speed of the target below the datum between R and 2 R from the impact point, alpha, c,
hbar : means there, all weighted by mass

Below some 10 viscosity takes a good part of the flow's momentum while the crater doubles (``REYNOLDS_LEAST``).
Measured (2 kg of copper into loose ground, 29,529 particles, from 15 ms on): speeds below the crater decay by 83 /s at
c = 3,145 m/s and alpha = 2, by 3.6 /s at alpha = 0.1, by 4.7 and 1.6 /s at alpha = 2 and c = 180 and 60 m/s: with
alpha c, not with the pores or friction.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

REYNOLDS_LEAST = 10.0
FEWEST = 10
"""Particles that a mean needs."""


def crater_radius(distance: np.ndarray, volume: np.ndarray) -> float:
    """Radius [m] of the half-spherical hole that leaves the half ball of 2^(1/3) its radius half full; ``distance``
    (n,) [m] of the target's particles below the datum from the impact point, ``volume`` (n,) [m^3]. Zero without a
    hole."""
    order = np.argsort(distance)
    reach = distance[order]
    nearer = np.cumsum(volume[order]) - volume[order]
    full = nearer >= math.pi / 3.0 * reach**3
    if len(full) < FEWEST:
        return 0.0
    # single particles fly about in the hole
    lasting = np.lib.stride_tricks.sliding_window_view(full, FEWEST).all(axis=1)
    return float(reach[np.argmax(lasting)]) / 2.0 ** (1.0 / 3.0) if lasting.any() else 0.0


def measure(
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
    half_length: np.ndarray,
    sound: np.ndarray,
    fraction: np.ndarray | float,
    density: np.ndarray,
    rest_density: np.ndarray,
    alpha: float,
    radius: float | None,
) -> dict[str, Any] | None:
    """The flow's numbers, for the target's particles (n,), positions [m] and velocities [m/s] (n, 3), ``half_length``
    hbar [m], speed of ``sound`` [m/s], ``fraction`` of the viscosity that a switch leaves, ``density`` as it is and at
    rest [kg/m^3]; ``radius`` [m] of a sphere, None for flat ground.

    None before there is a crater wider than hbar, or where too few particles lie below it. Without viscosity the
    Reynolds number is None.
    """
    if radius is None:
        height, pole = position[:, 2], np.zeros(3)
    else:
        height, pole = np.linalg.norm(position, axis=1) - radius, np.array([0.0, 0.0, radius])
    distance, under = np.linalg.norm(position - pole, axis=1), height < 0.0
    size = crater_radius(distance[under], (mass / np.maximum(density, rest_density))[under])
    below = under & (distance > size) & (distance < 2.0 * size)
    if np.count_nonzero(below) < FEWEST or size < np.median(half_length[below]):
        return None
    m = mass[below] / mass[below].sum()
    speed = math.sqrt(float(m @ np.einsum("ij,ij->i", velocity[below], velocity[below])))
    taken = alpha * float(m @ np.broadcast_to(fraction, mass.shape)[below])
    c, length = float(m @ sound[below]), float(m @ half_length[below])
    number = 20.0 * speed * size / (taken * c * length) if taken > 0.0 else None
    return {
        "reynolds": number,
        "radius_m": size,
        "speed_m_s": speed,
        "alpha": taken,
        "sound_speed_m_s": c,
        "hbar_m": length,
    }


def warnings(series: list[dict[str, Any]]) -> list[str]:
    """A sentence on the last row of ``series`` where its Reynolds number is too low, and one on the least of it."""
    known = [row for row in series if row["reynolds"] is not None]
    low = [row for row in known if row["reynolds"] < REYNOLDS_LEAST]
    if not low:
        return []
    least = min(low, key=lambda row: row["reynolds"])
    told = [
        f"artificial viscosity brakes the flow that opens the crater: its Reynolds number is below {REYNOLDS_LEAST:g} "
        f"in {len(low)} of {len(known)} snapshots (least {least['reynolds']:.2g} at {least['time_s']:.4g} s)"
    ]
    if known[-1]["reynolds"] < REYNOLDS_LEAST:
        told.append(
            f"viscosity still dominates at the end (Re = {known[-1]['reynolds']:.2g} at {known[-1]['time_s']:.4g} s); "
            f"lower [sph.late] alpha or sound_speed"
        )
    return told
