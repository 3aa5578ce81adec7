"""How wide and deep a bed is when a case does not say it, from the expected transient diameter D; and what its grains will be like, for predictions.

radius    1.25 D in flat ground, 1.5 D along the arc of a body: 2.5 and 3 crater radii. The collapsed crater with its rim reaches some 1.4 crater radii,
          the sides' damped layer begins beyond two. (A crater wider than 0.8 of its bed cannot be handed over.) Never beyond the ground that there is.
depth     0.75 D: twice the depth of the transient crater; in a body no deeper than the innermost layer's surface, in flat ground than its bottom. A bowl is
          as deep as it is wide.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dem import durations
from dem.beds import flat_settling
from dem.beds.packing import FRACTION, HEXAGONAL
from dem.contact_settings import shortest_contact_time
from matter import material
from matter.body import Impact, Target

if TYPE_CHECKING:
    from dem.bed_stage import Settings

FLAT_RADIUS, ARC_RADIUS, DEPTH = 1.25, 1.5, 0.75
_QUARTER = 0.9
"""Most of a quarter of a body's circumference."""


def radius(target: Target, impact: Impact) -> float:
    """Radius of the bed along the datum [m]."""
    diameter = impact.expected_transient_diameter
    if target.flat:
        return min(FLAT_RADIUS * diameter, target.radius if target.shape == "half_sphere" else target.half_width)
    return min(ARC_RADIUS * diameter, _QUARTER * 0.5 * math.pi * target.radius)


def depth(diameter: float, available: float) -> float:
    """Depth of the bed [m], of what is ``available`` [m]."""
    return min(DEPTH * diameter, available)


class Expected(NamedTuple):
    """Mean grain ``radius`` [m], number of grains ``below`` the datum, time ``step`` [s], ``height`` of bed and headroom over the radius."""

    radius: float
    below: float
    step: float
    height: float


def expected(settings: Settings) -> Expected:
    """What the bed's grains will be like, from the settings alone."""
    target, contact, diameter = settings.target, settings.contact, settings.impact.expected_transient_diameter
    top, g = settings.headroom_fraction * diameter, durations.surface_gravity(target)
    name = target.layers[-1].material
    rho, extent = material.reference_density(name), settings.arc_radius
    bowl = target.flat and (settings.shape == "bowl" or (settings.shape == "auto" and target.shape == "half_sphere"))
    if target.flat:
        deep = extent if bowl else settings.depth or depth(diameter, target.radius)
        area = 4.0 * extent**2 if settings.shape == "box" or (settings.shape == "auto" and target.shape == "block") else math.pi * extent**2
        below, above = area * deep * (2.0 / 3.0 if bowl else 1.0), area * top
    else:
        deep = settings.depth or depth(diameter, target.radius - (target.outer_radii[0] if len(target.layers) > 1 else 0.0))
        angle = 2.0 * math.pi / 3.0 * (1.0 - math.cos(min(extent / target.radius, 0.5 * math.pi)))
        below = angle * (target.radius**3 - (target.radius - deep) ** 3)
        above = angle * ((target.radius + top) ** 3 - target.radius**3)
    filled = HEXAGONAL if settings.packing == "hcp" else FRACTION
    grain = (filled * (below + above) / settings.count * 0.75 / math.pi) ** (1.0 / 3.0)
    r, mass = np.array([grain]), np.array([rho * 4.0 / 3.0 * math.pi * grain**3 / filled])
    pressure = rho * g * deep
    k = flat_settling.stiffness(r, mass, contact, pressure, settings.largest_speed) if target.flat else contact.stiffness(r, mass, name, pressure)
    least = 1.0 - settings.radius_spread  # m / k goes as r^2 where k goes as r
    step = least * shortest_contact_time(mass, k) / contact.steps_per_contact
    return Expected(grain, settings.count * below / (below + above), step, (deep + top) / grain)
