"""Numbers read off one radial profile: floor, apparent radius, crest, volume, slope. Everything here is plain
arithmetic on ring means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from crater.ground import surface_smoothing
from crater.ground.datum import Datum
from crater.ground.radial_profile import Relief


@dataclass(frozen=True)
class Ruler:
    """Linear maps prepared once for a set of rings ``s`` [m] of local spacing ``d`` [m] and ``area`` [m^2].

    ``sharpen`` undoes the colour field's rounding, ``fine`` and ``broad`` are local quadratic regressions (widths for
    walls and for floors).
    """

    s: np.ndarray
    d: np.ndarray
    area: np.ndarray
    sharpen: np.ndarray
    fine: np.ndarray
    broad: np.ndarray

    def sharpened(self, h: np.ndarray) -> np.ndarray:
        """Heights (rings,) or (rings, sectors) with the rounding undone."""
        return surface_smoothing.sharpened(self.s, self.d, h, self.sharpen)


def make_ruler(ground: Relief, scale: float, mean: np.ndarray) -> Ruler:
    """``scale`` [m] is a first guess of the crater's radius, ``mean`` the ring means: they set how far and where the
    floor may be smoothed."""
    columns = ground.columns
    s, d = columns.distance, columns.spacing
    area = ground.datum.area_between(columns.edges[:-1], columns.edges[1:])
    sharpen = surface_smoothing.inverse(s, d)
    fine = _local_quadratic(s, area, np.maximum(1.5 * d, 0.08 * scale))
    # the floor is smoothed without the wall: what lies below 0.6 of the deepest ring inside the crater
    seen = fine @ surface_smoothing.sharpened(s, d, mean, sharpen)
    inside = s < 0.9 * scale
    deepest = float(seen[inside].min()) if inside.any() else float(seen.min())
    bottom = inside & (seen < 0.6 * deepest) if deepest < 0.0 else inside
    broad = np.full((len(s), len(s)), np.nan)
    rows = np.flatnonzero(bottom)
    if len(rows):
        local = _local_quadratic(s[rows], area[rows], np.maximum(4.5 * d, 0.3 * scale)[rows], power=1)
        broad[np.ix_(rows, np.arange(len(s)))] = 0.0
        broad[np.ix_(rows, rows)] = local
    return Ruler(s, d, area, sharpen, fine, broad)


def _local_quadratic(s: np.ndarray, area: np.ndarray, width: np.ndarray, power: int = 2) -> np.ndarray:
    """Matrix of a local quadratic regression, weights area times (1 - u^2)^power, even about the axis: exact for
    paraboloids."""
    mirrored = np.concatenate([-s[::-1], s])
    weight = np.concatenate([area[::-1], area])
    n = len(s)
    result = np.zeros((n, n))
    for i in range(n):
        u = (mirrored - s[i]) / width[i]
        use = np.flatnonzero(np.abs(u) < 1.0)
        w = np.sqrt(weight[use] * (1.0 - u[use] ** 2) ** power)
        basis = np.vander(u[use], 3, increasing=True) if len(use) >= 5 else np.ones((len(use), 1))
        row = np.linalg.pinv(basis * w[:, None])[0] * w
        np.add.at(result[i], np.where(use < n, n - 1 - use, use - n), row)
    return result


def apparent_radius(s: np.ndarray, h: np.ndarray, floor: int) -> float:
    """Distance at which a profile first rises through the datum outside ring ``floor`` [m]; NaN if it does not."""
    above = np.flatnonzero(h[floor:] >= 0.0)
    if len(above) == 0 or above[0] == 0:
        return float("nan")
    i = floor + above[0]
    return float(s[i - 1] + (s[i] - s[i - 1]) * h[i - 1] / (h[i - 1] - h[i]))


KNOTS = 51
"""Trial positions of the crest."""


@dataclass(frozen=True)
class CrestFinder:
    """Crest of a profile as the colour field shows it: two parabolas that meet at a knot, each passed through the same
    rounding.

    ``use`` are the rings, ``knots`` [m] the trial positions; ``solve`` and ``reject`` the matrices of the
    least-squares fits; the crest is looked for between ``low`` and ``high`` [m].
    """

    use: np.ndarray
    knots: np.ndarray
    solve: np.ndarray
    reject: np.ndarray
    low: float
    high: float
    scale: float

    def find(self, h: np.ndarray) -> tuple[float, float]:
        """Distance and height of the crest [m], of the true profile: the best fit that has a crest inside the window;
        else NaN."""
        y = h[self.use]
        misfit = ((self.reject @ y) ** 2).sum(axis=1)
        for k in np.argsort(misfit):
            position, height = self._top(float(self.knots[k]), *(self.solve[k] @ y))
            if self.low < position < self.high:
                return position, height
        return float("nan"), float("nan")

    def _top(self, knot: float, c: float, a1: float, b1: float, a2: float, b2: float) -> tuple[float, float]:
        """Highest point of the two parabolas if it is a maximum: the knot, or the vertex of one side; else NaN."""
        if a1 >= 0.0 >= a2:
            return knot, c
        best = (float("nan"), -np.inf)
        for slope, bend, side in ((a1, b1, -1.0), (a2, b2, 1.0)):
            if bend < 0.0 and side * slope > 0.0:
                vertex = -slope / (2.0 * bend)
                if c - slope**2 / (4.0 * bend) > best[1]:
                    best = (knot + self.scale * vertex, c - slope**2 / (4.0 * bend))
        return best


def _two_parabolas(knot: float, scale: float):
    """Constant, and inner and outer powers of the distance to the knot in units of ``scale`` [m] (so that the fit is
    well conditioned)."""
    return (
        lambda s: np.ones_like(s),
        lambda s: np.minimum((s - knot) / scale, 0.0),
        lambda s: np.minimum((s - knot) / scale, 0.0) ** 2,
        lambda s: np.maximum((s - knot) / scale, 0.0),
        lambda s: np.maximum((s - knot) / scale, 0.0) ** 2,
    )


def make_crest_finder(ruler: Ruler, mean: np.ndarray, apparent: float, depth: float) -> CrestFinder | None:
    """Prepare the search for the crest of the profile ``mean`` beyond its ``apparent`` radius [m]; None where no ring
    rises above the datum.

    The window starts on the wall a quarter of the ``depth`` below the datum, and ends 0.4 radii (at least four
    spacings) beyond the highest ring.
    """
    d = float(np.interp(apparent, ruler.s, ruler.d))
    fine = ruler.fine @ mean
    ring = np.flatnonzero((ruler.s > apparent - 0.25 * d) & (ruler.s < max(1.8 * apparent, apparent + 3.0 * d)))
    if len(ring) < 3 or fine[ring].max() <= 0.0:
        return None
    first = float(ruler.s[ring[int(np.argmax(fine[ring]))]])
    low_wall = ruler.s[(mean < -0.25 * depth) & (ruler.s < apparent)]
    inner = max(first - max(2.5 * d, 0.25 * apparent), float(low_wall[-1]) if len(low_wall) else 0.0)
    use = np.flatnonzero((ruler.s > inner) & (ruler.s < first + max(4.0 * d, 0.4 * apparent)))
    if len(use) < 8:
        return None
    s, w = ruler.s[use], np.sqrt(ruler.area[use])
    # the highest ring of a broad crest may be far from its top, and the bootstrap must be free to find it elsewhere
    knots = np.linspace(first - max(1.25 * d, 0.2 * apparent), first + max(1.25 * d, 0.2 * apparent), KNOTS)
    knots = knots[(knots > s[1]) & (knots < s[-4])]
    solve, reject, where = [], [], surface_smoothing.averaging_centres(s, ruler.d[use])
    for knot in knots:
        basis = np.column_stack([surface_smoothing.averaged(part, where) for part in _two_parabolas(knot, d)])
        inverse = np.linalg.pinv(basis * w[:, None], rcond=1e-9) * w[None, :]
        solve.append(inverse)
        reject.append(w[:, None] * (np.eye(len(s)) - basis @ inverse))
    if not solve:
        return None
    reach = max(2.0 * d, 0.3 * apparent)
    return CrestFinder(use, knots, np.array(solve), np.array(reject), max(apparent, first - reach), first + reach, d)


def volume_below(ruler: Ruler, datum: Datum, h: np.ndarray, radius: float) -> float:
    """Volume between the datum and the ground inside ``radius`` [m^3]; on a sphere dV = (R^3 - (R + h)^3) / 3 per
    solid angle."""
    depth = -h * (1.0 + h / datum.radius + h**2 / (3.0 * datum.radius**2)) if datum.is_sphere else -h
    half = 0.5 * (ruler.s[1] - ruler.s[0]) if len(ruler.s) > 1 else 0.0
    edges = np.concatenate([[0.0], 0.5 * (ruler.s[1:] + ruler.s[:-1]), [ruler.s[-1] + half]])
    fraction = np.clip((radius - edges[:-1]) / (edges[1:] - edges[:-1]), 0.0, 1.0)
    total = float(np.sum(np.where(fraction >= 1.0, depth * ruler.area, 0.0)))
    for i in np.flatnonzero((fraction > 0.0) & (fraction < 1.0)):
        # the ring in which the wall leaves the datum: its inner part is a wedge that thins to zero
        total += max(0.0, -0.5 * float(np.interp(edges[i], ruler.s, h))) * fraction[i] * float(ruler.area[i])
    return total


@dataclass(frozen=True)
class Shape:
    """Plain numbers of one profile [m, m^3, deg]; NaN where a measure does not exist."""

    depth: float
    apparent: float
    rim: float
    rim_height: float
    volume: float
    slope: float
    floor_radius: float

    def as_array(self) -> np.ndarray:
        """All numbers, in the order of the fields."""
        return np.array([getattr(self, name) for name in self.__dataclass_fields__])

    def sizes(self) -> dict[str, float]:
        """Those that every method gives, by the names of the measures (``matter.wording.crater_measures``)."""
        return {
            "depth_m": self.depth,
            "diameter_apparent_m": 2.0 * self.apparent,
            "diameter_rim_m": 2.0 * self.rim,
            "rim_height_m": self.rim_height,
            "depth_rim_to_floor_m": self.depth + self.rim_height,
            "volume_m3": self.volume,
        }


def shape_of(mean: np.ndarray, ruler: Ruler, datum: Datum, finder: CrestFinder | None, outermost: float) -> Shape:
    """Numbers of the profile ``mean`` of ring means as the colour field shows them (gaps closed); the floor lies
    inside ``outermost`` [m].

    Floor radius: where the wall has risen by a tenth of the depth.
    """
    sharp = ruler.sharpened(mean)
    fine, broad = ruler.fine @ sharp, ruler.broad @ sharp
    broad = np.where((ruler.s < outermost) & np.isfinite(broad), broad, np.inf)
    floor = int(np.argmin(broad))
    if not np.isfinite(broad[floor]):
        return Shape(*([float("nan")] * len(Shape.__dataclass_fields__)))
    depth = -float(broad[floor])
    apparent = apparent_radius(ruler.s, fine, floor)
    rim, rim_height = finder.find(mean) if finder is not None else (float("nan"), float("nan"))
    volume = slope = floor_radius = float("nan")
    if np.isfinite(apparent):
        volume = volume_below(ruler, datum, sharp, apparent)
        floor_radius = apparent_radius(ruler.s, fine - 0.9 * float(fine[floor]), floor)
        wall = (ruler.s[1:] > ruler.s[floor]) & (ruler.s[:-1] < apparent)
        if wall.any():
            slope = float(np.degrees(np.arctan(np.max((np.diff(fine) / np.diff(ruler.s))[wall]))))
    return Shape(depth, apparent, rim, rim_height, volume, slope, floor_radius)


def sector_radii(cells: np.ndarray, ruler: Ruler, floor_limit: float) -> np.ndarray:
    """Apparent radius of every sector [m]; NaN where the wall does not reach the datum."""
    smooth = ruler.fine @ cells
    inside = ruler.s < floor_limit
    radii = np.full(cells.shape[1], np.nan)
    for k in range(cells.shape[1]):
        floor = int(np.argmin(np.where(inside, smooth[:, k], np.inf)))
        radii[k] = apparent_radius(ruler.s, smooth[:, k], floor)
    return radii


def harmonics(radii: np.ndarray) -> tuple[np.ndarray, float]:
    """(mean, cos, sin, cos 2, sin 2) amplitudes of the radii over azimuth by a robust fit, and the scatter about it
    [m]."""
    good = np.isfinite(radii)
    azimuth = (np.arange(len(radii)) + 0.5) * 2.0 * np.pi / len(radii)
    basis = np.column_stack(
        [np.ones(len(radii)), np.cos(azimuth), np.sin(azimuth), np.cos(2 * azimuth), np.sin(2 * azimuth)]
    )[good]
    r = radii[good]
    if len(r) < 8:
        return np.array([np.mean(r) if len(r) else np.nan, 0.0, 0.0, 0.0, 0.0]), float("nan")
    scale = max(1.4826 * float(np.median(np.abs(r - np.median(r)))), 1e-6 * float(np.median(r)))
    start = np.array([np.median(r), 0.0, 0.0, 0.0, 0.0])
    fit = least_squares(lambda p: (basis @ p - r) / scale, start, loss="soft_l1", x_scale=scale)
    left = basis @ fit.x - r
    return fit.x, 1.4826 * float(np.median(np.abs(left)))
