"""Rows of the ledger that compare fields before and after a transfer: velocity, momentum by region, energy below the
size of a grain, density, mass of ejecta by speed."""

from __future__ import annotations

import numpy as np

from handoff.domains import domain
from handoff.ledger import Ledger
from handoff.source import free_flight, grain_size
from handoff.source.hydrostatic import Column
from handoff.transfer import compare_clouds
from handoff.transfer.handed import Handoff
from matter.particles import Particles
from matter.wording import readable


def support_of(source: Particles, spacing: np.ndarray) -> np.ndarray:
    """Kernel support [m]: the source's own, or two spacings."""
    return source.support_radius if "support_radius" in source else 2.0 * spacing


def comparison_cells(handoff: Handoff, source: Particles, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells of the field comparison for the sample points, and their sizes [m]."""
    support = support_of(source, handoff.split.spacing)[handoff.compact.indices][handoff.carving.samples.particle]
    return compare_clouds.cells(handoff.mapped.fields, support, 3.0 * radius)


def corrected_fields(handoff: Handoff, source: Particles, bed: Particles) -> compare_clouds.Fields:
    """Both clouds on the sample points with the corrected masses and velocities, against the ground at rest."""
    kept = np.flatnonzero(handoff.carving.stays)
    compact, region = handoff.compact, handoff.region
    before = (
        source.mass[compact.indices] * compact.fraction,
        region.flow(source.position[compact.indices], source.velocity[compact.indices]),
        handoff.mapped.own_gradient,
    )
    start, count = handoff.start, len(kept)
    return compare_clouds.fields_of(
        bed,
        kept,
        handoff.carving.samples,
        handoff.carving.receiver,
        before,
        start.mass[:count],
        region.flow(start.position[:count], start.velocity[:count]),
        handoff.carving.volume,
    )


def enter(
    ledger: Ledger, handoff: Handoff, source: Particles, bed: Particles, region: domain.Domain, column: Column
) -> None:
    """The rows on velocity field, local momentum and bulk density, over cells that hold many grains."""
    radius = grain_size.at_impact(bed)
    number, size = comparison_cells(handoff, source, radius)
    fields = corrected_fields(handoff, source, bed)
    difference = compare_clouds.field_difference(fields, number, size)
    note = f"{len(difference.mass)} cells of {readable.length(size.min())} to {readable.length(size.max())}"
    ledger.measure("velocity_field_L2", difference.l2, note)
    ledger.measure("velocity_direction_deg_mean", difference.direction_deg, note)
    local = compare_clouds.local_momentum(handoff.mapped.fields, region)
    worst = max(local, key=lambda row: row[1], default=("none: nothing moves", 0.0, 0.0))
    ledger.measure("momentum_local_rel", worst[1], f"worst: {worst[0]}, which holds {worst[2]:.1%} of sum m|v|")
    left = max((row[1] for row in compare_clouds.local_momentum(fields, region)), default=0.0)
    ledger.state("momentum_local_after_rel", left, "1", "the same after the correction")
    bulk, peculiar = compare_clouds.energy_split(handoff.mapped.fields, handoff.carving.receiver)
    ledger.state(
        "kinetic_energy_bulk", bulk, "J", "of the source's compact matter, averaged over the cells of single grains"
    )
    ledger.state(
        "kinetic_energy_peculiar",
        peculiar,
        "J",
        f"below the size of a grain, which grains cannot take over: {_momentum_fraction(peculiar, bulk + peculiar)}",
    )
    density = compare_clouds.density_difference(fields, radius)
    if np.isfinite(density):
        ledger.measure("bulk_density_rel", density)
    else:
        ledger.skip("bulk_density_rel", "not_applicable", "no cube of 5 grain radii lies wholly inside the surface")
    ejecta = handoff.ejecta.source
    before = flying_mass(source.position[ejecta], source.velocity[ejecta], source.mass[ejecta], region, column)
    inside = flying_mass(
        source.position[handoff.compact.indices],
        source.velocity[handoff.compact.indices],
        source.mass[handoff.compact.indices] * handoff.compact.fraction,
        region,
        column,
    )
    position = handoff.start.position.copy()
    position[len(position) - len(ejecta) :] = source.position[
        ejecta
    ]  # judged where it was, not where its grain found room
    after = flying_mass(position, handoff.start.velocity, handoff.start.mass, region, column)
    ledger.measure(
        "ejecta_mass_curve_rel",
        compare_clouds.mass_curve_difference(
            np.r_[before[0], inside[0]], np.r_[before[1], inside[1]], *after, above=handoff.split.speed_limit
        ),
        f"rising matter above {handoff.split.speed_limit:.4g} m/s that free flight brings above the datum; grains "
        f"of the bed included",
    )


def _momentum_fraction(part: float, whole: float) -> str:
    return f"{part / whole:.2%} of both" if whole > 0.0 else "nothing moves"


def flying_mass(position, velocity, mass, region: domain.Domain, column: Column) -> tuple[np.ndarray, np.ndarray]:
    """Masses [kg] and speeds [m/s] of what rises and would come above the datum in free flight."""
    speed = np.linalg.norm(region.flow(position, velocity), axis=1)
    upward = free_flight.rising(region, position, velocity)
    flies = (upward > 0.0) & (free_flight.apex(region, column, position, velocity) > 0.0)
    return mass[flies], speed[flies]
