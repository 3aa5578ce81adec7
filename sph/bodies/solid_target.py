"""An ellipsoid, or a body with the surface of a file, as particles: at rest in its own turning frame.

No hydrostatic balance is asked of its shape: below some kilometres strength or friction holds it. Relaxed, it bears
the weight of what lies above (``sph.bodies.solid_weight``); with ``start = "literal"`` it is uniform, and its weight
comes on as on a body set down gently. It turns as a whole,

    v = omega x r,   omega = 2 pi / period along the spin axis
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import numpy as np

from matter.case.body import Target
from matter.constants import G
from matter.errors import InputError
from matter.points import packing
from matter.points.regions import Interior
from matter.solids.distance import Distance, measured, sides
from matter.solids.placed import Placed
from matter.solids.solid import Solid
from sph.bodies import solid_weight
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body, Zones, loaded, spacing_law
from sph.materials.rows import Materials

SAMPLES = 200_000
NEAR = 0.3
"""Up to this fraction of the body's radius from the site it counts as a ball of its volume: too few samples lie
there."""


@lru_cache(maxsize=2)
def _distance(solid: Solid, height: float) -> Distance:
    with _named():
        return measured(solid, site=np.array([0.0, 0.0, height]))


@contextmanager
def _named() -> Iterator[None]:
    """What is wrong with the surface is wrong with the target's file."""
    try:
        yield
    except InputError as reason:
        raise InputError(f"[target] file: {reason}") from None


@lru_cache(maxsize=2)
def _samples(solid: Solid, height: float) -> np.ndarray:
    """Distances [m] of points spread evenly in the body from the site, sorted."""
    with _named():
        points = Interior(solid, sides(solid)).random_points(np.random.default_rng(0), SAMPLES)
    return np.sort(np.linalg.norm(points - [0.0, 0.0, height], axis=1))


def reach(placed: Placed) -> float:
    """Largest distance [m] of the body from the site."""
    return float(np.linalg.norm(placed.solid.vertices - [0.0, 0.0, placed.height], axis=1).max())


def area(placed: Placed, distance: np.ndarray) -> np.ndarray:
    """Area (n,) [m^2] of the part inside the body of spheres about the site, at these rising distances (n,) [m]."""
    radius, volume = placed.solid.radius, placed.solid.volume
    found = _samples(placed.solid, placed.height)
    near = NEAR * radius
    grid = np.linspace(near, reach(placed), 60)
    within = volume * np.searchsorted(found, grid) / len(found)
    far = np.interp(distance, 0.5 * (grid[1:] + grid[:-1]), np.diff(within) / np.diff(grid), right=0.0)
    ball = 2.0 * math.pi * distance**2 * np.clip(1.0 - distance / (2.0 * radius), 0.0, None)
    return np.where(distance < near, ball, far)


def spin(target: Target) -> np.ndarray:
    """Angular velocity (3,) [1/s]."""
    return target.placed.spin(target.spin_period)


def build(target: Target, materials: Materials, zones: Zones, seed: int) -> Body:
    """The target's particles: a graded glass whose layers follow the surface, or (one spacing everywhere) a uniform
    hexagonal lattice; the mass is that of the body. Raises ``InputError`` where no particle fits in."""
    solid = target.placed.solid
    inside = Interior(solid, _distance(solid, target.placed.height))
    if zones.uniform:
        lattice = packing.hexagonal(zones.contact, solid.extent)
        position = lattice[inside.inside(lattice)]
        volume = np.full(len(position), zones.contact**3)
        support = np.full(len(position), zones.support * zones.contact)
    else:
        spacing = spacing_law(target, zones)
        stream = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
        grown = (np.array(target.impact_point), zones.contact)
        position, volume = packing.graded(spacing, inside, stream, finest=zones.contact, grown_from=grown)
        support = zones.support * spacing(position)
    if not len(position):
        raise InputError(f"layer {target.layers[0].name!r} holds no particle: the spacing is too coarse for the body")
    index = materials.index(target.layers[0].material)
    density = float(materials.bulk_density[index])
    n = len(position)
    mass, material = density * volume * (solid.volume / volume.sum()), np.full(n, index, dtype=np.int32)
    rho, distention = np.full(n, density), np.full(n, float(materials.rows.alpha0[index]))
    if target.start == "relaxed" and target.attracts:
        loaded(weight(target, materials, position, mass), material, materials.rows, rho, distention)
        if not (rho > 0.0).all():
            raise InputError("no density of its material bears the weight of this body")
    return Body(position, mass, rho, support, np.zeros(n, dtype=np.int32), material, distention)


def weight(target: Target, materials: Materials, position: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """The pressure (n,) [Pa] with which particles of a ``mass`` (n,) [kg] begin, at ``position`` (n, 3) [m]; 0 with
    ``start = "literal"``."""
    if target.start != "relaxed" or not target.attracts:
        return np.zeros(len(position))
    density = float(materials.bulk_density[materials.index(target.layers[0].material)])
    depths = _distance(target.placed.solid, target.placed.height)
    return solid_weight.pressure(target, depths, position, mass, density)


def carried(target: Target, materials: Materials, cloud: Cloud) -> np.ndarray:
    """The part (n,) [Pa] of the pressures of a ``cloud`` that carries weight: what its particles of the body began
    with."""
    found, mine = np.zeros(len(cloud)), cloud.layer >= 0
    found[mine] = weight(target, materials, cloud.initial_position[mine], cloud.mass[mine])
    return found


def _companion(target: Target) -> dict[str, Any] | None:
    """Mass, position and axis of the circle of the body's companion in the frame of the run, at the moment of the
    impact."""
    if (one := target.companion) is None:
        return None
    position = target.placed.over_equator(one.distance)
    return {"mass_kg": one.mass, "place_m": position.tolist(), "axis": target.placed.spin_axis.tolist()}


def target_json(target: Target, density: float) -> dict[str, Any]:
    """The content of ``target.json``: the body in its own turning frame at the moment of the impact; ``density``
    [kg/m^3]."""
    placed = target.placed
    moments = np.linalg.eigvalsh(density * placed.solid.inertia)
    # axes of the ellipsoid of the same mass and moments: A = m (b^2 + c^2) / 20 with full axes
    mass = density * placed.solid.volume
    axes = np.sqrt(np.maximum(10.0 / mass * (moments.sum() - 2.0 * moments), 0.0))
    return {
        "frame": "solid",
        "shape": target.shape,
        "centre": [0.0, 0.0, 0.0],
        "radius_m": placed.solid.radius,
        "volume_m3": placed.solid.volume,
        "mass_kg": mass,
        "material": target.layers[0].material,
        "axes_of_inertia_m": axes.tolist(),
        "site_m": [0.0, 0.0, placed.height],
        "normal": placed.normal.tolist(),
        "normal_from_vertical_deg": math.degrees(math.acos(min(1.0, float(placed.normal[2])))),
        "angular_velocity_1_s": spin(target).tolist(),
        "companion": _companion(target),
        "from_body_frame": placed.turn.tolist(),
        "surface_gravity_m_s2": G * mass / placed.solid.radius**2,
    }
