"""What an impact left of a body: one of ``CLASSES``, with its reason. All of it is this project's own but for what
Thomas (1999) saw.

Of the change of height dh over the surface A of before, with the error e of a resurfaced position
(``HeightMap.error``), only what exceeds ``SURE`` e counts:

    changed = A(|dh| > SURE e) / A              spread = (int |dh| dA)^2 / (A int dh^2 dA)

``spread`` is the fraction of the surface that the same change would take were it even (the participation ratio); it is
at most ``changed``: 3/4 of the hollow's own fraction for a paraboloid, 0.74 of ``changed`` or so where an ellipsoid
gets other axes. A hollow of apparent diameter D takes the fraction of the surface

    q = pi D^2 / (4 A),        on a ball q = sin^2(theta / 2) at theta to either side, seen from the centre

and no longer is the hollow of a crater where q reaches sin^2(``WIDEST`` / 2) = 0.146, that is D = 0.77 times the
diameter of the ball of that surface. The flattened ground ends at some 80 deg (``tangent_map.REACH``): beyond
``WIDEST`` less ground lies round a hollow than its own radius, and a diameter of it is no measure (a bowl of 180 m
on a body of 149 m read as 64 m). Half of the rocky bodies carry a crater as wide as their mean radius (Thomas 1999,
Icarus 142, 89): 29 deg, far below.

    reshaped       spread > sin^2(WIDEST / 2), or a hollow with q above that; or no hollow, but an axis changed by more
                   than ``SURE`` times its error and by more than the error of a change of height, or more than
                   ``RESURFACED`` of the surface is resurfaced
    crater         a hollow about the site: closed, deeper than the noise (``crater.measures.measure``), q at most
                   that, and at least ``RESOLVED`` radii of a grain wide
    not resolved   one that is narrower, or too shallow to have a diameter
    no hollow      none of these: nothing at the site is deeper than the noise of the ground, and no change is global
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from crater.bodies.body_comparison import BodyComparison, Pair
from crater.bodies.height_map import HeightMap
from crater.measures.measure import Measures
from crater.measures.uncertainty import Quantity
from matter.wording import readable
from matter.wording.body_measures import BY_NAME

SOURCES = ("Thomas1999",)

CLASSES = ("crater", "not resolved", "reshaped", "no hollow")
RESOLVED = 10.0
"""Radii of a grain across the narrowest hollow that is measured."""
RESURFACED = 0.05
"""Fraction of the surface."""
SURE = 3.0
"""Standard deviations."""
WIDEST = math.radians(45.0)
"""Half the angle that the widest crater takes of a ball, seen from its centre."""
LOCAL = math.sin(0.5 * WIDEST) ** 2
"""Fraction of a ball's surface within ``WIDEST`` of a point."""


class Extent(NamedTuple):
    """Of the change of height: the fraction of the surface that ``changed`` for sure, and the fraction over which it
    would be ``spread`` were it even."""

    changed: float
    spread: float


def extent_of(chart: HeightMap) -> Extent:
    """How much of a body's surface changed, and how evenly."""
    area = chart.points.area / chart.points.area.sum()
    change = np.where(np.abs(chart.change) > SURE * chart.error, chart.change, 0.0)
    square = float(area @ change**2)
    spread = float(area @ np.abs(change)) ** 2 / square if square > 0.0 else 0.0
    return Extent(float(area[change != 0.0].sum()), spread)


def area_fraction(diameter: float, chart: HeightMap) -> float:
    """Fraction q of the body's surface that a hollow of this apparent ``diameter`` [m] takes."""
    return 0.25 * math.pi * diameter**2 / float(chart.points.area.sum())


def half_angle(fraction: float) -> float:
    """Angle [deg] to either side, seen from the centre of a ball, of a cap with this fraction of its surface."""
    return 2.0 * math.degrees(math.asin(math.sqrt(min(fraction, 1.0))))


def grain_radius(compared: BodyComparison, crater: Measures, diameter: float) -> float:
    """Mean radius of the body's grains [m], without what flies: ejecta are as fine as the particles that they were. Of
    a shock stage half the spacing at the rim."""
    p = compared.after.particles
    if "radius" in p:
        return float(p.radius[compared.after.body].mean())
    columns = crater.ground.columns
    return 0.5 * float(np.interp(0.5 * diameter, columns.distance, columns.spacing))


def classed(
    compared: BodyComparison, measures: Mapping[str, Quantity | Pair], crater: Measures | None
) -> tuple[str, str]:
    """The class of what the impact left, and why; ``crater``: what was measured at the site, None where nothing could
    be."""
    size = crater["diameter_apparent_m"].value if crater is not None else None
    extent = extent_of(compared.chart)
    far = f"the change of height is as if spread evenly over {extent.spread:.0%} of the surface"
    limit = f"the widest crater takes {LOCAL:.0%}"
    if crater is not None and size is not None:
        fraction, radius = area_fraction(size, compared.chart), grain_radius(compared, crater, size)
        words = (
            f"a hollow {readable.length(size)} wide, {size / radius:.3g} radii of a grain, "
            f"{half_angle(fraction):.0f} deg to either side seen from the centre"
        )
        if fraction > LOCAL:
            return "reshaped", f"{words}, takes {fraction:.0%} of the surface: {limit}"
        if extent.spread > LOCAL:
            return "reshaped", f"{words}, but {far}: {limit}"
        if size < RESOLVED * radius:
            return "not resolved", f"{words}: fewer than {RESOLVED:g} resolve nothing"
        return "crater", f"{words}; {far}"
    resurfaced = f"{compared.chart.resurfaced_fraction:.1%} of the surface is resurfaced"
    if extent.spread > LOCAL:
        return "reshaped", "; ".join([f"{far}: {limit}", resurfaced, *_moved(compared, measures)])
    if crater is not None and (crater["depth_m"].value or 0.0) > 0.0:
        return "not resolved", crater["diameter_apparent_m"].reason
    if (moved := _moved(compared, measures)) or compared.chart.resurfaced_fraction > RESURFACED:
        return "reshaped", "; ".join([f"no hollow at the site, {resurfaced}", *moved])
    return "no hollow", (
        f"nothing at the site is deeper than the noise of the ground, no axis changed beyond its error, {resurfaced}"
    )


def _moved(compared: BodyComparison, measures: Mapping[str, Quantity | Pair]) -> list[str]:
    """In words, the axes that changed by more than their error and than that of a change of height: grains that shake
    in their positions widen the ellipsoid of their inertia a little."""
    noise = float(np.average(compared.chart.error, weights=compared.chart.points.area))
    found = []
    for name, entry in measures.items():
        if not (name.startswith("axis_") and BY_NAME[name].unit == "m" and isinstance(entry, Pair)):
            continue
        value, sigma = entry.change.value, entry.change.sigma or 0.0
        if value is not None and abs(value) > max(SURE * sigma, noise):
            found.append(f"{BY_NAME[name].words}: {readable.measured(value, sigma, 'm')}")
    return found
