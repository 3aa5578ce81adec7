"""Rows of the ledger on the cavity: its size in grains; its surface, volume, depth and rim before and after."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from handoff.domains import domain
from handoff.domains.whole_body import WholeBody
from handoff.ledger import LIMITS, SCATTER, Ledger, height_scatter, volume_limit, volume_scatter
from handoff.source import grain_size
from handoff.source.cloud_surface import Rules
from handoff.source.offset import by_one_factor
from handoff.transfer import carve, compare_clouds
from handoff.transfer.handed import Handoff
from matter.errors import InputError
from matter.geometry.alpha_shape import alpha_shape
from matter.particles import Particles
from matter.points.packing import hexagonal
from matter.wording import readable

FLOOR, RIM = 0.5, (1.0, 1.6)
"""In cavity radii: how far the floor goes, and from where to where the rim."""
NEARLY_ALL = 0.99
"""Part of a surface's area that lies within the partial Hausdorff distance of the other (Huttenlocher et al. 1993,
IEEE PAMI 15, 850, eq. 6). The plain distance is that of the one worst grain among thousands: another draw of the bed
moves it by a quarter of a radius."""
_CALIBRATION = 60_000


def nearly_all(distance: np.ndarray, area: np.ndarray) -> float:
    """Distance [m] within which ``NEARLY_ALL`` of the area lies."""
    return float(np.quantile(distance, NEARLY_ALL, weights=area, method="inverted_cdf"))


def grain_surface(handoff: Handoff, bed: Particles, chosen: Callable[[np.ndarray], np.ndarray], wider: np.ndarray):
    """Surface of the carved bed (a mesh): the alpha-shape of the grains that stay, at the offset at which it holds,
    among the ``chosen`` sample points, as many as the cells of these grains. Its radius is one grain spacing: what a
    further grain would touch. Only grains in ``wider`` (mask over the bed) are looked at."""
    taken = handoff.carving.stays & wider
    centre, spacing = bed.position[taken], np.cbrt(handoff.carving.volume[taken])
    if handoff.blocks is not None:
        within = _in_blocks(handoff.blocks.grains, float(spacing.mean()))
        centre, spacing = np.concatenate([centre, within]), np.append(spacing, np.full(len(within), spacing.mean()))
    shape = alpha_shape(centre, spacing, 1.0, fill_below=4.0 * spacing**3).only(1)
    samples, here = handoff.carving.samples, chosen(handoff.carving.samples.position)
    position = samples.position[here]
    fraction = float(np.mean(carve.filled(handoff.carving.stays, samples.grain[here], position, handoff.region)))
    return by_one_factor(shape, spacing, position[:_CALIBRATION], fraction, Rules())[0].mesh


def _in_blocks(blocks: Particles, spacing: float) -> np.ndarray:
    """Points (n, 3) [m] in the whole blocks, half as far apart as grains: a block is no hollow of the bed."""
    points = [
        centre + hexagonal(0.5 * spacing, float(radius), rotate=False)
        for centre, radius in zip(blocks.position, blocks.radius)
    ]
    return np.concatenate([np.empty((0, 3)), *points])


def enter(ledger: Ledger, handoff: Handoff, bed: Particles, region: domain.Domain) -> None:
    """The rows on the cavity: grains per radius, distance of the two surfaces, volume below the datum."""
    radius = grain_size.at_impact(bed)
    size = handoff.carving.size
    if size.radius == 0.0:
        for name in [name for name in LIMITS if name.startswith("cavity_")]:
            ledger.skip(name, "not_applicable", "there is no cavity")
        return
    ratio = size.radius / radius
    ledger.measure(
        "cavity_radius_over_r_DEM_min",
        ratio,
        f"radius {readable.length(size.radius)}, depth {readable.length(size.depth)}, grains "
        f"{readable.length(radius)}",
    )
    if not isinstance(region, WholeBody):
        ledger.state("bed_radii", region.arc / size.radius, "1", "radius of the bed over that of the cavity")
    margin = 3.0 * radius

    def chosen(points: np.ndarray) -> np.ndarray:
        return (size.distance(points, region) < 1.5 * size.radius) & (region.depth_inside(points) > margin)

    # all of a whole body: in its middle the nearest point of the datum changes sides
    wider = size.distance(bed.position, region) < 1.8 * size.radius
    wider |= isinstance(region, WholeBody)
    try:
        mesh = grain_surface(handoff, bed, chosen, wider)
        there, there_area, back, back_area = compare_clouds.surface_distance(handoff.carving.solid.mesh, mesh, chosen)
    except InputError as reason:
        ledger.skip("cavity_hausdorff_over_r", "not_measured", str(reason))
    else:
        both, area = np.r_[there, back] / radius, np.r_[there_area, back_area]
        ledger.measure(
            "cavity_hausdorff_over_r",
            max(nearly_all(there, there_area), nearly_all(back, back_area)) / radius,
            f"partial Hausdorff distance ({NEARLY_ALL:.0%} of the area of either surface); rms "
            f"{np.sqrt(np.average(both**2, weights=area)):.3f}, largest {both.max():.3f}",
        )
    spacing = float(np.cbrt(handoff.carving.volume[handoff.carving.stays & wider].mean()))
    cut = (spacing, size.radius, size.depth, size.volume)
    empty, carved = _hollow(handoff, 0.0, 1.0)
    scatter = volume_scatter(*cut)
    ledger.measure(
        "cavity_volume_rel",
        abs(carved / empty - 1.0) if empty > 0.0 else np.inf,
        f"below the datum: source {readable.volume(empty)}, bed {readable.volume(carved)}; at {ratio:.1f} grains per "
        f"cavity radius another draw of the bed "
        f"moves it by {scatter:.1%}",
        bound=volume_limit(*cut),
    )
    _heights(ledger, handoff, cut[0], radius)


def _hollow(handoff: Handoff, inner: float, outer: float) -> tuple[float, float]:
    """Volume [m^3] between datum and surface in a ring, edges in cavity radii, of the source and of the carved bed;
    net of what stands above the datum: a rough but level surface has no volume."""
    size, region, samples = handoff.carving.size, handoff.region, handoff.carving.samples
    away = size.distance(samples.position, region) / size.radius
    here = (away >= inner) & (away < outer)
    sign = np.where(region.frame.height(samples.position[here]) < 0.0, 1.0, -1.0)
    held = carve.filled(handoff.carving.stays, samples.grain[here], samples.position[here], region)
    empty, carved = (
        float((sign * samples.weight[here]) @ (full == (sign < 0.0))) * samples.volume
        for full in (samples.inside[here], held)
    )
    return empty, carved


def _heights(ledger: Ledger, handoff: Handoff, spacing: float, radius: float) -> None:
    """Depth of the floor and height of the rim right before and right after, as means over even points: grains as a
    whole are too coarse for extremes."""
    size = handoff.carving.size
    floor = math.pi * (FLOOR * size.radius) ** 2
    before, after = (volume / floor for volume in _hollow(handoff, 0.0, FLOOR))
    scatter = height_scatter(spacing, floor)
    ledger.measure(
        "cavity_depth_rel",
        abs(after / before - 1.0) if before > 0.0 else np.inf,
        f"mean inside half the radius: source {readable.length(before)}, bed {readable.length(after)}; another draw "
        f"of the bed moves it by {readable.length(scatter)}",
        bound=max(LIMITS["cavity_depth_rel"].limit, SCATTER * scatter / max(before, 1e-300)),
    )
    if isinstance(handoff.region, WholeBody):
        ledger.skip("cavity_rim_over_r", "not_applicable", "a whole body's bed has no grains above the datum")
        return
    ring = math.pi * (RIM[1] ** 2 - RIM[0] ** 2) * size.radius**2
    before, after = (-volume / ring for volume in _hollow(handoff, *RIM))
    scatter = height_scatter(spacing, ring)
    ledger.measure(
        "cavity_rim_over_r",
        abs(after - before) / radius,
        f"mean from {RIM[0]:g} to {RIM[1]:g} cavity radii: source {readable.length(before)}, bed "
        f"{readable.length(after)}; another draw of the bed moves it by {readable.length(scatter)}",
        bound=max(LIMITS["cavity_rim_over_r"].limit, SCATTER * scatter / radius),
    )
