"""A ball that strikes its own material straight down, in cells about the axis; peak pressures by V08's own measure."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sph.materials.rows import Materials
from studies.eulerian import godunov
from studies.eulerian.flow import Flow

CONE = np.radians(30.0)
SHELL = 0.2
"""Half-angle about the vertical, thickness of a shell over the ball's radius, of ``examples/peak_pressures.py``."""
FINE = 8
"""Points a side by which a cell at the ball's surface is filled."""


@dataclass(frozen=True)
class Markers:
    """Where markers began, over the ball's radius (n, 2: r, z), the mass [kg] that each stands for, whether it is the
    ball's, and the largest pressure that it felt [Pa]."""

    first: np.ndarray
    mass: np.ndarray
    ball: np.ndarray
    peak: np.ndarray


def filled(r: np.ndarray, z: np.ndarray, h: float, radius: float) -> np.ndarray:
    """Fraction of the ball, which touches z = 0, in cells of size ``h`` with middles ``r``, ``z`` (by volume)."""
    inside, whole = np.zeros((len(r), len(z))), np.zeros((len(r), 1))
    steps = (np.arange(FINE) + 0.5) / FINE - 0.5
    for a in steps:
        away = r[:, None] + a * h
        whole += away * FINE
        for b in steps:
            inside += away * (np.hypot(away, z[None, :] + b * h - radius) < radius)
    return inside / whole


def set_up(
    materials: Materials, speed: float, radius: float, cells: int, reach: float, above: float, friction: bool = False
) -> Flow:
    """The moment of contact, in cells of ``radius / cells``: from ``reach`` radii below the surface to ``above``
    radii above it, ``max(0.75 reach, 1.1)`` wide; what of the ball lies higher flows in."""
    h = radius / cells
    wide, low, high = (int(np.ceil(x * cells)) for x in (max(0.75 * reach, 1.1), reach, above))
    r, z = (np.arange(wide) + 0.5) * h, (np.arange(-low, high) + 0.5) * h
    ball = filled(r, z, h, radius)
    fraction = ball + (z < 0.0)
    rho0 = float(materials.bulk_density[0])
    conserved = np.zeros((wide, low + high, godunov.SHEARED + 3 * friction))
    conserved[:, :, godunov.MASS] = rho0 * fraction
    conserved[:, :, godunov.ALONG_Z] = -rho0 * speed * ball
    conserved[:, :, godunov.ENERGY] = 0.5 * rho0 * speed**2 * ball
    conserved[:, :, godunov.DISTENDED] = float(materials.rows.alpha0[0]) * conserved[:, :, godunov.MASS]
    i, k = np.nonzero(fraction >= 0.5)
    return Flow(conserved, h, -low * h, materials, np.column_stack([r[i], z[k]]))


def struck(
    materials: Materials, speed: float, radius: float, cells: int, reach: float, above: float
) -> tuple[Markers, Flow]:
    """Runs until the shock has passed ``reach`` radii below the contact."""
    flow = set_up(materials, speed, radius, cells, reach, above)
    first = flow.position.copy()
    mass = 2.0 * np.pi * first[:, 0] * flow.h**2 * float(materials.bulk_density[0])
    flow.run(reach * radius / float(flow.state[0, 0, godunov.C]))
    return Markers(first / radius, mass, first[:, 1] > 0.0, flow.peak), flow


def shells(markers: Markers, reach: float) -> np.ndarray:
    """Middle radius of each shell about the point of contact, over the ball's, and the median peak pressure [Pa] of
    the target's mass in it within ``CONE`` of the vertical."""
    away = np.hypot(*markers.first.T)
    below = ~markers.ball & (-markers.first[:, 1] > np.cos(CONE) * away)
    rows = []
    for low, high in pairwise(SHELL * np.arange(1, round(reach / SHELL) + 1)):
        here = np.flatnonzero(below & (away >= low) & (away < high))
        here = here[np.argsort(markers.peak[here])]
        weight = np.cumsum(markers.mass[here])
        rows.append((0.5 * (low + high), markers.peak[here[np.searchsorted(weight, 0.5 * weight[-1])]]))
    return np.array(rows)


def exponent(table: np.ndarray, low: float = 1.5, high: float = 4.0) -> float:
    """n of P ~ r^-n through the shells between ``low`` and ``high`` radii."""
    far = (table[:, 0] > low) & (table[:, 0] < high)
    r, peak = np.log(table[far].T)
    return -float(np.polyfit(r, peak, 1)[0])


def overshoot(markers: Markers, limit: float, whole: float) -> float:
    """Fraction of the ball's ``whole`` mass [kg] whose peak pressure lies above ``limit`` [Pa]."""
    return float(markers.mass[markers.ball & (markers.peak > limit)].sum() / whole)
