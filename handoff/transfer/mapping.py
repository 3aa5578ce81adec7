"""Masses and velocities that the grains take over from the particles around them.

Velocity: a conservative remap. A grain takes the momentum of the matter in its cell: every sample point of the cell
moves with the particle that owns it, the particle's velocity varying linearly over the particle's own cell about its
mean, so that what a particle loses its grains gain. Linear fields stay exact; motion on scales below a grain is
averaged out, and the kinetic energy, spins included, never exceeds the source's (the linear part is taken as far as
that allows).

Mass: density of the nearest particle times the volume that the grain stands for, times a smooth factor that closes the
local sums.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from handoff.transfer import interpolation

LEAST_NEIGHBOURS, _MOST_NEIGHBOURS = 20, 64
_DENSITY_FACTOR = (0.7, 1.4)


class Overlap:
    """Which particle and which grain own the same sample points.

    ``samples`` and the ``receiver`` (s,) of each point (points without one are left out); ``particles`` (n, 3) and
    ``grains`` (m, 3) are the centres [m]; ``kept`` (k,) the grains that stay, in whose order everything per grain
    stands here. ``grains`` of this object are the centroids of their cells, ``arm`` the position of each point about
    the centroid of its particle's cell [m].
    """

    def __init__(self, samples, receiver, particles, grains, kept):
        number = np.full(len(grains), -1)
        number[kept] = np.arange(len(kept))
        here = receiver >= 0
        self.particle, self.grain, self.weight = samples.particle[here], number[receiver[here]], samples.weight[here]
        position = samples.position[here]
        self.particles = np.asarray(particles)
        self.per_particle = np.bincount(self.particle, weights=self.weight, minlength=len(self.particles))
        self.per_grain = np.bincount(self.grain, weights=self.weight, minlength=len(kept))
        self.arm = position - self._mean(self.particle, position, self.per_particle)[self.particle]
        centre = self._mean(self.grain, position, self.per_grain)
        self.grains = np.where((self.per_grain > 0)[:, None], centre, grains[kept])

    def mean(self, mass: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Mass-weighted mean (k, 3) over each grain's cell of values (s, 3) per point; ``mass`` (n,) of each particle
        lies evenly on its points."""
        weight = (np.maximum(mass, 1e-300) / np.where(self.per_particle > 0.0, self.per_particle, 1.0))[
            self.particle
        ] * self.weight
        total = np.bincount(self.grain, weights=weight, minlength=len(self.grains))
        sums = np.stack(
            [np.bincount(self.grain, weights=weight * values[:, k], minlength=len(self.grains)) for k in range(3)],
            axis=1,
        )
        return sums / np.maximum(total, 1e-300)[:, None]

    def _mean(self, number: np.ndarray, values: np.ndarray, whole: np.ndarray) -> np.ndarray:
        total = np.stack(
            [np.bincount(number, weights=self.weight * values[:, k], minlength=len(whole)) for k in range(3)], axis=1
        )
        return total / np.where(whole > 0.0, whole, 1.0)[:, None]


@dataclass(frozen=True)
class Motion:
    """Velocity (k, 3) [m/s] and spin (k, 3) [rad/s] of the kept grains, gradients (n, 3, 3) [1/s] of the particles
    themselves, and the fraction of their linear variation that the energy allowed."""

    velocity: np.ndarray
    spin: np.ndarray
    own_gradient: np.ndarray
    fraction: float


def neighbours_used(grain_volume: np.ndarray, particle_volume: np.ndarray) -> int:
    """Neighbours of the fit: 20 where the source is coarse, more where a grain stands for several particles (at most
    64)."""
    ratio = float(np.median(grain_volume / particle_volume))
    return int(np.clip(round(4.0 * ratio), LEAST_NEIGHBOURS, _MOST_NEIGHBOURS))


def motion(
    tree: cKDTree,
    velocity: np.ndarray,
    volume: np.ndarray,
    held: np.ndarray,
    overlap: Overlap,
    mass: np.ndarray,
    radius: np.ndarray,
    energy: float,
    grain_volume: np.ndarray,
    near: np.ndarray,
) -> Motion:
    """Velocities and spins for the kept grains.

    ``tree`` over the particles with their ``velocity`` (n, 3), ``volume`` (n,) and mass inside the domain ``held``
    (n,); ``mass``, ``radius``, ``grain_volume`` and nearest particle ``near`` of each grain (k,); ``energy`` [J] is
    what the source has for them. A grain without a point of its own takes the linear fit at its centre.
    """
    count = neighbours_used(grain_volume, volume[near])
    fitted, gradient = interpolation.local_linear(tree, velocity, volume, overlap.grains, count)
    _, own = interpolation.local_linear(tree, velocity, volume, overlap.particles, count)
    spin = interpolation.rotation_rate(gradient)
    turning = 0.2 * float(np.sum(mass * radius**2 * np.einsum("ij,ij->i", spin, spin)))
    some = (overlap.per_grain > 0)[:, None]
    level = np.where(some, overlap.mean(held, velocity[overlap.particle]), fitted)
    step = np.where(some, overlap.mean(held, np.einsum("sa,sab->sb", overlap.arm, own[overlap.particle])), 0.0)
    room = energy - turning - 0.5 * float(np.sum(mass * np.einsum("ij,ij->i", level, level)))
    fraction = energy_fraction(mass, level, step, room)
    return Motion(level + fraction * step, spin, own, fraction)


def locally_closed(mass: np.ndarray, tree: cKDTree, wanted: np.ndarray, overlap: Overlap) -> np.ndarray:
    """Grain masses (k,) whose local sums are those of the source, ``wanted`` (n,) per particle.

    A cloud of particles fills space with mass / density of each only roughly (a few per cent, at interfaces and after
    much flow), so that the particles' own densities do not sum to their mass. The factor that closes it is smooth over
    about 24 particles. A grain too small to hold a point of the overlap keeps its ``mass``.
    """
    points = (mass / np.where(overlap.per_grain > 0.0, overlap.per_grain, 1.0))[overlap.grain] * overlap.weight
    sums = np.bincount(overlap.particle, weights=points, minlength=len(wanted))
    factor = np.clip(interpolation.matching_factor(tree, wanted, sums, passes=4), *_DENSITY_FACTOR)
    closed = np.bincount(overlap.grain, weights=points * factor[overlap.particle], minlength=len(mass))
    return np.where(overlap.per_grain > 0.0, closed, mass)


def energy_fraction(mass: np.ndarray, velocity: np.ndarray, step: np.ndarray, room: float) -> float:
    """The largest fraction in [0, 1] of ``step`` (n, 3) that may be added to ``velocity`` without adding more than
    ``room`` [J] of energy."""
    linear = float(np.sum(mass * np.einsum("ij,ij->i", velocity, step)))
    square = 0.5 * float(np.sum(mass * np.einsum("ij,ij->i", step, step)))
    if linear + square <= room:
        return 1.0
    if room <= 0.0 or square <= 0.0:
        return 0.0
    return float(np.clip((-linear + np.sqrt(linear**2 + 4.0 * square * room)) / (2.0 * square), 0.0, 1.0))
