"""A random packing of grains in a solid body of any shape.

Random points in the body are relaxed without friction and without weight, held in by a push from its surface

    a_i = k_i / m_i  max(0, r_i - s - depth_i)  inwards,

with the depth below the surface from ``matter.solids.distance``. Then the radii shrink by the mean overlap: the
packing is just no longer jammed, and nothing bursts when the push is gone.

Beside a smooth surface grains lie loosely. So the outermost stand out by s = ``PROUD`` mean radii, and the moments of
inertia are those of the body (measured with 500 to 8,000 grains in an ellipsoid). The grains fill
``FRACTION`` (1 - ``AT_SURFACE`` r A / V) of its volume; A / V = 3 / R of a ball.

Packed ``loosely`` they begin smaller, without any contact that holds. (A close packing whose grains are made smaller
is no loose one: under its own weight it closes to 0.636 of the bulk again, whatever the friction.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem.beds import bed_measures
from dem.contact.columns import MASS, RADIUS, STIFFNESS
from dem.grains.grain_list import GrainList
from matter.solids.distance import Distance
from matter.solids.solid import Solid

PROUD = 0.3
JAMMED = 0.65
"""Of the bulk that grains of ``radii`` fill."""
SINKS = 0.0103
"""By which a loose body sinks onto the contacts that hold it, over the radius of a ball of its volume (measured with
12,000 grains in an ellipsoid: 0.580 of the bulk before, 0.598 after)."""
BULK_DEPTH = 3.0
"""Mean radii below the surface at which the bulk begins."""
FRACTION, AT_SURFACE = 0.66, 0.05
"""Grain volume over the body's, slightly above random close packing, and what its surface takes of it."""


def radii(count: int, spread: float, solid: Solid, seed: np.random.SeedSequence) -> np.ndarray:
    """Radii [m] uniform within +-``spread`` about a mean at which ``count`` grains fill the body."""
    shape = np.random.default_rng(seed).uniform(1.0 - spread, 1.0 + spread, count)
    corner = solid.vertices[solid.triangles]
    area = 0.5 * float(
        np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1).sum()
    )
    volume, fraction = solid.volume, FRACTION
    for _ in range(20):
        scale = (fraction * volume / (4.0 / 3.0 * math.pi * float(np.sum(shape**3)))) ** (1.0 / 3.0)
        fraction = FRACTION * max(0.3, 1.0 - AT_SURFACE * scale * area / volume)
    return np.asarray(scale * shape)


def loosely(radius: np.ndarray, solid: Solid, fraction: float) -> tuple[np.ndarray, float]:
    """Grains that fill this ``fraction`` of the bulk, not jammed, in a body that stands out of its surface by what it
    sinks by when friction alone holds them: their radii from those of ``radii``, and how far it stands out [m]."""
    sinks = SINKS * (0.75 / math.pi * solid.volume) ** (1.0 / 3.0)
    return (1.0 + SINKS) * (fraction / JAMMED) ** (1.0 / 3.0) * radius, sinks


def centres(
    radius: np.ndarray, solid: Solid, distance: Distance, seed: np.random.SeedSequence,
    taken: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:  # fmt: skip
    """Centres (n, 3) uniform over the part of the body that each grain can reach; those that find none lie anywhere
    inside. ``taken``: where grains of these radii (m,) at these points (m, 3) cannot lie; None: nowhere."""
    rng = np.random.default_rng(seed)
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    position, todo = np.empty((len(radius), 3)), np.arange(len(radius))
    stand = PROUD * float(radius.mean())
    for trial in range(1000):
        if not len(todo):
            break
        position[todo] = low + (high - low) * rng.random((len(todo), 3))
        least = radius[todo] - stand if trial < 900 else 0.0
        bad = distance.at(position[todo])[0] < least
        if taken is not None:
            bad |= taken(position[todo], radius[todo])
        todo = todo[bad]
    return position


def bulk_fraction(position: np.ndarray, radius: np.ndarray, distance: Distance) -> float:
    """Fraction of space that the grains fill from ``BULK_DEPTH`` mean radii below the surface on; nan where none lies
    so deep."""
    inner = distance.at(position)[0] > BULK_DEPTH * float(radius.mean())
    return bed_measures.bulk_fraction_where(position, radius, inner)


@dataclass(frozen=True)
class Inside:
    """The push of the body's surface on grains that would leave it (``dem.grains.cached_gravity.ExternalForce``); they
    may ``stand`` [m] out of it."""

    distance: Distance
    stand: float

    def add(self, bed: GrainList, pull: np.ndarray) -> None:
        """Add its acceleration to ``pull`` (moving grains, 3)."""
        k = slice(0, bed.moving)
        depth, inwards = self.distance.at(bed.position[k])
        repulsion = bed.V[k, STIFFNESS] / bed.V[k, MASS] * np.maximum(bed.X[k, RADIUS] - self.stand - depth, 0.0)
        pull += repulsion[:, None] * inwards

    def energy(self, bed: GrainList, part: np.ndarray | slice) -> float:
        """1/2 sum k (r - depth)^2 [J]."""
        over = np.maximum(bed.X[part, RADIUS] - self.stand - self.distance.at(bed.position[part])[0], 0.0)
        return float(0.5 * bed.V[part, STIFFNESS] @ over**2)
