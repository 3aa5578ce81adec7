"""Mie-Grueneisen equation of state on a Hugoniot of linear shock speed, U_s = c0 + s u_p (Rice, McQueen & Walsh 1958).

    chi = 1 - rho0 / rho,   mu = rho / rho0 - 1
    compressed (chi >= 0):  P = P_H + Gamma0 rho0 (u - P_H chi / (2 rho0)),   P_H = rho0 c0^2 chi / (1 - s chi)^2
    expanded (chi < 0):     P = c0^2 rho mu + Gamma0 rho u

P_H and P_H chi / (2 rho0) are pressure and energy behind a shock into matter at rest with u = 0: the three conditions
of Rankine and Hugoniot with the linear shock speed. Gamma rho = Gamma0 rho0 in compression (Gamma falls as rho0/rho),
Gamma = Gamma0 in expansion. c0 [m/s] bulk sound speed, s slope, Gamma0 Grueneisen's number at rest, rho0 [kg/m^3].

Both halves meet at rho0 with the same P, and at u = 0 with the same c. P_H has a pole at chi = 1 / s (the most that
any shock compresses); from 0.9 of that on it goes straight on in chi. The expanded half lets go: hotter than
u = c0^2 / Gamma0 no tension is left. It knows neither vapour nor melting: for condensed matter, of metals up to a few
100 GPa.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import PositiveDensity, PositiveSpeed
from matter.compilation.jit import law
from sph.eos import densest

SOURCES = ("Rice1958",)
NEAR = 0.9
"""Fraction of the largest chi from which on the Hugoniot goes straight on."""


class Parameters(NamedTuple):
    """rho0 [kg/m^3], c0 [m/s], s, gamma0."""

    rho0: PositiveDensity
    c0: PositiveSpeed
    s: Annotated[float, Field(ge=0)]
    gamma0: Annotated[float, Field(ge=0)]


EXAMPLE = Parameters(2703.0, 5350.0, 1.34, 1.97)


def kinks(p: Parameters) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Densities [kg/m^3] and energies [J/kg] at which derivatives jump."""
    return (p.rho0,), ()


@law
def modulus(p):
    """Bulk modulus at rest [Pa]."""
    return p.rho0 * p.c0 * p.c0


@law
def hugoniot(rho, p):
    """P_H [Pa], its energy u_H [J/kg], and the slopes of both in rho, at rho >= rho0."""
    chi = 1.0 - p.rho0 / rho
    held = min(chi, NEAR / p.s) if p.s > 0.0 else chi
    K, free = p.rho0 * p.c0 * p.c0, 1.0 - p.s * held
    slope = K * (1.0 + p.s * held) / (free * free * free)
    P = K * held / (free * free) + slope * (chi - held)
    d_chi = p.rho0 / (rho * rho)
    return P, P * chi / (2.0 * p.rho0), slope * d_chi, (P + slope * chi) / (2.0 * p.rho0) * d_chi


@law
def pressure_and_derivatives(rho, u, p):
    """P [Pa], dP/drho at constant u, dP/du at constant rho, for density rho [kg/m^3] and specific energy u [J/kg]."""
    if rho >= p.rho0:
        P, u_shock, P_rho, u_rho = hugoniot(rho, p)
        stiff = p.gamma0 * p.rho0
        return P + stiff * (u - u_shock), P_rho - stiff * u_rho, stiff
    c2 = p.c0 * p.c0
    mu = rho / p.rho0 - 1.0
    return rho * (c2 * mu + p.gamma0 * u), c2 * (1.0 + 2.0 * mu) + p.gamma0 * u, p.gamma0 * rho


@law
def sound_speed(rho, u, p):
    """Adiabatic bulk sound speed [m/s]; zero where the law is unstable."""
    P, d_rho, d_u = pressure_and_derivatives(rho, u, p)
    return math.sqrt(max(d_rho + P / (rho * rho) * d_u, 0.0))


_densest = densest.density_at_pressure(pressure_and_derivatives)


@law
def density(P, u, p):
    """The densest density [kg/m^3] with pressure P [Pa] at u [J/kg]; -1 where none exists."""
    return _densest(P, u, p.rho0, p)


@law
def energy(rho, P, p):
    """The specific energy u >= 0 [J/kg] with pressure P [Pa] at rho [kg/m^3]; -1 where none exists."""
    cold, _d_rho, d_u = pressure_and_derivatives(rho, 0.0, p)
    if P < cold or d_u <= 0.0:
        return -1.0
    return (P - cold) / d_u
