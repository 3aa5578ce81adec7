"""The errors of a crater's measures, each counted once, in quadrature.

``azimuth``     what the particles scatter: bootstrap over sectors; for the floor, where sectors are smaller than particles, carried over from outer rings,
``resolution``  what the steps from heights to measures get wrong even without noise,
``datum``       the ways in which the datum may be off, passed through the same measuring: depth, diameter and volume err together,
``method``      by how much half of the distance to the other methods is more than the scatter and the resolution, which are most of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from crater import far_field
from crater.datum import Datum
from crater.radial_profile import RINGS_SHARE, Relief, closed
from crater.shape import CrestFinder, Ruler, Shape, make_crest_finder, shape_of

UNITS = {
    "diameter_rim_m": "m",
    "diameter_apparent_m": "m",
    "depth_m": "m",
    "depth_rim_to_floor_m": "m",
    "rim_height_m": "m",
    "volume_m3": "m^3",
    "depth_over_diameter": "1",
    "wall_slope_deg": "deg",
    "floor_diameter_m": "m",
    "central_peak_m": "m",
    "central_pit_m": "m",
    "terraces": "1",
    "ellipticity": "1",
    "rim_asymmetry": "1",
    "blanket_exponent": "1",
    "blanket_height_at_rim_m": "m",
}
# What the steps from ring means to measures get wrong without any noise, in local spacings: found by passing known profiles through the colour
# field's rounding and measuring them, 7 to 30 spacings per radius (rms; tests/crater/test_resolution.py). Scatter of particles is not in it.
# The crest's holds another 0.05: on walls of 45 degrees the half level does not follow the linear map, and a sharp crest is found so much inside.
RESOLUTION_HEIGHT = 0.047
RESOLUTION_DIAMETER = 0.027
STEEP_WALL = 0.05
RESOLUTION_CREST = float(np.hypot(0.08, STEEP_WALL))
RESOLUTION_RIM = 0.1
"""Of what the colour field rounds off the crest and the fit restores: nothing of a crest without a corner."""
RESOLUTION_VOLUME = 0.0024
"""Of the apparent area, times the spacing."""


@dataclass(frozen=True)
class Quantity:
    """A value with its standard error; ``value`` is None where it cannot be stated, and ``reason`` says why."""

    value: float | None
    sigma: float | None
    unit: str
    reason: str = ""
    parts: dict[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict:
        """``{"value", "sigma", "unit"}``, and ``reason`` or the ``sigma_parts`` where there are any."""
        result: dict = {"value": self.value, "sigma": self.sigma, "unit": self.unit}
        if self.reason:
            result["reason"] = self.reason
        if self.parts:
            result["sigma_parts"] = self.parts
        return result


def of_datum(errors: tuple[tuple[float, float], ...], mean: np.ndarray, ruler: Ruler, datum: Datum, finder: CrestFinder | None, outermost: float) -> np.ndarray:
    """The profile's numbers (ways, numbers) with the datum off in each of the ways of ``Datum.errors``: so a depth, a diameter and a volume err together."""
    cosine = np.cos(ruler.s / datum.radius) if datum.is_sphere else np.ones(len(ruler.s))
    shapes = [shape_of(mean + c + k * cosine, ruler, datum, finder, outermost).as_array() for c, k in errors]
    return np.array(shapes).reshape(len(errors), len(Shape.__dataclass_fields__))


def quantities_of(
    base: Shape, trials: np.ndarray, ruler: Ruler, cells: np.ndarray, shifts: np.ndarray, table_of_methods: dict[str, dict[str, float]]
) -> dict[str, Quantity]:
    """Every measure with sigma from azimuth (bootstrap over sectors), resolution, datum (``shifts`` by each of its errors) and method in quadrature."""
    d = float(np.interp(base.apparent, ruler.s, ruler.d))
    fields = Shape.__dataclass_fields__
    spread = dict(zip(fields, deviation(trials)))
    level = dict(zip(fields, np.sqrt(np.sum(shifts**2, axis=0))))
    depth, rim_height = list(fields).index("depth"), list(fields).index("rim_height")
    spread["depth"] = max(spread["depth"], _floor_noise(cells, ruler, base))
    area = np.pi * base.apparent**2
    height = RESOLUTION_HEIGHT * d
    rounded_off = max(0.0, base.rim_height - float(np.interp(base.rim, ruler.s, cells.mean(axis=1)))) if np.isfinite(base.rim) else 0.0
    crest = RESOLUTION_RIM * rounded_off
    table = {
        "depth_m": (base.depth, spread["depth"], height, level["depth"]),
        "diameter_apparent_m": (2.0 * base.apparent, 2.0 * spread["apparent"], 2.0 * RESOLUTION_DIAMETER * d, 2.0 * level["apparent"]),
        "diameter_rim_m": (2.0 * base.rim, 2.0 * spread["rim"], 2.0 * RESOLUTION_CREST * d, 2.0 * level["rim"]),
        "rim_height_m": (base.rim_height, spread["rim_height"], crest, level["rim_height"]),
        "depth_rim_to_floor_m": (
            base.depth + base.rim_height,
            np.hypot(spread["depth"], spread["rim_height"]),
            np.hypot(height, crest),
            float(np.sqrt(np.sum((shifts[:, depth] + shifts[:, rim_height]) ** 2))),
        ),
        "volume_m3": (base.volume, spread["volume"], RESOLUTION_VOLUME * d * area, level["volume"]),
        "wall_slope_deg": (base.slope, spread["slope"], 2.0, 0.0),
        "floor_diameter_m": (2.0 * base.floor_radius, 2.0 * spread["floor_radius"], 1.0 * d, 0.0),
    }
    names = ("azimuth", "resolution", "datum", "method")
    method = {name: _method_error(table_of_methods, name, np.hypot(row[1], row[2])) for name, row in table.items()}
    result = {name: quantity(row[0], dict(zip(names, (*row[1:], method[name]))), UNITS[name]) for name, row in table.items()}
    if base.peak_height > 3.0 * result["depth_m"].sigma and base.peak_height > 0.5 * d:  # type: ignore[operator]
        result["central_peak_m"] = quantity(base.peak_height, {"azimuth": spread["peak_height"], "resolution": height}, "m")
    else:
        result["central_peak_m"] = Quantity(None, None, "m", "no peak above the noise of the floor")
    relative = np.hypot((result["depth_m"].sigma or 0.0) / base.depth, (result["diameter_apparent_m"].sigma or 0.0) / (2.0 * base.apparent))
    ratio = base.depth / (2.0 * base.apparent)
    result["depth_over_diameter"] = Quantity(ratio, float(ratio * relative), "1")
    return result


def deviation(trials: np.ndarray) -> np.ndarray:
    """Standard deviation of each column over the trials in which it exists; NaN where it exists in fewer than half of them."""
    number = np.isfinite(trials).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.nansum(trials, axis=0) / number
        deviation = np.sqrt(np.nansum((trials - mean) ** 2, axis=0) / number)
    return np.where(2 * number >= len(trials), deviation, np.nan)


def _floor_noise(cells: np.ndarray, ruler: Ruler, base: Shape) -> float:
    """Error of the floor [m] where sectors are smaller than particles and say nothing: scatter of outer rings carried over by area.

    var(mean of ring i) = v d^2 / A_i with v from the sectors of the rings between 0.3 and 1 apparent radii, times ``RINGS_SHARE``.
    """
    ring = (ruler.s > 0.3 * base.apparent) & (ruler.s < base.apparent)
    if ring.sum() < 2:
        return 0.0
    detrended = cells - cells.mean(axis=1, keepdims=True)
    scatter = (1.4826 * np.median(np.abs(detrended), axis=1)) ** 2 / cells.shape[1]
    v = float(np.median((scatter * ruler.area / ruler.d**2)[ring]))
    seen = ruler.broad @ cells.mean(axis=1)
    floor = int(np.argmin(np.where((ruler.s < base.apparent) & np.isfinite(seen), seen, np.inf)))
    return float(np.sqrt(RINGS_SHARE * v * np.nansum(ruler.broad[floor] ** 2 * ruler.d**2 / ruler.area)))


def by_every_method(ground: Relief, radius: float, ruler: Ruler, base: Shape, outermost: float) -> dict[str, dict[str, float]]:
    """Depth, diameters, rim height and volume by every method that was used, each over its own far field, in m and m^3."""
    far, _ = far_field.far_field(ground, radius)
    table: dict[str, dict[str, float]] = {}
    for name, cells in ground.methods.items():
        filled = closed(cells)
        if name != "colour" and far.any():
            offset = np.average((filled - closed(ground.cell)).mean(axis=1)[far], weights=ruler.area[far])
            filled = filled - offset
        mean = filled.mean(axis=1)
        finder = make_crest_finder(ruler, mean, base.apparent, base.depth)
        shape = shape_of(mean, ruler, ground.datum, finder, outermost)
        table[name] = {
            "depth_m": shape.depth,
            "diameter_apparent_m": 2.0 * shape.apparent,
            "diameter_rim_m": 2.0 * shape.rim,
            "rim_height_m": shape.rim_height,
            "depth_rim_to_floor_m": shape.depth + shape.rim_height,
            "volume_m3": shape.volume,
        }
    return table


def _method_error(table: dict[str, dict[str, float]], name: str, counted: float) -> float:
    """What half the distance between the colour field and the median of the other methods is more than the errors ``counted`` already [SI].

    Half, because the others are noisier (the volume method) or coarser (the highest particle); 0 where there are none.
    """
    ours = table["colour"].get(name, np.nan)
    others = np.array([row.get(name, np.nan) for method, row in table.items() if method != "colour"])
    others = others[np.isfinite(others)]
    if not len(others) or not np.isfinite(ours):
        return 0.0
    half = 0.5 * abs(float(np.median(others)) - ours)
    return float(np.sqrt(max(0.0, half**2 - counted**2))) if np.isfinite(counted) else half


def quantity(value: float, parts: dict[str, float], unit: str, reason: str = "") -> Quantity:
    """A measure with the parts of its error in quadrature, in ``unit``; without a value, and with the ``reason``, where ``value`` is not finite."""
    if not np.isfinite(value):
        return Quantity(None, None, unit, reason or "not found in the profile")
    parts = {name: float(part) for name, part in parts.items() if np.isfinite(part) and part > 0.0}
    return Quantity(float(value), float(np.sqrt(sum(part**2 for part in parts.values()))), unit, "", parts)
