"""How long a crater grows: the time scale that lengths of runs, intervals of output and the choice of a handoff go by.

    T = 0.8 sqrt(V^(1/3) / g)                weight ends the growth (Schmidt & Housen 1987, Int. J. Impact Eng. 5, 543)

Strength Y resists like the weight of a layer as thick as the crater is wide, so g becomes g + Y / (rho D) where there
is both: T = 1.1 R sqrt(rho / Y) for a crater of radius R that strength alone ends. No crater takes longer than its
growth needs to reach that radius, from the projectile's radius a and speed U on,

    R / a = (U t / a)^(mu / (1 + mu)),   mu = 0.5   (point source; Housen & Holsapple 2011, Icarus 211, 856, section 2)
"""

from __future__ import annotations

import math

SOURCES = ("SchmidtHousen1987", "HousenHolsapple2011")

ENOUGH = 0.8
"""Share of T that a run lasts at least if its crater is to be called final: T is good to a fifth."""
_MU = 0.5
GROWTH = _MU / (1.0 + _MU)
"""Exponent of a crater's growth: its radius goes as t^(mu / (1 + mu))."""


def formation_time(volume: float, gravity: float) -> float:
    """T = 0.8 sqrt(V^(1/3) / g) [s] of a crater of ``volume`` [m^3]."""
    return 0.8 * math.sqrt(volume ** (1.0 / 3.0) / gravity)


def of_crater(diameter: float, gravity: float, weight: float = 0.0, strength: float = 0.0) -> float:
    """T [s] of a paraboloid of ``diameter`` D [m] and depth D / 3 under ``gravity`` [m/s^2], in ground of density
    ``weight`` [kg/m^3] and ``strength`` [Pa].

    Infinite where neither resists.
    """
    resistance = gravity + (strength / (weight * diameter) if strength > 0.0 else 0.0)
    return formation_time(math.pi / 24.0 * diameter**3, resistance) if resistance > 0.0 else math.inf


def of_growth(diameter: float, radius: float, speed: float) -> float:
    """Time [s] in which a point source opens a crater of ``diameter`` [m], from a projectile's ``radius`` [m] and
    ``speed`` [m/s]."""
    return radius / speed * max(0.5 * diameter / radius, 1.0) ** (1.0 / GROWTH)
