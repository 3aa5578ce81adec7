"""Bodies so large that their curvature is nothing to the crater: flat ground costs less."""

from __future__ import annotations

from typing import Any

LARGE = 1000.0
"""Radius of a body over that of the projectile from which on its curvature is nothing to the crater."""


def advice(sph: Any) -> str:
    """What to take instead of the body that the settings of a shock stage name, under the gravity at the site; empty
    for other targets, and where the ground there weighs nothing (a fast spin)."""
    from dem.beds import patch  # numba is loaded where a stage is needed
    from sph.planning import durations

    target, materials = sph.target, sph.chosen_materials()
    times = target.radius / sph.impact.projectile.radius
    if target.flat or times <= LARGE:
        return ""
    if target.solid:
        gravity = patch.expected_gravity(target, materials.at_rest)
    else:
        gravity = durations.surface_gravity(target, materials)
    if gravity <= 0.0:
        return ""
    return (
        f"the target is {times:,.0f} times as large as the projectile, and its curvature is nothing to this crater: "
        f"take it as a half space, "
        f'[target] shape = "half_space", gravity = "{gravity:.3g} m/s^2", with its uppermost layer'
    )
