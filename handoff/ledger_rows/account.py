"""From one transfer to its ledger: every row of the acceptance list that one handoff can measure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains.whole_body import WholeBody
from handoff.ledger import Ledger
from handoff.ledger_rows import block_rows, cavity_rows, field_rows, shock_rows
from handoff.source import cloud_surface
from handoff.source.hydrostatic import Column
from handoff.transfer import force_network, grain_provenance
from handoff.transfer.direct import Direct, enter
from handoff.transfer.handed import Handoff
from matter.particles import Particles
from matter.wording import readable


def ledger_of(handoff: Handoff, source: Particles, bed: Particles, column: Column, waive: Mapping[str, str]) -> Ledger:
    """The ledger of a transfer; limits that need further runs stand as not measured."""
    ledger = Ledger(waive)
    region = handoff.region
    _sums(ledger, handoff)
    field_rows.enter(ledger, handoff, source, bed, region, column)
    _overlaps(ledger, handoff)
    cavity_rows.enter(ledger, handoff, bed, region)
    shock_rows.enter(ledger, handoff, source, region, column)
    if "residual_speed_over_sqrt_g_r" in bed.attributes:
        ledger.measure("bed_residual_speed_over_sqrt_g_r", bed.attributes["residual_speed_over_sqrt_g_r"])
    _layers(ledger, handoff, source)
    grain_provenance.enter(ledger, handoff, source, region)
    if "stiffness" in handoff.start:
        net = force_network.measure(handoff.start)
        ledger.state(
            "contact_force_p99_over_mean",
            net.spread,
            "1",
            f"mean {net.mean:.4g} N, {net.contacts_per_grain:.2f} contacts per grain, at the start",
        )
    _statements(ledger, handoff)
    _shrunk(ledger, handoff, bed)
    block_rows.enter(ledger, handoff.blocks, source, handoff.start)
    return ledger


def ledger_of_direct(
    direct: Direct, handoff: Handoff, source: Particles, bed: Particles, column: Column, waive: Mapping[str, str]
) -> Ledger:
    """The ledger of a direct transition; ``handoff`` holds the surface and the split that both ways share."""
    ledger = Ledger(waive)
    enter(ledger, direct, handoff)
    if handoff.carving.size.radius > 0.0:
        radius, hole = float(direct.start.radius[: direct.compact].mean()), handoff.carving.size.radius
        ledger.measure(
            "cavity_radius_over_r_DEM_min",
            hole / radius,
            f"radius {readable.length(hole)}, grains {readable.length(radius)}",
        )
    else:
        ledger.skip("cavity_radius_over_r_DEM_min", "not_applicable", "there is no cavity")
    shock_rows.enter(ledger, handoff, source, handoff.region, column)
    ledger.skip("bed_residual_speed_over_sqrt_g_r", "not_applicable", "no grain of the bed is handed over")
    outside = handoff.sums.outside
    ledger.state("mass_outside_domain", outside.mass, "kg", "compact matter beside and below the bed's domain")
    _state_rules(ledger, handoff)
    ledger.state("cavity_radius", handoff.carving.size.radius, "m")
    ledger.state("cavity_depth", handoff.carving.size.depth, "m")
    ledger.state("cavity_volume", handoff.carving.size.volume, "m^3")
    ledger.state("cavity_off_axis", float(np.hypot(*handoff.carving.size.centre[:2])), "m", "of its centre")
    ledger.state(
        "grains_kept", float(direct.compact), "1", f"and {len(direct.start) - direct.compact} ejecta, one per particle"
    )
    return ledger


def _sums(ledger: Ledger, handoff: Handoff) -> None:
    before, raw, after = handoff.sums.before, handoff.sums.raw, handoff.sums.after
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
    bed_only = handoff.start.state == 0
    bed_only[len(handoff.mapped.change) :] = False
    weight = handoff.start.mass[bed_only]
    flow = handoff.region.flow(handoff.start.position[bed_only], handoff.start.velocity[bed_only])
    rms = np.sqrt(np.sum(weight * np.sum(flow**2, axis=1)) / weight.sum())
    largest = float(np.linalg.norm(handoff.mapped.change, axis=1).max())
    ledger.measure(
        "correction_max_dv_over_rms_v",
        _relative(largest, rms),
        f"largest {largest:.4g} m/s, rms velocity {rms:.4g} m/s",
    )
    ledger.measure(
        "mass_total_rel",
        abs(float(handoff.start.mass.sum()) / before.mass - 1.0),
        f"masses of the bed times {handoff.mapped.scale:.9f}",
    )
    ledger.measure("momentum_linear_rel_after", _relative(after.momentum - before.momentum, before.momentum_scale))
    ledger.measure("momentum_angular_rel_after", _relative(after.angular - before.angular, before.angular_scale))
    change = after.kinetic / before.kinetic - 1.0 if before.kinetic > 0.0 else 0.0
    note = f"source {before.kinetic:.4e} J, grains {after.kinetic:.4e} J"
    ledger.measure("kinetic_energy_change_min", change, note)
    ledger.measure("kinetic_energy_change_max", change, note)
    flying_energy = handoff.ejecta_energy
    begun, left = handoff.moving
    ledger.measure(
        "kinetic_energy_compact_change",
        abs(left / begun - 1.0) if begun > 1e-12 * before.kinetic else 0.0,
        f"compact matter {begun:.4e} J, its grains {left:.4e} J ({'gained' if left > begun else 'lost'})",
    )
    ledger.state(
        "kinetic_energy_ejecta",
        flying_energy,
        "J",
        f"{flying_energy / before.kinetic:.2%} of all" if before.kinetic > 0.0 else "nothing moves",
    )


def _relative(difference, scale: float) -> float:
    size = float(np.linalg.norm(difference))
    return size / scale if scale > 0.0 else (0.0 if size == 0.0 else float("inf"))


def _overlaps(ledger: Ledger, handoff: Handoff) -> None:
    """Overlaps that the transfer made: those with an ejecta grain. Bed grains have not moved, their overlaps are those
    of the settled bed."""
    start, first = handoff.start, int(handoff.carving.stays.sum())
    active = np.flatnonzero(start.state == 0)
    ejecta = active[active >= first]
    if "block" in start:
        ejecta = ejecta[start.block[ejecta] < 0]
    depth, stored, release = 0.0, 0.0, 0.0
    if len(ejecta):
        reach = float(start.radius[active].max() + start.radius[ejecta].max())
        tree = cKDTree(start.position[active])
        for one, near in zip(ejecta, tree.query_ball_point(start.position[ejecta], reach)):
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
    note = "bed grains keep their positions: their excess is zero; ejecta against bed and ejecta counted here"
    ledger.measure("overlap_max_over_r", depth, note)
    flow = float(np.median(np.linalg.norm(handoff.region.flow(start.position, start.velocity)[active], axis=1)))
    if "stiffness" in start:
        ledger.measure(
            "overlap_energy_over_KE",
            stored / handoff.sums.after.kinetic if handoff.sums.after.kinetic > 0.0 else 0.0,
            note,
        )
        ledger.measure("overlap_release_speed_over_median_flow", release / flow if flow > 0.0 else 0.0, note)
    else:
        for name in ("overlap_energy_over_KE", "overlap_release_speed_over_median_flow"):
            ledger.skip(
                name, "not_applicable" if depth == 0.0 else "not_measured", "the bed carries no field 'stiffness'"
            )


def _shrunk(ledger: Ledger, handoff: Handoff, bed: Particles) -> None:
    """Grains made smaller for the dilated matter that they stand for, where there are some."""
    full = bed.radius[handoff.carving.stays]
    ratio = handoff.start.radius[: len(full)] / full
    smaller = ratio < 1.0
    if smaller.any():
        volume = handoff.carving.volume[handoff.carving.stays][smaller]
        packed = float(volume @ ratio[smaller] ** 3)
        ledger.state(
            "grains_shrunk",
            float(np.count_nonzero(smaller)),
            "1",
            f"stand for {readable.volume(volume.sum())} of dilated matter, packed {readable.volume(packed)}; "
            f"smallest {ratio.min():.3f} of its radius",
        )


def _layers(ledger: Ledger, handoff: Handoff, source: Particles) -> None:
    """Volume of each material inside the domain, before and after (material of a grain: the nearest compact
    particle's)."""
    volume = (source.mass / cloud_surface.counted_density(source))[handoff.compact.indices] * handoff.compact.fraction
    named = source.attributes.get("materials", [])
    after = np.bincount(
        handoff.start.material[: int(handoff.carving.stays.sum())],
        weights=handoff.carving.volume[handoff.carving.stays],
    )
    for number in np.unique(source.material[handoff.compact.indices]):
        name = named[number] if number < len(named) else f"material {number}"
        index = (
            handoff.start.attributes["materials"].index(name)
            if name in handoff.start.attributes["materials"]
            else int(number)
        )
        before, now = (
            float(volume[source.material[handoff.compact.indices] == number].sum()),
            float(after[index]) if index < len(after) else 0.0,
        )
        ledger.state(
            f"layer_volume_rel_{name}".replace(" ", "_"),
            now / before - 1.0 if before else 0.0,
            "1",
            f"source {readable.volume(before)}, grains {readable.volume(now)}",
        )


def _statements(ledger: Ledger, handoff: Handoff) -> None:
    outside, flying = handoff.sums.outside, handoff.ejecta
    ledger.state("mass_outside_domain", outside.mass, "kg", "compact matter beside and below the bed's domain")
    ledger.state("momentum_outside_domain", float(np.linalg.norm(outside.momentum)), "kg m/s")
    ledger.state(
        "angular_momentum_outside_domain", float(np.linalg.norm(outside.angular)), "kg m^2/s", "about the origin"
    )
    for name, mass in flying.mass_by_state().items():
        ledger.state(f"ejecta_mass_{name.replace(' ', '_')}", mass, "kg")
    if isinstance(handoff.region, WholeBody):
        for name, mass in flying.mass_by_fate().items():
            ledger.state(f"ejecta_mass_that_{name}", mass, "kg", "by two-body flight about the body")
    ledger.state(
        "ejecta_count",
        float(len(flying.mass)),
        "1",
        f"{flying.shrunk} shrunk, {np.count_nonzero(flying.moved)} moved to fit (by at most "
        f"{readable.length(flying.moved.max(initial=0.0))})",
    )
    _state_rules(ledger, handoff)
    ledger.state(
        "surface_offset_spacings",
        handoff.carving.offset,
        "1",
        "found from the volume of the compact particles unless given",
    )
    ledger.state(
        "linear_share",
        handoff.mapped.linear_share,
        "1",
        "fraction taken of the velocity's variation inside a particle; below 1 where more would create energy",
    )
    ledger.state(
        "mass_by_particle_density_rel",
        abs(handoff.mapped.plain_mass / handoff.sums.before.mass - 1.0),
        "1",
        "with each grain at the density of its nearest particle as it stands, before local sums are matched",
    )
    ledger.state("surface_voids_filled", float(handoff.carving.solid.shape.voids_filled), "1")
    ledger.state("cavity_radius", handoff.carving.size.radius, "m")
    ledger.state("cavity_depth", handoff.carving.size.depth, "m")
    ledger.state("cavity_volume", handoff.carving.size.volume, "m^3")
    ledger.state("cavity_off_axis", float(np.hypot(*handoff.carving.size.centre[:2])), "m", "of its centre")
    ledger.state("grains_kept", float(handoff.carving.stays.sum()), "1", f"of {len(handoff.carving.stays)}")


def _state_rules(ledger: Ledger, handoff: Handoff) -> None:
    said = ", ".join(f"{name} {count}" for name, count in handoff.split.counts().items())
    ledger.state("ejecta_by_rule", said, "1", "particles of the source")
