"""Tillotson equation of state (Tillotson 1962, GA-3216; form of Benz & Asphaug 1999; Melosh 1989, App. II).

    eta = rho / rho0,   mu = eta - 1,   w = u / (E0 eta^2) + 1,   z = 1/eta - 1

    compressed, or cold (eta >= 1 or u <= Eiv):   Pc = (a + b/w) rho u + A mu + B mu^2
    vapour (eta < 1 and u >= Ecv):                Pe = a rho u + [b rho u / w + A mu exp(-beta z)] exp(-alpha z^2)
    between (eta < 1, Eiv < u < Ecv):             P  = [(u - Eiv) Pe + (Ecv - u) Pc] / (Ecv - Eiv)

The cold curve A mu + B mu^2 turns back up below its minimum at mu = -A / (2 B), to a spurious GPa of pressure in cold
water at half its density (B > A there); below the minimum it stays at its least value -A^2 / (4 B), which the
material's tension cut then takes to what it can bear.

Sound speed: c^2 = dP/drho|u + (P / rho^2) dP/du|rho, derived exactly in all three regions (published codes use the
compressed form everywhere or blend c^2 linearly). Valid for rho > 0; u below zero is read as u = 0 (no thermal
pressure below the cold curve). Expanded and cold, the compressed form is tension; the tension that a material bears is
cut elsewhere (``sph.stepping.state``).
"""

import math
from typing import NamedTuple

from matter.case.quantity import PositiveDensity, PositivePressure, SpecificEnergy
from matter.compilation.jit import law
from sph.eos import densest

SOURCES = ("Tillotson1962", "BenzAsphaug1999", "Melosh1989")


class Parameters(NamedTuple):
    """rho0 [kg/m^3], a, b, A and B [Pa], E0, Eiv, Ecv [J/kg], alpha, beta."""

    rho0: PositiveDensity
    a: float
    b: float
    A: PositivePressure
    B: PositivePressure
    E0: SpecificEnergy
    Eiv: SpecificEnergy
    Ecv: SpecificEnergy
    alpha: float
    beta: float


EXAMPLE = Parameters(2700.0, 0.5, 1.5, 2.67e10, 2.67e10, 4.87e8, 4.72e6, 1.82e7, 5.0, 5.0)
"""Basalt of Benz & Asphaug 1999."""


def kinks(p: Parameters) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Densities [kg/m^3] and specific energies [J/kg] at which derivatives jump: the borders of the forms, and the
    least cold pressure."""
    return (p.rho0, p.rho0 * (1.0 - 0.5 * p.A / p.B)), (p.Eiv, p.Ecv)


@law
def modulus(p):
    """Bulk modulus at rest [Pa]."""
    return p.A


@law
def _compressed(rho, u, p):
    """P, dP/drho, dP/du of the compressed form."""
    eta = rho / p.rho0
    mu = eta - 1.0
    w = u / (p.E0 * eta * eta) + 1.0
    mu_cold = max(mu, -0.5 * p.A / p.B)
    pressure = (p.a + p.b / w) * rho * u + p.A * mu_cold + p.B * mu_cold * mu_cold
    # d(rho u / w)/drho = u (3 w - 2) / w^2 because dw/drho = -2 (w - 1) / rho
    d_rho = p.a * u + p.b * u * (3.0 * w - 2.0) / (w * w) + (p.A + 2.0 * p.B * mu_cold) / p.rho0
    d_u = p.a * rho + p.b * rho / (w * w)
    return pressure, d_rho, d_u


@law
def _expanded(rho, u, p):
    """P, dP/drho, dP/du of the vapour form."""
    eta = rho / p.rho0
    mu = eta - 1.0
    z = 1.0 / eta - 1.0
    w = u / (p.E0 * eta * eta) + 1.0
    damp = math.exp(-p.alpha * min(z * z, 600.0 / p.alpha))
    cold = math.exp(-p.beta * min(z, 600.0 / p.beta))
    bracket = p.b * rho * u / w + p.A * mu * cold
    pressure = p.a * rho * u + bracket * damp
    dz = -p.rho0 / (rho * rho)
    d_bracket = p.b * u * (3.0 * w - 2.0) / (w * w) + p.A * cold * (1.0 / p.rho0 - p.beta * mu * dz)
    d_rho = p.a * u + damp * (d_bracket - 2.0 * p.alpha * z * dz * bracket)
    d_u = p.a * rho + damp * p.b * rho / (w * w)
    return pressure, d_rho, d_u


@law
def pressure_and_derivatives(rho, u, p):
    """P [Pa], dP/drho at constant u, dP/du at constant rho, for density rho [kg/m^3] and specific energy u [J/kg]."""
    u = max(u, 0.0)
    if rho >= p.rho0 or u <= p.Eiv:
        return _compressed(rho, u, p)
    if u >= p.Ecv:
        return _expanded(rho, u, p)
    pc, pc_rho, pc_u = _compressed(rho, u, p)
    pe, pe_rho, pe_u = _expanded(rho, u, p)
    f = (u - p.Eiv) / (p.Ecv - p.Eiv)
    return (
        f * pe + (1.0 - f) * pc,
        f * pe_rho + (1.0 - f) * pc_rho,
        f * pe_u + (1.0 - f) * pc_u + (pe - pc) / (p.Ecv - p.Eiv),
    )


@law
def pressure(rho, u, p):
    """P [Pa] at density rho [kg/m^3] and specific energy u [J/kg]."""
    return pressure_and_derivatives(rho, u, p)[0]


@law
def sound_speed(rho, u, p):
    """Adiabatic bulk sound speed [m/s]; zero where the law itself is unstable (c^2 < 0: cold, strongly expanded)."""
    P, d_rho, d_u = pressure_and_derivatives(rho, u, p)
    return math.sqrt(max(d_rho + P / (rho * rho) * d_u, 0.0))


_densest = densest.density_at_pressure(pressure_and_derivatives)


@law
def density(P, u, p):
    """The density [kg/m^3] with pressure P [Pa] at specific energy u [J/kg]; -1 where none exists.

    Compressed: Newton steps from rho0. Where the pressure at rho0 is above P, the first root below rho0 (the condensed
    branch; tension down to the law's least pressure has one too).
    """
    if P >= pressure(p.rho0, u, p):
        rho = p.rho0
        for _ in range(60):
            value, d_rho, _d_u = _compressed(rho, max(u, 0.0), p)
            step = (P - value) / d_rho
            rho = max(rho + step, 0.5 * rho)
            if abs(step) < 1e-13 * rho:
                break
        return rho
    return _densest(P, u, p.rho0, p)


@law
def energy(rho, P, p):
    """The specific energy u >= 0 [J/kg] with pressure P [Pa] at density rho [kg/m^3], by bisection; -1 where none
    exists."""
    low, high = 0.0, p.E0
    if pressure(rho, low, p) > P:
        return -1.0
    for _ in range(200):
        if pressure(rho, high, p) >= P:
            break
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        if pressure(rho, middle, p) < P:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
