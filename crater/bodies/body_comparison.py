"""A body before and after an impact, as all its measures see it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from crater.bodies import body_state, height_map, mutual_orbit
from crater.bodies.body_state import BodyState, Rigid
from crater.bodies.exchange import Exchange
from crater.bodies.height_map import HeightMap
from crater.bodies.mutual_orbit import Orbit
from crater.measures.uncertainty import Quantity
from matter.solids.body_shape import Shape

NEAR = 1.2
"""Bound matter out to so many of the body's largest distances from its centre may be counted to it."""


class Pair(NamedTuple):
    """A measure before and after the impact, and its change."""

    before: Quantity
    after: Quantity
    change: Quantity

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {name: entry.as_dict() for name, entry in self._asdict().items()}


@dataclass(frozen=True)
class BodyComparison:
    """A body ``before`` and ``after`` an impact: its ``shape`` and rotation ``omega`` (3,) [1/s] of before, the
    ``chart`` of its surface, the ``moved`` momentum, the ``orbit`` about a companion, None where there is none."""

    shape: Shape
    omega: np.ndarray
    before: BodyState
    after: BodyState
    chart: HeightMap
    moved: Exchange
    orbit: Orbit | None

    @cached_property
    def first(self) -> Rigid:
        """The body before."""
        return body_state.rigid(self.before, self.before.body)

    @cached_property
    def last(self) -> Rigid:
        """The body after."""
        return body_state.rigid(self.after, self.after.body)

    @cached_property
    def counted(self) -> Rigid:
        """The same with the bound matter near it."""
        near = np.linalg.norm(self.after.position, axis=1) < NEAR * self.shape.solid.extent
        return body_state.rigid(self.after, self.after.body | (self.after.bound & near))

    @cached_property
    def moved_pair(self) -> Exchange | None:
        """The momentum that stays with body and companion; None without a companion."""
        if self.orbit is None:
            return None
        return mutual_orbit.pair_exchange(self.orbit, self.before, self.after, self.moved.brought)

    @cached_property
    def moved_fraction(self) -> float:
        """Fraction of the body's mass that went, or moved against it."""
        rests = height_map.unmoved(self.before, self.after)
        mass = self.before.particles.mass[self.before.body]
        return float(1.0 - mass[rests].sum() / mass.sum())

    @cached_property
    def axes(self) -> np.ndarray:
        """Full axes (3,) [m] of the ellipsoid of equal inertia of the shape itself, longest first."""
        solid = self.shape.solid
        moments = np.linalg.eigvalsh(0.5 * np.trace(solid.inertia) * np.eye(3) - solid.inertia)
        return np.asarray(2.0 * np.sqrt(5.0 * moments[::-1] / solid.volume))

    def extents(self, after: bool) -> tuple[np.ndarray, np.ndarray]:
        """Extents (3,) [m] of the ground along the body's own axes, and their errors."""
        own = self.chart.ground(after) @ self.shape.placed.turn
        ends = np.stack([own.argmin(axis=0), own.argmax(axis=0)])
        error = self.chart.noise * np.linalg.norm(self.chart.spacing[ends], axis=0)
        return own.max(axis=0) - own.min(axis=0), error
