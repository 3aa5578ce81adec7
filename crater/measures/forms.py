"""Forms inside and around a crater: central peak or pit, terraces on the wall, and how diameter and rim vary over
azimuth."""

from __future__ import annotations

import numpy as np

from crater.ground.shape import Ruler, harmonics, sector_radii

BENCH, STEEP = 10.0, 25.0
"""A terrace is a bench below ``BENCH`` degrees between walls above ``STEEP`` degrees."""
BENCH_WIDTH = 1.5
"""Smallest width of a bench in spacings: three rings."""


def central_pit(floor: np.ndarray) -> tuple[float, float]:
    """Depth of a pit below the ridge around it and the ridge's prominence over the floor outside [m], from smoothed
    heights of the floor's rings (n,) from the axis outwards; zeros where the floor has no ridge that stands above
    both."""
    best = (0.0, 0.0)
    for p in range(1, len(floor) - 1):
        inner, outer = float(floor[:p].min()), float(floor[p + 1 :].min())
        prominence = float(floor[p]) - max(inner, outer)
        if prominence > best[1]:
            best = (float(floor[p]) - inner, prominence)
    return best


def terraces(s: np.ndarray, h: np.ndarray, d: np.ndarray, floor: float, rim: float) -> int:
    """Number of terraces on the wall of a smoothed profile h(s) between the ``floor`` and the ``rim`` radius [m];
    ``d`` (n,) local spacing [m]."""
    wall = (s >= floor) & (s <= rim)
    if wall.sum() < 3:
        return 0
    slope = np.degrees(np.arctan(np.diff(h[wall]) / np.diff(s[wall])))
    distance = s[wall]
    count, steep_before, begin = 0, False, -1
    for i, angle in enumerate(slope):
        if abs(angle) < BENCH:
            begin = i if begin < 0 else begin
        elif angle > STEEP:
            if (
                begin >= 0
                and steep_before
                and distance[i] - distance[begin] >= BENCH_WIDTH * float(np.interp(distance[begin], s, d))
            ):
                count += 1
            steep_before, begin = True, -1
    return count


def crest_heights(cells: np.ndarray, ruler: Ruler, rim: float) -> np.ndarray:
    """Height of the crest in every sector [m]: the highest smoothed ring within a quarter (at least two spacings) of
    the ``rim`` radius [m]."""
    d = float(np.interp(rim, ruler.s, ruler.d))
    near = np.abs(ruler.s - rim) <= max(0.25 * rim, 2.0 * d)
    return (ruler.fine @ cells)[near].max(axis=0) if near.any() else np.full(cells.shape[1], np.nan)


def by_azimuth(
    cells: np.ndarray, rounded: np.ndarray, ruler: Ruler, outermost: float, rim: float
) -> dict[str, list[float]]:
    """Apparent radius of every sector in ``cells`` as they lie, and its crest height in those that were made round,
    where the crest stands at ``rim`` all round; counted from +x of the crater's axes; NaN where there is none."""
    azimuth = (np.arange(cells.shape[1]) + 0.5) * 360.0 / cells.shape[1]
    radii = sector_radii(cells, ruler, outermost)
    crests = crest_heights(rounded, ruler, rim) if np.isfinite(rim) else np.full(cells.shape[1], np.nan)
    return {"azimuth_deg": azimuth.tolist(), "apparent_radius_m": radii.tolist(), "crest_height_m": crests.tolist()}


def rim_asymmetry(crests: np.ndarray) -> tuple[float, float, float]:
    """First harmonic of the crest height over azimuth divided by its mean, its standard error, and the azimuth of the
    highest side [deg]."""
    good = np.isfinite(crests)
    if good.sum() < 8:
        return float("nan"), float("nan"), float("nan")
    (mean, east, north, *_), scatter = harmonics(crests)
    if not mean > 0.0:
        return float("nan"), float("nan"), float("nan")
    error = scatter * np.sqrt(2.0 / good.sum()) / mean
    return float(np.hypot(east, north) / mean), float(error), float(np.degrees(np.arctan2(north, east)) % 360.0)
