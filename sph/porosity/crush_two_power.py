"""Crush curve of two powers (Jutzi, Benz & Michel 2008, Icarus 198, 242; pumice: Jutzi et al. 2009).

    (alpha - 1) / (alpha_s - 1) = { (alpha_e - alpha_t) [(Pt - P) / (Pt - Pe)]^n1 + (alpha_t - 1) [(Ps - P) / (Ps -
    Pe)]^n2 } / (alpha_e - 1)

for Pe < P < Pt; the second term alone for Pt <= P < Ps. alpha_e and alpha_t are those of the measured curve; a
material of another distention alpha_s takes the curve scaled, as the formula says.
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import PositivePressure
from matter.compilation.jit import law

SOURCES = ("Jutzi2008", "Jutzi2009")


class Parameters(NamedTuple):
    """alpha_e > alpha_t >= 1; Pe < Pt < Ps [Pa]; powers n1, n2 >= 1."""

    alpha_e: Annotated[float, Field(gt=1)]
    alpha_t: Annotated[float, Field(ge=1)]
    Pe: PositivePressure
    Pt: PositivePressure
    Ps: PositivePressure
    n1: Annotated[float, Field(ge=1)]
    n2: Annotated[float, Field(ge=1)]


EXAMPLE = Parameters(4.64, 1.90, 1e6, 6.8e7, 2.13e8, 12.0, 3.0)


def fault(p: Parameters) -> str:
    """What is wrong with the values together, or nothing."""
    if not p.Pe < p.Pt < p.Ps:
        return "the pressures must obey Pe < Pt < Ps"
    return "" if p.alpha_t <= p.alpha_e else "alpha_t must not be above alpha_e"


@law
def onset(p):
    """The pressure [Pa] at which crushing starts."""
    return p.Pe


@law
def openness(P, p):
    """(alpha - 1) / (alpha_s - 1) at pressure P [Pa]."""
    if P <= p.Pe:
        return 1.0
    if P >= p.Ps:
        return 0.0
    value = (p.alpha_t - 1.0) * ((p.Ps - P) / (p.Ps - p.Pe)) ** p.n2
    if P < p.Pt:
        value += (p.alpha_e - p.alpha_t) * ((p.Pt - P) / (p.Pt - p.Pe)) ** p.n1
    return value / (p.alpha_e - 1.0)


@law
def slope(P, p):
    """Its derivative with P [1/Pa], <= 0; at Pe that of the curve above."""
    if P < p.Pe or P >= p.Ps:
        return 0.0
    value = (p.alpha_t - 1.0) * p.n2 / (p.Ps - p.Pe) * ((p.Ps - P) / (p.Ps - p.Pe)) ** (p.n2 - 1.0)
    if P < p.Pt:
        value += (p.alpha_e - p.alpha_t) * p.n1 / (p.Pt - p.Pe) * ((p.Pt - P) / (p.Pt - p.Pe)) ** (p.n1 - 1.0)
    return -value / (p.alpha_e - 1.0)
