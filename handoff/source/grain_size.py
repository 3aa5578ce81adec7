"""The size of a bed's grains where the cavity is: grains of flat ground may grow outwards from the impact."""

from __future__ import annotations

from matter.errors import InputError
from matter.particles import Particles


def at_impact(bed: Particles) -> float:
    """Mean radius [m] of the grains that carry the crater: that at the impact of a bed that says how its grains grow
    (attribute ``grading``), else of all. Raises ``InputError`` for one that is no length."""
    said = bed.attributes.get("grading")
    radius = float(bed.radius.mean() if said is None else said.get("radius_m", 0.0))
    if not radius > 0.0:
        raise InputError(f"the bed's attribute 'grading' says a radius_m of {radius:g}: it must be positive")
    return radius
