"""Masses of the grains of a whole body: its mass, its centre of mass, and its own axes.

All grains are as dense as each other, but for a correction with the least sum of squares,

    m_i = rho_g V_i (1 + sum_k c_k q_k(x_i)),   q = 1, x, y, z, xy, xz, yz   along the body's principal axes,

that gives the sum of all masses that of the body, puts their centre of mass into the origin, and makes their products
of inertia zero: a random packing would otherwise turn about an axis that is not its own, and nod by some thousandths
of its radius. Blocks keep the masses that they are listed with; the grains between them take the correction.
"""

from __future__ import annotations

import math

import numpy as np

from dem.beds.solid_body import SolidBody

NO_BLOCKS = np.zeros(0)


def matched(
    position: np.ndarray, radius: np.ndarray, body: SolidBody, blocks: np.ndarray = NO_BLOCKS
) -> tuple[np.ndarray, float]:
    """Masses (n,) [kg] of the grains, of which the last are ``blocks`` of these masses (b,) [kg], and the largest
    relative correction."""
    plain = slice(0, len(radius) - len(blocks))
    volume = 4.0 / 3.0 * math.pi * radius[plain] ** 3
    mass = np.concatenate([(body.mass - float(blocks.sum())) / volume.sum() * volume, blocks])
    axes = np.linalg.eigh(body.solid.inertia)[1]
    x, y, z = (position / body.solid.radius @ axes).T
    terms = np.stack([np.ones(len(x)), x, y, z, x * y, x * z, y * z])
    lacking = -(terms @ mass)
    lacking[0] = 0.0
    own, free = terms[:, plain], mass[plain]
    change = own.T @ np.linalg.solve((own * free) @ own.T, lacking)
    return np.concatenate([free * (1.0 + change), blocks]), float(np.abs(change).max())
