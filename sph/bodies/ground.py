"""Flat ground as particles: half-space, half-sphere or block, uniform or in balance with uniform gravity.

Layer masses are those of the uniform layers (density rho0 of each material, pores taken off). Relaxed ground keeps
them: pressure is the weight above,

    P(m) = g m,   m the mass per area above,   rho = rho_cold(P)
        (cold curve of the layer's equation of state, u = 0; pores closed as P closes them)

and the ground sinks vertically to the depths that these densities give, its surface staying at z = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from matter.case.body import Target
from matter.errors import InputError
from matter.geometry.ground_region import OF_TARGET
from matter.points import packing
from matter.points.regions import Cut, Slab
from sph.bodies import symmetry as symmetries
from sph.bodies.target import Body, Zones, loaded, spacing_law
from sph.materials.rows import Materials


class Ground(NamedTuple):
    """The ground against depth, on slabs of fixed mass from the surface down: all arrays (n,), SI.

    ``uniform_depth`` is the lower end of a slab at uniform density, ``depth`` in balance; density, pressure and
    resting ``distention`` hold at ``middle``; ``mass`` per area [kg/m^2] down to ``depth``; ``layer`` counts from the
    bottom.
    """

    uniform_depth: np.ndarray
    depth: np.ndarray
    middle: np.ndarray
    density: np.ndarray
    pressure: np.ndarray
    mass: np.ndarray
    layer: np.ndarray
    distention: np.ndarray
    gravity: float

    @property
    def bottom(self) -> float:
        """Height of the bottom in balance [m]."""
        return -float(self.depth[-1])

    def sunk(self, z: np.ndarray) -> np.ndarray:
        """Heights in balance of what lies at the heights ``z`` (n,) [m] at uniform density."""
        return -np.interp(-z, np.concatenate([[0.0], self.uniform_depth]), np.concatenate([[0.0], self.depth]))


def hydrostatic(target: Target, materials: Materials, slabs: int = 2000) -> Ground:
    """The column of the target, relaxed or (``start = "literal"``) uniform with P = 0.

    Raises ``InputError`` when no density balances the weight.
    """
    edges, layers, depth = [], [], 0.0
    for l in range(len(target.layers) - 1, -1, -1):
        thickness = target.layers[l].thickness
        count = max(20, round(slabs * thickness / target.radius))
        edges.append(depth + thickness * (np.arange(count) + 1.0) / count)
        layers.append(np.full(count, l))
        depth += thickness
    uniform, layer = np.concatenate(edges), np.concatenate(layers)
    material = np.array([materials.index(piece.material) for piece in target.layers], dtype=np.int32)[layer]
    rho, distention = materials.bulk_density[material], materials.rows.alpha0[material]
    dm = rho * np.diff(np.concatenate([[0.0], uniform]))
    mass = np.cumsum(dm)
    P = np.zeros_like(mass)
    if target.start == "relaxed" and target.gravity > 0.0:
        P = target.gravity * (mass - 0.5 * dm)
        loaded(P, material, materials.rows, rho, distention)
        if not (rho > 0.0).all():
            raise InputError("no hydrostatic equilibrium exists for this ground: it is too heavy for its materials")
    lower = np.cumsum(dm / rho)
    return Ground(uniform, lower, lower - 0.5 * dm / rho, rho, P, mass, layer, distention, target.gravity)


def slabs_of(target: Target) -> list[Slab]:
    """The region of every layer at uniform density, from the bottom up."""
    tops = np.array(target.outer_radii) - target.radius
    tops[-1] = 0.0
    radius = target.radius if target.shape == "half_sphere" else target.half_width
    return [
        Slab(OF_TARGET[target.shape], radius, float(bottom), float(top))
        for bottom, top in zip([-target.radius, *tops[:-1]], tops)
    ]


def build(
    target: Target, ground: Ground, materials: Materials, zones: Zones, seed: int, symmetry: str = "none"
) -> Body:
    """The target's particles: a graded glass, layer by layer, or (one spacing everywhere) a uniform hexagonal lattice;
    masses of every layer are exact. With a ``symmetry`` only its part."""
    mirrors = symmetries.MIRRORS[symmetry]
    slabs: list[Slab | Cut] = [Cut(slab, mirrors) if mirrors else slab for slab in slabs_of(target)]
    density0 = np.array([materials.bulk_density[materials.index(piece.material)] for piece in target.layers])
    points, volumes, supports = [], [], []
    if zones.uniform:
        reach = math.hypot(target.radius, math.sqrt(2.0) * target.half_width)
        lattice = symmetries.folded(packing.hexagonal(zones.contact, reach), symmetry, 0.35 * zones.contact)
        points = [lattice[slab.inside(lattice)] for slab in slabs]
        volumes = [np.full(len(centres), zones.contact**3) for centres in points]
        supports = [np.full(len(centres), zones.support * zones.contact) for centres in points]
    else:
        spacing = spacing_law(target, zones)
        streams = np.random.SeedSequence(seed).spawn(len(slabs))
        for l, slab in enumerate(slabs):
            finest = zones.contact if l == len(slabs) - 1 else None
            centres, volume = packing.graded(spacing, slab, np.random.default_rng(streams[l]), finest=finest)
            points.append(centres)
            volumes.append(volume)
            supports.append(zones.support * spacing(centres))
    for l, centres in enumerate(points):
        if len(centres) == 0:
            raise InputError(
                f"layer {target.layers[l].name!r} holds no particle: the spacing is too coarse for its thickness"
            )
    layer = np.repeat(np.arange(len(points)), [len(centres) for centres in points])
    mass = np.concatenate([density0[l] * volumes[l] * (slabs[l].volume / volumes[l].sum()) for l in range(len(slabs))])
    position = np.concatenate(points)
    position[:, 2] = ground.sunk(position[:, 2])
    density, distention = np.empty(len(position)), np.empty(len(position))
    for l in range(len(slabs)):  # layer by layer: density jumps at interfaces
        mine, at = layer == l, ground.layer == l
        density[mine] = np.interp(-position[mine, 2], ground.middle[at], ground.density[at])
        distention[mine] = np.interp(-position[mine, 2], ground.middle[at], ground.distention[at])
    material = np.array([materials.index(piece.material) for piece in target.layers])[layer]
    return Body(
        position,
        mass,
        density,
        np.concatenate(supports),
        layer.astype(np.int32),
        material.astype(np.int32),
        distention,
    )


def depth_from_sides(target: Target, position: np.ndarray) -> np.ndarray:
    """Distance (n,) [m] of the target's particles from its sides (of a half-sphere: from its bowl)."""
    if target.shape == "half_space":
        return target.half_width - np.hypot(position[:, 0], position[:, 1])
    if target.shape == "block":
        return target.half_width - np.abs(position[:, :2]).max(axis=1)
    return target.radius - np.linalg.norm(position, axis=1)


def target_json(target: Target, ground: Ground) -> dict:
    """The content of ``target.json``: heights [m] above the undisturbed surface, z = 0, from the bottom up."""
    layers = []
    for l, piece in enumerate(target.layers):
        at = np.flatnonzero(ground.layer == l)
        top = 0.0 if at[0] == 0 else -float(ground.depth[at[0] - 1])
        above = 0.0 if at[0] == 0 else float(ground.mass[at[0] - 1])
        layers.append(
            {
                "name": piece.name,
                "material": piece.material,
                "bottom_m": -float(ground.depth[at[-1]]),
                "top_m": top,
                "mass_kg_m2": float(ground.mass[at[-1]]) - above,
            }
        )
    edges = np.flatnonzero(np.diff(ground.layer))
    pick = np.unique(np.concatenate([np.linspace(0, len(ground.depth) - 1, 400).astype(int), edges, edges + 1]))[::-1]
    return {
        "frame": "plane",
        "shape": target.shape,
        "start": target.start,
        "depth_m": float(ground.depth[-1]),
        "half_width_m": target.half_width,
        "surface_gravity_m_s2": target.gravity,
        "layers": layers,
        "profile": {
            "height_m": (-ground.middle[pick]).tolist(),
            "density_kg_m3": ground.density[pick].tolist(),
            "pressure_Pa": ground.pressure[pick].tolist(),
            "gravity_m_s2": np.full(len(pick), target.gravity).tolist(),
            "layer": ground.layer[pick].tolist(),
        },
    }
