"""The fields of gravity that act on grains: uniform, and central from a tabulated g(r).

    a = g_0 - g(|x|) x/|x|,   g linear between equidistant nodes, G M / r^2 beyond the last one

The table comes from ``target.json`` (the body without projectile) and stays fixed: what the grains' own redistribution
adds is of second order. The potential is the exact integral of the interpolated g, so that energy can be audited to
the integrator's own error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from matter.compilation.jit import law

NODES = 4096


@dataclass(frozen=True)
class Field:
    """``uniform`` (3,) [m/s^2]; ``table`` g at equidistant radii from 0 to ``radius`` [m]; ``radius`` 0 means no
    central part."""

    uniform: np.ndarray
    table: np.ndarray
    radius: float

    @staticmethod
    def constant(g: tuple[float, float, float]) -> Field:
        """Uniform gravity, or none."""
        return Field(np.array(g, dtype=float), np.zeros(2), 0.0)

    @staticmethod
    def of_target(profile: Mapping[str, list[float]]) -> Field:
        """Central gravity from the profile of ``target.json`` (``radius_m``, ``gravity_m_s2``)."""
        r = np.concatenate([[0.0], np.asarray(profile["radius_m"], dtype=float)])
        g = np.concatenate([[0.0], np.asarray(profile["gravity_m_s2"], dtype=float)])
        nodes = np.linspace(0.0, r[-1], NODES)
        return Field(np.zeros(3), np.interp(nodes, r, g), float(r[-1]))

    def strength(self, radius: np.ndarray) -> np.ndarray:
        """g at a distance from the centre [m/s^2]."""
        radius = np.asarray(radius, dtype=float)
        if self.radius == 0.0:
            return np.full(radius.shape, float(np.linalg.norm(self.uniform)))
        inside = np.interp(radius, np.linspace(0.0, self.radius, len(self.table)), self.table)
        return np.where(
            radius <= self.radius, inside, self.table[-1] * (self.radius / np.maximum(radius, 1e-300)) ** 2
        )

    def potential(self, position: np.ndarray) -> np.ndarray:
        """Energy per mass [J/kg]; the central part is zero at infinity, the uniform one at the origin."""
        phi = -(position @ self.uniform)
        if self.radius == 0.0:
            return phi
        r = np.linalg.norm(position, axis=1)
        step = self.radius / (len(self.table) - 1)
        surface = -self.table[-1] * self.radius
        below = np.concatenate([[0.0], np.cumsum(0.5 * (self.table[1:] + self.table[:-1]) * step)])
        cell = np.minimum((r / step).astype(np.int64), len(self.table) - 2)
        part = np.minimum(r, self.radius) - cell * step
        slope = (self.table[cell + 1] - self.table[cell]) / step
        inside = surface - below[-1] + below[cell] + self.table[cell] * part + 0.5 * slope * part**2
        return phi + np.where(r <= self.radius, inside, surface * self.radius / np.maximum(r, 1e-300))


@law
def central(r, table, radius):
    """g(r) [m/s^2] by linear interpolation, G M / r^2 beyond ``radius``."""
    last = table.shape[0] - 1
    if r >= radius:
        return table[last] * (radius / r) * (radius / r)
    s = r / radius * last
    k = min(int(s), last - 1)
    s -= k
    return table[k] + s * (table[k + 1] - table[k])
