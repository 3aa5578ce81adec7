"""The transfer: a settled bed takes over the surface, the motion and the matter of a shock-physics cloud.

1. the source is split into compact material and ejecta, the surface drawn (``surface``);
2. grains outside the surface are carved away (``carve``);
3. each grain that stays takes velocity and spin from the compact particles around it (``interpolation``), material and
   bulk density from the nearest one, and the mass of the volume that it stands for; its size, too, where asked for
   (``loosened``);
4. masses are rescaled by one factor, velocities corrected by one field a + b x r, so that mass, linear and angular
   momentum of the bed's domain and the ejecta are those of the source (``correction``);
5. the ejecta are added as grains or put on the ballistic list (``ejecta``);
6. every grain is told what matter it stands for (``provenance``).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains import domain
from handoff.domains.whole_body import WholeBody
from handoff.source import cavity, cloud_surface, grain_size, heights, hydrostatic, offset
from handoff.transfer import bulking, carve, compare_clouds, grain_provenance, mapping
from handoff.transfer import correction as closing
from handoff.transfer import ejecta as ejected
from handoff.transfer.blocks.whole_blocks import WholeBlocks
from handoff.transfer.handed import Balance, Carving, Compact, Handoff, Mapped
from handoff.transfer.species import material_numbers, species_by_material
from matter.errors import InputError
from matter.geometry.alpha_shape import OffsetShape
from matter.particles import Particles
from matter.wording import readable

_COLUMNS = 2500
_WIDEST = 0.9
# matter slower than this fraction of the speed limit rests; resting above the headroom it may make up this fraction of
# the mass over the bed
_RESTING, _STANDING = 0.2, 2e-3


def hand_over(
    source: Particles,
    bed: Particles,
    rules: cloud_surface.Rules,
    column: hydrostatic.Column,
    region: domain.Domain | None = None,
    until: float = math.inf,
    blocks: WholeBlocks | None = None,
) -> Handoff:
    """Hand the ``source`` (SPH particles, along the axes of the bed: ``handoff.domains.turning``) over to the ``bed``
    (settled grains), split and drawn by the ``rules``, above the undisturbed ``column``; in the ``region`` (None: that
    of the bed's attributes), to a collapse that ends ``until`` [s] after the impact at the latest. Whole ``blocks``
    (``handoff.transfer.blocks``) count for the surface; what they become is not touched here.

    Raises ``InputError`` for inputs that cannot be handed over.
    """
    region = region or domain.read(bed.attributes)
    free = None if blocks is None else ~blocks.taken
    split, inner, beyond, tree, carving = _surface(source, bed, rules, column, region, free)
    compact, stays, volume = inner.indices, carving.stays, carving.volume
    density = cloud_surface.counted_density(source)
    held, volume_of = source.mass[compact] * inner.fraction, source.mass[compact] / density[compact]
    motion = region.flow(source.position[compact], source.velocity[compact])

    kept = np.flatnonzero(stays)
    near = _nearest(tree, bed.position[kept], None if free is None else free[compact])
    nearest = compact[near]
    grid = mapping.Overlap(carving.samples, carving.receiver, tree.data, bed.position, kept)
    plain_mass = density[nearest] * volume[kept]
    raw_mass = mapping.locally_closed(plain_mass, tree, held, grid)
    packing = float(np.sum(4.0 / 3.0 * np.pi * bed.radius[kept] ** 3) / volume[kept].sum())
    shrink = _shrink(source, compact, grid, near, bed, kept) if rules.loosened == "shrunk" else None
    carved = _carved(bed, stays, source, nearest, density[nearest], shrink)

    ejecta = np.flatnonzero(~split.compact if free is None else ~split.compact & free)
    flying = ejected.from_source(source, ejecta, carved, packing, region, column, until, rules)
    handed = inner if free is None else inner.among(free)
    before, outside, airborne, ground_mass, energy = _budget(source, handed, beyond, ejecta, flying, region, blocks)
    position, radius, scale = bed.position[kept], carved.radius, ground_mass / raw_mass.sum()
    turning = region if isinstance(region, WholeBody) else None
    energy = closing.sums(held, source.position[compact], motion).kinetic if turning else energy
    taken = mapping.motion(tree, motion, volume_of, held, grid, raw_mass * scale, radius, energy, volume[kept], near)
    velocity, moving = taken.velocity, (held, motion, taken.own_gradient)
    fields = compare_clouds.fields_of(bed, kept, carving.samples, carving.receiver, moving, raw_mass, velocity, volume)
    velocity, spin = region.inertial(position, velocity, taken.spin)
    raw = _of(region, raw_mass, position, velocity, radius, spin) + airborne
    mass = raw_mass * scale
    mass *= (before.mass - airborne.mass) / mass.sum()
    moved, after = _closed(region, mass, position, velocity, radius, spin, before, airborne)
    filled = volume[kept] * (radius / bed.radius[kept]) ** 3  # what a grain fills, from here on
    for name, values in dict(velocity=moved, angular_velocity=spin, mass=mass, density=mass / filled).items():
        carved[name] = values
    start = _start(carved, bed, source, stays, flying, region, _first_identity(bed, blocks))
    origins = grain_provenance.taken(source, compact, held, grid, near, flying.source)
    grain_provenance.give(start, source, region, origins)
    plain = float(plain_mass.sum() + airborne.mass)
    mapped = Mapped(taken.own_gradient, taken.fraction, fields, moved - velocity, scale, plain)
    sums = Balance(before, outside, raw, after)
    energies = (energy, _energy_against(turning, mass, position, moved, radius, spin)) if turning else None
    return Handoff(start, split, inner, carving, mapped, flying, sums, region, energies, blocks)


def _surface(
    source: Particles, bed: Particles, rules: cloud_surface.Rules, column: hydrostatic.Column, region: domain.Domain,
    free: np.ndarray | None,
) -> tuple[cloud_surface.Split, Compact, np.ndarray, cKDTree, Carving]:  # fmt: skip
    """The split into compact matter and ejecta, the compact matter as from ``_compact``, and what its surface leaves
    of the bed. Particles that are not ``free`` count for the surface alone."""
    carve.check(bed, region)
    split, shape, corners = cloud_surface.classify(source, region, column, rules)
    inner, beyond, tree = _compact(source, split, region)
    carving = _carving(source, bed, region, rules, (split, shape, corners), inner, tree, free)
    if free is not None:
        inner = replace(inner, fraction=np.where(free[inner.indices], inner.fraction, 0.0))
        beyond = beyond[free[beyond]]
    return split, inner, beyond, tree, carving


def _budget(
    source: Particles, handed: Compact, beyond: np.ndarray, ejecta: np.ndarray, flying: ejected.Ejecta,
    region: domain.Domain, blocks: WholeBlocks | None,
) -> tuple[closing.Sums, closing.Sums, closing.Sums, float, float]:  # fmt: skip
    """Sums of what is handed over, of what stays outside and of what is airborne, whole blocks with the first and the
    last; mass [kg] and kinetic energy [J] that the grains of the ground take over."""
    before, outside = _sums(source, handed, beyond, ejecta, region)
    airborne = _of(region, flying.mass, flying.position, flying.velocity)
    mass, energy = before.mass - airborne.mass, before.kinetic - airborne.kinetic
    if blocks is not None:
        before, airborne = before + blocks.before, airborne + blocks.after
    return before, outside, airborne, mass, energy


def _first_identity(bed: Particles, blocks: WholeBlocks | None) -> int:
    """The first identity that neither the bed nor a block has."""
    return 1 + max(int(some.identity.max(initial=0)) for some in (bed, *([] if blocks is None else [blocks.grains])))


def _energy_against(region: WholeBody, mass, position, velocity, radius, spin) -> float:
    """Kinetic energy [J] of grains against the turning ground."""
    return closing.sums(mass, position, region.flow(position, velocity), radius, spin - region.omega).kinetic


def _closed(
    region: domain.Domain, mass: np.ndarray, position: np.ndarray, velocity: np.ndarray, radius: np.ndarray,
    spin: np.ndarray, before: closing.Sums, airborne: closing.Sums,
) -> tuple[np.ndarray, closing.Sums]:  # fmt: skip
    """Velocities (n, 3) [m/s] with the field that closes momentum and angular momentum, and the sums with them."""
    moved = velocity.copy()
    for _ in range(2):  # the second pass takes away the rounding of the first
        now = _of(region, mass, position, moved, radius, spin) + airborne
        moved += closing.closing_field(mass, position, before.momentum - now.momentum, before.angular - now.angular)
    return moved, _of(region, mass, position, moved, radius, spin) + airborne


def _nearest(tree: cKDTree, points: np.ndarray, free: np.ndarray | None) -> np.ndarray:
    """Index of the particle of the ``tree`` that is nearest to each point, among those that are ``free``."""
    if free is None:
        return np.asarray(tree.query(points)[1])
    some = np.flatnonzero(free)
    return some[cKDTree(tree.data[some]).query(points)[1]]


def _of(region: domain.Domain, mass, position, velocity, radius=None, spin=None) -> closing.Sums:
    return closing.sums(mass, position, velocity, radius, spin, region.pace(position, velocity))


def _compact(
    source: Particles, split: cloud_surface.Split, region: domain.Domain
) -> tuple[Compact, np.ndarray, cKDTree]:
    """The compact matter of the source between the floor and the top of the domain, the indices in the source of that
    beyond them, and a tree of the former."""
    everything = np.flatnonzero(split.compact)
    # matter beyond the floor (the core) is another body to the grains: they slide on it and take nothing from it
    within = region.between(source.position[everything])
    compact, beyond = everything[within], everything[~within]
    if len(compact) < mapping.LEAST_NEIGHBOURS:
        raise InputError("no compact material of the source lies inside the bed's domain: do they share a frame?")
    tree, numbers = cKDTree(source.position[compact]), np.arange(len(compact))
    fraction, centre = cloud_surface.fraction_inside(
        source.position[compact], split.spacing[compact], region, tree, numbers
    )
    if not np.any(fraction > 0.0):
        raise InputError("no compact material of the source lies inside the bed's domain: do they share a frame?")
    return Compact(compact, fraction, centre), beyond, tree


def _carving(
    source: Particles,
    bed: Particles,
    region: domain.Domain,
    rules: cloud_surface.Rules,
    classified,
    inner: Compact,
    tree,
    free: np.ndarray | None = None,
) -> Carving:
    """The solid below the surface and what it leaves of the bed; ``classified`` as from ``surface.classify``, ``tree``
    of the indices ``inner``. Points of particles that are not ``free`` (n,) go to no grain."""
    split, shape, corners = classified
    volume_of = source.mass[inner.indices] / cloud_surface.counted_density(source)[inner.indices]
    part = float(np.sum(inner.fraction * volume_of)) / region.volume
    coarse, grains = 2.0 * grain_size.at_impact(bed), cKDTree(bed.position)
    solid, factor = offset.by_one_factor(
        shape, split.spacing[corners], offset.even_points(region), part, rules, coarse
    )
    alike = float(np.sum((bed.radius / grain_size.at_impact(bed)) ** 3))
    points = carve.even_samples(region, tree, grains, alike)
    if rules.offset == "auto":
        solid = offset.point_by_point(
            solid,
            split.spacing[corners],
            tree.data,
            inner.fraction * volume_of,
            points.position,
            points.particle,
            region,
        )
    samples = carve.finer(points, region, tree, grains, volume_of).within(solid)
    stays = carve.keep(bed, solid, region)
    receiver = carve.receivers(bed, stays, samples)
    if free is not None:
        receiver[~free[inner.indices[samples.particle]]] = -1
    volume = carve.grain_volumes(bed, stays, receiver, samples)
    size, columns = _cavity(solid, stays, grains, region, bed)
    _refuse_misfit(size, source, split, region, rules, bed, free)
    return Carving(solid, factor, stays, volume, samples, receiver, size, columns)


def _sums(
    source: Particles, inner: Compact, beyond: np.ndarray, ejecta: np.ndarray, region: domain.Domain
) -> tuple[closing.Sums, closing.Sums]:
    """Mass, momenta and energy of what is handed over (with the ejecta ``ejecta``), and of what stays outside."""
    m, x, v, compact = source.mass, source.position, source.velocity, inner.indices
    before = _of(region, m[compact] * inner.fraction, inner.centre, v[compact])
    outside = _of(region, m[compact] * (1.0 - inner.fraction), x[compact], v[compact])
    return before + _of(region, m[ejecta], x[ejecta], v[ejecta]), outside + _of(
        region, m[beyond], x[beyond], v[beyond]
    )


def _cavity(solid: OffsetShape, stays: np.ndarray, grains: cKDTree, region: domain.Domain, bed: Particles):
    foot, distance, height = heights.surface_heights(solid.contains, region, _COLUMNS)

    def held(points: np.ndarray) -> np.ndarray:
        return carve.filled(stays, grains.query(points)[1], points, region)

    carved = heights.surface_heights(held, region, _COLUMNS)[2]

    def heights_in(part: domain.Domain) -> tuple[np.ndarray, np.ndarray]:
        return (foot, height) if part is region else heights.surface_heights(solid.contains, part, _COLUMNS)[::2]

    size = cavity.seek(heights_in, region, noise=cavity.RESOLVED_DEPTH * grain_size.at_impact(bed))
    return size, (foot, distance, height, carved)


def _refuse_misfit(
    size: cavity.Cavity,
    source: Particles,
    split: cloud_surface.Split,
    region: domain.Domain,
    rules: cloud_surface.Rules,
    bed: Particles,
    free: np.ndarray | None,
) -> None:
    radius = grain_size.at_impact(bed)
    if size.radius == 0.0 and rules.crater == "required":
        raise InputError(
            f"no crater: the compact surface lies nowhere deeper than two grain radii "
            f"({readable.length(2.0 * radius)}) below the datum near the axis"
        )
    if size.radius > _WIDEST * region.arc:
        raise InputError(
            f"the crater (radius {readable.length(size.radius)}) is wider than {_WIDEST:.0%} of the bed "
            f"({readable.length(region.arc)}): "
            "take a wider bed or an earlier snapshot"
        )
    if isinstance(region, WholeBody):  # what has risen goes to the grains below it
        return
    frame, headroom = region.frame, region.span[1]
    height = frame.height(source.position)
    over = region.cut_depth(source.position - height[:, None] * frame.up(source.position)) > 0.0
    resting = np.linalg.norm(source.velocity, axis=1) < _RESTING * split.speed_limit
    resting_high = (height > headroom) & over & resting & (split.reason != cloud_surface.SPARSE)
    if free is not None:
        resting_high &= free
    if source.mass[resting_high].sum() > _STANDING * source.mass[split.compact & over].sum():
        raise InputError(
            f"{np.count_nonzero(resting_high)} particles rest higher than the bed's headroom "
            f"({readable.length(headroom)}): give the bed more headroom"
        )


def _carved(
    bed: Particles, stays: np.ndarray, source: Particles, nearest: np.ndarray, density, shrink: np.ndarray | None
) -> Particles:
    """The grains that stay, of the material and density of their ``nearest`` particles; ``shrink``: radii over those
    in the bed."""
    carved = bed.select(stays)
    if shrink is not None:
        carved["radius"] = carved.radius * shrink
    names, table = material_numbers(source, bed)
    carved["material"] = table[np.clip(source.material[nearest], 0, len(table) - 1)]
    if "species" in bed:
        carved["species"] = species_by_material(bed, names)[carved.material]
    carved["density"] = density
    carved.attributes["materials"] = names
    return carved


def _shrink(source: Particles, compact: np.ndarray, grid: mapping.Overlap, near, bed: Particles, kept) -> np.ndarray:
    """Radius over that in the bed (k,) of the ``kept`` grains, by how loose the matter is that each stands for."""
    undisturbed = bed.density[kept] if "density" in bed else None
    reference = cloud_surface.reference_density(source)[compact]
    fraction = bulking.packed_fraction(
        cloud_surface.counted_density(source)[compact], reference, grid, near, undisturbed
    )
    return bulking.radius_factor(fraction)


def _start(
    carved: Particles,
    bed: Particles,
    source: Particles,
    stays,
    flying: ejected.Ejecta,
    region: domain.Domain,
    first: int,
) -> Particles:
    """The carved bed and the ejecta, of identities from ``first`` on, as one set of grains; every field of the bed is
    carried."""
    count, extra = len(carved), len(flying.mass)
    names, table = material_numbers(source, bed)
    material = table[np.clip(source.material[flying.source], 0, len(table) - 1)]
    reference = float(np.median(carved.mass))
    tail = {
        "identity": first + np.arange(extra),
        "position": flying.position,
        "velocity": flying.velocity,
        "angular_velocity": np.zeros((extra, 3)),
        "mass": flying.mass,
        "radius": flying.radius,
        "material": material,
        "density": flying.density,
        "headroom": np.zeros(extra, dtype=np.int8),
        "species": species_by_material(bed, names)[material],
        "state": flying.state,
    }
    head = {name: carved[name] for name in carved}
    head |= {name: np.zeros(count, dtype=np.int8) for name in ("headroom", "state")}
    if "stiffness" in bed:
        softest = float(np.min(carved.stiffness))
        tail["stiffness"] = np.minimum(1.0, flying.mass / reference) * softest
    fields = {}
    for name, values in head.items():
        if name in tail:
            fields[name] = np.concatenate([values, tail[name]])
        elif extra == 0:
            fields[name] = values
        else:
            raise InputError(f"the bed carries the field {name!r}, which ejecta have no value for")
    attributes = {
        **bed.attributes,
        "materials": names,
        "stage": "handoff",
        "time": float(source.attributes.get("time", 0.0)),
    }
    attributes["bed_grains"] = first  # identities from here on are ejecta
    tables = bulking.contacts_kept(carve.surviving_tables(bed, stays), bed.select(stays), carved.radius, region)
    return Particles(fields, attributes, tables)
