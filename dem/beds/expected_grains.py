"""What a bed's grains will be like, before there is any: size, number, time step, from the settings alone; for
predictions."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dem.beds import flat_settling, grading, patch
from dem.beds.extent import depth
from dem.beds.grading import Grading
from dem.beds.grain_packing import FRACTION, HEXAGONAL
from dem.beds.settings import Settings
from dem.beds.solid_packing import FRACTION as SOLID_FRACTION
from dem.contact.settings import shortest_contact_time
from matter.case import at_rest
from matter.case.body import Target
from matter.geometry.ground_region import OF_TARGET, Upright

LOOSE = 0.596
"""Solid fraction of a loose bed for predictions: that of the friction of 30 degrees."""
FILLED = {"loose": LOOSE, "rcp": FRACTION, "hcp": HEXAGONAL, "hcp_tilted": HEXAGONAL}


class Expected(NamedTuple):
    """Mean grain ``radius`` [m] (of flat ground at the impact), number of grains ``below`` the datum, time ``step``
    [s], ``height`` of bed and headroom over the radius."""

    radius: float
    below: float
    step: float
    height: float


def expected(settings: Settings) -> Expected:
    """What the bed's grains will be like, from the settings alone."""
    target = patch.target_of(settings)
    if target.solid:
        return _of_body(settings)
    contact, diameter = settings.contact, settings.impact.expected_transient_diameter
    top, g = settings.headroom_fraction * diameter, at_rest.surface_gravity(target, settings.densities)
    name = target.layers[-1].material
    own = at_rest.densities_at_rest(name, settings.densities)
    rho = own.bulk
    filled = FILLED[settings.packing]
    if target.flat:
        container, sizes, below = of_flat(settings, target)
        grain, deep = sizes.radius, -container.floor
    else:
        deep = _depth(settings)
        angle = 2.0 * math.pi / 3.0 * (1.0 - math.cos(min(settings.arc_radius / target.radius, 0.5 * math.pi)))
        inside = angle * (target.radius**3 - (target.radius - deep) ** 3)
        above = angle * ((target.radius + top) ** 3 - target.radius**3)
        grain = (filled * (inside + above) / settings.count * 0.75 / math.pi) ** (1.0 / 3.0)
        below = settings.count * inside / (inside + above)
    r, mass = np.array([grain]), np.array([rho * 4.0 / 3.0 * math.pi * grain**3 / filled])
    pressure = rho * g * deep
    k = (
        flat_settling.stiffness(r, mass, contact, pressure, settings.largest_speed)
        if target.flat
        else contact.stiffness(r, mass, name, pressure, own.solid)
    )
    least = 1.0 - settings.radius_spread  # m / k goes as r^2 where k goes as r
    step = least * shortest_contact_time(mass, k) / contact.steps_per_contact
    return Expected(grain, below, step, (deep + top) / grain)


def of_flat(settings: Settings, target: Target) -> tuple[Upright, Grading, float]:
    """Upright and sizes of a bed of flat ground, and how many of its grains lie below the datum."""
    shape = OF_TARGET[target.shape] if settings.shape in ("auto", "cap") else settings.shape
    diameter, wide = settings.impact.expected_transient_diameter, settings.arc_radius
    deep = wide if shape == "bowl" else settings.depth or depth(diameter, target.radius)
    container = Upright(shape, wide, -deep, settings.headroom_fraction * diameter)
    alike = settings.packing.startswith("hcp")
    spread, growth = (0.0, 0.0) if alike else (settings.radius_spread, settings.growth)
    filled = FILLED[settings.packing]
    return container, *grading.solved(settings.count, spread, filled, container, settings.impact, growth)


def hard(settings: Settings) -> bool:
    """Whether a bed on a sphere gets springs for its weight alone (``Contact.of_weight``)."""
    target = settings.target
    own = at_rest.densities_at_rest(target.layers[-1].material, settings.densities)
    pressure = own.bulk * at_rest.surface_gravity(target, settings.densities) * _depth(settings)
    return settings.contact.of_weight(target.layers[-1].material, pressure, own.solid)


def _depth(settings: Settings) -> float:
    """Depth [m] of a bed on a sphere."""
    target = settings.target
    inner = target.outer_radii[0] if len(target.layers) > 1 else 0.0
    return settings.depth or depth(settings.impact.expected_transient_diameter, target.radius - inner)


def _of_body(settings: Settings) -> Expected:
    """The same of an ellipsoid or mesh, which the grains fill as a whole."""
    target, contact = settings.target, settings.contact
    volume = target.placed.solid.volume
    rho = at_rest.densities_at_rest(target.layers[-1].material, settings.densities).bulk
    grain = (SOLID_FRACTION * volume / settings.count * 0.75 / math.pi) ** (1.0 / 3.0)
    r, mass = np.array([grain]), np.array([rho * volume / settings.count])
    pressure = 0.5 * rho * at_rest.surface_gravity(target, settings.densities) * target.radius
    k = flat_settling.stiffness(r, mass, contact, pressure, None)
    step = (1.0 - settings.radius_spread) * shortest_contact_time(mass, k) / contact.steps_per_contact
    return Expected(grain, float(settings.count), step, 2.0 * target.radius / grain)
