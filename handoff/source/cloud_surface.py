"""What of a shock-physics cloud is compact material, what is ejecta, and where the compact material ends.

Ejecta, by the first rule that holds (``REASONS``):

* ``sparse``: a particle that has lost its neighbours;
* ``expanded``: density below ``SPARSEST`` of its material's reference density, and it moves away from the ground along
  the local vertical, or is above it already (by half a spacing). Expanded matter that sinks below the datum goes with
  the floor: it is debris that settles there, and counts as compact at ``SPARSEST`` of its reference density;
* ``fast``: faster than the speed limit, rising, and in free flight it would come above the datum. Material below the
  cavity that is driven down or sideways faster than the limit is confined by what lies around it and stays compact;
* ``high``: above the ground already (by half a spacing), and in free flight it would rise beyond the bed's headroom.
  Ground that moves up is pushed by what lies below it and held by what lies above it: no free flight, however weak
  gravity is;
* ``detached``: not a corner of the largest piece of the alpha-shape of what the rules above left.

How far outside the alpha-shape's particles the surface runs says ``handoff.source.offset``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.spatial import cKDTree

from handoff.domains.domain import Domain
from handoff.source import free_flight, speed_limit
from handoff.source.hydrostatic import Column
from matter.case import at_rest, material
from matter.case.body import Model
from matter.case.quantity import PositiveSpeed
from matter.errors import InputError
from matter.geometry.alpha_shape import AlphaShape, alpha_shape
from matter.particles import Particles
from matter.points import sobol
from matter.wording import readable

REASONS = ("compact", "sparse", "expanded", "fast", "high", "detached")
COMPACT, SPARSE, EXPANDED, FAST, HIGH, DETACHED = range(6)
SPARSEST = 0.5
"""Fraction of its packed density at which matter still counts as compact; what is sparser and yet compact is counted
as if it had this much."""
LONELY = 6
"""A particle with fewer neighbours inside its support is ejecta (a full support of 2 spacings holds about 33)."""
# m, kg, kg/m^3 against cm, km, g or g/cm^3 is a factor of 1000 at least; a body with a crater lies within 5 of 1
_UNITS = 50.0
# in spacings above the datum: what is higher has left the ground
_ABOVE = 0.5
_CELL_POINTS = 128
# particles this many spacings beyond the side walls still shape the surface inside
_AROUND = 8.0


class Rules(Model):
    """How the source is split and its surface drawn."""

    speed_limit: PositiveSpeed | Literal["auto"] = "auto"
    """Rising material above it is ejecta; ``auto``: sqrt(2 g headroom), the speed that just reaches the top of the
    bed; on flat ground cavity radius over time where that is more (``handoff.source.speed_limit``)."""
    alpha: float = Field(1.5, gt=0.8, le=5.0)
    """Alpha of the alpha-shape in local particle spacings (0.8 is the least that keeps a close-packed lattice
    whole)."""
    offset: float | Literal["auto"] = "auto"
    """Distance of the surface outside its particles, in local spacings (0 ... 1); ``auto`` closes volume against mass
    over density, point by point."""
    loosened: Literal["full_size", "shrunk"] = "shrunk"
    """Grains that stand for matter which the flow has dilated: ``shrunk``, as small as the matter is when packed
    (``handoff.transfer.bulking``); ``full_size``, as in the bed, so that the matter keeps its dilated volume. With
    ``method = "direct"`` it counts for the mapped grains that the report compares."""
    crater: Literal["required", "any"] = "required"
    """``required``: stop when there is no crater; ``any``: for control runs without an impact."""


@dataclass(frozen=True)
class Split:
    """The source, classified: ``reason`` (n,) indexes ``REASONS``; ``speed_limit`` [m/s] in use; ``spacing`` (n,)
    [m]."""

    reason: np.ndarray
    speed_limit: float
    spacing: np.ndarray

    @property
    def compact(self) -> np.ndarray:
        return self.reason == COMPACT

    def counts(self) -> dict[str, int]:
        """Number of particles by the reason for which they are compact or ejecta."""
        return {name: int(np.count_nonzero(self.reason == code)) for code, name in enumerate(REASONS)}


def check(source: Particles) -> None:
    """Refuse a source that lacks a field or holds values that are not finite. Raises ``InputError``."""
    source.need("position", "velocity", "mass", "density", "material")
    for name in source:
        bad = ~np.isfinite(source[name]).reshape(len(source), -1).all(axis=1)
        if bad.any():
            first = int(np.flatnonzero(bad)[0])
            who = int(source.identity[first]) if "identity" in source else first
            raise InputError(
                f"the source's field {name!r} is not finite for {bad.sum()} of {len(source)} particles (first: "
                f"particle {who})"
            )
    for name in ("mass", "density"):
        if np.any(source[name] <= 0.0):
            raise InputError(
                f"the source's field {name!r} is not positive for {int(np.sum(source[name] <= 0.0))} particles"
            )
    _check_units(source)


def _check_units(source: Particles) -> None:
    """Refuse a source whose volumes, mass over density, are far from the room that its particles take: its columns are
    in units that do not belong together. The room is that of the middle 80 % of the mass along each axis, which ejecta
    hardly widen; of the number it would be that of the finest particles, which may be most of them."""
    room, volume = 1.0, float(np.sum(source.mass / source.density))
    for axis in range(3):
        order = np.argsort(source.position[:, axis])
        room *= float(
            np.ptp(
                np.interp((0.1, 0.9), np.cumsum(source.mass[order]) / source.mass.sum(), source.position[order, axis])
            )
        )
    if room > 0.0 and not 1.0 / _UNITS < volume / room < _UNITS:
        raise InputError(
            f"mass over density gives the source's particles {readable.volume(volume)}, and they fill about "
            f"{readable.volume(room)} of space: "
            f"positions, masses and densities are in mixed units (SI is needed)"
        )


def spacing_of(source: Particles) -> np.ndarray:
    """Local particle spacing (mass / ``counted_density``)^(1/3) [m]; never above three quarters of the kernel's
    support where that is known."""
    spacing = np.cbrt(source.mass / counted_density(source))
    return np.minimum(spacing, 0.75 * source.support_radius) if "support_radius" in source else spacing


def neighbour_count(source: Particles, spacing: np.ndarray) -> np.ndarray:
    """Number of other particles within two spacings: the field ``neighbours`` where the source carries it."""
    if "neighbours" in source:
        return source.neighbours
    tree = cKDTree(source.position)
    return tree.query_ball_point(source.position, 2.0 * spacing, return_length=True) - 1


def solid_densities(source: Particles, names: Sequence[str]) -> list[float]:
    """Density at rest of the solid of each material of ``names`` [kg/m^3]; zero where it is not known here.

    What the shock stage computed with (attribute ``reference_densities_kg_m3``, by material), a case's own value
    included; of a material for which the source does not say so, that of its file.
    """
    known = material.names()
    table = {name: at_rest.of_file(name).solid if name in known else 0.0 for name in names}
    own = dict(zip(source.attributes.get("materials", []), source.attributes.get("reference_densities_kg_m3") or []))
    return [float(own.get(name, table[name])) for name in names]


def reference_density(source: Particles) -> np.ndarray:
    """Reference density of each particle's material with the pores it has [kg/m^3], as its volume is counted: of
    ground that was laid flat in the flat frame, so that the widths of a curved body are no loosening; zero where the
    material is not known here."""
    names = source.attributes.get("materials", [])
    table = np.array(solid_densities(source, names) or [0.0])
    solid = np.where(source.material < len(table), table[np.clip(source.material, 0, len(table) - 1)], 0.0)
    if "distention" in source:
        solid = solid / source.distention
    return solid * source.widening if "widening" in source else solid


def counted_density(source: Particles) -> np.ndarray:
    """Density [kg/m^3] by which the room of a particle's matter is counted, mass over density: its own, and at least
    ``SPARSEST`` of its reference. Room beyond that is void, which no grain fills."""
    return np.maximum(source.density, SPARSEST * reference_density(source))


def by_motion(source: Particles, domain: Domain, column: Column, rules: Rules) -> Split:
    """Split the source by the rules that need no surface (all but ``detached``). Raises ``InputError`` for an unusable
    source."""
    check(source)
    height = domain.frame.height(source.position)
    speed = np.linalg.norm(domain.flow(source.position, source.velocity), axis=1)
    upward = free_flight.rising(domain, source.position, source.velocity)
    headroom = domain.span[1]
    apex = free_flight.apex(domain, column, source.position, source.velocity)
    spacing = spacing_of(source)
    reason = np.zeros(len(source), dtype=np.int8)
    above = height > _ABOVE * spacing
    reason[(apex > headroom) & above] = HIGH
    sparser = source.density < SPARSEST * reference_density(source)
    loose = np.where(sparser & ((upward > 0.0) | above), EXPANDED, COMPACT)
    loose[neighbour_count(source, spacing) < LONELY] = SPARSE
    if rules.speed_limit == "auto":
        kept = (reason == COMPACT) & (loose == COMPACT)
        limit = speed_limit.default(
            source.position[kept],
            spacing[kept],
            float(source.attributes.get("time", 0.0)),
            domain,
            column.surface_gravity,
        )
    else:
        limit = float(rules.speed_limit)
    reason[(speed > limit) & (upward > 0.0) & (apex > 0.0)] = FAST
    reason = np.where(loose != COMPACT, loose, reason).astype(np.int8)
    return Split(reason, limit, spacing)


def classify(source: Particles, domain: Domain, column: Column, rules: Rules) -> tuple[Split, AlphaShape, np.ndarray]:
    """Split the source; also the alpha-shape of its compact material in and around the domain (the largest piece), and
    the indices in the source of the points of that shape.

    Raises ``InputError`` when nothing compact is left, or when the projectile has not hit yet.
    """
    split = by_motion(source, domain, column, rules)
    _refuse_incoming(source, domain, split.speed_limit)
    reason, spacing = split.reason, split.spacing
    left = np.flatnonzero(split.compact)
    if len(left) < 4:
        raise InputError(
            f"all {len(source)} particles of the source are ejecta (speed limit {split.speed_limit:.4g} m/s): there "
            f"is no surface to carve with"
        )
    left = left[_around(source.position[left], spacing[left], domain)]
    if len(left) < 4:
        raise InputError("no compact material of the source lies inside the bed's domain: do they share a frame?")
    shape = alpha_shape(
        source.position[left], spacing[left], rules.alpha, fill_below=float(np.median(spacing[left]) ** 3)
    )
    reason[left[shape.members != 0]] = DETACHED
    return split, shape.only(1), left


def _around(position: np.ndarray, spacing: np.ndarray, domain: Domain) -> np.ndarray:
    """Mask of the points that the surface inside the domain depends on: those inside its side walls and as far around
    as a piece may reach."""
    return domain.cut_depth(position) > -_AROUND * spacing


def _refuse_incoming(source: Particles, domain: Domain, limit: float) -> None:
    if "layer" not in source:
        _refuse_falling(source, domain, limit)
        return
    projectile = source.layer < 0
    if not projectile.any():
        return
    position, velocity = source.position[projectile], source.velocity[projectile]
    mass = source.mass[projectile]
    downward = -free_flight.rising(domain, position, velocity)
    incoming = (domain.frame.height(position) > 0.0) & (downward > limit)
    if mass[incoming].sum() > 0.5 * mass.sum():
        raise InputError(
            f"the projectile is still above the surface: {mass[incoming].sum() / mass.sum():.0%} of it flies "
            f"downwards; take a later snapshot"
        )


def _refuse_falling(source: Particles, domain: Domain, limit: float) -> None:
    """Where no field says what the projectile is: what falls from above the datum, faster than the limit, must not
    carry most of the energy."""
    downward = -free_flight.rising(domain, source.position, source.velocity)
    flow = domain.flow(source.position, source.velocity)
    energy = source.mass * np.einsum("ij,ij->i", flow, flow)
    falling = (domain.frame.height(source.position) > 0.0) & (downward > limit)
    if energy[falling].sum() > 0.5 * energy.sum() > 0.0:
        raise InputError(
            f"{energy[falling].sum() / energy.sum():.0%} of the kinetic energy falls from above the datum: the "
            f"projectile is still above the surface; "
            "take a later snapshot"
        )


def fraction_inside(
    position: np.ndarray, spacing: np.ndarray, domain: Domain, owner: cKDTree, owners: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which part of each particle's matter lies inside the domain, and where its centre is.

    A particle near a face that cuts through matter is represented by its Voronoi cell: the points of a ball of one
    spacing that are nearer to it than to any other particle. At a face that is an interface the centre decides:
    particles of either side keep off it. ``owner`` is the tree over all compact particles, ``owners`` (n,) the indices
    in it of the ones asked for. Returns the fraction (n,) in [0, 1] and the centroid (n, 3) [m] of the part inside.
    """
    between, cut = domain.between(position), domain.cut_depth(position)
    fraction, centre = (between & (cut > 0.0)).astype(float), position.copy()
    crossing = np.flatnonzero(between & (np.abs(cut) < spacing))
    cloud = sobol.stream(1).random(_CELL_POINTS)
    radius, cosine, azimuth = np.cbrt(cloud[:, 0]), 2.0 * cloud[:, 1] - 1.0, 2.0 * np.pi * cloud[:, 2]
    sine = np.sqrt(1.0 - cosine**2)
    ball = radius[:, None] * np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)
    for begin in range(0, len(crossing), 4096):
        rows = crossing[begin : begin + 4096]
        points = (position[rows, None] + spacing[rows, None, None] * ball).reshape(-1, 3)
        mine = (owner.query(points)[1].reshape(len(rows), -1)) == owners[rows, None]
        inside = (domain.cut_depth(points) > 0.0).reshape(mine.shape) & mine
        count = inside.sum(axis=1)
        fraction[rows] = count / np.maximum(mine.sum(axis=1), 1)
        mean = np.einsum("ik,ikj->ij", inside, points.reshape(len(rows), -1, 3)) / np.maximum(count, 1)[:, None]
        centre[rows] = np.where(count[:, None] > 0, mean, position[rows])
    return fraction, centre
