"""How two craters differ: heights resampled on common rings, ratios of diameter, depth and volume with errors, and a
verdict.

Nothing is shifted or scaled unless the name says so: ``rms_inside_m`` compares heights on each one's own datum inside
1.5 rim radii of the larger crater, ``rms_m`` as far as both go (flat ground far out makes it small), ``rms_aligned_m``
after taking out the mean difference of the ground outside both craters (``offset_m``, stated), ``rms_shape`` compares
z / depth over r / R.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from crater.ground.radial_profile import Profile
from crater.ground.shape import apparent_radius
from crater.measures.profile_measures import measure_profile
from matter.errors import InputError
from matter.wording.crater_measures import RATIOS, TABLE

MATCH = {"rms_over_depth": 0.10, **{measure.name: measure.match for measure in TABLE if measure.match is not None}}
"""Largest relative difference that still counts as a match between independent craters."""
OUTSIDE = 1.5
"""The ground outside begins at this many apparent radii of the larger crater."""
INSIDE = 1.5
"""The crater and its rim end at this many rim radii of the larger crater (apparent radii, where neither has a rim)."""


def profile_difference(a: Profile, b: Profile, rim: float | None = None) -> dict[str, Any]:
    """Height differences (b minus a) of two profiles resampled on the coarser one's rings [m], area-weighted, where
    both exist.

    ``rms_inside_m`` within ``inside_m`` = 1.5 rim radii of the larger crater, and ``rms_over_depth``, the same over
    the depth of the deeper one; ``largest_m`` and ``largest_at_m``, the largest difference and its
    radius; ``rms_m`` and ``mean_m`` as far as both go, ``offset_m`` the mean outside both craters (None where they end
    before) and ``rms_aligned_m`` without it; ``rms_shape`` [1] of z / depth over r / apparent radius. ``rim`` [m] is
    the larger rim radius where it is known better than the profiles say it.

    Raises ``InputError`` when they overlap in fewer than three radii.
    """
    coarse, fine = (a, b) if len(a.radius) <= len(b.radius) else (b, a)
    sign = 1.0 if coarse is b else -1.0
    known = np.isfinite(fine.height)
    if known.sum() < 3:
        raise InputError("one of the profiles has fewer than three heights: nothing to compare")
    inside = (
        np.isfinite(coarse.height)
        & (coarse.radius >= fine.radius[known][0])
        & (coarse.radius <= fine.radius[known][-1])
    )
    if inside.sum() < 3:
        raise InputError("the profiles overlap in fewer than three radii: nothing to compare")
    r = coarse.radius[inside]
    difference = sign * (coarse.height[inside] - np.interp(r, fine.radius[known], fine.height[known]))
    weight = r * np.gradient(r)
    inner, reach = _inside(a, b, r, rim)
    rms = _rms(difference[inner], weight[inner])
    worst = int(np.argmax(np.abs(difference)))
    scale = max(-float(np.nanmin(a.height)), -float(np.nanmin(b.height)))
    offset = _offset(a, b, r, difference, weight)
    return {
        "rms_inside_m": rms,
        "inside_m": reach,
        "rms_m": _rms(difference, weight),
        "mean_m": float(np.average(difference, weights=weight)),
        "largest_m": float(difference[worst]),
        "largest_at_m": float(r[worst]),
        "from_m": float(r[0]),
        "to_m": float(r[-1]),
        "depth_scale_m": float(scale),
        "rms_over_depth": rms / scale if scale > 0.0 else None,
        "offset_m": offset,
        "rms_aligned_m": None if offset is None else _rms(difference - offset, weight),
        "rms_shape": _rms_of_shape(a, b),
    }


def _inside(a: Profile, b: Profile, r: np.ndarray, rim: float | None) -> tuple[np.ndarray, float]:
    """Mask of the radii ``r`` inside 1.5 rim radii of the larger crater, and where that ends [m]: at the end of ``r``
    where neither is a crater."""
    sizes = [size for size in ([rim] if rim else [rim_radius(profile) for profile in (a, b)]) if np.isfinite(size)]
    reach = min(INSIDE * max(sizes), float(r[-1])) if sizes else float(r[-1])
    inner = r <= reach
    return (inner, reach) if inner.sum() >= 3 else (np.ones(len(r), dtype=bool), float(r[-1]))


def rim_radius(profile: Profile) -> float:
    """Radius of the crest as read off a profile, or of the apparent rim where no crest stands up [m]; NaN without a
    crater."""
    quantities = measure_profile(profile)
    for name in ("diameter_rim_m", "diameter_apparent_m"):
        if name in quantities and quantities[name].value is not None:
            return 0.5 * float(quantities[name].value or 0.0)
    return float("nan")


def _rms(difference: np.ndarray, weight: np.ndarray) -> float:
    return float(np.sqrt(np.average(difference**2, weights=weight)))


def radius_and_depth(profile: Profile) -> tuple[float, float]:
    """Apparent radius and depth below the datum [m] as read off a profile; NaN where it has none."""
    known = np.isfinite(profile.height)
    s, h = profile.radius[known], profile.height[known]
    if len(s) < 3:
        return float("nan"), float("nan")
    floor = int(np.argmin(h))
    return apparent_radius(s, h, floor), -float(h[floor])


def _offset(a: Profile, b: Profile, r: np.ndarray, difference: np.ndarray, weight: np.ndarray) -> float | None:
    sizes = [radius_and_depth(profile)[0] for profile in (a, b)]
    if not np.isfinite(sizes).all():
        return None
    outside = r > OUTSIDE * max(sizes)
    return float(np.average(difference[outside], weights=weight[outside])) if outside.sum() >= 3 else None


def _rms_of_shape(a: Profile, b: Profile) -> float | None:
    """RMS of z / depth over r / R between the axis (or the first ring of either) and the end of the shorter profile,
    at most two radii."""
    scaled = []
    for profile in (a, b):
        radius, depth = radius_and_depth(profile)
        if not (np.isfinite(radius) and depth > 0.0):
            return None
        known = np.isfinite(profile.height)
        scaled.append((profile.radius[known] / radius, profile.height[known] / depth))
    low, high = max(x[0] for x, _ in scaled), min(2.0, *(x[-1] for x, _ in scaled))
    x = np.linspace(low, high, 100)
    first, second = (np.interp(x, u, z) for u, z in scaled)
    return _rms(second - first, x)


def resampled(profiles: list[Profile]) -> tuple[np.ndarray, np.ndarray]:
    """Common radii (n,) [m], as fine as the finest profile (at most 400), and heights (n, profiles) [m]; NaN where one
    has no ground."""
    far = max(float(p.radius[np.isfinite(p.height)][-1]) for p in profiles)
    step = max(min(float(np.median(np.diff(p.radius))) for p in profiles), far / 400.0)
    r = np.arange(0.0, far + 0.5 * step, step)
    heights = []
    for p in profiles:
        known = np.isfinite(p.height)
        z = np.interp(r, p.radius[known], p.height[known])
        heights.append(np.where((r >= p.radius[known][0] - step) & (r <= p.radius[known][-1]), z, np.nan))
    return r, np.column_stack(heights)


def ratio(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, bool]:
    """b / a, its error, and whether they agree within one joint error; a and b are (value, minus, plus) and the errors
    facing each other count.

    An error that is not known (NaN) counts as none; the error of the ratio is NaN where neither has one.
    """
    low, high = (a, b) if a[0] <= b[0] else (b, a)
    joint = float(np.hypot(*np.nan_to_num([low[2], high[1]])))
    value = b[0] / a[0]
    relative_errors = [max(np.nan_to_num(x[1:])) / abs(x[0]) for x in (a, b)]
    known = any(np.isfinite(x[1:]).any() for x in (a, b))
    return (
        value,
        abs(value) * float(np.hypot(*relative_errors)) if known else float("nan"),
        bool(abs(a[0] - b[0]) <= joint),
    )


def verdict(
    a: dict[str, tuple[float, float, float]], b: dict[str, tuple[float, float, float]], heights: dict[str, Any] | None
) -> dict[str, Any]:
    """Ratios of what both state, each with ``error``, ``within_errors`` and ``match`` (limits in ``MATCH``), and the
    same for the RMS over depth."""
    result: dict[str, Any] = {}
    for name in RATIOS:
        if name in a and name in b and a[name][0] > 0.0:
            value, error, agree = ratio(a[name], b[name])
            result[name] = {
                "ratio": value,
                "error": error,
                "within_errors": agree,
                "match": abs(value - 1.0) <= MATCH[name],
            }
    if heights is not None and heights["rms_over_depth"] is not None:
        result["rms_over_depth"] = {
            "value": heights["rms_over_depth"],
            "match": heights["rms_over_depth"] <= MATCH["rms_over_depth"],
        }
    return result
