"""Rows of the ledger on the cavity: its size in grains, its surface and volume before and after."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handoff import carve, compare, domain, grain_size
from handoff.handed import Handoff
from handoff.ledger import Ledger, volume_limit, volume_scatter
from handoff.offset import by_one_factor
from handoff.surface import Rules
from handoff.whole_body import WholeBody
from matter import readable
from matter.alpha_shape import alpha_shape
from matter.errors import InputError
from matter.particles import Particles

_CALIBRATION = 60_000


def grain_surface(handoff: Handoff, bed: Particles, chosen: Callable[[np.ndarray], np.ndarray], wider: np.ndarray):
    """Surface of the carved bed (a mesh): the alpha-shape of the grains that stay, at the offset at which it holds,
    among the ``chosen`` sample points, as many as the cells of these grains. Its radius is one grain spacing: what a
    further grain would touch. Only grains in ``wider`` (mask over the bed) are looked at."""
    taken = handoff.carving.stays & wider
    spacing = np.cbrt(handoff.carving.volume[taken])
    shape = alpha_shape(bed.position[taken], spacing, 1.0, fill_below=4.0 * float(np.median(spacing)) ** 3).only(1)
    samples, here = handoff.carving.samples, chosen(handoff.carving.samples.position)
    place = samples.position[here]
    share = float(np.mean(carve.filled(handoff.carving.stays, samples.grain[here], place, handoff.region)))
    return by_one_factor(shape, spacing, place[:_CALIBRATION], share, Rules())[0].mesh


def enter(ledger: Ledger, handoff: Handoff, bed: Particles, region: domain.Domain) -> None:
    """The rows on the cavity: grains per radius, distance of the two surfaces, volume below the datum."""
    radius = grain_size.at_impact(bed)
    size = handoff.carving.size
    if size.radius == 0.0:
        for name in ("cavity_radius_over_r_DEM_min", "cavity_hausdorff_over_r", "cavity_volume_rel"):
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
        there, back = compare.surface_distance(handoff.carving.solid.mesh, mesh, chosen)
    except InputError as reason:
        ledger.skip("cavity_hausdorff_over_r", "not_measured", str(reason))
    else:
        both = np.r_[there, back] / radius
        ledger.measure(
            "cavity_hausdorff_over_r",
            both.max(),
            f"rms {np.sqrt(np.mean(both**2)):.3f}, 99 % below {np.percentile(both, 99):.3f}",
        )
    samples = handoff.carving.samples
    here = size.distance(samples.position, region) < size.radius
    # net of what stands above the datum: a rough but level surface has no volume
    sign = np.where(region.frame.height(samples.position[here]) < 0.0, 1.0, -1.0)
    empty = float((sign * samples.weight[here]) @ (samples.inside[here] == (sign < 0.0))) * samples.volume
    held = carve.filled(handoff.carving.stays, samples.grain[here], samples.position[here], region)
    carved = float((sign * samples.weight[here]) @ (held == (sign < 0.0))) * samples.volume
    spacing = float(np.cbrt(handoff.carving.volume[handoff.carving.stays & wider].mean()))
    cut = (spacing, size.radius, size.depth, size.volume)
    scatter = volume_scatter(*cut)
    ledger.measure(
        "cavity_volume_rel",
        abs(carved / empty - 1.0) if empty > 0.0 else np.inf,
        f"below the datum: source {readable.volume(empty)}, bed {readable.volume(carved)}; at {ratio:.1f} grains per "
        f"cavity radius another draw of the bed "
        f"moves it by {scatter:.1%}",
        bound=volume_limit(*cut),
    )
