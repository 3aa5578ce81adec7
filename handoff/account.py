"""From one transfer to its ledger: every row of the acceptance list that one handoff can measure."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.spatial import cKDTree

from handoff import compare, domain, force_network, shock_rows
from handoff.direct import Direct, enter
from handoff.handed import Handoff
from handoff.hydrostatic import Column
from handoff.ledger import Ledger, volume_limit, volume_scatter
from handoff.offset import by_one_factor
from handoff.surface import Rules
from matter import readable
from matter.alpha_shape import alpha_shape
from matter.errors import InputError
from matter.particles import Particles

_CALIBRATION = 60_000


def ledger_of(made: Handoff, source: Particles, bed: Particles, column: Column, waive: Mapping[str, str]) -> Ledger:
    """The ledger of a transfer; limits that need further runs stand as not measured."""
    ledger = Ledger(waive)
    region = domain.read(bed.attributes)
    _sums(ledger, made)
    _fields(ledger, made, source, bed, region, column)
    _overlaps(ledger, made)
    _surface(ledger, made, bed, region)
    shock_rows.enter(ledger, made, source, region, column)
    if "residual_speed_over_sqrt_g_r" in bed.attributes:
        ledger.measure("bed_residual_speed_over_sqrt_g_r", bed.attributes["residual_speed_over_sqrt_g_r"])
    _layers(ledger, made, source)
    if "stiffness" in made.start:
        net = force_network.measure(made.start)
        ledger.state(
            "contact_force_p99_over_mean",
            net.spread,
            "1",
            f"mean {net.mean:.4g} N, {net.contacts_per_grain:.2f} contacts per grain, at the start",
        )
    _statements(ledger, made)
    return ledger


def ledger_of_direct(
    direct: Direct, made: Handoff, source: Particles, bed: Particles, column: Column, waive: Mapping[str, str]
) -> Ledger:
    """The ledger of a direct transition; ``made`` holds the surface and the split that both ways share."""
    ledger = Ledger(waive)
    enter(ledger, direct, made)
    if made.carving.size.radius > 0.0:
        radius, hole = float(direct.start.radius[: direct.compact].mean()), made.carving.size.radius
        ledger.measure(
            "cavity_radius_over_r_DEM_min",
            hole / radius,
            f"radius {readable.length(hole)}, grains {readable.length(radius)}",
        )
    else:
        ledger.skip("cavity_radius_over_r_DEM_min", "not_applicable", "there is no cavity")
    shock_rows.enter(ledger, made, source, domain.read(bed.attributes), column)
    ledger.skip("bed_residual_speed_over_sqrt_g_r", "not_applicable", "no grain of the bed is handed over")
    outside = made.sums.outside
    ledger.state("mass_outside_domain", outside.mass, "kg", "compact matter beside and below the bed's domain")
    ledger.state(
        "ejecta_by_rule",
        ", ".join(f"{name} {count}" for name, count in made.split.counts().items()),
        "1",
        "particles of the source",
    )
    ledger.state("cavity_radius", made.carving.size.radius, "m")
    ledger.state("cavity_depth", made.carving.size.depth, "m")
    ledger.state("cavity_volume", made.carving.size.volume, "m^3")
    ledger.state("cavity_off_axis", float(np.hypot(*made.carving.size.centre[:2])), "m", "of its centre")
    ledger.state(
        "grains_kept", float(direct.compact), "1", f"and {len(direct.start) - direct.compact} ejecta, one per particle"
    )
    return ledger


def _sums(ledger: Ledger, made: Handoff) -> None:
    before, raw, after = made.sums.before, made.sums.raw, made.sums.after
    kilograms, metres = f"source {before.mass:.6e} kg, grains {raw.mass:.6e} kg", f"{before.momentum_scale:.4e} kg m/s"
    ledger.measure("mass_raw_rel", abs(raw.mass / before.mass - 1.0), kilograms)
    ledger.measure(
        "momentum_linear_raw_rel",
        _relative(raw.momentum - before.momentum, before.momentum_scale),
        f"sum m|v| = {metres}",
    )
    ledger.measure(
        "momentum_angular_raw_rel",
        _relative(raw.angular - before.angular, before.angular_scale),
        f"sum m|r||v| = {before.angular_scale:.4e} kg m^2/s, about the origin",
    )
    bed_only = made.start.state == 0
    bed_only[len(made.mapped.change) :] = False
    weight = made.start.mass[bed_only]
    rms = np.sqrt(np.sum(weight * np.sum(made.start.velocity[bed_only] ** 2, axis=1)) / weight.sum())
    largest = float(np.linalg.norm(made.mapped.change, axis=1).max())
    ledger.measure(
        "correction_max_dv_over_rms_v",
        _relative(largest, rms),
        f"largest {largest:.4g} m/s, rms velocity {rms:.4g} m/s",
    )
    ledger.measure(
        "mass_total_rel",
        abs(float(made.start.mass.sum()) / before.mass - 1.0),
        f"masses of the bed times {made.mapped.scale:.9f}",
    )
    ledger.measure("momentum_linear_rel_after", _relative(after.momentum - before.momentum, before.momentum_scale))
    ledger.measure("momentum_angular_rel_after", _relative(after.angular - before.angular, before.angular_scale))
    change = after.kinetic / before.kinetic - 1.0 if before.kinetic > 0.0 else 0.0
    note = f"source {before.kinetic:.4e} J, grains {after.kinetic:.4e} J"
    ledger.measure("kinetic_energy_change_min", change, note)
    ledger.measure("kinetic_energy_change_max", change, note)
    thrown = made.ejecta_energy
    begun, left = before.kinetic - thrown, after.kinetic - thrown
    ledger.measure(
        "kinetic_energy_compact_change",
        abs(left / begun - 1.0) if begun > 1e-12 * before.kinetic else 0.0,
        f"compact matter {begun:.4e} J, its grains {left:.4e} J ({'gained' if left > begun else 'lost'})",
    )
    ledger.state(
        "kinetic_energy_ejecta",
        thrown,
        "J",
        f"{thrown / before.kinetic:.2%} of all" if before.kinetic > 0.0 else "nothing moves",
    )


def _relative(difference, scale: float) -> float:
    size = float(np.linalg.norm(difference))
    return size / scale if scale > 0.0 else (0.0 if size == 0.0 else float("inf"))


def support_of(source: Particles, spacing: np.ndarray) -> np.ndarray:
    """Kernel support [m]: the source's own, or two spacings."""
    return source.smoothing_length if "smoothing_length" in source else 2.0 * spacing


def comparison_cells(made: Handoff, source: Particles, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells of the field comparison for the sample points, and their sizes [m]."""
    support = support_of(source, made.split.spacing)[made.compact.places][made.carving.samples.particle]
    return compare.cells(made.mapped.fields, support, 3.0 * radius)


def corrected_fields(made: Handoff, source: Particles, bed: Particles) -> compare.Fields:
    """Both clouds on the sample points with the corrected masses and velocities."""
    kept = np.flatnonzero(made.carving.stays)
    before = (
        source.mass[made.compact.places] * made.compact.share,
        source.velocity[made.compact.places],
        made.mapped.own_gradient,
    )
    start, count = made.start, len(kept)
    return compare.fields_of(
        bed,
        kept,
        made.carving.samples,
        made.carving.heir,
        before,
        start.mass[:count],
        start.velocity[:count],
        made.carving.volume,
    )


def _fields(
    ledger: Ledger, made: Handoff, source: Particles, bed: Particles, region: domain.Domain, column: Column
) -> None:
    radius = float(bed.radius.mean())
    number, size = comparison_cells(made, source, radius)
    fields = corrected_fields(made, source, bed)
    difference = compare.field_difference(fields, number, size)
    note = f"{len(difference.mass)} cells of {readable.length(size.min())} to {readable.length(size.max())}"
    ledger.measure("velocity_field_L2", difference.l2, note)
    ledger.measure("velocity_direction_deg_mean", difference.direction_deg, note)
    local = compare.local_momentum(made.mapped.fields, region)
    worst = max(local, key=lambda row: row[1], default=("none: nothing moves", 0.0, 0.0))
    ledger.measure("momentum_local_rel", worst[1], f"worst: {worst[0]}, which holds {worst[2]:.1%} of sum m|v|")
    left = max((row[1] for row in compare.local_momentum(fields, region)), default=0.0)
    largest = float(np.linalg.norm(made.mapped.regional, axis=1).max())
    ledger.state(
        "momentum_local_after_rel",
        left,
        "1",
        f"the same after the correction; regional part of it: at most {largest:.4g} m/s",
    )
    bulk, peculiar = compare.energy_split(made.mapped.fields, made.carving.heir)
    ledger.state(
        "kinetic_energy_bulk", bulk, "J", "of the source's compact matter, averaged over the cells of single grains"
    )
    ledger.state(
        "kinetic_energy_peculiar",
        peculiar,
        "J",
        f"below the size of a grain, which grains cannot take over: {_share(peculiar, bulk + peculiar)}",
    )
    density = compare.density_difference(fields, radius)
    if np.isfinite(density):
        ledger.measure("bulk_density_rel", density)
    else:
        ledger.skip("bulk_density_rel", "not_applicable", "no cube of 5 grain radii lies wholly inside the surface")
    thrown = made.ejecta.source
    before = flying_mass(source.position[thrown], source.velocity[thrown], source.mass[thrown], region, column)
    inside = flying_mass(
        source.position[made.compact.places],
        source.velocity[made.compact.places],
        source.mass[made.compact.places] * made.compact.share,
        region,
        column,
    )
    place = made.start.position.copy()
    place[len(place) - len(thrown) :] = source.position[thrown]  # judged where it was, not where its grain found room
    after = flying_mass(place, made.start.velocity, made.start.mass, region, column)
    ledger.measure(
        "ejecta_mass_curve_rel",
        compare.mass_curve_difference(
            np.r_[before[0], inside[0]], np.r_[before[1], inside[1]], *after, above=made.split.speed_limit
        ),
        f"rising matter above {made.split.speed_limit:.4g} m/s that free flight brings above the datum; grains of the "
        f"bed included",
    )


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.2%} of both" if whole > 0.0 else "nothing moves"


def flying_mass(position, velocity, mass, region: domain.Domain, column: Column) -> tuple[np.ndarray, np.ndarray]:
    """Masses [kg] and speeds [m/s] of what rises and would come above the datum in free flight."""
    height, speed = region.frame.height(position), np.linalg.norm(velocity, axis=1)
    upward = np.einsum("ij,ij->i", velocity, region.frame.up(position))
    flies = (upward > 0.0) & (column.apex(height, upward, speed) > 0.0)
    return mass[flies], speed[flies]


def _overlaps(ledger: Ledger, made: Handoff) -> None:
    """Overlaps that the transfer made: those with an ejecta grain. Bed grains have not moved, their overlaps are those
    of the settled bed."""
    start, first = made.start, int(made.carving.stays.sum())
    active = np.flatnonzero(start.state == 0)
    thrown = active[active >= first]
    depth, stored, release = 0.0, 0.0, 0.0
    if len(thrown):
        reach = float(start.radius[active].max() + start.radius[thrown].max())
        tree = cKDTree(start.position[active])
        for one, near in zip(thrown, tree.query_ball_point(start.position[thrown], reach)):
            other = active[np.asarray(near)]
            other = other[other != one]
            overlap = (
                start.radius[one]
                + start.radius[other]
                - np.linalg.norm(start.position[other] - start.position[one], axis=1)
            )
            hit = overlap > 0.0
            if not hit.any():
                continue
            overlap, other = overlap[hit], other[hit]
            depth = max(depth, float(np.max(overlap / np.minimum(start.radius[one], start.radius[other]))))
            if "stiffness" in start:
                k = np.minimum(start.stiffness[one], start.stiffness[other])
                stored += 0.5 * float(np.sum(k * overlap**2))
                release = max(
                    release, float(np.max(overlap * np.sqrt(k / np.minimum(start.mass[one], start.mass[other]))))
                )
    note = "bed grains keep their places: their excess is zero; ejecta against bed and ejecta counted here"
    ledger.measure("overlap_max_over_r", depth, note)
    flow = float(np.median(np.linalg.norm(start.velocity[active], axis=1)))
    if "stiffness" in start:
        ledger.measure(
            "overlap_energy_over_KE", stored / made.sums.after.kinetic if made.sums.after.kinetic > 0.0 else 0.0, note
        )
        ledger.measure("overlap_release_speed_over_median_flow", release / flow if flow > 0.0 else 0.0, note)
    else:
        for name in ("overlap_energy_over_KE", "overlap_release_speed_over_median_flow"):
            ledger.skip(
                name, "not_applicable" if depth == 0.0 else "not_measured", "the bed carries no field 'stiffness'"
            )


def grain_surface(made: Handoff, bed: Particles, chosen: Callable[[np.ndarray], np.ndarray], wider: np.ndarray):
    """Surface of the carved bed (a mesh): the alpha-shape of the grains that stay, at the offset at which it holds,
    among the ``chosen`` sample points, as many as the cells of these grains. Its radius is one grain spacing: what a
    further grain would touch. Only grains in ``wider`` (mask over the bed) are looked at."""
    taken = made.carving.stays & wider
    spacing = np.cbrt(made.carving.volume[taken])
    shape = alpha_shape(bed.position[taken], spacing, 1.0, fill_below=4.0 * float(np.median(spacing)) ** 3).only(1)
    here = chosen(made.carving.samples.position)
    share = float(np.mean(made.carving.stays[made.carving.samples.grain[here]]))
    return by_one_factor(shape, spacing, made.carving.samples.position[here][:_CALIBRATION], share, Rules())[0].mesh


def _surface(ledger: Ledger, made: Handoff, bed: Particles, region: domain.Domain) -> None:
    radius = float(bed.radius.mean())
    size = made.carving.size
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
    margin = 3.0 * radius

    def chosen(points: np.ndarray) -> np.ndarray:
        return (size.distance(points, region) < 1.5 * size.radius) & (region.depth_inside(points) > margin)

    try:
        mesh = grain_surface(made, bed, chosen, size.distance(bed.position, region) < 1.8 * size.radius)
        there, back = compare.surface_distance(made.carving.solid.mesh, mesh, chosen)
    except InputError as reason:
        ledger.skip("cavity_hausdorff_over_r", "not_measured", str(reason))
    else:
        both = np.r_[there, back] / radius
        ledger.measure(
            "cavity_hausdorff_over_r",
            both.max(),
            f"rms {np.sqrt(np.mean(both**2)):.3f}, 99 % below {np.percentile(both, 99):.3f}",
        )
    samples = made.carving.samples
    here = size.distance(samples.position, region) < size.radius
    # net of what stands above the datum: a rough but level surface has no volume
    sign = np.where(region.frame.height(samples.position[here]) < 0.0, 1.0, -1.0)
    empty = float((sign * samples.weight[here]) @ (samples.inside[here] == (sign < 0.0))) * samples.volume
    carved = (
        float((sign * samples.weight[here]) @ (made.carving.stays[samples.grain[here]] == (sign < 0.0)))
        * samples.volume
    )
    cut = (float(np.cbrt(made.carving.volume[made.carving.stays].mean())), size.radius, size.depth, size.volume)
    scatter = volume_scatter(*cut)
    ledger.measure(
        "cavity_volume_rel",
        abs(carved / empty - 1.0) if empty > 0.0 else np.inf,
        f"below the datum: source {readable.volume(empty)}, bed {readable.volume(carved)}; at {ratio:.1f} grains per "
        f"cavity radius another draw of the bed "
        f"moves it by {scatter:.1%}",
        bound=volume_limit(*cut),
    )


def _layers(ledger: Ledger, made: Handoff, source: Particles) -> None:
    """Volume of each material inside the domain, before and after (material of a grain: the nearest compact
    particle's)."""
    volume = source.mass[made.compact.places] / source.density[made.compact.places] * made.compact.share
    named = source.attributes.get("materials", [])
    after = np.bincount(
        made.start.material[: int(made.carving.stays.sum())], weights=made.carving.volume[made.carving.stays]
    )
    for number in np.unique(source.material[made.compact.places]):
        name = named[number] if number < len(named) else f"material {number}"
        place = (
            made.start.attributes["materials"].index(name)
            if name in made.start.attributes["materials"]
            else int(number)
        )
        before, now = (
            float(volume[source.material[made.compact.places] == number].sum()),
            float(after[place]) if place < len(after) else 0.0,
        )
        ledger.state(
            f"layer_volume_rel_{name}".replace(" ", "_"),
            now / before - 1.0 if before else 0.0,
            "1",
            f"source {readable.volume(before)}, grains {readable.volume(now)}",
        )


def _statements(ledger: Ledger, made: Handoff) -> None:
    outside, flying = made.sums.outside, made.ejecta
    ledger.state("mass_outside_domain", outside.mass, "kg", "compact matter beside and below the bed's domain")
    ledger.state("momentum_outside_domain", float(np.linalg.norm(outside.momentum)), "kg m/s")
    ledger.state(
        "angular_momentum_outside_domain", float(np.linalg.norm(outside.angular)), "kg m^2/s", "about the origin"
    )
    for name, mass in flying.mass_by_state().items():
        ledger.state(f"ejecta_mass_{name.replace(' ', '_')}", mass, "kg")
    ledger.state(
        "ejecta_count",
        float(len(flying.mass)),
        "1",
        f"{flying.shrunk} shrunk, {np.count_nonzero(flying.moved)} moved to fit (by at most "
        f"{readable.length(flying.moved.max(initial=0.0))})",
    )
    ledger.state(
        "ejecta_by_rule",
        ", ".join(f"{name} {count}" for name, count in made.split.counts().items()),
        "1",
        "particles of the source",
    )
    ledger.state(
        "surface_offset_spacings",
        made.carving.offset,
        "1",
        "found from the volume of the compact particles unless given",
    )
    ledger.state(
        "linear_share",
        made.mapped.linear_share,
        "1",
        "share taken of the velocity's variation inside a particle; below 1 where more would create energy",
    )
    ledger.state(
        "mass_by_particle_density_rel",
        abs(made.mapped.plain_mass / made.sums.before.mass - 1.0),
        "1",
        "with each grain at the density of its nearest particle as it stands, before local sums are matched",
    )
    ledger.state("surface_voids_filled", float(made.carving.solid.shape.voids_filled), "1")
    ledger.state("cavity_radius", made.carving.size.radius, "m")
    ledger.state("cavity_depth", made.carving.size.depth, "m")
    ledger.state("cavity_volume", made.carving.size.volume, "m^3")
    ledger.state("cavity_off_axis", float(np.hypot(*made.carving.size.centre[:2])), "m", "of its centre")
    ledger.state("grains_kept", float(made.carving.stays.sum()), "1", f"of {len(made.carving.stays)}")
