"""The functions that measure a hollow, each named like its row in ``matter/wording/crater_measures.py``: one argument,
the ``Hollow``, one ``Quantity`` back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from crater.ground.radial_profile import RINGS_SHARE, Relief
from crater.ground.shape import CrestFinder, Ruler, Shape, shape_of
from crater.measures import forms
from crater.measures.blanket import blanket
from crater.measures.central_peak import CentralPeak, central_peak
from crater.measures.uncertainty import (
    Quantity,
    by_every_method,
    deviation,
    few_draws,
    method_error,
    of_datum,
    quantity,
)
from matter.wording.crater_measures import UNITS

RESOLUTION_ACROSS = (5.0, 6.0, 7.0, 10.0, 14.0, 20.0, 30.0)
"""Local spacings per apparent radius at which the four below are known.

What the steps from ring means to measures get wrong without any noise, in local spacings: found by passing known
profiles through the colour field's rounding and measuring them (rms over six shapes; tests/crater/test_resolution.py).
Scatter of particles is not in it. Below seven spacings a radius a crest is found too far out.
"""
RESOLUTION_HEIGHT = (0.058, 0.061, 0.062, 0.054, 0.037, 0.029, 0.043)
RESOLUTION_DIAMETER = (0.022, 0.032, 0.036, 0.039, 0.026, 0.011, 0.004)
RESOLUTION_CREST = (0.303, 0.228, 0.116, 0.062, 0.055, 0.054, 0.097)
STEEP_WALL = 0.05
"""More of the crest: on walls of 45 degrees the half level does not follow the linear map, and a sharp crest is found
so much inside."""
RESOLUTION_VOLUME = (0.0066, 0.0056, 0.0030, 0.0025, 0.0024, 0.0024, 0.0017)
"""Of the apparent area, times the spacing."""
RESOLUTION_RIM = 0.1
"""Of what the colour field rounds off the crest and the fit restores: nothing of a crest without a corner."""
INDEPENDENT = 2.5
"""Spacings between heights that do not correlate."""
RESOLUTION_SLOPE = 2.0
"""Of the slope of the wall [deg]."""


@dataclass(frozen=True)
class Hollow:
    """A hollow that has been found: the relief ``ground`` and first ``radius`` [m], heights in ``cells`` (rings,
    sectors) [m] made round, their ``ruler``, the crest's ``finder``, the ``base`` shape of the mean profile with its
    floor inside ``outermost`` [m].

    ``draws`` (trials, sectors): the bootstrap; ``datum_errors``: the ways in which the datum may be off
    (``Datum.errors``); ``flattening``: of the ellipse that was made round; ``level``: of the ground beyond the blanket
    over that before the impact.
    """

    ground: Relief
    radius: float
    cells: np.ndarray
    ruler: Ruler
    finder: CrestFinder | None
    base: Shape
    outermost: float
    draws: np.ndarray
    datum_errors: tuple[tuple[float, float], ...]
    flattening: Quantity
    level: Quantity

    @cached_property
    def mean(self) -> np.ndarray:
        """Mean height of every ring [m]."""
        return self.cells.mean(axis=1)

    @cached_property
    def spacing(self) -> float:
        """Local spacing at the apparent radius [m]."""
        return float(np.interp(self.base.apparent, self.ruler.s, self.ruler.d))

    def resolved(self, misses: tuple[float, ...]) -> float:
        """One of the rows ``RESOLUTION_*`` at this crater's spacings per radius, times the spacing [m]."""
        return self.spacing * float(np.interp(self.base.apparent / self.spacing, RESOLUTION_ACROSS, misses))

    @cached_property
    def spread(self) -> dict[str, float]:
        """Error of every number of the shape by the bootstrap, widened for few independent sectors; the floor's is at
        least that of its particles."""
        datum = self.ground.datum
        trials = [
            shape_of(self.cells[:, pick].mean(axis=1), self.ruler, datum, self.finder, self.outermost).as_array()
            for pick in self.draws
        ]
        around = 2.0 * np.pi * self.base.apparent / (INDEPENDENT * self.spacing)
        widened = few_draws(min(float(self.cells.shape[1]), around)) * deviation(
            np.array(trials), self.base.as_array()
        )
        deviations = dict(zip(Shape.__dataclass_fields__, widened))
        return {**deviations, "depth": max(deviations["depth"], self.floor_errors[0])}

    @cached_property
    def floor_errors(self) -> tuple[float, float]:
        """Of noise and of form [m] (``_floor_errors``)."""
        return _floor_errors(self)

    @cached_property
    def floor_resolution(self) -> float:
        """What the depth gets wrong without any noise [m]."""
        return float(np.hypot(self.resolved(RESOLUTION_HEIGHT), self.floor_errors[1]))

    @cached_property
    def shifts(self) -> dict[str, np.ndarray]:
        """Change of every number of the shape (ways,) with the datum off in each of its ways."""
        datum = self.ground.datum
        rows = (
            of_datum(self.datum_errors, self.mean, self.ruler, datum, self.finder, self.outermost)
            - self.base.as_array()
        )
        return dict(zip(Shape.__dataclass_fields__, rows.T))

    @cached_property
    def by_method(self) -> dict[str, dict[str, float]]:
        """The sizes by every method, in m and m^3."""
        return by_every_method(self.ground, self.radius, self.ruler, self.base, self.outermost)

    @cached_property
    def blanket(self) -> tuple[tuple[float, float], np.ndarray]:
        """Exponent and height [m] of the ejecta blanket, and their deviations over the same bootstrap."""
        ruler, rim = self.ruler, self.base.rim
        trials = [blanket(ruler.sharpened(self.cells[:, pick].mean(axis=1)), ruler, rim) for pick in self.draws]
        value = blanket(ruler.sharpened(self.mean), ruler, rim)
        return value, deviation(np.array(trials), np.array(value))

    @cached_property
    def peak(self) -> CentralPeak:
        """The central peak."""
        return self._peak_of(self.mean)

    @cached_property
    def peak_draws(self) -> list[CentralPeak]:
        """The central peak over the bootstrap."""
        return [self._peak_of(self.cells[:, pick].mean(axis=1)) for pick in self.draws]

    def _peak_of(self, mean: np.ndarray) -> CentralPeak:
        return central_peak(self.ruler.s, self.ruler.fine @ self.ruler.sharpened(mean), self.base.apparent)

    @cached_property
    def crest_resolution(self) -> float:
        """What the fit of the crest gets wrong in height without any noise [m]."""
        base = self.base
        rounded_off = (
            max(0.0, base.rim_height - float(np.interp(base.rim, self.ruler.s, self.mean)))
            if np.isfinite(base.rim)
            else 0.0
        )
        return RESOLUTION_RIM * rounded_off

    def stated(self, name: str, value: float, azimuth: float, resolution: float, datum: float) -> Quantity:
        """A measure with its four errors: what half the distance to the other methods is more than ``azimuth`` and
        ``resolution`` comes last."""
        method = method_error(self.by_method, name, np.hypot(azimuth, resolution))
        return quantity(
            value, {"azimuth": azimuth, "resolution": resolution, "datum": datum, "method": method}, UNITS[name]
        )

    def size(self, name: str, number: str, resolution: float) -> Quantity:
        """The measure ``name`` that is a number of the shape, or twice that: a diameter."""
        value = self.base.sizes()[name]
        factor = 2.0 if number in ("apparent", "rim") else 1.0
        return self.stated(
            name, value, factor * self.spread[number], factor * resolution, factor * _norm(self.shifts[number])
        )


def _norm(shifts: np.ndarray) -> float:
    return float(np.sqrt(np.sum(shifts**2, axis=0)))


def _noise(hollow: Hollow) -> float:
    """v of var(mean height of ring i) = v d^2 / A_i, from the sectors of the rings between 0.3 and 1 apparent radii;
    NaN where they are fewer than two."""
    ruler, cells, apparent = hollow.ruler, hollow.cells, hollow.base.apparent
    ring = (ruler.s > 0.3 * apparent) & (ruler.s < apparent)
    if ring.sum() < 2:
        return float("nan")
    detrended = cells - cells.mean(axis=1, keepdims=True)
    scatter = (1.4826 * np.median(np.abs(detrended), axis=1)) ** 2 / cells.shape[1]
    return RINGS_SHARE * float(np.median((scatter * ruler.area / ruler.d**2)[ring]))


def _floor_errors(hollow: Hollow) -> tuple[float, float]:
    """Two errors of the floor [m]: of noise, where sectors are smaller than particles and say nothing (scatter of
    outer rings carried over by area), and of its form: what the broad regression misses there of the fine one, over
    the noise of that. A flat floor with a steep wall is no parabola.
    """
    ruler, v = hollow.ruler, _noise(hollow)
    seen = ruler.broad @ hollow.mean
    floor = int(np.argmin(np.where((ruler.s < hollow.base.apparent) & np.isfinite(seen), seen, np.inf)))
    if not np.isfinite(v) or not np.isfinite(seen[floor]):
        return 0.0, 0.0
    broad, fine = (v * np.nansum(rows[floor] ** 2 * ruler.d**2 / ruler.area) for rows in (ruler.broad, ruler.fine))
    sharp = ruler.sharpened(hollow.mean)
    missed = float(ruler.fine[floor] @ sharp - ruler.broad[floor] @ sharp)
    return float(np.sqrt(broad)), float(np.sqrt(max(0.0, missed**2 - fine)))


def diameter_rim_m(hollow: Hollow) -> Quantity:
    """Twice the distance of the crest."""
    return hollow.size(
        "diameter_rim_m", "rim", np.hypot(hollow.resolved(RESOLUTION_CREST), STEEP_WALL * hollow.spacing)
    )


def diameter_apparent_m(hollow: Hollow) -> Quantity:
    """Twice the distance at which the wall meets the datum."""
    return hollow.size("diameter_apparent_m", "apparent", hollow.resolved(RESOLUTION_DIAMETER))


def depth_m(hollow: Hollow) -> Quantity:
    """Datum to floor."""
    return hollow.size("depth_m", "depth", hollow.floor_resolution)


def depth_rim_to_floor_m(hollow: Hollow) -> Quantity:
    """Crest to floor; where the datum is off, both ends move with it."""
    spread, shifts = hollow.spread, hollow.shifts
    azimuth = np.hypot(spread["depth"], spread["rim_height"])
    resolution = np.hypot(hollow.floor_resolution, hollow.crest_resolution)
    value = hollow.base.sizes()["depth_rim_to_floor_m"]
    return hollow.stated(
        "depth_rim_to_floor_m", value, azimuth, resolution, _norm(shifts["depth"] + shifts["rim_height"])
    )


def rim_height_m(hollow: Hollow) -> Quantity:
    """Crest above the datum."""
    return hollow.size("rim_height_m", "rim_height", hollow.crest_resolution)


def volume_m3(hollow: Hollow) -> Quantity:
    """Between datum and ground inside the apparent diameter."""
    return hollow.size("volume_m3", "volume", hollow.resolved(RESOLUTION_VOLUME) * (np.pi * hollow.base.apparent**2))


def depth_over_diameter(hollow: Hollow) -> Quantity:
    """Depth over apparent diameter, their errors taken as independent."""
    depth, diameter = depth_m(hollow), diameter_apparent_m(hollow)
    relative = np.hypot(
        (depth.sigma or 0.0) / hollow.base.depth, (diameter.sigma or 0.0) / (2.0 * hollow.base.apparent)
    )
    ratio = hollow.base.depth / (2.0 * hollow.base.apparent)
    return Quantity(ratio, float(ratio * relative), "1")


def wall_slope_deg(hollow: Hollow) -> Quantity:
    """Steepest slope between floor and apparent rim."""
    return hollow.stated("wall_slope_deg", hollow.base.slope, hollow.spread["slope"], RESOLUTION_SLOPE, 0.0)


def floor_diameter_m(hollow: Hollow) -> Quantity:
    """Twice the distance at which the wall has risen by a tenth of the depth."""
    return hollow.stated(
        "floor_diameter_m",
        2.0 * hollow.base.floor_radius,
        2.0 * hollow.spread["floor_radius"],
        1.0 * hollow.spacing,
        0.0,
    )


def central_peak_m(hollow: Hollow) -> Quantity:
    """Highest point inside the floor above it, where that stands out of the noise."""
    return _of_peak(hollow, "height", hollow.peak.height)


def central_peak_diameter_m(hollow: Hollow) -> Quantity:
    """Twice the distance at which the central peak has come down to half of its height."""
    return _of_peak(hollow, "radius", 2.0 * hollow.peak.radius)


def _of_peak(hollow: Hollow, number: str, value: float) -> Quantity:
    """``value`` [m] of the central peak: its ``height``, or twice its ``radius``, with the scatter over azimuth and
    half a spacing of resolution on each side."""
    if hollow.peak.height > max(3.0 * (depth_m(hollow).sigma or 0.0), 0.5 * hollow.spacing):
        spread = float(np.nanstd([getattr(trial, number) for trial in hollow.peak_draws]))
        wide = number == "radius"
        resolution = hollow.spacing if wide else hollow.resolved(RESOLUTION_HEIGHT)
        return quantity(value, {"azimuth": (2.0 if wide else 1.0) * spread, "resolution": resolution}, "m")
    return Quantity(None, None, "m", "no peak above the noise of the floor")


def central_pit_m(hollow: Hollow) -> Quantity:
    """Depth of a pit below the ridge around it, where the ridge stands out of the noise."""
    ruler, sigma = hollow.ruler, depth_m(hollow).sigma or 0.0
    floor = (ruler.broad @ ruler.sharpened(hollow.mean))[ruler.s < 0.6 * hollow.base.apparent]
    pit, prominence = forms.central_pit(floor[np.isfinite(floor)])
    stands_out = prominence > max(3.0 * sigma, 0.5 * hollow.spacing)
    return quantity(pit if stands_out else np.nan, {"depth": sigma}, "m", "no pit above the noise of the floor")


def terraces(hollow: Hollow) -> Quantity:
    """Number of benches between steep walls."""
    ruler, base = hollow.ruler, hollow.base
    edge = base.rim if np.isfinite(base.rim) else base.apparent
    heights = ruler.fine @ ruler.sharpened(hollow.mean)
    steps = forms.terraces(ruler.s, heights, ruler.d, base.floor_radius, edge) if np.isfinite(base.floor_radius) else 0
    return Quantity(float(steps), None, "1")


def far_field_level_m(hollow: Hollow) -> Quantity:
    """How the ground beyond the blanket rose or fell."""
    return hollow.level


def ellipticity(hollow: Hollow) -> Quantity:
    """1 - b/a of the apparent rim."""
    return hollow.flattening


def rim_asymmetry(hollow: Hollow) -> Quantity:
    """First harmonic of the crest's height over its mean; the azimuth of the highest side stands in the reason."""
    if not np.isfinite(hollow.base.rim):
        return quantity(np.nan, {}, "1", "no crest around the crater")
    fraction, error, towards = forms.rim_asymmetry(forms.crest_heights(hollow.cells, hollow.ruler, hollow.base.rim))
    result = quantity(fraction, {"azimuth": error}, "1", "no crest around the crater")
    return replace(result, reason=f"highest towards azimuth {towards:.0f} deg") if np.isfinite(towards) else result


def blanket_exponent(hollow: Hollow) -> Quantity:
    """Exponent of the ejecta blanket's power law."""
    return _of_blanket(hollow, "blanket_exponent", 0)


def blanket_height_at_rim_m(hollow: Hollow) -> Quantity:
    """Height of the ejecta blanket, with the uplift under it, at the rim."""
    return _of_blanket(hollow, "blanket_height_at_rim_m", 1)


def _of_blanket(hollow: Hollow, name: str, which: int) -> Quantity:
    values, spread = hollow.blanket
    reason = "fewer than five rings stand above the datum between 1.1 and 3 rim radii"
    return quantity(values[which], {"azimuth": spread[which]}, UNITS[name], reason)
