"""The net torque of a cloud on itself, taken out by one rigid angular acceleration b about its centre of mass:

    I b = T,   T = sum m x' (x) (a + g),   a <- a - b (x) x'

with x' the position from the centre of mass, so that no net force comes with it. Pairs that carry shear stress exert
torques that do not cancel (their force is not along the line between them), a frozen field of gravity turns what has
moved since, and the field of a tree has a net torque of its own.
"""

from __future__ import annotations

import numpy as np

from matter.compilation.jit import parallel_kernel, prange
from sph.bodies import symmetry as symmetries
from sph.bodies.particle_cloud import PARTS, Cloud


@parallel_kernel
def _net_torque(x, centre, a, g, mass, out):
    """Sums of m x' (x) (a + g) and the inertia tensor (xx xy xz yy yz zz) with x' = x - centre; ``out`` (parts, 9)
    holds them in pieces."""
    n, parts = len(mass), len(out)
    for part in prange(parts):
        tx, ty, tz, xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(part * n // parts, (part + 1) * n // parts):
            m, p, q, r = mass[i], x[i, 0] - centre[0], x[i, 1] - centre[1], x[i, 2] - centre[2]
            ax, ay, az = a[i, 0] + g[i, 0], a[i, 1] + g[i, 1], a[i, 2] + g[i, 2]
            tx += m * (q * az - r * ay)
            ty += m * (r * ax - p * az)
            tz += m * (p * ay - q * ax)
            xx += m * (q * q + r * r)
            xy -= m * p * q
            xz -= m * p * r
            yy += m * (p * p + r * r)
            yz -= m * q * r
            zz += m * (p * p + q * q)
        out[part, 0], out[part, 1], out[part, 2], out[part, 3], out[part, 4] = tx, ty, tz, xx, xy
        out[part, 5], out[part, 6], out[part, 7], out[part, 8] = xz, yy, yz, zz


@parallel_kernel
def _unturn(x, centre, spin, a):
    """a - spin (x) (x - centre), in place."""
    for i in prange(len(x)):
        p, q, r = x[i, 0] - centre[0], x[i, 1] - centre[1], x[i, 2] - centre[2]
        a[i, 0] -= spin[1] * r - spin[2] * q
        a[i, 1] -= spin[2] * p - spin[0] * r
        a[i, 2] -= spin[0] * q - spin[1] * p


def remove(cloud: Cloud, acceleration: np.ndarray, symmetry: str = "none") -> np.ndarray:
    """Take the net torque of ``acceleration`` (n, 3) [m/s^2] and the cloud's gravity together out of ``acceleration``,
    in place; returns it (3,) [N m]. With a ``symmetry`` it is that of the whole, whose part the cloud is."""
    pieces = np.empty((PARTS, 9))
    centre = cloud.mass @ cloud.position / cloud.mass.sum()
    if symmetry != "none":
        centre[list(symmetries.MIRRORS[symmetry])] = 0.0
    _net_torque(cloud.position, centre, acceleration, cloud.gravity, cloud.mass, pieces)
    sums = pieces.sum(axis=0)
    torque = sums[:3]
    inertia = np.array([[sums[3], sums[4], sums[5]], [sums[4], sums[6], sums[7]], [sums[5], sums[7], sums[8]]])
    if symmetry != "none":
        torque = symmetries.summed(torque, symmetry, axial=True)
        inertia = sum(np.outer(s, s) for s in symmetries.signs(symmetry)) * inertia
    _unturn(cloud.position, centre, np.linalg.solve(inertia, torque), acceleration)
    return torque


class Torque:
    """``present`` (3,) [N m]: the net torque that the last evaluation took out; ``removed`` (3,) [kg m^2/s]: its
    integral over time."""

    def __init__(self) -> None:
        self.present, self.removed = np.zeros(3), np.zeros(3)
