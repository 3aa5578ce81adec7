"""What a finished run of the shock stage says of itself: ``stage_report.json``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sph import flow_reynolds, timestep

if TYPE_CHECKING:
    from sph.simulation import Simulation


def of(run: Simulation) -> dict[str, Any]:
    """Counts, what limited the steps, drifts of the conserved quantities, the late stage, the flow's Reynolds number and warnings."""
    i, ball = run.integrator, run.impact
    mass = run.materials.bulk_density[run.materials.index(ball.projectile.material)] * ball.projectile.volume
    scale = {
        "energy_J": 0.5 * mass * ball.speed**2,
        "momentum_kg_m_s": mass * ball.speed,
        "angular_momentum_kg_m2_s": mass * ball.speed * run.radius * max(np.sin(ball.angle_from_vertical), 0.1),
    }
    drift = run.history.drift()
    return {
        "particles": len(i.cloud),
        "steps": i.steps,
        "step_limits": {name: int(n) for name, n in zip(timestep.REASONS, i.limits)},
        "list_builds": i.neighbourhood.builds,
        "gravity_evaluations": i.gravity_evaluations,
        "gravity_correction_max_rel": i.gravity_correction,
        "removed_angular_momentum_over_projectile": float(np.linalg.norm(i.torque_removed)) / scale["angular_momentum_kg_m2_s"],
        "projectile": {"mass_kg": mass, "kinetic_energy_J": scale["energy_J"], "momentum_kg_m_s": scale["momentum_kg_m_s"]},
        "late": run.late or None,
        "late_viscosity": {"alpha": i.damping.alpha, "beta": i.damping.beta} if run.thinned else None,
        "flow": {
            "definition": "Re = 20 v R / (alpha c hbar) of the flow below the crater (sph/flow_reynolds.py)",
            "least_allowed": flow_reynolds.REYNOLDS_LEAST,
            "series": run.flow,
        },
        "warnings": flow_reynolds.warnings(run.flow),
        "drift": drift,
        "drift_over_projectile": {name: drift[name] / scale[name] for name in drift},
        "peak_pressure_Pa": float(i.cloud.peak_pressure.max()),
        "mean_neighbours": float(i.cloud.neighbours[i.cloud.layer >= 0].mean()),
    }
