"""The errors of a crater's measures, each counted once, in quadrature.

``azimuth``     what the particles scatter: bootstrap over pairs of adjacent sectors, which see the same particles; for
                the floor, where sectors are smaller than particles, carried over from outer rings,
``resolution``  what the steps from heights to measures get wrong even without noise,
``datum``       the ways in which the datum may be off, passed through the same measuring: depth, diameter and volume
                err together,
``method``      by how much half of the distance to the other methods is more than the scatter and the resolution,
                which are most of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from crater.ground import far_field
from crater.ground.datum import Datum
from crater.ground.radial_profile import Relief, closed
from crater.ground.shape import CrestFinder, Ruler, Shape, make_crest_finder, shape_of


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


def of_datum(
    errors: tuple[tuple[float, float], ...],
    mean: np.ndarray,
    ruler: Ruler,
    datum: Datum,
    finder: CrestFinder | None,
    outermost: float,
) -> np.ndarray:
    """The profile's numbers (ways, numbers) with the datum off in each of the ways of ``Datum.errors``: so a depth, a
    diameter and a volume err together."""
    cosine = np.cos(ruler.s / datum.radius) if datum.is_sphere else np.ones(len(ruler.s))
    shapes = [shape_of(mean + c + k * cosine, ruler, datum, finder, outermost).as_array() for c, k in errors]
    return np.array(shapes).reshape(len(errors), len(Shape.__dataclass_fields__))


def deviation(trials: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Root mean square of each column of ``trials`` about ``base``, over the trials in which it exists: scatter and
    the bias that noise gives to whatever picks an extreme. NaN where it exists in fewer than half of them."""
    number = np.isfinite(trials).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        deviation = np.sqrt(np.nansum((trials - base) ** 2, axis=0) / number)
    return np.where(2 * number >= len(trials), deviation, np.nan)


def few_draws(number: float) -> float:
    """Factor that makes a deviation over ``number`` independent parts an error whose 1.96-fold holds 95 %: sqrt(n / (n
    - 1)), because the parts give their own mean, and Student's t of n - 1, because they give their own deviation."""
    n = max(number, 3.0)
    return float(np.sqrt(n / (n - 1.0)) * stats.t.ppf(0.975, n - 1.0) / 1.96)


def by_every_method(
    ground: Relief, radius: float, ruler: Ruler, base: Shape, outermost: float
) -> dict[str, dict[str, float]]:
    """Depth, diameters, rim height and volume by every method that was used, each over its own far field, in m and
    m^3."""
    far = far_field.outermost(ground, radius)
    table: dict[str, dict[str, float]] = {}
    for name, cells in ground.methods.items():
        filled = closed(cells)
        if name != "colour" and far.any():
            offset = np.average((filled - closed(ground.cell)).mean(axis=1)[far], weights=ruler.area[far])
            filled = filled - offset
        mean = filled.mean(axis=1)
        finder = make_crest_finder(ruler, mean, base.apparent, base.depth)
        shape = shape_of(mean, ruler, ground.datum, finder, outermost)
        table[name] = shape.sizes()
    return table


def method_error(table: dict[str, dict[str, float]], name: str, counted: float) -> float:
    """What half the distance between the colour field and the median of the other methods is more than the errors
    ``counted`` already [SI].

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
    """A measure with the parts of its error in quadrature, in ``unit``; without a value, and with the ``reason``,
    where ``value`` is not finite."""
    if not np.isfinite(value):
        return Quantity(None, None, unit, reason or "not found in the profile")
    parts = {name: float(part) for name, part in parts.items() if np.isfinite(part) and part > 0.0}
    return Quantity(float(value), float(np.sqrt(sum(part**2 for part in parts.values()))), unit, "", parts)
