"""Blocks among the particles of a target.

A particle whose centre lies in a block takes the block's material, its pores and its density. Blocks less than
``RESOLVED`` spacings across are homogenised: their mass stays in the ground between, as a mixture of the same density.

    matrix density   rho_m = (rho - f rho_b) / (1 - f)
    mixture          rho_h = rho_m + (rho_b - rho_m) V_h / V

rho the density of the ground as its material says, rho_b that of the blocks, f their volume fraction; V_h the volume
of homogenised blocks in a zone of similar spacing, V that of the matrix there. Beyond ``within`` the ground is the
whole mixture, of density rho. Masses are closed twice: those of the resolved blocks by one factor to their listed
volume (the particles of a block 6 spacings across are off by 3 %), those of all else by one factor to the mass of the
target, which thus does not depend on blocks or spacing.

Matrix of another density has other pores, alpha = rho_solid / rho_h: ``LEVELS`` rows of its material stand for it
behind the others, with its name. Yield, tension and crushing pressures are the matrix's in all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from matter.blocks import block_file
from matter.blocks.placing import Placing
from matter.case.body import Projectile, Target
from matter.errors import InputError
from matter.particles import Particles
from matter.wording import readable
from sph.bodies.target import Body, Zones, loaded
from sph.materials.rows import Materials, Rows, collect
from sph.materials.settings import AS_PUBLISHED, law_of
from sph.porosity import dispatch as porosity

RESOLVED = 6.0
"""Spacings across a block from which on it has particles of its own: some 110, its volume to 3 %."""
LEVELS = 25
"""Densities of the mixture, from the matrix's to half as far again beyond the whole ground's."""
LEAST = 0.3
"""Least density of the matrix over that of its solid."""
_RATIO = 1.2
"""Spacings of a zone differ by this factor."""


class Matrix(NamedTuple):
    """The ground between the blocks: ``density`` [kg/m^3] of the matrix alone, of the whole ``ground`` and of the
    ``block``; the indices ``rows`` of the material's variants and their ``densities``."""

    density: float
    ground: float
    block: float
    rows: np.ndarray
    densities: np.ndarray


def fault(target: Target, ball: Projectile, symmetry: str, reconstructs: bool) -> str:
    """What else of the shock stage does not go with blocks, or nothing."""
    if symmetry != "none":
        return f'target.blocks: they have no mirror images: symmetry must be "none", not "{symmetry}"'
    if not reconstructs:
        return 'target.blocks: they need numerics = "reconstructed", no viscosity_switch and no corrected gradients'
    shared = {target.layers[0].material, *target.block_materials} & set(ball.materials)
    if shared:
        return (
            f"target.blocks: the projectile is of {sorted(shared)[0]}, as the ground or its blocks; it must be of "
            "another material"
        )
    return ""


def matrix_density(materials: Materials, name: str, placing: Placing) -> float:
    """rho_m [kg/m^3] of the ground's material ``name``. Raises ``InputError`` where it cannot be as light or as dense,
    with the largest fraction that works."""
    i = materials.index(name)
    ground, solid = float(materials.bulk_density[i]), float(materials.rho0[i])
    block, f = float(materials.bulk_density[materials.index(placing.material)]), placing.fraction
    if block == ground or placing.material == name:
        return ground
    found = (ground - f * block) / (1.0 - f)
    least, most = LEAST * solid, solid
    if least <= found <= most:
        if materials.rows.porosity[i] == 0:
            raise InputError(
                f"target.blocks: {name} has no pores, so that it cannot make up for the density of blocks of "
                f"{placing.material}; give it a law of pores ([sph.materials.{name}] porosity)"
            )
        return found
    limit = least if found < least else most
    largest = max((ground - limit) / (block - limit), 0.0) if (ground - limit) * (block - limit) > 0.0 else 0.0
    raise InputError(
        f"target.blocks: with {f:.3g} of its volume in blocks of {block:.4g} kg/m^3, ground of {ground:.4g} kg/m^3 "
        f"needs a matrix of {found:.4g} kg/m^3, which must lie between {least:.4g} and {most:.4g}; the largest "
        f"volume_fraction that works is {math.floor(1000.0 * largest) / 1000.0:g}"
    )


def with_matrix(materials: Materials, name: str, placing: Placing) -> tuple[Materials, Matrix]:
    """The materials with variants of the ground's ``name`` behind them, and the matrix. Raises ``InputError``."""
    i = materials.index(name)
    block = float(materials.bulk_density[materials.index(placing.material)])
    density, ground = matrix_density(materials, name, placing), float(materials.bulk_density[i])
    if density == ground:
        return materials, Matrix(ground, ground, block, np.array([i]), np.array([ground]))
    wanted = density + (ground - density) * np.arange(LEVELS) / 16.0
    distention = np.maximum(float(materials.rho0[i]) / wanted, 1.0)
    choice = materials.choices.get(name, AS_PUBLISHED)
    law = law_of(name, porosity.FAMILY.key, "none", choice)
    variants = [
        collect((name,), {name: choice.model_copy(update={law: {**(getattr(choice, law) or {}), "alpha0": float(a)}})})
        for a in distention
    ]
    rows = Rows(*(_joined([array, *(getattr(v.rows, key) for v in variants)]) for key, array in _fields(materials)))
    first = len(materials.names)
    more = replace(materials, names=(*materials.names, *([name] * LEVELS)), rows=rows)
    return more, Matrix(density, ground, block, np.arange(first, first + LEVELS), more.bulk_density[first:])


def _fields(materials: Materials) -> list[tuple[str, np.ndarray]]:
    return list(zip(Rows._fields, materials.rows))


def _joined(arrays: list[np.ndarray]) -> np.ndarray:
    """Arrays one behind the other, narrow ones filled up with zeros to the width of the first."""
    wide = arrays[0].shape[1:]
    filled = [np.pad(a, [(0, 0), (0, wide[0] - a.shape[1])]) if wide else a for a in arrays]
    return np.concatenate(filled)


def resolved(placing: Placing, zones: Zones, site: np.ndarray) -> np.ndarray:
    """Which blocks (n,) have particles of their own: the least axis against the spacing at the centre."""
    spacing = zones.spacing(np.linalg.norm(placing.centre - site, axis=1))
    return placing.size.min(axis=1) >= RESOLVED * spacing


def listed(target: Target, materials: Materials, placing: Placing, zones: Zones) -> Particles:
    """The blocks as ``blocks.h5`` holds them."""
    density = float(materials.bulk_density[materials.index(placing.material)])
    return block_file.particles(target, placing, density, resolved(placing, zones, np.array(target.impact_point)))


def filled(
    body: Body,
    materials: Materials,
    matrix: Matrix,
    placing: Placing,
    zones: Zones,
    site: np.ndarray,
    weight: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[Body, dict[str, Any]]:
    """The body with its blocks, and what became of them in numbers; ``site`` (3,) [m] the impact point, ``weight`` the
    pressure (n,) [Pa] that particles of these masses (n,) [kg] begin with, None for none."""
    volume, total = body.mass / matrix.ground, float(body.mass.sum())
    own = resolved(placing, zones, site)
    block = _block_of(body.position, placing, own)
    inside, between = np.flatnonzero(block >= 0), np.flatnonzero(block < 0)
    listed, taken = float(placing.volume[own].sum()), float(volume[inside].sum())
    mass, material = np.empty(len(volume)), body.material.copy()
    material[inside] = materials.index(placing.material)
    mass[inside] = matrix.block * volume[inside] * (listed / taken if taken else 0.0)
    row = _mixture(body.position[between], volume[between], matrix, placing, own, zones, site)
    material[between] = row
    mass[between] = materials.bulk_density[row] * volume[between]
    mass[between] *= (total - float(mass[inside].sum())) / float(mass[between].sum())
    density, distention = materials.bulk_density[material], materials.rows.alpha0[material]
    if weight is not None:
        loaded(weight(mass), material, materials.rows, density, distention)
    facts = {
        "blocks": len(own),
        "resolved": int(own.sum()),
        "smallest_resolved_m": float(placing.size[own].min()) if own.any() else None,
        "unplaced": placing.unplaced,
        "volume_fraction": placing.fraction,
        "resolved_fraction": listed / placing.ground_volume,
        "homogenised_fraction": float(placing.volume[~own].sum()) / placing.ground_volume,
        "particles_in_blocks": len(inside),
        "volume_in_particles_over_listed": taken / listed if listed else None,
        "block_mass_kg": float(mass[inside].sum()),
        "matrix_density_kg_m3": matrix.density,
    }
    return body._replace(mass=mass, material=material, density=density, distention=distention, block=block), facts


def _block_of(position: np.ndarray, placing: Placing, own: np.ndarray) -> np.ndarray:
    """The resolved block (n,) in which the centre of each particle lies, -1 for none."""
    found = np.full(len(position), -1, dtype=np.int32)
    tree = cKDTree(position)
    for j in np.flatnonzero(own):
        near = np.array(tree.query_ball_point(placing.centre[j], 0.5 * placing.size[j].max()), dtype=np.int64)
        way = (position[near] - placing.centre[j]) / (0.5 * placing.size[j])
        found[near[np.einsum("ij,ij->i", way, way) <= 1.0]] = j
    return found


def _mixture(
    position: np.ndarray,
    volume: np.ndarray,
    matrix: Matrix,
    placing: Placing,
    own: np.ndarray,
    zones: Zones,
    site: np.ndarray,
) -> np.ndarray:
    """The row (n,) of the material of particles between the resolved blocks, by zones of similar spacing."""
    if len(matrix.rows) == 1:
        return np.full(len(position), matrix.rows[0], dtype=np.int32)
    distance = np.linalg.norm(position - site, axis=1)
    zone = _zone(zones.spacing(distance), zones)
    small = ~own
    away = np.linalg.norm(placing.centre[small] - site, axis=1)
    homogenised = np.bincount(
        _zone(zones.spacing(away), zones), weights=placing.volume[small], minlength=int(zone.max()) + 1
    )[: int(zone.max()) + 1]
    far = distance >= (placing.within or math.inf)
    room = np.bincount(zone[~far], weights=volume[~far], minlength=len(homogenised))
    wanted = matrix.density + (matrix.block - matrix.density) * homogenised / np.maximum(room, 1e-300)
    nearest = np.abs(matrix.densities[None] - wanted[:, None]).argmin(axis=1)[zone]
    nearest[far] = int(np.abs(matrix.densities - matrix.ground).argmin())
    return matrix.rows[nearest].astype(np.int32)


def _zone(spacing: np.ndarray, zones: Zones) -> np.ndarray:
    return np.floor(np.log(np.maximum(spacing / zones.contact, 1.0)) / math.log(_RATIO)).astype(np.int64)


def worded(placing: Placing, materials: Materials, target: Target, zones: Zones) -> str:
    """The blocks in words, for ``--check``. Raises ``InputError``."""
    own = resolved(placing, zones, np.array(target.impact_point))
    density = matrix_density(materials, target.layers[0].material, placing)
    parts = placing.volume / placing.ground_volume
    smallest = f", the smallest {readable.length(float(placing.size[own].min()))}" if own.any() else ""
    return (
        f"{len(own):,} block{'s' * (len(own) > 1)} of {placing.material} fill{'s' * (len(own) == 1)} "
        f"{placing.fraction:.3g} of the ground"
        + (f" ({placing.unplaced} found no room)" if placing.saturated else "")
        + f": {int(own.sum()):,} are {RESOLVED:g} spacings across or more{smallest}; the others, "
        f"{parts[~own].sum():.3g} of the ground's volume, are mixed into the matrix of {density:,.0f} kg/m^3. They "
        "add no particles"
    )
