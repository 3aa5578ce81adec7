"""What a finished run of the shock stage says of itself: ``stage_report.json``."""

from __future__ import annotations

from typing import Any

import numpy as np

from sph.bodies import symmetry
from sph.boundary import dispatch as boundaries
from sph.boundary.external_budget import COLUMNS
from sph.outcome import block_fates, energy_check, escaping
from sph.planning import durations
from sph.shock_states import impedance
from sph.simulation import Simulation
from sph.stepping import flow_reynolds, sides_and_floor, timestep


def stage_summary(run: Simulation) -> dict[str, Any]:
    """Counts, what limited the steps, drifts of the conserved quantities, the late stage, the flow's Reynolds number
    and warnings."""
    i, ball, s = run.integrator, run.impact, run.settings
    mass = run.materials.bulk_density[run.materials.index(ball.projectile.material)] * ball.projectile.volume
    scale = {
        "energy_J": 0.5 * mass * ball.speed**2,
        "momentum_kg_m_s": mass * ball.speed,
        "angular_momentum_kg_m2_s": mass * ball.speed * run.radius * max(np.sin(ball.angle_from_vertical), 0.1),
    }
    drift, checked = run.history.drift(), energy_check.energy_balance(run)
    by_rows = drift["energy_J"]
    if checked is not None:
        drift["energy_J"] = checked["largest_J"]
    return {
        "particles": len(i.cloud),
        "steps": i.steps,
        "step_limits": {name: int(n) for name, n in zip(timestep.REASONS, i.step_limit.counts)},
        "list_builds": i.neighbourhood.builds,
        "gravity_evaluations": i.gravity.evaluations,
        "gravity_correction_max_rel": i.gravity.correction,
        "removed_angular_momentum_over_projectile": float(np.linalg.norm(i.torque.removed))
        / scale["angular_momentum_kg_m2_s"],
        "removed_angular_momentum_over_all": float(np.linalg.norm(i.torque.removed)) / max(_turning(run), 1e-300),
        "projectile": {
            "mass_kg": mass, "kinetic_energy_J": scale["energy_J"], "momentum_kg_m_s": scale["momentum_kg_m_s"],
            **_resolution(run),
        },
        "expected_growth_s": durations.crater_time(s.target, s.impact, run.materials, s.strength, s.damage),
        **({"blocks": run.rubble | block_fates.fates(run)} if run.rubble else {}),
        "late": run.late[0] if run.late else None,
        "late_slower": run.late[1:],
        "late_viscosity": {"alpha": i.damping.alpha, "beta": i.damping.beta} if run.viscosity_reduced else None,
        "flow": {
            "definition": "Re = 20 v R / (alpha c hbar) of the flow below the crater (sph/stepping/flow_reynolds.py)",
            "least_allowed": flow_reynolds.REYNOLDS_LEAST,
            "series": run.flow,
        },
        "individual_steps": {
            "definition": "step of each particle over the shortest, by powers of two, neighbours within a factor of "
                          "4; visits saved (sph/stepping/individual_steps.py)",
            "series": run.individual,
        },
        "warnings": flow_reynolds.warnings(run.flow),
        "drift": drift,
        "energy_check": checked,
        "energy_by_rows_over_projectile": by_rows / scale["energy_J"],
        "drift_over_projectile": {name: drift[name] / scale[name] for name in drift},
        "edges": _edges(run),
        "escaping": escaping.escaping_mass(run),
        "peak_pressure": _pressures(run),
        "peak_pressure_Pa": float(i.cloud.peak_pressure.max()),
        "mean_neighbours": float(i.cloud.neighbours[i.cloud.layer >= 0].mean()),
    }  # fmt: skip


def _turning(job: Simulation) -> float:
    """Angular momentum of body and projectile at the first row of the history [kg m^2/s]."""
    first = job.history.rows[0]
    return float(np.linalg.norm([float(first[f"angular_momentum_{axis}"]) for axis in "xyz"]))


def _resolution(job: Simulation) -> dict[str, Any]:
    """Number of projectile particles, and its radius over their spacing (V / n)^(1/3): what grid codes quote as cells
    per projectile radius."""
    ball = job.impact.projectile
    count = symmetry.copies(job.settings.symmetry) * int((job.integrator.cloud.layer < 0).sum())
    return {
        "particles": count,
        "particles_per_radius": ball.radius / (ball.volume / count) ** (1.0 / 3.0) if count else None,
    }


def _edges(job: Simulation) -> dict[str, Any] | None:
    """The boundaries of flat ground and what they absorbed: momentum [kg m/s], net of the weight that they carry, and
    energy [J]. None without boundaries; a value is None where the checkpoint of the run lacks the budget.

    ``passing`` names boundaries that take no momentum. The rest is booked by ``sph.boundary.external_budget``; the
    difference from p(0) - p(end) is the drift of momentum.
    """
    s = job.settings
    side, floor = sides_and_floor.chosen(s.target, s.sides, s.floor)
    chosen, taking = {"sides": side, "floor": floor}, boundaries.having("TAKES_MOMENTUM")
    if not set(chosen.values()) & set(taking):
        return None
    passing = [direction for direction, name in chosen.items() if name not in ("free", *taking)]
    more = {"passing": passing} if passing else {}
    first, last = (
        np.array([float(row[name]) for name in COLUMNS]) for row in (job.history.rows[0], job.history.rows[-1])
    )
    took = dict(zip(COLUMNS, (first - last).tolist()))
    known = np.isfinite(first - last).all()
    return {
        **chosen,
        **more,
        "momentum_taken_kg_m_s": [took[f"outside_momentum_{axis}"] for axis in "xyz"] if known else None,
        "energy_taken_J": took["outside_energy_J"] if known else None,
    }


def _pressures(job: Simulation) -> dict[str, Any]:
    """Largest pressures so far [Pa]: of single particles, by fractions of the projectile's mass, and the planar limit
    at the vertical speed beside them."""
    cloud, ball = job.integrator.cloud, job.impact
    mine = cloud.layer < 0
    pressures: dict[str, Any] = {"target_largest_Pa": float(cloud.peak_pressure[~mine].max())}
    if mine.any():
        peak, mass = cloud.peak_pressure[mine], cloud.mass[mine]
        pressures |= {
            "projectile_largest_Pa": float(peak.max()),
            "projectile_half_Pa": _reached(peak, mass, 0.5),
            "projectile_nine_tenths_Pa": _reached(peak, mass, 0.9),
        }
    speed = ball.speed * float(np.cos(ball.angle_from_vertical))
    try:
        match = impedance.planar(
            job.materials, ball.projectile.material, job.settings.target.layers[-1].material, speed
        )
        limit: dict[str, Any] = {"planar_limit_Pa": match.pressure}
    except ValueError as reason:
        limit = {"planar_limit_Pa": None, "planar_limit_note": str(reason)}
    return pressures | limit | {"planar_speed_m_s": speed}


def _reached(peak: np.ndarray, mass: np.ndarray, fraction: float) -> float:
    """The pressure that this ``fraction`` of the ``mass`` reached or passed."""
    order = np.argsort(-peak)
    at = int(np.searchsorted(np.cumsum(mass[order]), fraction * mass.sum() * (1.0 - 1e-12)))
    return float(peak[order][min(at, len(order) - 1)])
