"""The cloud of the shock stage as a snapshot, with what says how a crater in it is measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from matter.files import snapshot
from matter.particles import Particles
from sph.bodies import ground as grounds
from sph.bodies import symmetry
from sph.bodies import target as bodies
from sph.materials import temperature
from sph.settings import Settings
from sph.shock_states import release_phases
from sph.stepping import state
from sph.stepping.integrator import Integrator

XX, XY, XZ, YY, YZ, ZZ = range(6)


def particles(
    integrator: Integrator, settings: Settings, column: bodies.Profile | grounds.Ground, radius: float
) -> Particles:
    """The cloud as a snapshot, in order of identity. ``column`` is the undisturbed target, ``radius`` [m] its own
    where it is a body."""
    i, c, bottom = integrator, integrator.cloud, column.bottom if isinstance(column, grounds.Ground) else 0.0
    damage = state.damage_of(c, i.materials.rows)
    whole = i.materials.rows.mixes_damage[c.material] > 0
    deviator = np.empty((len(c), 6))
    fraction = np.where(whole, 1.0, 1.0 - damage) / i.forces.evaluated.distention
    np.multiply(fraction[:, None], c.stress, out=deviator[:, :ZZ])
    deviator[:, ZZ] = -(deviator[:, XX] + deviator[:, YY])
    fields = {
        "identity": c.identity, "position": c.position, "velocity": c.velocity, "mass": c.mass,
        "density": c.density,
        "specific_energy": c.specific_energy, "smoothing_length": c.support_radius,
        "pressure": i.forces.evaluated.pressure,
        "deviatoric_stress": deviator, "damage": damage,
        "distention": i.forces.evaluated.distention, "material": c.material, "layer": c.layer,
        "sound_speed": i.forces.evaluated.sound,
        "peak_pressure": c.peak_pressure, "gravity": c.gravity, "initial_position": c.initial_position,
        "neighbours": c.neighbours,
        **({"plastic_strain": c.plastic_strain} if len(c.plastic_strain) else {}),
        **({"vibration": c.vibration} if len(c.vibration) else {}),
        **temperature.fields(c.material, i.rows, i.forces.evaluated.distention * c.density, c.specific_energy),
    }  # fmt: skip
    names = list(dict.fromkeys(i.materials.names))  # variants of the ground between blocks are one material
    fields["material"] = np.array([names.index(name) for name in i.materials.names])[c.material]
    if len(c.block):
        fields["block"] = c.block
    order = np.argsort(c.identity)
    attributes = {
        "time": i.time,
        "stage": "sph",
        "frame": settings.target.frame,
        "materials": names,
        "layers": [layer.name for layer in settings.target.layers],
        **({"target_depth_m": -bottom} if settings.target.flat else {"target_radius_m": radius}),
        "spacing_at_impact_m": settings.spacing_at_impact,
        **({} if settings.target.solid else {"measuring": measuring(settings, column, radius)}),
        "shear_moduli_Pa": i.rows.shear[: len(names)].tolist(),
        "reference_densities_kg_m3": i.rows.rho0[: len(names)].tolist(),
        **({"block_model": shaking} if (shaking := i.materials.decay()) else {}),
        **({"release": phases} if (phases := release_phases.phase_thresholds(i.materials)) else {}),
    }
    part = Particles({name: array[order] for name, array in fields.items()}, attributes)
    return symmetry.whole(part, settings.symmetry)


def measuring(settings: Settings, column: bodies.Profile | grounds.Ground, radius: float) -> dict[str, Any]:
    """How a crater in these snapshots is measured (``crater.results.measurement_config``): datum, gravity, expected
    size, and the ground before the impact."""
    size = settings.impact.expected_transient_diameter
    datum: dict[str, Any] = {"kind": "plane", "centre_m": [0.0, 0.0, 0.0], "source": "undisturbed ground"}
    gravity = settings.target.gravity
    if isinstance(column, bodies.Profile):
        datum = {
            "kind": "sphere",
            "radius_m": radius,
            "centre_m": [0.0, 0.0, 0.0],
            "source": "radius of the relaxed target",
        }
        gravity = float(column.gravity[-1])
    return {
        "datum": datum,
        "gravity_m_s2": gravity,
        "expected_transient_diameter_m": size,
        "before": f"snap_0000{snapshot.SUFFIX}",
    }
