"""The cloud under the ruler: local spacing of every particle, and which particles carry a surface.

One definition of ground holds in every stage (``GROUND``). A particle supports the surface when it is compact and
attached, whatever it is made of: it has enough neighbours for its own spacing, hangs together with the largest group
of such particles, and does not fly. It flies where

* it is above the datum and would rise beyond a limit;
* it is expanded, to a density below half of that at rest, and rises or is above the datum: expanded matter that sinks
  below the datum goes with the floor, as in the handoff;
* it is of the projectile, above the datum, and comes down from beyond that limit: it has not hit yet.

Before the impact nothing of the projectile is ground (``locate.ground_before``); where heights or velocities are not
known, neither the projectile nor expanded matter is. Everything else is ejecta or debris and takes no part in heights.
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

FIELDS = (
    "position", "velocity", "mass", "density", "distention", "radius", "smoothing_length", "layer", "state",
    "material",
)  # fmt: skip
"""All that a cloud takes from a snapshot."""
GROUND = (
    "Ground is what is compact and attached, whatever it is made of, the projectile's matter too; what flies is not, "
    "nor a projectile that has not hit yet."
)
"""The definition in words."""
FEWEST = 100
RANDOM_PACKING = 0.62
"""Solid fraction assumed for grains that state neither a bulk density nor a packing fraction."""

# A particle in the bulk has 4/3 pi 2^3 = 33 others within two spacings, one at a flat surface about 20, one in a spray
# a few.
CORE_NEIGHBOURS = 12
BORDER_NEIGHBOURS = 6
LINK = 1.5
EXPANDED = 0.5
"""Below this fraction of its density at rest matter of the shock stage is expanded; it is counted at that density:
vapour must not paint a huge solid."""
FINE = 0.5
"""What is smaller than this fraction of a particle's spacing counts for nothing among its neighbours: a dozen small
grains that fell into the pores about a large one would else take the positions of the large ones that hold it."""


@dataclass(frozen=True)
class Cloud:
    """Positions (n, 3) [m], volume each particle stands for (n,) [m^3], local spacing = volume^(1/3) (n,) [m];
    velocity or None; (n,) which particles are expanded (``low_density``), and which are of the ``projectile``."""

    position: np.ndarray
    volume: np.ndarray
    spacing: np.ndarray
    velocity: np.ndarray | None
    low_density: np.ndarray
    projectile: np.ndarray

    def __len__(self) -> int:
        return len(self.position)

    def select(self, which: np.ndarray) -> Cloud:
        """The particles chosen by a mask or by indices."""
        velocity = None if self.velocity is None else self.velocity[which]
        marks = self.low_density[which], self.projectile[which]
        return Cloud(self.position[which], self.volume[which], self.spacing[which], velocity, *marks)


def particle_cloud(particles: Particles, what: str = "the snapshot") -> Cloud:
    """The cloud of a snapshot: booked particles (state other than 0) left out.

    Spacing is that of a grain's radius and the packing fraction, else (mass / density)^(1/3), else half the kernel's
    support, else from the distance to the twelfth neighbour. A density of shock-stage matter below half of that at
    rest, with the pores it has, marks expanded matter; where the snapshot does not say the density at rest, below half
    the median of its material.

    Raises ``InputError`` for fewer than 100 particles or a position that is not finite.
    """
    particles.need("position")
    keep = np.ones(len(particles), dtype=bool)
    if "state" in particles:
        keep &= particles.state == 0
    chosen = particles if keep.all() else particles.select(keep)
    if len(chosen) < FEWEST:
        left_out = f" ({len(particles) - len(chosen)} in flight left out)" if len(chosen) < len(particles) else ""
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
    projectile = chosen.layer < 0 if "layer" in chosen else np.zeros(len(chosen), dtype=bool)
    return Cloud(position, volume, np.cbrt(volume), velocity, low, projectile)


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
        least = EXPANDED * _at_rest(particles)
        low = particles.density < least
        volume = particles.mass / np.maximum(particles.density, least)
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


def _at_rest(particles: Particles) -> np.ndarray:
    """Density at rest (n,) [kg/m^3] of each particle's matter with the pores it has, as its volume is counted (on
    ground that was laid flat in the flat frame); the median of its material where the snapshot does not say."""
    group = particles.material if "material" in particles else np.zeros(len(particles), dtype=int)
    solid = np.array(particles.attributes.get("reference_densities_kg_m3") or [])
    usual = np.empty(len(particles))
    for index in np.unique(group):
        here = group == index
        if index >= len(solid) or not solid[index] > 0.0:
            usual[here] = np.median(particles.density[here])
            continue
        usual[here] = solid[index]
        for name, power in (("distention", -1), ("widening", 1)):
            if name in particles:
                usual[here] *= particles[name][here].astype(float) ** power
    return usual


def _neighbours(cloud: Cloud) -> tuple[np.ndarray, np.ndarray]:
    """Distances [m] and indices of the nearest ``CORE_NEIGHBOURS`` of every particle that are no finer than ``FINE``
    of its spacing, both (n, ``CORE_NEIGHBOURS``); infinite, and its own index, where there are fewer within two
    spacings."""
    tree, d = cKDTree(cloud.position), cloud.spacing
    distance, neighbour = tree.query(cloud.position, k=CORE_NEIGHBOURS + 1, workers=get_num_threads())
    distance, neighbour = distance[:, 1:], neighbour[:, 1:]
    for i in np.flatnonzero((d[neighbour] < FINE * d[:, None]).any(axis=1)):
        around = np.array(tree.query_ball_point(cloud.position[i], 2.0 * d[i]))
        around = around[(around != i) & (d[around] >= FINE * d[i])]
        separation = np.linalg.norm(cloud.position[around] - cloud.position[i], axis=1)
        nearest = np.argsort(separation, kind="stable")[:CORE_NEIGHBOURS]
        distance[i], neighbour[i] = np.inf, i
        distance[i, : len(nearest)], neighbour[i, : len(nearest)] = separation[nearest], around[nearest]
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

    ``height`` above the datum [m] and ``speed_up`` along the local vertical [m/s] tell what flies; above the datum,
    what would rise above ``rise_limit`` [m] under ``gravity`` [m/s^2], h + v^2 / 2 g, where both are given.

    Raises ``InputError`` when nothing compact is left.
    """
    distance, neighbour = _neighbours(cloud)
    d = cloud.spacing
    held = ~_flying(cloud, height, speed_up, gravity, rise_limit)
    core = (distance[:, CORE_NEIGHBOURS - 1] <= 2.0 * d) & held
    border = (distance[:, BORDER_NEIGHBOURS - 1] <= 2.0 * d) & held
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


def _flying(
    cloud: Cloud,
    height: np.ndarray | None,
    speed_up: np.ndarray | None,
    gravity: float | None,
    rise_limit: float | None,
) -> np.ndarray:
    """Mask of the particles that fly; arguments as of ``supported``."""
    if height is None or speed_up is None:
        return cloud.low_density | cloud.projectile
    above = height > 0.5 * cloud.spacing
    far = np.ones(len(cloud), dtype=bool)
    rises = np.zeros(len(cloud), dtype=bool)
    if gravity and rise_limit:
        far = height + speed_up**2 / (2.0 * gravity) > rise_limit
        rises = above & (speed_up > 0.0) & far
    comes = cloud.projectile & above & (speed_up < 0.0) & far
    return rises | comes | (cloud.low_density & (above | (speed_up > 0.0)))
