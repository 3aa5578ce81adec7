"""Friction of ground made of grains that has to flow faster than its weight rearranges them: the mu(I) law (GDR MiDi
2004, Eur. Phys. J. E 14, 341; Jop, Forterre & Pouliquen 2006, Nature 441, 727; as public accounts of them have it).

    mu(I) / mu_s = 1 + (mu_2 / mu_s - 1) / (1 + I_0 / I),    I = g d sqrt(rho_s / P),    g = sqrt(2 E':E')

d diameter of the grains, rho_s their density, P the pressure that they bear, E' the deviator of the rate of strain of
the evaluation before; mu_s friction of slow flow, mu_2 that of the fastest. The yield law sees its pressure times this
factor, so that cohesion and the end of the cone in tension stay. Ground whose grains are small against the flow has
I = 0 and the friction of the cone alone, the default. Grains of metres on a body of small weight have I about 1.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import PositiveLength
from matter.compilation.jit import law

SOURCES = ("GDRMiDi2004", "Jop2006")
DIAMETER, I0, RATIO, WIDTH = range(4)
"""Columns of a row."""


class Parameters(NamedTuple):
    """grain_diameter d [m]; I0, the number I at half of the rise; ratio mu_2 / mu_s (defaults: glass beads, 0.279 and
    0.643 / 0.382, Jop et al. 2006)."""

    grain_diameter: PositiveLength
    I0: Annotated[float, Field(gt=0)] = 0.279
    ratio: Annotated[float, Field(ge=1, le=5)] = 0.643 / 0.382


@law
def inertial_number(xx, xy, xz, yy, yz, zz, diameter, density, P):
    """I of a rate of strain [1/s] under a pressure P > 0 [Pa]; ``density`` of the grains [kg/m^3]."""
    third = (xx + yy + zz) / 3.0
    xx, yy, zz = xx - third, yy - third, zz - third
    squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)
    return math.sqrt(2.0 * squares * density / P) * diameter


@law
def factor(number, I0, ratio):
    """mu(I) / mu_s."""
    return 1.0 + (ratio - 1.0) * number / (number + I0)
