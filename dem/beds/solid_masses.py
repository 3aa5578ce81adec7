"""Masses of the grains of a whole body: its mass, its centre of mass, and its own axes.

All grains are as dense as each other, but for a correction with the least sum of squares,

    m_i = rho_g V_i (1 + sum_k c_k q_k(x_i)),   q = 1, x, y, z, xy, xz, yz   along the body's principal axes,

that gives the sum of all masses that of the body, puts their centre of mass into the origin, and makes their products
of inertia zero: a random packing would otherwise turn about an axis that is not its own, and nod by some thousandths
of its radius.
"""

from __future__ import annotations

import math

import numpy as np

from dem.beds.solid_body import SolidBody


def matched(position: np.ndarray, radius: np.ndarray, body: SolidBody) -> tuple[np.ndarray, float]:
    """Masses (n,) [kg] of the grains, and the largest relative correction."""
    volume = 4.0 / 3.0 * math.pi * radius**3
    mass = body.mass / volume.sum() * volume
    axes = np.linalg.eigh(body.solid.inertia)[1]
    x, y, z = (position / body.solid.radius @ axes).T
    terms = np.stack([np.ones(len(x)), x, y, z, x * y, x * z, y * z])
    lacking = -(terms @ mass)
    lacking[0] = 0.0
    change = terms.T @ np.linalg.solve((terms * mass) @ terms.T, lacking)
    return mass * (1.0 + change), float(np.abs(change).max())
