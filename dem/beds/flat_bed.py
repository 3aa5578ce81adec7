"""The bed of flat ground: random or hexagonal packing, settled in a bowl, a box or a cylinder, with its report."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dem.beds import bed_files, bed_measures, extent, grading, grain_packing
from dem.beds.blocks import block_grains
from dem.beds.blocks.block_grains import BlockGrains
from dem.beds.blocks.block_settling import BlockSettling, LooseRoundBlocks, materials
from dem.beds.finishing import finish
from dem.beds.flat_ground import FlatGround
from dem.beds.flat_settling import FlatSettling
from dem.beds.loose_packing import LooseBed
from dem.beds.settings import Settings
from dem.contact.columns import RADIUS
from dem.grains.assembly import Assembly
from matter.blocks import block_file
from matter.errors import InputError
from matter.geometry.ground_region import OF_TARGET, Upright
from matter.particles import Particles
from matter.solids.placed import PATCH

MARGIN, COARSE = 3.0, 1.5
"""Local mean radii from the walls and the datum at which the bulk of graded grains begins, and the mean radius over
that at the impact from which on grains are coarse."""


def container_of(settings: Settings, ground: FlatGround) -> Upright:
    """The container that the settings ask for; ``InputError`` when the ground cannot hold it."""
    shape = OF_TARGET[ground.shape] if settings.shape == "auto" else settings.shape
    if shape == "cap":
        raise InputError(
            '[bed] shape = "cap" is for spherical targets; flat ground is filled as a bowl, a box or a cylinder'
        )
    radius = settings.arc_radius
    if shape == "bowl":
        if settings.depth is not None and settings.depth != radius:
            raise InputError(
                f"[bed] a bowl is as deep as its radius: leave depth out, or make it arc_radius = {radius:.6g} m"
            )
        depth = radius
    else:
        depth = (
            extent.depth(settings.impact.expected_transient_diameter, ground.depth)
            if settings.depth is None
            else settings.depth
        )
    if depth > ground.depth * (1.0 + 1e-9):
        raise InputError(
            f"[bed] the {shape} reaches {depth:.6g} m down, the ground of the target only {ground.depth:.6g} m"
        )
    top = settings.headroom_fraction * settings.impact.expected_transient_diameter
    species = settings.contact.species_of(ground.materials[int(ground.layer_of(np.array([-depth * 0.999]))[0])])
    return Upright(shape, radius, -depth, top, floor_species=species, side_species=species if shape == "bowl" else -1)


def maker(
    settings: Settings,
    ground: FlatGround,
    patch: Mapping[str, Any] | None = None,
    target: Path | None = None,
) -> Callable[[Path], None]:
    """Check the settings against the ground; what is returned makes the bed in a folder. ``patch``: what the ground is
    a patch of (``dem.beds.patch``), for report and grains to carry; ``target``: the ``target.json`` whose blocks the
    bed holds."""
    if not settings.contact.linear:
        raise InputError(
            f'[bed] flat ground is settled with springs of constant stiffness: normal = "{settings.contact.normal}" '
            f"is not for it"
        )
    container = container_of(settings, ground)
    return lambda out: make(settings, ground, container, out, patch, block_file.of_target(target) if target else None)


def _grains(
    settings: Settings, ground: FlatGround, container: Upright, blocks: Particles | None
) -> tuple[FlatSettling, grading.Grading, BlockGrains | None]:
    """Grains in the container before they settle, their sizes, and the blocks among them."""
    seed = np.random.SeedSequence(settings.seed)
    hexagonal, loose = settings.packing.startswith("hcp"), None
    limit, speed = bed_files.RESIDUAL_SPEED, settings.largest_speed
    if hexagonal:
        points, equal = grain_packing.hexagonal_in(settings.count, container, tilted=settings.packing == "hcp_tilted")
        radius, sizes = np.full(len(points), equal), grading.Grading(equal, container.radius, 0.0)
    else:
        loose = LooseBed.of_law(ground, container, settings.contact) if settings.packing == "loose" else None
        filled = grain_packing.FRACTION if loose is None else loose.mean(loose.fraction)
        sizes, _ = grading.solved(
            settings.count, settings.radius_spread, filled, container, settings.impact, settings.growth
        )
        points, radius = grain_packing.contained(settings.count, settings.radius_spread, container, sizes, seed)
        if loose is not None:
            raised = loose.raised(loose.radii(radius))
            points, radius = grain_packing.contained(
                settings.count, settings.radius_spread, raised, sizes, seed, loose.begins_at
            )
            radius = loose.radii(radius)
    large = None if blocks is None else block_grains.of_ground(blocks, block_file.digest(blocks), container, sizes)
    if large is not None and len(large.number) and loose is not None:
        about = LooseRoundBlocks.about(loose, large, radius)
        some = about.between(points, radius)
        return BlockSettling(points[some], radius[some], about, limit, settings.contact, speed), sizes, large
    work = FlatSettling(points, radius, ground, container, settings.contact, limit, hexagonal, speed, loose)
    return work, sizes, large


def make(
    settings: Settings,
    ground: FlatGround,
    container: Upright,
    out: Path,
    patch: Mapping[str, Any] | None = None,
    blocks: Particles | None = None,
) -> None:
    """``bed.vtkhdf``, ``bed_report.json``, ``bed.png`` in ``out``. Raises ``Unsound`` when the bed did not come to
    rest."""
    work, sizes, large = _grains(settings, ground, container, blocks)
    bed, facts = finish(work, out)
    edge = float(sizes.at(np.array([container.radius]))[0])
    width = bed_files.DAMPED_LAYERS * 2.0 * edge
    rate = 4.5 * bed_files.wave_speed(bed) / width if width > 0.0 else 0.0
    container = replace(container, damped_width=width, damping_rate=rate)
    report = report_of(bed, ground, container, {**facts, "inflation_of_gravity": work.inflation})
    report |= across_sizes(bed, container, sizes)
    if work.loose is not None:
        report["packing_fraction_meant"] = work.loose.mean(work.loose.fraction)
    of_body: dict[str, Any] = {} if patch is None else {PATCH: dict(patch)}
    report |= of_body
    names, fields = list(dict.fromkeys(ground.materials)), {}
    if large is not None:
        of_body |= {block_file.DIGEST: large.digest}
        fields = with_blocks(bed, container, sizes, large, report)
        names = materials(ground.materials, large) if fields else names
    bed_files.leave(
        bed,
        settings,
        report,
        out,
        lambda path: _picture(bed, container, report, path),
        fields=fields,
        frame="plane",
        materials=names,
        domain=container.as_attribute(),
        packing=settings.packing,
        grading=sizes.as_attribute(),
        **of_body,
    )


def with_blocks(
    bed: Assembly, container: Upright, sizes: grading.Grading, large: BlockGrains, report: dict[str, Any]
) -> dict[str, np.ndarray]:
    """The field ``block`` of the grains in the order of their identities (none where no block is a grain), and what
    the ``report`` says of blocks; solid fractions are those of the grains between them."""
    grains = bed.particles({}, tables=False)
    count = len(grains) - len(large.number)
    grains["block"] = np.full(len(grains), -1)
    grains["block"][count:] = large.number
    report["blocks"] = block_grains.facts(large, grains, report["mass_kg"])
    if len(large.number) == 0:
        return {}
    x, r, mean = grains.position, grains.radius, sizes.local(grains.position)
    room = np.minimum(container.depth_inside(x), -x[:, 2])
    bulk = room > MARGIN * mean
    which = {
        "packing_fraction": room > bed_measures.BULK_MARGIN * sizes.radius,
        "packing_fraction_fine": bulk & (mean == sizes.radius),
        "packing_fraction_coarse": bulk & (mean > COARSE * sizes.radius),
    }
    report |= {key: block_grains.packing_fraction(x, r, inner, grains.block) for key, inner in which.items()}
    return {"block": grains.block}


def report_of(bed: Assembly, ground: FlatGround, container: Upright, facts: dict[str, float]) -> dict[str, Any]:
    """Everything that says how good the bed is."""
    below = bed.headroom == 0
    z, rattlers = bed_measures.coordination(bed, below)
    inner = below & (container.side_depth(bed.position) > bed_measures.BULK_MARGIN * bed.mean_radius)
    inner &= (bed.position[:, 2] < -bed_measures.BULK_MARGIN * bed.mean_radius) & (
        bed.position[:, 2] > container.floor + bed_measures.BULK_MARGIN * bed.mean_radius
    )
    weight = float(bed.mass[below].sum() * ground.g)
    forces = bed_measures.wall_forces(bed)
    mass = bed_measures.ground_mass(ground, container)
    grains = float(np.sum(4.0 / 3.0 * np.pi * bed.X[below, RADIUS] ** 3))
    return {
        "grains": len(bed.X),
        "grains_headroom": int((~below).sum()),
        "mean_radius_m": bed.mean_radius,
        "packing_fraction": bed_measures.bulk_fraction(
            bed.position, bed.X[:, RADIUS], container, bed_measures.BULK_MARGIN * bed.mean_radius
        ),
        "packing_fraction_with_walls": grains / container.volume_between(container.floor, 0.0),
        "coordination_number": z,
        "coordination_number_bulk": bed_measures.coordination(bed, inner)[0] if inner.any() else float("nan"),
        "rattler_share": rattlers,
        "residual_speed_over_sqrt_g_r": bed_measures.residual(bed, ground.g),
        "mass_kg": float(bed.mass[below].sum()),
        "mass_error": float(bed.mass[below].sum() / mass - 1.0),
        "weight_N": weight,
        "wall_forces_N": forces.tolist(),
        "weight_carried": float(-forces[:, 2].sum() / weight),
        "floor_share": float(-forces[0, 2] / weight),
        "sideways_force_over_weight": float(np.hypot(*forces[:, :2].sum(axis=0)) / weight),
        "overlap": bed_measures.overlaps(bed),
        "time_step_s": bed.dt,
        **facts,
        "domain": container.as_attribute(),
    }


def across_sizes(bed: Assembly, container: Upright, sizes: grading.Grading) -> dict[str, Any]:
    """How grains grow, and whether coarse ones pack as fine ones do: the ``packing_fraction_fine`` within the fine
    radius and ``packing_fraction_coarse`` where grains are half as large again and more, in the bulk (``MARGIN`` of
    their own radii from walls and datum); nan where a zone has no bulk."""
    x, mean = bed.position, sizes.local(bed.position)
    bulk = np.minimum(container.depth_inside(x), -x[:, 2]) > MARGIN * mean
    fine, coarse = bulk & (mean == sizes.radius), bulk & (mean > COARSE * sizes.radius)
    return {
        "grading": sizes.as_attribute(),
        "radius_at_edge_m": float(sizes.at(np.array([container.radius]))[0]),
        "packing_fraction_fine": bed_measures.bulk_fraction_where(x, bed.X[:, RADIUS], fine),
        "packing_fraction_coarse": bed_measures.bulk_fraction_where(x, bed.X[:, RADIUS], coarse),
    }


def _picture(bed: Assembly, container: Upright, report: dict[str, Any], path: Path) -> None:
    from dem.beds import bed_pictures

    bed_pictures.flat_bed(bed, container, report, path)
