"""Which equation of state a material has: every law of this folder behind one call, chosen by ``kind`` and fed from a row of numbers.

A row holds the values of the law's ``Parameters`` in their order, rho0 first, zeros behind; ``LAWS[kind]`` names the law. Sound speeds are exact for every
law, c^2 = dP/drho|u + (P / rho^2) dP/du|rho.
"""

import math

from matter.jit import law
from sph.eos import ideal_gas, murnaghan, tillotson

LAWS = ("tillotson", "murnaghan", "ideal_gas")
PARAMETERS = (tillotson.Parameters, murnaghan.Parameters, ideal_gas.Parameters)
WIDTH = 10
TILLOTSON, MURNAGHAN, IDEAL_GAS = range(3)


@law
def as_tillotson(t):
    """A row as Tillotson's parameters."""
    return tillotson.Parameters(t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7], t[8], t[9])


@law
def pressure_and_derivatives(kind, row, rho, u):
    """P [Pa], dP/drho at constant u, dP/du at constant rho, at density rho [kg/m^3] and specific energy u [J/kg]."""
    if kind == TILLOTSON:
        return tillotson.pressure_and_derivatives(rho, u, as_tillotson(row))
    if kind == MURNAGHAN:
        return murnaghan.pressure_and_derivatives(rho, u, murnaghan.Parameters(row[0], row[1], row[2]))
    return ideal_gas.pressure_and_derivatives(rho, u, ideal_gas.Parameters(row[0], row[1]))


@law
def sound_speed(kind, row, rho, u):
    """Adiabatic bulk sound speed [m/s]; zero where the law is unstable."""
    P, d_rho, d_u = pressure_and_derivatives(kind, row, rho, u)
    return math.sqrt(max(d_rho + P / (rho * rho) * d_u, 0.0))


@law
def density(kind, row, P, u):
    """The density [kg/m^3] with pressure P [Pa] at specific energy u [J/kg], the densest one; -1 where none exists."""
    if kind == TILLOTSON:
        return tillotson.density(P, u, as_tillotson(row))
    if kind == MURNAGHAN:
        return murnaghan.density(P, u, murnaghan.Parameters(row[0], row[1], row[2]))
    return ideal_gas.density(P, u, ideal_gas.Parameters(row[0], row[1]))


@law
def energy(kind, row, rho, P):
    """The specific energy u >= 0 [J/kg] with pressure P [Pa] at density rho [kg/m^3]; -1 where none exists."""
    if kind == TILLOTSON:
        return tillotson.energy(rho, P, as_tillotson(row))
    if kind == MURNAGHAN:
        return murnaghan.energy(rho, P, murnaghan.Parameters(row[0], row[1], row[2]))
    return ideal_gas.energy(rho, P, ideal_gas.Parameters(row[0], row[1]))


@law
def modulus(kind, row):
    """Bulk modulus at rest [Pa]: A, K0, or 0 for a gas."""
    if kind == TILLOTSON:
        return row[3]
    if kind == MURNAGHAN:
        return row[1]
    return 0.0
