"""Murnaghan equation of state (Murnaghan 1944, PNAS 30, 244): a bulk modulus that grows linearly with pressure.

    P = (K0 / n) [(rho / rho0)^n - 1],   c^2 = dP/drho = (K0 / rho0) (rho / rho0)^(n - 1)

Energy does not enter: no heating, no vapour. For soils and for weak shocks (P up to about K0).
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import PositiveDensity, PositivePressure
from matter.compilation.jit import law

SOURCES = ("Murnaghan1944",)


class Parameters(NamedTuple):
    """rho0 [kg/m^3], K0 bulk modulus at rest [Pa], n = dK/dP."""

    rho0: PositiveDensity
    K0: PositivePressure
    n: Annotated[float, Field(gt=0)]


EXAMPLE = Parameters(1600.0, 2.7e9, 4.0)


@law
def modulus(p):
    """Bulk modulus at rest [Pa]."""
    return p.K0


@law
def pressure_and_derivatives(rho, u, p):
    """P [Pa], dP/drho, dP/du (zero) at density rho [kg/m^3]; ``u`` is not used."""
    ratio = rho / p.rho0
    stiff = ratio ** (p.n - 1.0)
    return p.K0 / p.n * (stiff * ratio - 1.0), p.K0 / p.rho0 * stiff, 0.0


@law
def sound_speed(rho, u, p):
    """Bulk sound speed [m/s]."""
    return math.sqrt(p.K0 / p.rho0 * (rho / p.rho0) ** (p.n - 1.0))


@law
def density(P, u, p):
    """The density [kg/m^3] with pressure P [Pa]; -1 below the tension -K0/n, which no density has."""
    ratio = 1.0 + p.n * P / p.K0
    if ratio <= 0.0:
        return -1.0
    return p.rho0 * ratio ** (1.0 / p.n)


@law
def energy(rho, P, p):
    """0 where P [Pa] is the pressure at rho [kg/m^3] (to 1e-9 of K0), else -1: no energy changes it."""
    return 0.0 if abs(pressure_and_derivatives(rho, 0.0, p)[0] - P) <= 1e-9 * p.K0 else -1.0
