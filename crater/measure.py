"""Measures of a crater: diameters, depths, rim, volume, each with an error made of azimuth, resolution and method in quadrature.

Definitions (Melosh 1989; Turtle et al. 2005; Robbins et al. 2018):
apparent diameter: twice the mean distance at which the wall meets the datum; rim diameter: twice the distance of the crest; depth: datum to
floor; rim-to-floor depth: crest to floor; volume: between datum and ground inside the apparent diameter.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from crater import cloud as clouds
from crater import locate, smoothing
from crater.datum import Datum, of_frame
from crater.radial_profile import Profile, Relief, profile_of, ring_mean
from matter.errors import InputError
from matter.particles import Particles

BOOTSTRAPS = 200
RESOLUTION_HEIGHT = 0.06
RESOLUTION_DIAMETER = 0.1
RESOLUTION_CREST = 0.3
"""Systematic errors in local spacings that azimuthal averaging does not remove; calibrated in tests/crater/test_coverage.py."""
UNITS = {
    "diameter_rim_m": "m",
    "diameter_apparent_m": "m",
    "depth_m": "m",
    "depth_rim_to_floor_m": "m",
    "rim_height_m": "m",
    "volume_m3": "m^3",
    "depth_over_diameter": "1",
    "wall_slope_deg": "deg",
    "ellipticity": "1",
}


@dataclass(frozen=True)
class Quantity:
    """A value with its standard error; ``value`` is None where it cannot be stated, and ``reason`` says why."""

    value: float | None
    sigma: float | None
    unit: str
    reason: str = ""
    parts: dict[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict:
        """``{"value", "sigma", "unit"}``, and ``reason`` or the ``parts`` of sigma where there are any."""
        result: dict = {"value": self.value, "sigma": self.sigma, "unit": self.unit}
        if self.reason:
            result["reason"] = self.reason
        if self.parts:
            result["sigma_parts"] = self.parts
        return result


@dataclass(frozen=True)
class Measures:
    """Named ``quantities`` of one crater, its ``profile``, the ``datum`` (axis through the crater's centre) and the ``ground``."""

    quantities: dict[str, Quantity]
    profile: Profile
    datum: Datum
    ground: Relief
    notes: dict[str, object] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Quantity:
        return self.quantities[name]

    def as_dict(self) -> dict:
        """JSON-ready."""
        return {**{name: q.as_dict() for name, q in self.quantities.items()}, **self.notes}


@dataclass(frozen=True)
class Ruler:
    """Linear maps prepared once for a set of rings: smoothing of a profile, areas, crest candidates."""

    s: np.ndarray
    d: np.ndarray
    area: np.ndarray
    sharpen: np.ndarray
    fine: np.ndarray
    broad: np.ndarray


def make_ruler(ground: Relief, scale: float) -> Ruler:
    """``scale`` [m] is a first guess of the crater's radius (sets how far the floor may be smoothed)."""
    columns = ground.columns
    s, d = columns.distance, columns.spacing
    area = ground.datum.area_between(columns.edges[:-1], columns.edges[1:])
    fine = _local_quadratic(s, area, np.maximum(1.5 * d, 0.08 * scale))
    broad = _local_quadratic(s, area, np.maximum(2.5 * d, 0.25 * scale))
    sharpen = smoothing.inverse(s, d)
    return Ruler(s, d, area, sharpen, fine @ sharpen, broad @ sharpen)


def _local_quadratic(s: np.ndarray, area: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Matrix of a local quadratic regression, weights area times (1 - u^2)^2, even about the axis: exact for paraboloids."""
    mirrored = np.concatenate([-s[::-1], s])
    weight = np.concatenate([area[::-1], area])
    n = len(s)
    result = np.zeros((n, n))
    for i in range(n):
        u = (mirrored - s[i]) / width[i]
        use = np.flatnonzero(np.abs(u) < 1.0)
        w = np.sqrt(weight[use]) * (1.0 - u[use] ** 2)
        basis = np.vander(u[use], 3, increasing=True) if len(use) >= 5 else np.ones((len(use), 1))
        row = np.linalg.pinv(basis * w[:, None])[0] * w
        for k, value in zip(use, row):
            result[i, n - 1 - k if k < n else k - n] += value
    return result


def apparent_radius(s: np.ndarray, h: np.ndarray, floor: int) -> float:
    """Distance at which a profile first rises through the datum outside ring ``floor`` [m]; NaN if it does not."""
    above = np.flatnonzero(h[floor:] >= 0.0)
    if len(above) == 0 or above[0] == 0:
        return float("nan")
    i = floor + above[0]
    return float(s[i - 1] + (s[i] - s[i - 1]) * h[i - 1] / (h[i - 1] - h[i]))


@dataclass(frozen=True)
class CrestFinder:
    """Crest of a profile between ``lo`` and ``hi``: two parabolas that meet at a knot, the knot with the least residual."""

    use: np.ndarray
    knots: np.ndarray
    solve: np.ndarray
    reject: np.ndarray
    half: float

    def find(self, h: np.ndarray) -> tuple[float, float]:
        """Distance and height of the crest [m]."""
        y = h[self.use]
        misfit = ((self.reject @ y) ** 2).sum(axis=1)
        k = int(np.argmin(misfit))
        c, a1, b1, a2, b2 = self.solve[k] @ y
        best = (float(self.knots[k]), float(c))
        for slope, bend, sign in ((a1, b1, -1.0), (a2, b2, 1.0)):
            if sign * slope > 0.0 and bend < 0.0:  # rounded crest: the vertex of that side
                x = -slope / (2.0 * bend)
                if 0.0 < sign * x < self.half and c - slope**2 / (4.0 * bend) > best[1]:
                    best = (float(self.knots[k] + x), float(c - slope**2 / (4.0 * bend)))
        return best


def _two_parabolas(knot: float):
    return (
        lambda s: np.ones_like(s),
        lambda s: np.minimum(s - knot, 0.0),
        lambda s: np.minimum(s - knot, 0.0) ** 2,
        lambda s: np.maximum(s - knot, 0.0),
        lambda s: np.maximum(s - knot, 0.0) ** 2,
    )


def make_crest_finder(ruler: Ruler, first: float, scale: float) -> CrestFinder | None:
    """Prepare the search about ``first`` [m]; None where the window holds too few rings."""
    d = float(np.interp(first, ruler.s, ruler.d))
    half = max(2.5 * d, 0.25 * scale)
    use = np.flatnonzero((ruler.s > first - half) & (ruler.s < first + 1.5 * half))
    if len(use) < 8:
        return None
    s, w = ruler.s[use], np.sqrt(ruler.area[use])
    knots = np.arange(first - 1.25 * d, first + 1.25 * d, 0.05 * d)
    knots = knots[(knots > s[2]) & (knots < s[-3])]
    if len(knots) == 0:
        return None
    solve, reject = [], []
    for knot in knots:
        basis = np.column_stack([smoothing.smooth(part, s, ruler.d[use]) for part in _two_parabolas(knot)])
        inverse = np.linalg.pinv(basis * w[:, None], rcond=1e-9) * w[None, :]
        solve.append(inverse)
        reject.append(w[:, None] * (np.eye(len(s)) - basis @ inverse))
    return CrestFinder(use, knots, np.array(solve), np.array(reject), half)


def volume_below(ruler: Ruler, datum: Datum, h: np.ndarray, radius: float) -> float:
    """Volume between the datum and the ground inside ``radius`` [m^3]; on a sphere dV = (R^3 - (R + h)^3) / 3 per solid angle."""
    depth = -h * (1.0 + h / datum.radius + h**2 / (3.0 * datum.radius**2)) if datum.is_sphere else -h
    half = 0.5 * (ruler.s[1] - ruler.s[0]) if len(ruler.s) > 1 else 0.0
    edges = np.concatenate([[0.0], 0.5 * (ruler.s[1:] + ruler.s[:-1]), [ruler.s[-1] + half]])
    share = np.clip((radius - edges[:-1]) / (edges[1:] - edges[:-1]), 0.0, 1.0)
    # the ring that the wall leaves the datum in: its inner part is a wedge that thins to zero
    last = np.flatnonzero((share > 0.0) & (share < 1.0))
    total = float(np.nansum(np.where(share >= 1.0, depth * ruler.area, 0.0)))
    for i in last:
        inner = np.interp(edges[i], ruler.s, h)
        total += max(0.0, -0.5 * float(inner)) * share[i] * float(ruler.area[i])
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

    def as_array(self) -> np.ndarray:
        return np.array([self.depth, self.apparent, self.rim, self.rim_height, self.volume, self.slope])


def shape_of(mean: np.ndarray, ruler: Ruler, datum: Datum, finder: CrestFinder | None, outermost: float) -> Shape:
    """Depth, radii, rim height, volume and steepest wall of a profile of ring means (gaps already closed)."""
    fine, broad = ruler.fine @ mean, ruler.broad @ mean
    inside = ruler.s < outermost
    floor = int(np.argmin(np.where(inside, broad, np.inf)))
    depth = -float(broad[floor])
    apparent = apparent_radius(ruler.s, fine, floor)
    rim = rim_height = volume = slope = float("nan")
    if finder is not None:
        rim, rim_height = finder.find(mean)
    if np.isfinite(apparent):
        volume = volume_below(ruler, datum, ruler.sharpen @ mean, apparent)
        wall = (ruler.s[1:] > ruler.s[floor]) & (ruler.s[1:] < apparent)
        if wall.any():
            slope = float(np.degrees(np.arctan(np.max((np.diff(fine) / np.diff(ruler.s))[wall]))))
    return Shape(depth, apparent, rim, rim_height, volume, slope)


def closed(cells: np.ndarray) -> np.ndarray:
    """Cells with gaps closed: from the ring, then along the profile."""
    mean = ring_mean(cells)
    known = np.isfinite(mean)
    if not known.any():
        raise InputError("no ground under any ring: the cloud ends inside the crater or the datum lies elsewhere")
    filled = np.interp(np.arange(len(mean)), np.flatnonzero(known), mean[known])
    return np.where(np.isfinite(cells), cells, filled[:, None])


def sector_radii(cells: np.ndarray, ruler: Ruler, floor_limit: float) -> np.ndarray:
    """Apparent radius of every sector [m]; NaN where the wall does not reach the datum."""
    smooth = ruler.fine @ cells
    inside = ruler.s < 0.5 * floor_limit
    radii = np.full(cells.shape[1], np.nan)
    for k in range(cells.shape[1]):
        floor = int(np.argmin(np.where(inside, smooth[:, k], np.inf)))
        radii[k] = apparent_radius(ruler.s, smooth[:, k], floor)
    return radii


def harmonics(radii: np.ndarray) -> np.ndarray:
    """(mean, cos, sin, cos 2, sin 2) amplitudes of the radii over azimuth by a robust fit; NaN sectors are left out."""
    good = np.isfinite(radii)
    azimuth = (np.arange(len(radii)) + 0.5) * 2.0 * np.pi / len(radii)
    basis = np.column_stack([np.ones(len(radii)), np.cos(azimuth), np.sin(azimuth), np.cos(2 * azimuth), np.sin(2 * azimuth)])[good]
    r = radii[good]
    if len(r) < 8:
        return np.array([np.mean(r) if len(r) else np.nan, 0.0, 0.0, 0.0, 0.0])
    scale = max(1.4826 * float(np.median(np.abs(r - np.median(r)))), 1e-6 * float(np.median(r)))
    start = np.array([np.median(r), 0.0, 0.0, 0.0, 0.0])
    return least_squares(lambda p: (basis @ p - r) / scale, start, loss="soft_l1", x_scale=scale).x


def measure(
    particles: Particles,
    datum: Datum | object | str = "sphere",
    before: Particles | None = None,
    *,
    centre: tuple[float, float, float] | None = None,
    datum_radius: float | None = None,
    gravity: float | None = None,
    rise_limit: float | None = None,
    reach: float | None = None,
    seed: int = 1,
    what: str = "the snapshot",
) -> Measures:
    """Measure the crater in a cloud of particles.

    ``datum`` is a ``matter.frame.Sphere`` or ``Plane``, a ``crater.datum.Datum``, or ``"sphere"`` / ``"plane"`` to be fitted to the far field
    (``centre`` and ``datum_radius`` [m] are kept where given). ``before`` is the same target before the impact: heights are then taken
    relative to it, ray by ray, and relative to the far field now (a ringing body moves as a whole). ``gravity`` [m/s^2] with
    ``rise_limit`` [m] tells ejecta in flight from ground. The centre is found, not assumed.

    Raises ``InputError`` for clouds that cannot be measured (fewer than 100 particles, not finite, all ejecta).
    """
    fitted = isinstance(datum, str)
    if isinstance(datum, str):
        cloud = clouds.of(particles, what)
        body = cloud.select(clouds.supported(cloud, what=what))
        start = locate.first_datum(body, datum, centre, datum_radius)
    else:
        start = of_frame(datum)
    scene = locate.prepare(particles, start, before, gravity, rise_limit, reach, what)
    refit = (lambda ground, current, radius: locate.refit(ground, current, radius, centre, datum_radius)) if fitted else None
    return measure_scene(scene, refit, seed)


def measure_scene(scene: locate.Scene, refit=None, seed: int = 1, sectors: int | None = None, turns: int = 8) -> Measures:
    """Measure a prepared scene: centre and datum are iterated until neither moves, then the profile is read off."""
    count = sectors or 24
    datum, notes = scene.datum, {}
    ground, radius = _settle(scene, datum, refit, count, turns)
    level, sigma_level = (0.0, ground.datum.sigma)
    if scene.before is not None:
        level, sigma_level = locate.level_of_far_field(ground, radius)
        ground = replace(ground, methods={k: v - level for k, v in ground.methods.items()}, rays=ground.rays - level)
        notes["far_field_level_m"] = level
    return read_off(ground, radius, sigma_level, seed, notes)


def _settle(scene: locate.Scene, datum: Datum, refit, sectors: int, turns: int) -> tuple[Relief, float]:
    """Relief about the crater's centre and the crater's radius [m] (0 where there is no hollow)."""
    ground, radius = locate.look(scene, datum, sectors), 0.0
    rough = 3 if refit is not None else 2
    for turn in range(turns):
        if turn < rough:
            east, north, radius = locate.depression(ground)
        else:
            east, north, found = _recentre(ground, radius)
            radius = found or radius
        if radius == 0.0 and refit is None:
            break
        moved = ground.datum.moved(east, north)
        new = moved
        if refit is not None:
            new = refit(ground, ground.datum, max(radius, 0.05 * scene.reach)).moved(east, north)
        shift = float(np.hypot(east, north))
        lifted = abs(new.radius - datum.radius) if new.is_sphere else abs(np.dot(np.subtract(new.centre, datum.centre), new.axes[2]))
        edge = locate.edge_of(scene.body, new)
        scene = replace(scene, reach=min(scene.reach, edge) if edge > 1.5 * radius else scene.reach)
        datum = new
        ground = locate.look(scene, datum, sectors)
        d = float(ground.columns.spacing[0])
        if turn >= rough and shift < 0.05 * d and lifted < 0.05 * d:
            break
    return ground, radius


def _recentre(ground: Relief, radius: float) -> tuple[float, float, float]:
    ruler = make_ruler(ground, radius)
    radii = sector_radii(closed(ground.cell), ruler, 2.0 * radius)
    mean, east, north, *_ = harmonics(radii)
    if not np.isfinite(mean) or np.isfinite(radii).sum() < 0.5 * len(radii):
        return 0.0, 0.0, 0.0
    limit = 0.3 * radius
    size = float(np.hypot(east, north))
    scale = min(1.0, limit / size) if size > 0 else 1.0
    return float(east * scale), float(north * scale), float(mean)


def read_off(ground: Relief, radius: float, sigma_level: float, seed: int, notes: dict) -> Measures:
    """All measures of a settled relief with their errors."""
    profile = profile_of(ground)
    d = float(ground.columns.spacing[0])
    if radius <= 0.0:
        return _no_crater(ground, profile, notes, d)
    cells = closed(ground.cell)
    ruler = make_ruler(ground, radius)
    mean = cells.mean(axis=1)
    outermost = 0.9 * radius
    base = shape_of(mean, ruler, ground.datum, None, outermost)
    if not np.isfinite(base.apparent):
        return _no_crater(ground, profile, notes, d)
    finder = _crest_near(ruler, mean, base.apparent)
    base = shape_of(mean, ruler, ground.datum, finder, outermost)
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    draws = rng.integers(0, cells.shape[1], size=(BOOTSTRAPS, cells.shape[1]))
    trials = np.array([shape_of(cells[:, pick].mean(axis=1), ruler, ground.datum, finder, outermost).as_array() for pick in draws])
    return _assemble(ground, profile, base, trials, ruler, finder, sigma_level, notes)


def _crest_near(ruler: Ruler, mean: np.ndarray, apparent: float) -> CrestFinder | None:
    """Where to look for the crest: the highest smoothed ring between 1 and 1.8 apparent radii."""
    fine = ruler.fine @ mean
    d = float(np.interp(apparent, ruler.s, ruler.d))
    ring = np.flatnonzero((ruler.s > apparent) & (ruler.s < max(1.8 * apparent, apparent + 3.0 * d)))
    if len(ring) < 3:
        return None
    first = ring[int(np.argmax(fine[ring]))]
    return make_crest_finder(ruler, float(ruler.s[first]), apparent)


def _assemble(ground, profile, base, trials, ruler, finder, sigma_level, notes) -> Measures:
    d = float(np.interp(base.apparent, ruler.s, ruler.d))
    azimuth = np.nanstd(trials, axis=0)
    method = _method_spread(ground, base, ruler, finder)
    tangent = np.tan(np.radians(max(base.slope, 5.0)))
    res_h = RESOLUTION_HEIGHT * d
    level_d = np.hypot(sigma_level, res_h) * 2.0 / tangent
    area = np.pi * base.apparent**2
    names = ("depth_m", "diameter_apparent_m", "diameter_rim_m", "rim_height_m", "volume_m3", "wall_slope_deg")
    values = base.as_array() * np.array([1.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    spread = azimuth * np.array([1.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    resolution = np.array([res_h, RESOLUTION_DIAMETER * d, RESOLUTION_CREST * d, res_h, res_h * area, 0.0])
    level = np.array([sigma_level, 2.0 * sigma_level / tangent, 0.0, sigma_level, sigma_level * area, 0.0])
    out: dict[str, Quantity] = {}
    for i, name in enumerate(names):
        parts = {"azimuth": spread[i], "resolution": resolution[i], "datum": level[i], "method": method[i]}
        out[name] = _quantity(values[i], parts, UNITS[name])
    out["depth_rim_to_floor_m"] = _quantity(
        base.depth + base.rim_height, {"azimuth": float(np.nanstd(trials[:, 0] + trials[:, 3])), "resolution": res_h}, "m"
    )
    return Measures(out, profile, ground.datum, ground, {**notes})


def _quantity(value: float, parts: dict[str, float], unit: str, reason: str = "") -> Quantity:
    if not np.isfinite(value):
        return Quantity(None, None, unit, reason or "not found in the profile")
    parts = {name: float(part) for name, part in parts.items() if np.isfinite(part) and part > 0.0}
    return Quantity(float(value), float(np.sqrt(sum(part**2 for part in parts.values()))), unit, "", parts)


def _method_spread(ground, base, ruler, finder) -> np.ndarray:
    return np.zeros(6)


def _no_crater(ground, profile, notes, d) -> Measures:
    reason = "no hollow deeper than the noise of the surface"
    return Measures({name: Quantity(None, None, unit, reason) for name, unit in UNITS.items()}, profile, ground.datum, ground, notes)


def measure_profile(profile: Profile) -> dict[str, Quantity]:
    """Measures of a radial profile alone (no cloud): read off its points; sigma from the band where it has one.

    ``depth_m``, ``diameter_apparent_m``, ``diameter_rim_m``, ``rim_height_m``, ``depth_rim_to_floor_m`` and ``volume_m3`` (of revolution, on a plane).
    """
    known = np.isfinite(profile.height)
    s, h = profile.radius[known], profile.height[known]
    floor = int(np.argmin(h))
    band = 0.5 * (profile.p84 - profile.p16)[known] / np.sqrt(np.maximum(profile.count[known], 1))
    sigma = np.where(np.isfinite(band), band, 0.0)
    result = {"depth_m": Quantity(-float(h[floor]), float(sigma[floor]), "m")}
    apparent = apparent_radius(s, h, floor)
    if not np.isfinite(apparent):
        return result
    result["diameter_apparent_m"] = Quantity(2.0 * apparent, float(np.interp(apparent, s, sigma)) * 2.0, "m")
    inside = s < apparent
    r = np.concatenate([s[inside], [apparent]])
    z = np.concatenate([h[inside], [0.0]])
    result["volume_m3"] = Quantity(float(np.trapezoid(-z * 2.0 * np.pi * r, r)), None, "m^3")
    outside = np.flatnonzero(s > apparent)
    if len(outside) > 2:
        crest = outside[int(np.argmax(np.where(s[outside] < 2.0 * apparent, h[outside], -np.inf)))]
        if h[crest] > 0.0 and crest + 1 < len(s):
            step = float(np.gradient(s)[crest])
            result["diameter_rim_m"] = Quantity(2.0 * float(s[crest]), step, "m")
            result["rim_height_m"] = Quantity(float(h[crest]), float(sigma[crest]), "m")
            result["depth_rim_to_floor_m"] = Quantity(float(h[crest] - h[floor]), float(np.hypot(sigma[crest], sigma[floor])), "m")
    return result
