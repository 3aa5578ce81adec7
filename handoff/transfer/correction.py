"""Sums of mass, momentum and energy over particles, and the one global correction that closes linear and angular
momentum exactly.

Correction: dv_i = a + b x (r_i - r_c) on the grains of the bed, r_c their centre of mass. Then sum m dv = M a and the
angular momentum about r_c changes by I b with the inertia tensor I of the grains' centres, so that the six equations
fall apart into a = dp / M and b = I^-1 (dL - r_c x dp).

Before it, as an option, a regional one: momentum is closed node by node of a coarse grid, blended by quadratic
B-splines w_k (a smooth partition of unity, de Boor 1978): dv(r) = sum_k w_k(r) dp_k / M_k with dp_k and M_k the
w_k-weighted lack of momentum and mass.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sums:
    """Mass [kg], momentum [kg m/s], angular momentum about the origin [kg m^2/s], kinetic energy [J]; and what they
    are measured by: ``momentum_scale`` = sum m |v|, ``angular_scale`` = sum m |r| |v|."""

    mass: float
    momentum: np.ndarray
    angular: np.ndarray
    kinetic: float
    momentum_scale: float
    angular_scale: float

    def __add__(self, other: Sums) -> Sums:
        return Sums(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))


def sums(
    mass: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    radius=None,
    spin=None,
    pace: np.ndarray | None = None,
) -> Sums:
    """Sums over particles; with ``radius`` and ``spin`` (rad/s) those of solid spheres, their inertia 2/5 m r^2
    included. ``pace`` (n,) [m/s] stands for |v| in the scales where what moves is not measured by it (ground that
    turns with a body)."""
    momentum = mass[:, None] * velocity
    angular = np.cross(position, momentum).sum(axis=0)
    speed = np.linalg.norm(velocity, axis=1)
    kinetic = 0.5 * float(np.sum(mass * speed**2))
    if spin is not None:
        inertia = 0.4 * mass * radius**2
        angular = angular + (inertia[:, None] * spin).sum(axis=0)
        kinetic += 0.5 * float(np.sum(inertia * np.einsum("ij,ij->i", spin, spin)))
    scale = mass * (speed if pace is None else pace)
    return Sums(
        float(mass.sum()),
        momentum.sum(axis=0),
        angular,
        kinetic,
        float(scale.sum()),
        float(np.sum(scale * np.linalg.norm(position, axis=1))),
    )


def closing_field(
    mass: np.ndarray, position: np.ndarray, lacking: np.ndarray, lacking_angular: np.ndarray
) -> np.ndarray:
    """The change of velocity (n, 3) [m/s] that adds momentum ``lacking`` and angular momentum ``lacking_angular``
    (about the origin)."""
    total = mass.sum()
    centre = (mass[:, None] * position).sum(axis=0) / total
    arm = position - centre
    inertia = np.eye(3) * np.sum(mass * np.einsum("ij,ij->i", arm, arm)) - np.einsum("i,ia,ib->ab", mass, arm, arm)
    spin = np.linalg.solve(inertia, lacking_angular - np.cross(centre, lacking))
    return lacking / total + np.cross(spin, arm)


def regional_field(
    position: np.ndarray, mass: np.ndarray, lacking: np.ndarray, where: np.ndarray, size: float, passes: int = 2
) -> np.ndarray:
    """Change of velocity (k, 3) [m/s] at the points ``where`` (k, 3) that closes momentum region by region, each about
    ``size`` [m] wide.

    ``position`` (s, 3) are points that hold the grains' ``mass`` (s,) [kg] and lack the momentum ``lacking`` (s, 3)
    [kg m/s]. Nodes that hold less than a twentieth of the mass of the median node (at walls and free surfaces) give
    nothing; every further pass closes what the one before has left.
    """
    low = np.minimum(position.min(axis=0), where.min(axis=0)) / size
    count = (np.maximum(position.max(axis=0), where.max(axis=0)) / size - low).astype(np.int64) + 4
    there, here = position / size - low, where / size - low
    held = _gathered(there, mass[:, None], count)[:, 0]
    enough = held > 0.05 * np.median(held[held > 0.0])
    change, missing = np.zeros((len(where), 3)), lacking
    for _ in range(passes):
        nodes = np.where(enough[:, None], _gathered(there, missing, count) / np.where(enough, held, 1.0)[:, None], 0.0)
        change += _blended(here, nodes, enough, count)
        missing = missing - mass[:, None] * _blended(there, nodes, enough, count)
    return change


def _splines(position: np.ndarray, count: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The 27 nodes (s,) of each point with their weights (s,): products of quadratic B-splines on the unit grid."""
    base = np.floor(position).astype(np.int64)
    t = position - base
    weight = (0.5 * (1.0 - t) ** 2, 0.5 + t - t**2, 0.5 * t**2)
    for i, j, k in itertools.product(range(3), repeat=3):
        node = ((base[:, 0] + i) * count[1] + base[:, 1] + j) * count[2] + base[:, 2] + k
        yield node, weight[i][:, 0] * weight[j][:, 1] * weight[k][:, 2]


def _gathered(position: np.ndarray, values: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Sums (nodes, c) of the points' ``values`` (s, c) over the nodes, weighted."""
    total = np.zeros((int(np.prod(count)), values.shape[1]))
    for node, weight in _splines(position, count):
        for column in range(values.shape[1]):
            total[:, column] += np.bincount(node, weights=weight * values[:, column], minlength=len(total))
    return total


def _blended(position: np.ndarray, nodes: np.ndarray, counts: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Weighted mean (s, 3) at the points of the values ``nodes`` (nodes, 3) of those nodes that count; zero where none
    does."""
    total, weights = np.zeros((len(position), 3)), np.zeros(len(position))
    for node, weight in _splines(position, count):
        total += weight[:, None] * nodes[node]
        weights += weight * counts[node]
    return total / np.where(weights > 0.0, weights, 1.0)[:, None]
