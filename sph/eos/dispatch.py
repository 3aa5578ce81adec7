"""Which equation of state a material has: every law of this folder behind one call, chosen by ``kind`` and fed from a
row of numbers, rho0 first.

A law file defines ``pressure_and_derivatives``, ``density``, ``energy`` and ``modulus``. Sound speeds are exact for
every law, c^2 = dP/drho|u + (P / rho^2) dP/du|rho.
"""

import math

from matter.compilation.jit import law
from matter.compilation.law_family import Family
from sph.eos import ideal_gas, mie_gruneisen, murnaghan, table, tillotson

FAMILY = Family("eos", "equation of state", (tillotson, murnaghan, ideal_gas, table, mie_gruneisen))

pressure_and_derivatives = FAMILY.choose(
    "pressure_and_derivatives",
    "rho, u",
    about="P [Pa], dP/drho at constant u, dP/du at constant rho, at density rho [kg/m^3] and specific energy u "
    "[J/kg].",
)
density = FAMILY.choose(
    "density",
    "P, u",
    about="The density [kg/m^3] with pressure P [Pa] at specific energy u [J/kg], the densest one; -1 where none "
    "exists.",
)
energy = FAMILY.choose(
    "energy",
    "rho, P",
    about="The specific energy u >= 0 [J/kg] with pressure P [Pa] at density rho [kg/m^3]; -1 where none exists.",
)
modulus = FAMILY.choose("modulus", "", about="Bulk modulus at rest [Pa]; 0 for a gas.")
temperature = FAMILY.choose(
    "temperature", "rho, u", otherwise="0.0", about="T [K]; 0 of a law that knows no temperature."
)
entropy = FAMILY.choose(
    "entropy", "rho, u", otherwise="0.0", about="s [J/(kg K)], on the law's own zero; 0 of a law that knows none."
)


@law
def sound_speed(kind, row, rho, u):
    """Adiabatic bulk sound speed [m/s]; zero where the law is unstable."""
    P, d_rho, d_u = pressure_and_derivatives(kind, row, rho, u)
    return math.sqrt(max(d_rho + P / (rho * rho) * d_u, 0.0))
