"""The cloud under the ruler: local spacing of every particle, and which particles carry a surface.

A particle supports the surface when it is compact and belongs to the body: it is no projectile, has enough neighbours
for its own spacing, hangs together with the largest group of such particles, and is not on a ballistic flight above
the datum. Everything else is ejecta or debris and takes no part in heights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import get_num_threads
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from matter.errors import InputError
from matter.particles import Particles

FIELDS = ("position", "velocity", "mass", "density", "radius", "smoothing_length", "layer", "state", "material")
"""All that a cloud takes from a snapshot."""
FEWEST = 100
RANDOM_PACKING = 0.62
"""Solid fraction assumed for grains that state neither a bulk density nor a packing fraction."""

# A particle in the bulk has 4/3 pi 2^3 = 33 others within two spacings, one at a flat surface about 20, one in a spray
# a few.
CORE_NEIGHBOURS = 12
BORDER_NEIGHBOURS = 6
LINK = 1.5
FINE = 0.5
"""What is smaller than this share of a particle's spacing counts for nothing among its neighbours: a dozen small
grains that fell into the pores about a large one would else take the places of the large ones that hold it."""


@dataclass(frozen=True)
class Cloud:
    """Positions (n, 3) [m], volume each particle stands for (n,) [m^3], local spacing = volume^(1/3) (n,) [m];
    velocity or None."""

    position: np.ndarray
    volume: np.ndarray
    spacing: np.ndarray
    velocity: np.ndarray | None
    low_density: np.ndarray

    def __len__(self) -> int:
        return len(self.position)

    def select(self, which: np.ndarray) -> Cloud:
        """The particles chosen by a mask or by indices."""
        velocity = None if self.velocity is None else self.velocity[which]
        return Cloud(self.position[which], self.volume[which], self.spacing[which], velocity, self.low_density[which])


def of(particles: Particles, what: str = "the snapshot") -> Cloud:
    """The cloud of a snapshot: projectile (layer -1) and booked particles (state other than 0) left out.

    Spacing is that of a grain's radius and the packing fraction, else (mass / density)^(1/3), else half the kernel's
    support, else from the distance to the twelfth neighbour. A density of shock-stage matter below half the median of
    its material marks expanded matter.

    Raises ``InputError`` for fewer than 100 particles or a position that is not finite.
    """
    particles.need("position")
    keep = np.ones(len(particles), dtype=bool)
    if "layer" in particles:
        keep &= particles.layer >= 0
    if "state" in particles:
        keep &= particles.state == 0
    chosen = particles if keep.all() else particles.select(keep)
    if len(chosen) < FEWEST:
        left_out = (
            f" ({len(particles) - len(chosen)} of projectile or in flight left out)"
            if len(chosen) < len(particles)
            else ""
        )
        raise InputError(
            f"{what} holds {len(chosen)} particles{left_out}: at least {FEWEST} are needed to measure a surface"
        )
    position = chosen.position
    finite = np.isfinite(position).all(axis=1)
    if not finite.all():
        first = int(np.flatnonzero(~finite)[0])
        raise InputError(
            f"{what} has {int((~finite).sum())} positions that are not finite, the first is particle {first}: "
            f"{position[first]}"
        )
    volume, low = _volumes(chosen, what)
    velocity = chosen.velocity if "velocity" in chosen else None
    return Cloud(position, volume, np.cbrt(volume), velocity, low)


def _volumes(particles: Particles, what: str) -> tuple[np.ndarray, np.ndarray]:
    low = np.zeros(len(particles), dtype=bool)
    if (
        "radius" in particles
    ):  # a grain fills the space that its sphere takes in a packing, whatever the density of the matter it stands for
        packing = float(particles.attributes.get("packing_fraction", RANDOM_PACKING))
        if not packing > 0.0:  # a bed too small to hold any of it away from walls
            packing = RANDOM_PACKING
        volume = 4.0 / 3.0 * np.pi * particles.radius**3 / packing
    elif "mass" in particles and "density" in particles:
        for name in ("mass", "density"):
            bad = np.flatnonzero(~(np.isfinite(particles[name]) & (particles[name] > 0.0)))
            if len(bad):
                raise InputError(
                    f"{what}: the {name} of {len(bad)} particles is not a positive number, the first is particle "
                    f"{bad[0]}: {particles[name][bad[0]]}"
                )
        density = particles.density
        group = particles.material if "material" in particles else np.zeros(len(particles), dtype=int)
        usual = np.empty(len(particles))
        for index in np.unique(group):
            usual[group == index] = np.median(density[group == index])
        low = density < 0.5 * usual
        volume = particles.mass / np.maximum(density, 0.5 * usual)  # vapour must not paint a huge solid
    elif "support_radius" in particles:
        volume = (0.5 * particles.support_radius) ** 3
    else:
        distance, _ = cKDTree(particles.position).query(particles.position, k=13)
        volume = 4.0 / 3.0 * np.pi * np.maximum(distance[:, -1], 1e-300) ** 3 / 12.5
        volume[:] = np.minimum(volume, 2.0 * np.median(volume))  # at a surface half of the neighbours are missing
    if not (np.isfinite(volume).all() and (volume > 0.0).all()):
        raise InputError(
            f"{what}: radius or smoothing length of {int((~(volume > 0.0)).sum())} particles is not a positive number"
        )
    return volume, low


def _neighbours(cloud: Cloud) -> tuple[np.ndarray, np.ndarray]:
    """Distances [m] and places of the nearest ``CORE_NEIGHBOURS`` of every particle that are no finer than ``FINE`` of
    its spacing, both (n, ``CORE_NEIGHBOURS``); infinite, and its own place, where there are fewer within two
    spacings."""
    tree, d = cKDTree(cloud.position), cloud.spacing
    distance, neighbour = tree.query(cloud.position, k=CORE_NEIGHBOURS + 1, workers=get_num_threads())
    distance, neighbour = distance[:, 1:], neighbour[:, 1:]
    for i in np.flatnonzero((d[neighbour] < FINE * d[:, None]).any(axis=1)):
        around = np.array(tree.query_ball_point(cloud.position[i], 2.0 * d[i]))
        around = around[(around != i) & (d[around] >= FINE * d[i])]
        apart = np.linalg.norm(cloud.position[around] - cloud.position[i], axis=1)
        nearest = np.argsort(apart, kind="stable")[:CORE_NEIGHBOURS]
        distance[i], neighbour[i] = np.inf, i
        distance[i, : len(nearest)], neighbour[i, : len(nearest)] = apart[nearest], around[nearest]
    return distance, neighbour


def supported(
    cloud: Cloud,
    height: np.ndarray | None = None,
    speed_up: np.ndarray | None = None,
    gravity: float | None = None,
    rise_limit: float | None = None,
    what: str = "the snapshot",
) -> np.ndarray:
    """Mask of the particles that carry the surface.

    ``height`` above the datum [m], ``speed_up`` along the local vertical [m/s], ``gravity`` [m/s^2] and ``rise_limit``
    [m] switch on the ballistic rule: above the datum, what would rise by more than ``rise_limit`` (v^2 / 2 g) flies.

    Raises ``InputError`` when nothing compact is left.
    """
    distance, neighbour = _neighbours(cloud)
    d = cloud.spacing
    core = (distance[:, CORE_NEIGHBOURS - 1] <= 2.0 * d) & ~cloud.low_density
    border = (distance[:, BORDER_NEIGHBOURS - 1] <= 2.0 * d) & ~cloud.low_density
    if height is not None and speed_up is not None and gravity and rise_limit:
        flying = (height > 0.5 * d) & (speed_up > 0.0) & (height + speed_up**2 / (2.0 * gravity) > rise_limit)
        core &= ~flying
        border &= ~flying
    near = distance <= LINK * np.maximum(d[:, None], d[neighbour])
    if not core.any():
        raise InputError(
            f"{what} holds no compact material: all {len(cloud)} particles are ejecta (none has {CORE_NEIGHBOURS} "
            f"neighbours)"
        )
    linked = near & core[:, None] & core[neighbour]
    row, column = np.nonzero(linked)[0], neighbour[linked]
    graph = coo_matrix((np.ones(len(row), dtype=np.int8), (row, column)), shape=(len(cloud), len(cloud)))
    _, label = connected_components(graph, directed=False)
    largest = np.argmax(np.bincount(label[core]))
    body = core & (label == largest)
    touching = border & (near & body[neighbour]).any(axis=1)
    result = body | touching
    if result.sum() < FEWEST:
        raise InputError(
            f"{what} holds no compact body: the largest connected group has {int(result.sum())} of {len(cloud)} "
            f"particles, the rest is ejecta"
        )
    return result
