"""Ideal gas.

    P = (gamma - 1) rho u,   c^2 = gamma (gamma - 1) u

rho0 is only the density at which a body of it is set up; the gas has no pressure-free state but u = 0.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import PositiveDensity
from matter.compilation.jit import law

SOURCES = ()


class Parameters(NamedTuple):
    """rho0 [kg/m^3] at set-up, gamma ratio of specific heats."""

    rho0: PositiveDensity
    gamma: Annotated[float, Field(gt=1)]


EXAMPLE = Parameters(1.2, 1.4)


@law
def modulus(p):
    """0: a gas has no bulk modulus at rest."""
    return 0.0


@law
def pressure_and_derivatives(rho, u, p):
    """P [Pa], dP/drho at constant u, dP/du at constant rho; u below zero is read as 0."""
    heat = (p.gamma - 1.0) * max(u, 0.0)
    return heat * rho, heat, (p.gamma - 1.0) * rho


@law
def sound_speed(rho, u, p):
    """Adiabatic sound speed [m/s]."""
    return math.sqrt(p.gamma * (p.gamma - 1.0) * max(u, 0.0))


@law
def density(P, u, p):
    """The density [kg/m^3] with pressure P [Pa] at u [J/kg]; -1 where none exists (P < 0 or u <= 0)."""
    if P < 0.0 or u <= 0.0:
        return -1.0
    return P / ((p.gamma - 1.0) * u)


@law
def energy(rho, P, p):
    """The specific energy [J/kg] with pressure P [Pa] at rho [kg/m^3]; -1 for P < 0."""
    if P < 0.0:
        return -1.0
    return P / ((p.gamma - 1.0) * rho)
