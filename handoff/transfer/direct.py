"""The direct transition: every SPH particle becomes one grain, the common procedure that the mapping onto a settled
bed improves on.

A particle whose centre lies in the bed's domain (compact), and every ejecta particle, becomes a sphere of its
volume: r = (3 m / (4 pi rho))^(1/3), with its mass, position and velocity and without spin.
Mass, momenta and kinetic energy of these particles are then kept by construction. What is not kept is rest: spheres of
the full volume overlap wherever particles fill space, the overlaps push the grains apart, and the fastest of them sets
the step. No run takes this way: ``compare`` says what it would cost, beside the mapped grains. (Sphere of equal
volume: one of the choices of OpenSPH's handoff; overlaps and step: Ballouz et al. 2019, MNRAS 485, 697; its cost as
the reason for mapping: seed, Zhang et al. 2022, LPSC.)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from handoff.ledger import Ledger
from handoff.source import free_flight
from handoff.source.cloud_surface import counted_density
from handoff.source.hydrostatic import Column
from handoff.transfer import correction, overlaps
from handoff.transfer.ejecta import BOOKED, IN_CONTACT, past_edge
from handoff.transfer.handed import Handoff
from handoff.transfer.species import material_numbers
from matter.errors import InputError
from matter.particles import Particles

SOURCES = ("Ballouz2019",)

GRAIN_STEPS_PER_S = 2.0e6
"""Grain steps per second of one core in a collapse: the granular stage's own figure, for the forecast."""
Table = dict[str, dict[str, float | None]]


def grains_of(handoff: Handoff, source: Particles, bed: Particles, column: Column) -> Particles:
    """Spheres one to one from the ``source``, split as in ``handoff``, with the bed's stiffness per radius; their
    ``state`` as in ``handoff.transfer.ejecta``.

    Raises ``InputError`` when no particle lies in the bed's domain or the bed carries no stiffness.
    """
    bed.need("stiffness", "radius", "mass")
    region, compact = handoff.region, handoff.compact.indices
    x = source.position[compact]
    inside = compact[region.between(x) & (region.cut_depth(x) > 0.0)]
    if len(inside) == 0:
        raise InputError("no compact particle of the source lies inside the bed's domain: do they share a frame?")
    taken = np.concatenate([inside, np.flatnonzero(~handoff.split.compact)])
    position, velocity, mass = source.position[taken], source.velocity[taken], source.mass[taken]
    radius = np.cbrt(3.0 * mass / (4.0 * np.pi * counted_density(source)[taken]))
    escapes = free_flight.escapes(region, column, position, velocity)
    state = np.where(past_edge(position, region) | escapes, BOOKED, IN_CONTACT).astype(np.int8)
    state[: len(inside)] = IN_CONTACT
    names, table = material_numbers(source, bed)
    material = table[np.clip(source.material[taken], 0, len(table) - 1)]
    fields: dict[str, Any] = {
        "position": position, "velocity": velocity, "angular_velocity": np.zeros_like(position), "mass": mass,
        "radius": radius, "state": state, "stiffness": radius * _stiffness_per_radius(bed, names)[material],
    }  # fmt: skip
    return Particles(fields)


def _stiffness_per_radius(bed: Particles, names: list[str]) -> np.ndarray:
    """k_n / r [Pa] of each material: the median of the bed's grains of it, or of all."""
    ratio = bed.stiffness / bed.radius
    return np.array(
        [
            float(np.median(ratio[bed.material == k] if np.any(bed.material == k) else ratio))
            for k in range(max(len(names), 1))
        ]
    )


def compare(handoff: Handoff, source: Particles, column: Column, mapped: Ledger, bed: Particles) -> Table:
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
    straight = grains_of(handoff, source, bed, column)
    sums = correction.sums(
        straight.mass, straight.position, straight.velocity, straight.radius, straight.angular_velocity
    )
    grains = straight.select(straight.state == IN_CONTACT)
    bare = overlaps.measure(grains, region)
    excess = bare.beyond(lambda position: column.pressure_at(region.frame.height(position)))
    rows["direct"] = _row(sums, sums, handoff.sums.before, grains, bare, steps) | {
        "overlap_max_excess_over_r": excess.largest,
        "overlap_energy_excess_over_KE": _over(excess.energy, sums.kinetic),
        "release_speed_excess_m_s": float(excess.release_speed.max(initial=0.0)),
        "time_step_release_s": excess.step(overlap, steps),
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
