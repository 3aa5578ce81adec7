"""Measures of a radial profile alone: a user's CSV file, a published section."""

from __future__ import annotations

import numpy as np

from crater.ground.radial_profile import Profile
from crater.ground.shape import apparent_radius
from crater.measures.measure import Quantity


def measure_profile(profile: Profile) -> dict[str, Quantity]:
    """Measures of a radial profile alone (no cloud): read off its points; sigma from the band, None where it has none.

    ``depth_m``, ``diameter_apparent_m``, ``diameter_rim_m``, ``rim_height_m``, ``depth_rim_to_floor_m`` and
    ``volume_m3`` (of revolution, on a plane).
    """
    known = np.isfinite(profile.height)
    s, h = profile.radius[known], profile.height[known]
    floor = int(np.argmin(h))
    band = 0.5 * (profile.p84 - profile.p16)[known] / np.sqrt(np.maximum(profile.count[known], 1))
    result = {"depth_m": Quantity(-float(h[floor]), _known(band[floor]), "m")}
    apparent = apparent_radius(s, h, floor)
    if not np.isfinite(apparent):
        return result
    slope = max(float(np.interp(apparent, s, np.gradient(h, s))), 1e-3)
    result["diameter_apparent_m"] = Quantity(2.0 * apparent, _known(2.0 * np.interp(apparent, s, band) / slope), "m")
    inside = s < apparent
    r, z = np.concatenate([[0.0], s[inside], [apparent]]), np.concatenate([h[inside][:1], h[inside], [0.0]])
    result["volume_m3"] = Quantity(float(np.trapezoid(-z * 2.0 * np.pi * r, r)), None, "m^3")
    outside = np.flatnonzero(s > apparent)
    if len(outside) > 2:
        crest = outside[int(np.argmax(np.where(s[outside] < 2.0 * apparent, h[outside], -np.inf)))]
        if h[crest] > 0.0 and crest + 1 < len(s):
            step = float(np.gradient(s)[crest])
            result["diameter_rim_m"] = Quantity(2.0 * float(s[crest]), step, "m")
            result["rim_height_m"] = Quantity(float(h[crest]), _known(band[crest]), "m")
            result["depth_rim_to_floor_m"] = Quantity(
                float(h[crest] - h[floor]), _known(np.hypot(band[crest], band[floor])), "m"
            )
    return result


def _known(sigma: float) -> float | None:
    """An error that is a number, else None: a profile drawn by hand states none."""
    return float(sigma) if np.isfinite(sigma) else None
