"""Which porosity law a material has, chosen by ``kind`` and fed from a row of numbers, alpha0 first.

A law file defines ``compact``, ``compact_linear``, ``at_pressure`` and the flag ``CRUSHES`` (whether it takes a crush
curve); ``row(p, matrix)`` where its numbers are not its parameters.
"""

from typing import NamedTuple

from matter.compilation.jit import law
from matter.compilation.law_family import Family
from sph.eos import dispatch
from sph.porosity import p_alpha, strain_alpha


class LinearMedium(NamedTuple):
    """Material of a late stage: density of its matrix without pressure [kg/m^3], squared sound speed [m^2/s^2]."""

    solid: float
    c2: float


FAMILY = Family("porosity", "law of the pores", (p_alpha, strain_alpha), none=True)

_compact = FAMILY.choose(
    "compact",
    "curve, curve_row, eos_kind, eos_row, rho, u, rest, crushing",
    otherwise="1.0, 1.0, 1.0, 1.0, 1.0",
    about="``compact`` of material with pores.",
)
_compact_linear = FAMILY.choose(
    "compact_linear",
    "curve, curve_row, eos_kind, eos_row, rho, u, rest, medium",
    otherwise="1.0",
    about="``compact_linear`` of material with pores.",
)
_at_pressure = FAMILY.choose(
    "at_pressure",
    "curve, curve_row, eos_kind, eos_row, P",
    otherwise="0.0, 1.0",
    about="``at_pressure`` of material with pores.",
)


@law
def compact(kind, pores, curve, curve_row, eos_kind, eos_row, rho, u, rest, crushing):
    """The distention of a particle of bulk density rho [kg/m^3] and specific energy u [J/kg] that would rest at
    ``rest``.

    Returns alpha; the new resting distention (never above the old); f of the matrix strain for compression and for
    expansion; and the sound speed over that of the matrix.
    """
    if rest <= 1.0:
        return 1.0, 1.0, 1.0, 1.0, 1.0
    return _compact(kind, pores, curve, curve_row, eos_kind, eos_row, rho, u, rest, crushing)


@law
def compact_linear(kind, pores, curve, curve_row, eos_kind, eos_row, rho, u, rest, medium):
    """The new resting distention, at most ``rest``, in the linear medium P = c2 (rho - solid / rest) of a late stage.

    It is elastic up to the pressure at which the pores give way by the material's own law, and stays at that beyond:
    P = P_c(alpha).
    """
    if rest <= 1.0 or rho * rest <= medium.solid:
        return rest
    return _compact_linear(kind, pores, curve, curve_row, eos_kind, eos_row, rho, u, rest, medium)


@law
def at_pressure(kind, pores, curve, curve_row, eos_kind, eos_row, P):
    """The cold material under the pressure P >= 0 [Pa], loaded from rest: bulk density [kg/m^3], and the distention
    that it would rest at."""
    if kind == 0 or pores[0] <= 1.0:
        return dispatch.density(eos_kind, eos_row, P, 0.0), 1.0
    return _at_pressure(kind, pores, curve, curve_row, eos_kind, eos_row, P)
