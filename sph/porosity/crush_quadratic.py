"""Quadratic crush curve (Herrmann 1969, J. Appl. Phys. 40, 2490; Benz & Jutzi 2007, eq. 3.5).

    (alpha - 1) / (alpha_s - 1) = [(Ps - P) / (Ps - Pe)]^2,   Pe < P < Ps

1 below Pe, 0 from Ps on. P is the pressure of the porous material; alpha_s, the distention where crushing starts,
belongs to ``sph.porosity.p_alpha``.
"""

from typing import NamedTuple

from matter.case.quantity import PositivePressure
from matter.compilation.jit import law

SOURCES = ("Herrmann1969", "BenzJutzi2007")


class Parameters(NamedTuple):
    """Pe: pressure at which crushing starts, Ps: at which all pores are gone [Pa], Ps > Pe."""

    Pe: PositivePressure
    Ps: PositivePressure


EXAMPLE = Parameters(80e6, 700e6)


def fault(p: Parameters) -> str:
    """What is wrong with the values together, or nothing."""
    return "" if p.Ps > p.Pe else "Ps must be above Pe"


@law
def onset(p):
    """The pressure [Pa] at which crushing starts."""
    return p.Pe


@law
def openness(P, p):
    """(alpha - 1) / (alpha_s - 1) at pressure P [Pa]."""
    x = min(max((p.Ps - P) / (p.Ps - p.Pe), 0.0), 1.0)
    return x * x


@law
def slope(P, p):
    """Its derivative with P [1/Pa], <= 0; at Pe that of the curve above."""
    if P < p.Pe or P >= p.Ps:
        return 0.0
    return -2.0 * (p.Ps - P) / ((p.Ps - p.Pe) * (p.Ps - p.Pe))
