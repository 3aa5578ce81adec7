"""Overlaps of a set of grains, among themselves and with the walls: how deep, what they store, how fast they would
come apart, what step they ask for.

A contact of overlap delta and stiffness k stores k delta^2 / 2 and, let go, drives its lighter grain of mass m to
delta sqrt(k / m). A step that keeps the overlap of grains that close at speed v below x_max r needs k = m (v / (x_max
r))^2, hence dt = (pi / n) x_max r / (sqrt(2) v) with n steps per contact. (Ballouz et al. 2019, MNRAS 485, 697:
overlaps of spheres made straight from SPH particles drive the step to prohibitively low values.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains.domain import Domain
from matter.particles import Particles

SOURCES = ("Ballouz2019",)

OVERLAP_WARN = 0.15
"""Overlaps above this, in radii, are warned of in the collapse."""
_STEPS_PER_CONTACT = 30
# the granular stage softens grains whose k / m is above this many times that of the stiffest tenth
_SOFTENED, _STIFF = 2.0, 90.0


@dataclass(frozen=True)
class Overlaps:
    """Every overlapping contact (c,): ``depth`` [m], ``relative_depth`` = depth over the smaller radius, ``stiffness``
    [N/m], ``mass`` [kg] and ``radius`` [m] of the lighter and of the smaller grain, ``position`` (c, 3) [m];
    ``grains`` were looked at."""

    depth: np.ndarray
    relative_depth: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    radius: np.ndarray
    position: np.ndarray
    grains: int

    def beyond(self, carried: Callable[[np.ndarray], np.ndarray]) -> Overlaps:
        """The excess over the overlap r^2 P / k at which a contact carries the pressure P = ``carried(position)`` [Pa]
        of the undisturbed body."""
        excess = self.depth - carried(self.position) * self.radius**2 / self.stiffness
        some = excess > 0.0
        relative_depth = excess[some] / self.radius[some]
        return Overlaps(
            excess[some],
            relative_depth,
            self.stiffness[some],
            self.mass[some],
            self.radius[some],
            self.position[some],
            self.grains,
        )

    @property
    def energy(self) -> float:
        """Stored energy [J]."""
        return float(0.5 * np.sum(self.stiffness * self.depth**2))

    @property
    def largest(self) -> float:
        """Largest depth over the smaller radius."""
        return float(self.relative_depth.max(initial=0.0))

    @property
    def release_speed(self) -> np.ndarray:
        """(c,) speed of the lighter grain once the contact has let go [m/s]."""
        return self.depth * np.sqrt(self.stiffness / self.mass)

    def percentile(self, percent: float) -> float:
        """Percentile of the fraction over all overlapping contacts; zero without one."""
        return float(np.percentile(self.relative_depth, percent)) if len(self.relative_depth) else 0.0

    def step(self, overlap: float, steps: int) -> float:
        """The longest step [s] that still takes every contact apart at its release speed within ``overlap`` radii;
        infinite without contacts."""
        speed = self.release_speed
        moving = speed > 0.0
        if not moving.any():
            return float("inf")
        return float(np.min(np.pi / steps * overlap * self.radius[moving] / (np.sqrt(2.0) * speed[moving])))


def measure(grains: Particles, domain: Domain | None = None) -> Overlaps:
    """Overlaps among the ``grains`` (position, radius, mass, stiffness), and with the floor and side of ``domain``
    where it is given.

    Radii may differ by orders of magnitude: pairs are looked for class by class, each class a factor of two wide.
    """
    one, other = pairs(grains.position, grains.radius)
    radius, mass, k = grains.radius, grains.mass, grains.stiffness
    gap = radius[one] + radius[other] - np.linalg.norm(grains.position[one] - grains.position[other], axis=1)
    parts = [
        (gap, np.minimum(k[one], k[other]), np.minimum(mass[one], mass[other]), np.minimum(radius[one], radius[other]),
         0.5 * (grains.position[one] + grains.position[other]))
    ]  # fmt: skip
    if domain is not None:
        into = radius - domain.wall_depth(grains.position)
        hit = np.flatnonzero((into > 0.0) & (into < 2.0 * radius))
        parts.append((into[hit], k[hit], mass[hit], radius[hit], grains.position[hit]))
    depth, stiffness, lighter, smaller, position = (np.concatenate(columns) for columns in zip(*parts))
    some = depth > 0.0
    relative_depth = depth[some] / smaller[some]
    return Overlaps(
        depth[some], relative_depth, stiffness[some], lighter[some], smaller[some], position[some], len(grains)
    )


def pairs(position: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every pair of spheres that may touch, once."""
    number = np.round(np.log2(radius / radius.min())).astype(int) if len(radius) else np.zeros(0, dtype=int)
    classes = [np.flatnonzero(number == k) for k in np.unique(number)]
    trees = [cKDTree(position[members]) for members in classes]
    one, other = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for a, mine in enumerate(classes):
        pairs = trees[a].query_pairs(2.0 * float(radius[mine].max()), output_type="ndarray")
        one.append(mine[pairs[:, 0]])
        other.append(mine[pairs[:, 1]])
        for b in range(a + 1, len(classes)):
            theirs = classes[b]
            reach = float(radius[mine].max() + radius[theirs].max())
            close = trees[a].sparse_distance_matrix(trees[b], reach, output_type="ndarray")
            one.append(mine[close["i"]])
            other.append(theirs[close["j"]])
    return np.concatenate(one), np.concatenate(other)


def contact_step(grains: Particles, steps: int) -> float:
    """Step of the granular stage [s]: the shortest contact time pi sqrt(m / 2 k) over ``steps``, stiff light grains
    softened as it does."""
    frequency = grains.stiffness / grains.mass
    stiffest = min(float(frequency.max()), _SOFTENED * float(np.percentile(frequency, _STIFF)))
    return float(np.pi * np.sqrt(0.5 / stiffest)) / steps


def steps_per_contact(bed: Particles) -> int:
    """Steps per contact: the bed's own, or the default of the collapse."""
    return int(bed.attributes.get("contact", {}).get("steps_per_contact", _STEPS_PER_CONTACT))
