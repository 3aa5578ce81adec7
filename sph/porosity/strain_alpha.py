"""Strain-alpha porosity (Wünnemann, Collins & Melosh 2006, Icarus 180, 514).

With the volume strain eps = ln(V / V0) = -ln(rho / rho_00), negative in compression, rho_00 = rho_0 / alpha_0:

    elastic      eps > eps_e                 alpha = alpha_0
    exponential  eps_x < eps <= eps_e        alpha = alpha_0 exp[kappa (eps - eps_e)]
    power        eps_c < eps <= eps_x        alpha = 1 + (alpha_x - 1) [(eps_c - eps) / (eps_c - eps_x)]^2
    solid        eps <= eps_c                alpha = 1

    eps_x = eps_e + ln(alpha_x / alpha_0) / kappa,   eps_c = eps_x + 2 (1 - alpha_x) / (kappa alpha_x)          (continuous slope)

kappa near 1 means that nearly all compression goes into the pores (f = 1 - kappa in the exponential part). Irreversible: a particle keeps the smallest alpha
that it has had. The pressure is that of P-alpha, P_s(alpha rho, u) / alpha.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.jit import law


class Parameters(NamedTuple):
    """alpha0; eps_e <= 0 elastic limit (volume strain); kappa in (0, 1]; alpha_x in [1, alpha0]."""

    alpha0: Annotated[float, Field(ge=1, le=50)]
    eps_e: Annotated[float, Field(le=0)]
    kappa: Annotated[float, Field(gt=0, le=1)]
    alpha_x: Annotated[float, Field(ge=1)]


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
