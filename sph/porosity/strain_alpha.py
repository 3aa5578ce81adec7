"""Strain-alpha porosity (Wünnemann, Collins & Melosh 2006, Icarus 180, 514).

With the volume strain eps = ln(V / V0) = -ln(rho / rho_00), negative in compression, rho_00 = rho_0 / alpha_0:

    elastic      eps > eps_e                 alpha = alpha_0
    exponential  eps_x < eps <= eps_e        alpha = alpha_0 exp[kappa (eps - eps_e)]
    power        eps_c < eps <= eps_x        alpha = 1 + (alpha_x - 1) [(eps_c - eps) / (eps_c - eps_x)]^2
    solid        eps <= eps_c                alpha = 1

    eps_x = eps_e + ln(alpha_x / alpha_0) / kappa,   eps_c = eps_x + 2 (1 - alpha_x) / (kappa alpha_x)
        (continuous slope)

kappa near 1 means that nearly all compression goes into the pores (f = 1 - kappa in the exponential part).
Irreversible: a particle keeps the smallest alpha that it has had. The pressure is that of P-alpha, P_s(alpha rho, u) /
alpha.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.compilation.jit import law
from sph.eos import dispatch as eos

SOURCES = ("Wuennemann2006",)
CRUSHES = False
"""Its own curve says how pores close: it takes no crush curve."""


class Parameters(NamedTuple):
    """alpha0; eps_e <= 0 elastic limit (volume strain); kappa in (0, 1]; alpha_x in [1, alpha0]."""

    alpha0: Annotated[float, Field(ge=1, le=50)]
    eps_e: Annotated[float, Field(le=0)]
    kappa: Annotated[float, Field(gt=0, le=1)]
    alpha_x: Annotated[float, Field(ge=1)]


EXAMPLE = Parameters(1.5, -1e-4, 0.98, 1.1)


def fault(p: Parameters) -> str:
    """What is wrong with the values together, or nothing."""
    return "" if p.alpha_x <= max(p.alpha0, 1.0) else "alpha_x must not be above alpha0"


@law
def volume_strain(rho, rho0, p):
    """eps at the bulk density rho [kg/m^3] of a material whose solid density is rho0."""
    return -math.log(rho * p.alpha0 / rho0)


@law
def distention(strain, p):
    """alpha on the compaction curve at the volume strain eps."""
    if strain > p.eps_e:
        return p.alpha0
    x = p.eps_e + math.log(p.alpha_x / p.alpha0) / p.kappa
    if strain > x:
        return p.alpha0 * math.exp(p.kappa * (strain - p.eps_e))
    c = x + 2.0 * (1.0 - p.alpha_x) / (p.kappa * p.alpha_x)
    if strain <= c:
        return 1.0
    return 1.0 + (p.alpha_x - 1.0) * ((c - strain) / (c - x)) ** 2


@law
def strain_of(alpha, p):
    """eps at which the compaction curve has the distention alpha, 1 < alpha <= alpha_0."""
    if alpha >= p.alpha_x:
        return p.eps_e + math.log(alpha / p.alpha0) / p.kappa
    x = p.eps_e + math.log(p.alpha_x / p.alpha0) / p.kappa
    c = x + 2.0 * (1.0 - p.alpha_x) / (p.kappa * p.alpha_x)
    return c - (c - x) * math.sqrt((alpha - 1.0) / (p.alpha_x - 1.0))


@law
def crush_pressure(alpha, u, eos_kind, eos_row, p):
    """The pressure [Pa] on the compaction curve at the distention alpha > 1 and the specific energy u [J/kg]."""
    rho = eos_row[0] / p.alpha0 * math.exp(-strain_of(alpha, p))
    return eos.pressure_and_derivatives(eos_kind, eos_row, alpha * rho, u)[0] / alpha


@law
def slope(strain, p):
    """d alpha / d eps on the compaction curve."""
    if strain > p.eps_e:
        return 0.0
    x = p.eps_e + math.log(p.alpha_x / p.alpha0) / p.kappa
    if strain > x:
        return p.kappa * p.alpha0 * math.exp(p.kappa * (strain - p.eps_e))
    c = x + 2.0 * (1.0 - p.alpha_x) / (p.kappa * p.alpha_x)
    if strain <= c:
        return 0.0
    return -2.0 * (p.alpha_x - 1.0) * (c - strain) / ((c - x) * (c - x))


@law
def strain_factor(strain, p):
    """f = 1 + (rho / alpha) d alpha / d rho = 1 - (1 / alpha) d alpha / d eps on the compaction curve."""
    return max(1.0 - slope(strain, p) / distention(strain, p), 0.0)


@law
def compact(curve, curve_row, eos_kind, eos_row, rho, u, rest, crushing, q):
    """As ``dispatch.compact`` says, for material that still has pores."""
    strain = volume_strain(rho, eos_row[0], q)
    alpha = distention(strain, q)
    if crushing and alpha <= rest:
        return alpha, alpha, strain_factor(strain, q), 1.0, 1.0
    return rest, rest, 1.0, 1.0, 1.0


@law
def compact_linear(curve, curve_row, eos_kind, eos_row, rho, u, rest, medium, p):
    """As ``dispatch.compact_linear`` says: P_c(alpha) - c2 (rho - solid / alpha) falls with alpha; by bisection."""
    solid, c2 = medium.solid, medium.c2
    if c2 * (rho - solid / rest) <= crush_pressure(rest, u, eos_kind, eos_row, p):
        return rest
    low, high = max(solid / rho, 1.0), rest
    while high - low > 1e-13:
        alpha = 0.5 * (low + high)
        if crush_pressure(alpha, u, eos_kind, eos_row, p) > c2 * (rho - solid / alpha):
            low = alpha
        else:
            high = alpha
    return high


@law
def at_pressure(curve, curve_row, eos_kind, eos_row, P, q):
    """As ``dispatch.at_pressure`` says, by bisection."""
    low, high = 0.5 * eos_row[0] / q.alpha0, 2.0 * eos.density(eos_kind, eos_row, q.alpha0 * P, 0.0)
    alpha = 1.0
    for _ in range(100):
        rho = 0.5 * (low + high)
        alpha = distention(volume_strain(rho, eos_row[0], q), q)
        if eos.pressure_and_derivatives(eos_kind, eos_row, alpha * rho, 0.0)[0] / alpha > P:
            high = rho
        else:
            low = rho
    return 0.5 * (low + high), alpha
