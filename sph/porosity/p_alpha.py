"""P-alpha porosity (Herrmann 1969; Carroll & Holt 1972; Benz & Jutzi 2007, section 3; Jutzi, Benz & Michel 2008).

    P = P_s(alpha rho, u) / alpha,   alpha = rho_s / rho                                           (eqs. 3.1, 3.3)

Loading follows the crush curve, alpha = 1 + (alpha_s - 1) openness(P), from the pressure Pe on; everything else is
elastic:

    d alpha / dP = (alpha^2 / K_0) (1 - 1/h^2),   h = 1 + (alpha - 1) (c_e - c_0) / (c_0 (alpha_0 - 1))
        (Herrmann's elastic part)

with c_e and c_0 the sound speeds of the porous and the solid material and K_0 the bulk modulus of the matrix at rest;
c_e = c_0 means alpha constant. alpha_s = alpha at Pe on the elastic line from alpha_0 (= alpha_0 when c_e = c_0).

**State.** A particle keeps one number, the distention alpha_z that it would have if it were unloaded to P = 0: it can
only fall. Given rho and u, alpha solves the implicit equation (elastic line of alpha_z, or crush curve, whichever is
lower); on the crush curve alpha_z follows. The published codes integrate d alpha/dt (eq. 3.7), which lets particles
drift off their crush curve and limits the step; here each lies on or below it, to rounding.

**Stress.** The matrix is strained by f times the strain of the porous material, and what acts is S / alpha (eqs.
3.8-3.13):

    f = rho_s' / (alpha rho') = 1 + (rho / alpha) d alpha / d rho                   (printed as eq. 3.11 without "1 +")

along the path that the particle takes: adiabatic (du = P / rho^2 d rho) on the crush curve or the elastic line. alpha
= 1 is solid and costs nothing; alpha_0 = 1 is safe.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import PositiveSpeed
from matter.compilation.jit import law
from sph.eos import dispatch as eos
from sph.porosity import crush
from sph.porosity.matrix import Matrix

SOURCES = ("Herrmann1969", "CarrollHolt1972", "BenzJutzi2007", "Jutzi2008")
CRUSHES = True
"""It takes a crush curve (``sph.porosity.crush``)."""


class Parameters(NamedTuple):
    """alpha0: initial distention; elastic_speed c_e and solid_speed c_0 [m/s] of the elastic part (default: none)."""

    alpha0: Annotated[float, Field(ge=1, le=50)]
    elastic_speed: PositiveSpeed | None = None
    solid_speed: PositiveSpeed | None = None


EXAMPLE = Parameters(1.5)


class Pores(NamedTuple):
    """What the compiled laws read of a material: alpha0, start (alpha_s), stretch (dh/d alpha),
    bulk_modulus K_0 [Pa]."""

    alpha0: float
    start: float
    stretch: float
    bulk_modulus: float


Row = Pores


@law
def elastic_slope(alpha, p):
    """d alpha / dP [1/Pa] off the crush curve; beyond alpha_0, where h would fall to zero, and below 1 that of alpha_0
    and 1."""
    alpha = min(max(alpha, 1.0), p.alpha0)
    h = 1.0 + p.stretch * (alpha - 1.0)
    return alpha * alpha / p.bulk_modulus * (1.0 - 1.0 / (h * h)) if p.stretch < 0.0 else 0.0


@law
def along_elastic(alpha, change, p):
    """The distention after a change of pressure [Pa] along the elastic line (one Runge-Kutta step: the change is a few
    per cent of K_0)."""
    if p.stretch >= 0.0:
        return alpha
    k1 = elastic_slope(alpha, p)
    k2 = elastic_slope(alpha + 0.5 * change * k1, p)
    k3 = elastic_slope(alpha + 0.5 * change * k2, p)
    k4 = elastic_slope(alpha + change * k3, p)
    return max(alpha + change * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0, 1.0)


@law
def speed_factor(alpha, p):
    """h: sound speed of the porous material over that of its matrix, off the crush curve."""
    return 1.0 + p.stretch * (alpha - 1.0)


@law
def on_curve(P, curve, row, p):
    """Distention on the crush curve at pressure P [Pa]."""
    return 1.0 + (p.start - 1.0) * crush.openness(curve, row, P)


@law
def _bulk(alpha, rho, u, kind, material):
    """Pressure of the porous material and its derivatives with alpha, and (at constant alpha) with rho and u."""
    Ps, d_rho, d_u = eos.pressure_and_derivatives(kind, material, alpha * rho, u)
    P = Ps / alpha
    return P, (rho * d_rho - P) / alpha, d_rho, d_u / alpha


@law
def bulk_pressure(alpha, rho, u, kind, material):
    """P = P_s(alpha rho, u) / alpha [Pa]."""
    return _bulk(alpha, rho, u, kind, material)[0]


@law
def _elastic(rho, u, rest, kind, material, p):
    """Distention and pressure on the elastic line of the resting distention."""
    alpha = rest
    P, by_alpha, _r, _u = _bulk(alpha, rho, u, kind, material)
    if p.stretch < 0.0:
        for _ in range(20):
            short = along_elastic(rest, max(P, 0.0), p) - alpha
            alpha += short / (1.0 - elastic_slope(alpha, p) * by_alpha) if P > 0.0 else short
            P, by_alpha, _r, _u = _bulk(alpha, rho, u, kind, material)
            if abs(short) < 1e-13:
                break
    return alpha, P


@law
def _crushed(rho, u, most, kind, material, curve, row, p):
    """Distention on the crush curve between 1 and ``most``: alpha - crush(P(alpha)) rises with alpha, Newton steps
    kept inside a bracket."""
    P, by_alpha, _r, _u = _bulk(1.0, rho, u, kind, material)
    if on_curve(P, curve, row, p) <= 1.0:
        return 1.0
    low, high, alpha = 1.0, most, most
    for _ in range(100):
        P, by_alpha, _r, _u = _bulk(alpha, rho, u, kind, material)
        miss = alpha - on_curve(P, curve, row, p)
        if miss > 0.0:
            high = alpha
        else:
            low = alpha
        step = miss / (1.0 - (p.start - 1.0) * crush.slope(curve, row, P) * by_alpha)
        if abs(step) < 1e-14 or high - low < 1e-14:
            break
        alpha -= step
        if not (low < alpha < high):  # Newton left the bracket, or would not move
            alpha = 0.5 * (low + high)
    return alpha


@law
def distention(rho, u, rest, kind, material, curve, row, p, crushing):
    """The distention of a particle and what it keeps of it.

    rho bulk density [kg/m^3], u [J/kg], ``rest`` alpha_z so far; ``kind`` and ``material`` the equation of state of
    the matrix, ``curve`` and ``row`` the crush curve, ``p`` a ``Pores``; ``crushing`` False keeps the pores from
    closing for good.

    Returns alpha, the new alpha_z, and whether the particle is on the crush curve.
    """
    alpha, P = _elastic(rho, u, rest, kind, material, p)
    if not crushing or P <= crush.onset(curve, row) or alpha <= on_curve(P, curve, row, p):
        return alpha, rest, False
    alpha = _crushed(rho, u, alpha, kind, material, curve, row, p)
    if alpha <= 1.0:
        return 1.0, 1.0, True
    P = _bulk(alpha, rho, u, kind, material)[0]
    return alpha, max(min(rest, along_elastic(alpha, -max(P, 0.0), p)), 1.0), True


@law
def strain_factor(rho, u, alpha, by_pressure, kind, material, p):
    """f = 1 + (rho / alpha) d alpha / d rho for a path with the slope ``by_pressure`` = d alpha / dP [1/Pa].

    Where heat alone closes pores it comes out some 1e-4 below zero; it is 0 there: shear stress never grows against
    the strain.
    """
    if by_pressure == 0.0:
        return 1.0
    P, by_alpha, by_rho, by_u = _bulk(alpha, rho, u, kind, material)
    by_density = by_pressure * (by_rho + P / (rho * rho) * by_u) / (1.0 - by_pressure * by_alpha)
    return max(1.0 + rho / alpha * by_density, 0.0)


@law
def compact(curve, curve_row, eos_kind, eos_row, rho, u, rest, crushing, p):
    """As ``dispatch.compact`` says, for material that still has pores."""
    alpha, rest, loading = distention(rho, u, rest, eos_kind, eos_row, curve, curve_row, p, crushing)
    if alpha <= 1.0:
        return 1.0, rest, 1.0, 1.0, 1.0
    elastic = strain_factor(rho, u, alpha, elastic_slope(alpha, p), eos_kind, eos_row, p)
    loaded = elastic
    if loading:
        P = bulk_pressure(alpha, rho, u, eos_kind, eos_row)
        loaded = strain_factor(rho, u, alpha, (p.start - 1.0) * crush.slope(curve, curve_row, P), eos_kind, eos_row, p)
    return alpha, rest, loaded, elastic, speed_factor(alpha, p)


@law
def resting(P, curve, curve_row, p):
    """The distention at which the material would rest, loaded to P [Pa] on the crush curve."""
    alpha = on_curve(P, curve, curve_row, p)
    return min(max(along_elastic(alpha, -P, p), 1.0), p.alpha0) if alpha > 1.0 else 1.0


@law
def compact_linear(curve, curve_row, eos_kind, eos_row, rho, u, rest, medium, p):
    """As ``dispatch.compact_linear`` says: P - c2 (rho - solid / resting(P)) rises with P; by bisection."""
    solid, c2 = medium.solid, medium.c2
    low, high = crush.onset(curve, curve_row), c2 * (rho - solid / rest)
    if high <= low or resting(high, curve, curve_row, p) >= rest:
        return rest
    while high - low > 1e-12 * high:
        P = 0.5 * (low + high)
        if P > c2 * (rho - solid / resting(P, curve, curve_row, p)):
            high = P
        else:
            low = P
    return min(resting(low, curve, curve_row, p), rest)


@law
def at_pressure(curve, curve_row, eos_kind, eos_row, P, p):
    """As ``dispatch.at_pressure`` says."""
    alpha, rest = along_elastic(p.alpha0, P, p), p.alpha0
    if P > crush.onset(curve, curve_row):
        alpha, rest = on_curve(P, curve, curve_row, p), resting(P, curve, curve_row, p)
    return eos.density(eos_kind, eos_row, alpha * P, 0.0) / alpha, rest


def row(p: Parameters, matrix: Matrix) -> Pores:
    """The constants of a material with this matrix.

    Raises ``ValueError`` when c_e is above c_0.
    """
    c0 = p.solid_speed or math.sqrt(matrix.bulk_modulus / matrix.rho0)
    stretch = 0.0
    if p.elastic_speed is not None and p.alpha0 > 1.0:
        if p.elastic_speed > c0:
            raise ValueError(f"elastic_speed must not be above that of the solid, {c0:.4g} m/s")
        stretch = (p.elastic_speed - c0) / (c0 * (p.alpha0 - 1.0))
    pores = Pores(p.alpha0, p.alpha0, stretch, matrix.bulk_modulus)
    return pores._replace(start=along_elastic(p.alpha0, matrix.crush_onset, pores))
