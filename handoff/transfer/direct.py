"""The direct transition: every SPH particle becomes one grain, the common procedure that the mapping onto a settled
bed improves on.

A particle whose centre lies in the bed's domain (compact), and every ejecta particle, becomes a sphere of its
volume: r = (3 m / (4 pi rho))^(1/3), with its mass, position and velocity and without spin.
Mass, momenta and kinetic energy of these particles are then kept by construction. What is not kept is rest: spheres of
the full volume overlap wherever particles fill space, the overlaps push the grains apart, and the fastest of them sets
the step. ``compare`` puts both ways side by side. (Sphere of equal volume: one of the choices of OpenSPH's handoff;
overlaps and step: Ballouz et al. 2019, MNRAS 485, 697; its cost as the reason for mapping: seed, Zhang et al. 2022,
LPSC.)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from handoff.domains import domain
from handoff.ledger import Ledger
from handoff.source import free_flight
from handoff.source.cloud_surface import counted_density
from handoff.source.hydrostatic import Column
from handoff.transfer import correction, grain_provenance, overlaps
from handoff.transfer.ejecta import BOOKED, IN_CONTACT, past_edge
from handoff.transfer.handed import Handoff
from handoff.transfer.species import material_numbers, species_by_material
from matter.errors import InputError
from matter.particles import Particles

SOURCES = ("Ballouz2019",)

GRAIN_STEPS_PER_S = 2.0e6
"""Grain steps per second of one core in a collapse: the granular stage's own figure, for the forecast."""
Table = dict[str, dict[str, float | None]]
_SAME = "the grains are the source's own particles: nothing was mapped"


@dataclass(frozen=True)
class Direct:
    """``start`` (first the ``compact`` grains, then the ejecta), ``source`` (indices of their particles), sums of the
    particles taken and of the grains, overlaps bare and beyond what the undisturbed body would carry."""

    start: Particles
    source: np.ndarray
    compact: int
    before: correction.Sums
    after: correction.Sums
    bare: overlaps.Overlaps
    excess: overlaps.Overlaps


def hand_over(handoff: Handoff, source: Particles, bed: Particles, column: Column) -> Direct:
    """Grains one to one from the ``source``, split as in ``handoff``; stiffness per radius and contact settings are
    the bed's.

    Raises ``InputError`` when no particle lies in the bed's domain or the bed carries no stiffness.
    """
    bed.need("stiffness", "radius", "mass")
    region = handoff.region
    inside = handoff.compact.indices[
        region.between(source.position[handoff.compact.indices])
        & (region.cut_depth(source.position[handoff.compact.indices]) > 0.0)
    ]
    if len(inside) == 0:
        raise InputError("no compact particle of the source lies inside the bed's domain: do they share a frame?")
    taken = np.concatenate([inside, np.flatnonzero(~handoff.split.compact)])
    start = _start(source, taken, len(inside), bed, region, column)
    grain_provenance.give(start, source, region, grain_provenance.one_to_one(source, taken))
    before = correction.sums(source.mass[taken], source.position[taken], source.velocity[taken])
    after = correction.sums(start.mass, start.position, start.velocity, start.radius, start.angular_velocity)
    bare = overlaps.measure(start.select(start.state == IN_CONTACT), region)
    frame = region.frame
    return Direct(
        start,
        taken,
        len(inside),
        before,
        after,
        bare,
        bare.beyond(lambda position: column.pressure_at(frame.height(position))),
    )


def _start(
    source: Particles,
    taken: np.ndarray,
    compact: int,
    bed: Particles,
    region: domain.Domain,
    column: Column,
) -> Particles:
    position, velocity, mass = source.position[taken], source.velocity[taken], source.mass[taken]
    density = counted_density(source)[taken]
    radius = np.cbrt(3.0 * mass / (4.0 * np.pi * density))
    escapes = free_flight.escapes(region, column, position, velocity)
    state = np.where(past_edge(position, region) | escapes, BOOKED, IN_CONTACT).astype(np.int8)
    state[:compact] = IN_CONTACT
    names, table = material_numbers(source, bed)
    material = table[np.clip(source.material[taken], 0, len(table) - 1)]
    fields: dict[str, Any] = {
        "identity": np.arange(len(taken)),
        "position": position,
        "velocity": velocity,
        "angular_velocity": np.zeros_like(position),
        "mass": mass,
        "radius": radius,
        "material": material,
        "density": source.density[taken],
        "headroom": np.zeros(len(taken), dtype=np.int8),
        "species": species_by_material(bed, names)[material],
        "state": state,
        "stiffness": radius * _stiffness_per_radius(bed, names)[material],
    }
    attributes = {
        **bed.attributes,
        "materials": names,
        "stage": "handoff",
        "time": float(source.attributes.get("time", 0.0)),
        "bed_grains": compact,
    }
    return Particles(fields, attributes)


def _stiffness_per_radius(bed: Particles, names: list[str]) -> np.ndarray:
    """k_n / r [Pa] of each material: the median of the bed's grains of it, or of all."""
    ratio = bed.stiffness / bed.radius
    return np.array(
        [
            float(np.median(ratio[bed.material == k] if np.any(bed.material == k) else ratio))
            for k in range(max(len(names), 1))
        ]
    )


def enter(ledger: Ledger, direct: Direct, handoff: Handoff) -> None:
    """Enter the rows on what the grains took over, for a handoff that goes on with them: raw rows against the bed's
    domain, whose side cuts particles that are taken whole; rows after against the particles taken."""
    raw, domain_sums, taken, after = direct.after, handoff.sums.before, direct.before, direct.after
    cut = "against the bed's domain, whose side cuts particles that are taken whole"
    whole = "against the particles taken; no correction is made"
    ledger.measure("mass_raw_rel", abs(raw.mass / domain_sums.mass - 1.0), cut)
    ledger.measure(
        "momentum_linear_raw_rel", _relative(raw.momentum - domain_sums.momentum, domain_sums.momentum_scale), cut
    )
    ledger.measure(
        "momentum_angular_raw_rel", _relative(raw.angular - domain_sums.angular, domain_sums.angular_scale), cut
    )
    ledger.measure("mass_total_rel", abs(after.mass / taken.mass - 1.0), whole)
    ledger.measure(
        "momentum_linear_rel_after", _relative(after.momentum - taken.momentum, taken.momentum_scale), whole
    )
    ledger.measure("momentum_angular_rel_after", _relative(after.angular - taken.angular, taken.angular_scale), whole)
    change = after.kinetic / taken.kinetic - 1.0 if taken.kinetic > 0.0 else 0.0
    ledger.measure("kinetic_energy_change_min", change, whole)
    ledger.measure("kinetic_energy_change_max", change, whole)
    note = (
        f"{len(direct.bare.depth)} overlapping contacts, 99.9 % below {direct.excess.percentile(99.9):.4g} r; excess "
        f"over P r / k of the undisturbed body"
    )
    ledger.measure("overlap_max_over_r", direct.excess.largest, note)
    ledger.measure(
        "overlap_energy_over_KE", _over(direct.excess.energy, after.kinetic), f"{direct.excess.energy:.4e} J"
    )
    fastest = float(direct.excess.release_speed.max(initial=0.0))
    ledger.measure(
        "overlap_release_speed_over_median_flow", _over(fastest, _flow(direct.start)), f"largest {fastest:.4g} m/s"
    )
    for name in ("correction_max_dv_over_rms_v", "momentum_local_rel", "velocity_field_L2",
    "velocity_direction_deg_mean", "bulk_density_rel",
                 "cavity_hausdorff_over_r", "cavity_volume_rel", "cavity_depth_rel", "cavity_rim_over_r",
                 "ejecta_mass_curve_rel",
                 "kinetic_energy_compact_change"):  # fmt: skip
        ledger.skip(name, "not_applicable", _SAME)


def compare(handoff: Handoff, direct: Direct, mapped: Ledger, bed: Particles) -> Table:
    """Mapped against direct, as measured: conservation against the bed's domain, overlaps, and what the granular stage
    would cost (``LABELS`` says the units; None: no limit).

    The mapped bed's excess overlaps are the ledger's (its grains have not moved); its bare ones are those of the
    settled bed under its weight.
    """
    region = handoff.region
    steps, overlap = overlaps.steps_per_contact(bed), overlaps.OVERLAP_WARN
    grains = handoff.start.select(handoff.start.state == IN_CONTACT)
    bare = overlaps.measure(grains, region)
    value = {row["name"]: row["value"] for row in mapped.rows}
    rows: dict[str, dict[str, float]] = {}
    release = (value["overlap_release_speed_over_median_flow"] or 0.0) * _flow(handoff.start)
    rows["mapped"] = _row(handoff.sums.raw, handoff.sums.after, handoff.sums.before, grains, bare, steps) | {
        "overlap_max_excess_over_r": value["overlap_max_over_r"],
        "overlap_energy_excess_over_KE": value["overlap_energy_over_KE"] or 0.0,
        "release_speed_excess_m_s": release,
        "time_step_release_s": float(np.pi / steps * overlap * grains.radius.min() / (np.sqrt(2.0) * release))
        if release > 0.0
        else float("inf"),
    }
    grains = direct.start.select(direct.start.state == IN_CONTACT)
    rows["direct"] = _row(direct.after, direct.after, handoff.sums.before, grains, direct.bare, steps) | {
        "overlap_max_excess_over_r": direct.excess.largest,
        "overlap_energy_excess_over_KE": _over(direct.excess.energy, direct.after.kinetic),
        "release_speed_excess_m_s": float(direct.excess.release_speed.max(initial=0.0)),
        "time_step_release_s": direct.excess.step(overlap, steps),
    }
    for row in rows.values():
        step = min(row["time_step_contact_s"], row["time_step_release_s"])
        row["core_s_per_simulated_s"] = row["grains"] / (step * GRAIN_STEPS_PER_S)
    return {
        method: {name: value if math.isfinite(value) else None for name, value in row.items()}
        for method, row in rows.items()
    }


LABELS: Mapping[str, str] = {
    "grains": "grains in contact search",
    "radius_mean_m": "mean radius [m]",
    "mass_rel": "mass against the bed's domain, raw",
    "momentum_linear_rel": "linear momentum, raw, over sum m|v|",
    "momentum_angular_rel": "angular momentum, raw, over sum m|r||v|",
    "momentum_linear_rel_after": "linear momentum, as handed over",
    "momentum_angular_rel_after": "angular momentum, as handed over",
    "kinetic_energy_change": "kinetic energy, relative change",
    "overlapping_contacts": "overlapping contacts",
    "overlap_median_over_r": "median overlap [smaller radius]",
    "overlap_max_over_r": "largest overlap [smaller radius], bare",
    "overlap_max_excess_over_r": "largest overlap, excess over the undisturbed state",
    "overlap_energy_excess_over_KE": "energy stored in overlaps over kinetic energy, excess",
    "release_speed_excess_m_s": "largest speed that the overlaps release [m/s], excess",
    "time_step_contact_s": "time step by contact time [s]",
    "time_step_release_s": "time step that takes the release [s]",
    "core_s_per_simulated_s": "predicted core seconds per simulated second",
}


def _row(
    raw: correction.Sums,
    after: correction.Sums,
    before: correction.Sums,
    grains: Particles,
    bare: overlaps.Overlaps,
    steps: int,
) -> dict[str, float]:
    return {
        "grains": float(len(grains)),
        "radius_mean_m": float(grains.radius.mean()),
        "mass_rel": raw.mass / before.mass - 1.0,
        "momentum_linear_rel": _relative(raw.momentum - before.momentum, before.momentum_scale),
        "momentum_angular_rel": _relative(raw.angular - before.angular, before.angular_scale),
        "momentum_linear_rel_after": _relative(after.momentum - before.momentum, before.momentum_scale),
        "momentum_angular_rel_after": _relative(after.angular - before.angular, before.angular_scale),
        "kinetic_energy_change": after.kinetic / before.kinetic - 1.0 if before.kinetic > 0.0 else 0.0,
        "overlapping_contacts": float(len(bare.depth)),
        "overlap_median_over_r": bare.percentile(50.0),
        "overlap_max_over_r": bare.largest,
        "time_step_contact_s": overlaps.contact_step(grains, steps),
    }


def as_text(rows: Table) -> str:
    """The comparison as a table for a terminal."""
    lines = [f"{'mapped against direct':<56}{'mapped':>13}{'direct':>13}"]
    return "\n".join(
        lines
        + [
            f"{label:<56}{_shown(rows['mapped'][key]):>13}{_shown(rows['direct'][key]):>13}"
            for key, label in LABELS.items()
        ]
    )


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _flow(start: Particles) -> float:
    return float(np.median(np.linalg.norm(start.velocity[start.state == IN_CONTACT], axis=1)))


def _over(value: float, scale: float) -> float:
    return value / scale if scale > 0.0 else (0.0 if value == 0.0 else float("inf"))


def _relative(difference: np.ndarray, scale: float) -> float:
    return _over(float(np.linalg.norm(difference)), scale)
