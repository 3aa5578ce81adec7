"""What it takes to break a body in two: the specific energy after which the largest piece, what fell back together
counted, holds half of its mass.

    Q*_D = Q0 (R / 1 cm)^a + B rho (R / 1 cm)^b          strength holds the first, the body's own pull the second
    Q = m v^2 / (2 M)                                    of a projectile m at the speed v

Source: Benz & Asphaug 1999, Icarus 142, 5, eq. 6 and Table III, at 45 deg: basalt and ice at 3 km/s.
"""

from __future__ import annotations

import math

SOURCES = ("BenzAsphaug1999",)

CONSTANTS = {"rock": (3.5e3, -0.38, 0.3e-4, 1.36), "ice": (1.6e3, -0.39, 1.2e-4, 1.26)}
"""Q0 [J/kg], a, B [J/kg for a density in g/cm^3, as the paper counts it], b."""


def energy(radius: float, density: float, kind: str = "rock") -> float:
    """Q*_D [J/kg] of a body of this ``radius`` [m] and ``density`` [kg/m^3], of ``rock`` or ``ice``."""
    q0, a, big_b, b = CONSTANTS[kind]
    size = radius / 0.01
    return q0 * size**a + big_b * 1e-3 * density * size**b


def energy_ratio(projectile_mass: float, speed: float, target_mass: float, radius: float, kind: str = "rock") -> float:
    """Q over Q*_D of an impact; masses [kg], ``speed`` [m/s], ``radius`` of the target [m]."""
    density = target_mass / (4.0 / 3.0 * math.pi * radius**3)
    return 0.5 * projectile_mass * speed**2 / target_mass / energy(radius, density, kind)
