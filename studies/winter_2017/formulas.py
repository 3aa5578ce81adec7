"""Formulas of Winter 2017 on sizes and times of craters, as printed and put right."""

from __future__ import annotations

import math

from matter.errors import InputError


def collapse_time(diameter: float, gravity: float) -> float:
    """t = sqrt(D / g) [s] (Winter 2017, eq. 2, after Melosh 1989)."""
    return math.sqrt(diameter / gravity)


def central_pit_diameter(diameter: float) -> float:
    """D_cp = 1.45 exp(0.028 D), both in km inside, m outside (Winter 2017, eq. 1).

    Raises ``InputError`` above D = 150 km: the fit runs away there (2.6e4 km at D = 350 km).
    """
    if diameter > 150e3:
        raise InputError(f"D_cp = 1.45 exp(0.028 D) holds up to about 150 km, got {diameter / 1e3:.0f} km")
    return 1.45e3 * math.exp(0.028 * diameter / 1e3)


def transient_from_frustum(diameter: float, depth: float, floor_diameter: float) -> float:
    """D_t^2 H_t [m^3] of the paraboloid with the volume of a frustum of ``diameter``, ``floor_diameter`` and
    ``depth``.

    (2/3) H (D^2 + D D_f + D_f^2). Winter 2017, eq. 3 states D_t^3 H_t = 5 D^3 H / (1 + 6 / (1 + D_f/D + (D_f/D)^2)),
    which is no volume (``thesis_equation_3``); both are here.
    """
    return 2.0 / 3.0 * depth * (diameter**2 + diameter * floor_diameter + floor_diameter**2)


def thesis_equation_3(diameter: float, depth: float, floor_diameter: float) -> float:
    """D_t^3 H_t [m^4] as printed in Winter 2017, eq. 3 (dimensions of a volume times a length: use with care)."""
    ratio = floor_diameter / diameter
    return 5.0 * diameter**3 * depth / (1.0 + 6.0 / (1.0 + ratio + ratio**2))
