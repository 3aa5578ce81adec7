"""Crater sizes by scaling laws, beside every run: they disagree by tens of per cent, which is part of the answer.

Symbols: L projectile diameter, a = L/2, m its mass [m, m, kg]; v speed [m/s], theta angle from the vertical [rad], g
[m/s^2], rho_i and rho_t densities of projectile and target [kg/m^3]. All diameters are transient and apparent (at the
level of the ground before), in m.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from matter.case.formation_time import formation_time as formation_time
from matter.errors import InputError

SOURCES = (
    "Zahnle2003",
    "Collins2005",
    "SchmidtHousen1987",
    "Melosh1989",
    "Holsapple1993",
    "HousenHolsapple2011",
    "McKinnonSchenk1985",
    "Schenk2002",
)


class ImpactEvent(NamedTuple):
    """An impact: projectile ``radius`` [m], ``speed`` [m/s], ``angle`` from the vertical [rad], ``gravity`` [m/s^2],
    densities [kg/m^3]."""

    radius: float
    speed: float
    angle: float
    gravity: float
    projectile_density: float
    target_density: float

    @property
    def mass(self) -> float:
        """Mass of the projectile [kg]."""
        return 4.0 / 3.0 * math.pi * self.radius**3 * self.projectile_density


def zahnle_2003(s: ImpactEvent) -> float:
    """D = 1.1 (v^2/g)^0.217 (rho_i cos(theta) / rho_t)^0.333 L^0.783, in SI.

    Zahnle et al. 2003, Icarus 163, 263, eq. 2 (there for icy satellites, transient crater).
    """
    ratio = s.projectile_density * math.cos(s.angle) / s.target_density
    return 1.1 * (s.speed**2 / s.gravity) ** 0.217 * ratio**0.333 * (2.0 * s.radius) ** 0.783


def collins_2005(s: ImpactEvent) -> float:
    """D = 1.161 (rho_i/rho_t)^(1/3) L^0.78 v^0.44 g^-0.22 cos^(1/3)(theta), in SI.

    Collins, Melosh & Marcus 2005, Meteorit. Planet. Sci. 40, 817, eq. 21 (their angle is from the horizontal: sin
    there, cos here).
    """
    size = 1.161 * (s.projectile_density / s.target_density) ** (1.0 / 3.0)
    return size * (2.0 * s.radius) ** 0.78 * s.speed**0.44 * s.gravity**-0.22 * math.cos(s.angle) ** (1.0 / 3.0)


def schmidt_housen(s: ImpactEvent, coefficient: float, exponent: float) -> float:
    """D = C_D pi_2^-beta (m / rho_t)^(1/3) cos^(1/3)(theta), pi_2 = 1.61 g L / v^2.

    Schmidt & Housen 1987, Int. J. Impact Eng. 5, 543; in this form Melosh 1989, Impact Cratering, eq. 7.8.2 and Table
    7.1: water 1.88, 0.22; competent rock or saturated soil 1.6, 0.22; dry sand 1.54, 0.165.
    """
    pi_2 = 1.61 * s.gravity * 2.0 * s.radius / s.speed**2
    return (
        coefficient * pi_2**-exponent * (s.mass / s.target_density) ** (1.0 / 3.0) * math.cos(s.angle) ** (1.0 / 3.0)
    )


def schmidt_housen_water(s: ImpactEvent) -> float:
    """Schmidt-Housen in water: C_D = 1.88, beta = 0.22."""
    return schmidt_housen(s, 1.88, 0.22)


def schmidt_housen_rock(s: ImpactEvent) -> float:
    """Schmidt-Housen in competent rock or saturated soil: C_D = 1.6, beta = 0.22."""
    return schmidt_housen(s, 1.6, 0.22)


def schmidt_housen_sand(s: ImpactEvent) -> float:
    """Schmidt-Housen in dry sand: C_D = 1.54, beta = 0.165."""
    return schmidt_housen(s, 1.54, 0.165)


def holsapple_volume(s: ImpactEvent, k: float, mu: float) -> float:
    """V = K (m / rho_t) pi_2^(-3 mu / (2 + mu)) [m^3], pi_2 = g a / (v cos theta)^2: gravity regime.

    Holsapple 1993, Annu. Rev. Earth Planet. Sci. 21, 333; Holsapple's crater sizes: water K 0.98, mu 0.55; dry sand
    0.132, 0.41; wet soil and rock 0.095, 0.55.
    """
    pi_2 = s.gravity * s.radius / (s.speed * math.cos(s.angle)) ** 2
    return k * s.mass / s.target_density * pi_2 ** (-3.0 * mu / (2.0 + mu))


def paraboloid_diameter(volume: float) -> float:
    """Diameter [m] of a paraboloid of ``volume`` = pi/8 D^2 d [m^3] with d/D = 1/3, the usual transient crater."""
    return (8.0 * volume / (math.pi * (1.0 / 3.0))) ** (1.0 / 3.0)


def holsapple_water(s: ImpactEvent) -> float:
    """Holsapple's volume in water as a paraboloid of d/D = 1/3."""
    return paraboloid_diameter(holsapple_volume(s, 0.98, 0.55))


def holsapple_rock(s: ImpactEvent) -> float:
    """Holsapple's volume in wet soil or rock (gravity regime) as a paraboloid of d/D = 1/3."""
    return paraboloid_diameter(holsapple_volume(s, 0.095, 0.55))


def holsapple_sand(s: ImpactEvent) -> float:
    """Holsapple's volume in dry sand as a paraboloid of d/D = 1/3."""
    return paraboloid_diameter(holsapple_volume(s, 0.132, 0.41))


def housen_holsapple_2011(s: ImpactEvent, h1: float = 0.59, mu: float = 0.41, nu: float = 0.4) -> float:
    """D = 2 H1 (m/rho_t)^(1/3) (rho_t/rho_i)^((2 + mu - 6 nu)/(3 (2 + mu))) (g a / U^2)^(-mu/(2 + mu)), U = v cos
    theta, apparent.

    Housen & Holsapple 2011, Icarus 211, 856, eq. 14 (gravity regime); H1 and mu of dry sand by default (water: 0.68,
    0.55).
    """
    density = (s.target_density / s.projectile_density) ** ((2.0 + mu - 6.0 * nu) / (3.0 * (2.0 + mu)))
    pi_2 = s.gravity * s.radius / (s.speed * math.cos(s.angle)) ** 2
    return 2.0 * h1 * (s.mass / s.target_density) ** (1.0 / 3.0) * density * pi_2 ** (-mu / (2.0 + mu))


def housen_holsapple_2011_water(s: ImpactEvent) -> float:
    """Housen & Holsapple 2011 in water: H1 = 0.68, mu = 0.55."""
    return housen_holsapple_2011(s, 0.68, 0.55)


NU, SAND_BEND, SAND_EDGE = 0.4, 0.3, 1.3
"""nu of every ground, and p and n2 of dry sand in ``launch_speed`` (Housen & Holsapple 2011, Table 3)."""


def launch_speed(s: ImpactEvent, x: np.ndarray, radius: float, c1: float = 0.55, mu: float = 0.41) -> np.ndarray:
    """v(x) = C1 U ((x / a) (rho_t / rho_i)^nu)^(-1/mu) (1 - x / (n2 R))^p [m/s] of ejecta from ``x`` [m] of a crater
    of apparent ``radius`` R [m].

    Housen & Holsapple 2011, eq. 14; C1, mu, p and n2 of dry sand, U = v cos theta.
    """
    scaled_distance = np.asarray(x) / s.radius * (s.target_density / s.projectile_density) ** NU
    return (
        c1
        * s.speed
        * math.cos(s.angle)
        * scaled_distance ** (-1.0 / mu)
        * np.maximum(1.0 - np.asarray(x) / (SAND_EDGE * radius), 0.0) ** SAND_BEND
    )


def ejected_mass(s: ImpactEvent, speed: float, k: float, c1: float, mu: float, nu: float = 0.4) -> float:
    """M(>v) = m (3 k / 4 pi) (rho_t / rho_i)^(1 - 3 nu) (v / (C1 U))^(-3 mu) [kg], U = v cos theta: the power law,
    without its ends at the projectile and at the rim.

    From v/U = C1 ((x/a) (rho_t/rho_i)^nu)^(-1/mu) and M(<x) = k rho_t x^3 (Housen & Holsapple 2011, eqs. 14 and 19).
    Dry sand: k 0.3, C1 0.55, mu 0.41; water: 0.2, 1.5, 0.55 (their Table 3).
    """
    ratio = speed / (c1 * s.speed * math.cos(s.angle))
    return (
        s.mass
        * 3.0
        * k
        / (4.0 * math.pi)
        * (s.target_density / s.projectile_density) ** (1.0 - 3.0 * nu)
        * ratio ** (-3.0 * mu)
    )


EJECTA = {"sand": (0.3, 0.55, 0.41), "water": (0.2, 1.5, 0.55)}
"""k, C1 and mu of ``ejected_mass`` by target."""

LAWS: dict[str, Callable[[ImpactEvent], float]] = {
    "zahnle_2003": zahnle_2003,
    "collins_2005": collins_2005,
    "schmidt_housen_water": schmidt_housen_water,
    "schmidt_housen_rock": schmidt_housen_rock,
    "schmidt_housen_sand": schmidt_housen_sand,
    "holsapple_water": holsapple_water,
    "holsapple_rock": holsapple_rock,
    "holsapple_sand": holsapple_sand,
    "housen_holsapple_2011_water": housen_holsapple_2011_water,
    "housen_holsapple_2011_sand": housen_holsapple_2011,
}
GROUNDS: dict[str, tuple[str, ...]] = {
    "fluid": ("zahnle_2003", "collins_2005", "schmidt_housen_water"),
    "rock": ("schmidt_housen_rock", "holsapple_rock"),
    "sand": ("schmidt_housen_sand", "holsapple_sand", "housen_holsapple_2011_sand"),
}
"""The laws that a kind of ground is usually compared with; ``fluid`` is a target without friction, such as weak
ice."""
VOLUMES = {"fluid": (0.98, 0.55), "rock": (0.095, 0.55), "sand": (0.132, 0.41)}
"""K and mu of ``holsapple_volume`` by kind of ground."""
NAMES = {
    "zahnle_2003": "Zahnle et al. 2003", "collins_2005": "Collins et al. 2005",
    "schmidt_housen_water": "Schmidt & Housen 1987, water",
    "schmidt_housen_rock": "Schmidt & Housen 1987, rock", "schmidt_housen_sand": "Schmidt & Housen 1987, dry sand",
    "holsapple_water": "Holsapple 1993, water", "holsapple_rock": "Holsapple 1993, wet soil or rock",
    "holsapple_sand": "Holsapple 1993, dry sand",
    "housen_holsapple_2011_water": "Housen & Holsapple 2011, water",
    "housen_holsapple_2011_sand": "Housen & Holsapple 2011, dry sand",
}  # fmt: skip
"""Authors, year and target of every law, for pictures and pages."""


def diameters(event: ImpactEvent) -> dict[str, float]:
    """Transient apparent diameter [m] by every law."""
    if not (event.radius > 0.0 and event.speed > 0.0 and event.gravity > 0.0):
        raise InputError(f"scaling laws need a positive radius, speed and gravity, got {event}")
    return {name: law(event) for name, law in LAWS.items()}


def simple_to_complex(gravity: float, icy: bool) -> float:
    """Diameter D_sc [m] from which craters are complex, inverse to ``gravity`` [m/s^2] (Pike 1988): in rock 3.2 km on
    Earth (Collins et al. 2005), 19 km on the Moon; in ice 2.5 km on Callisto (Schenk 2002). Infinite without
    weight."""
    if gravity <= 0.0:
        return math.inf
    return (2500.0 * 1.236 if icy else 3200.0 * 9.81) / gravity


def final_from_transient(transient: float, simple_to_complex: float) -> float:
    """Final rim diameter D_f = 1.17 D_t^1.13 / D_sc^0.13 of a complex crater [m]; below D_sc the simple 1.25 D_t.

    McKinnon & Schenk 1985; Collins et al. 2005, eq. 27. ``simple_to_complex`` is D_sc [m].
    """
    if 1.25 * transient < simple_to_complex:
        return 1.25 * transient
    return 1.17 * transient**1.13 / simple_to_complex**0.13
