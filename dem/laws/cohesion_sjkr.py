"""Cohesion in proportion to the area of the contact (simplified JKR).

    F_c = k A,    A = pi x (2 r1 + 2 r2 - x) (2 r1 - x) (2 r2 - x) / (4 d^2)
        two spheres at the distance d = r1 + r2 - x
                  A = pi x (2 r - x)                                             sphere and wall

k cohesion energy density [J/m^3 = Pa], x overlap [m], A area of the circle in which the two bodies cut each other
[m^2]. The pull vanishes with the overlap, so two grains held together only by it rest at a small overlap (linear law:
where k_n x = k A) and have no pull-off force beyond that at the deepest net attraction. Energy -k times the integral
of A over the overlap.

The Coulomb limit stays that of the contact force without the pull (LIGGGHTS: ``tangential_reduce off``).

Source: manual of LIGGGHTS 3, ``gran cohesion sjkr``; Johnson, Kendall & Roberts 1971, Proc. R. Soc. A 324, 301 for the
law that it simplifies. LIGGGHTS: ``cohesion sjkr`` with ``cohesionEnergyDensity`` k; LAMMPS: none (``jkr`` is the full
law).
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import Pressure
from matter.compilation.jit import law

SOURCES = ("Johnson1971",)


EXAMPLE = {"cohesion": 2000.0}


class Parameters(NamedTuple):
    """``cohesion``: k [J/m^3]."""

    cohesion: Annotated[Pressure, Field(ge=0.0, description="Cohesion energy density k.")] = 0.0


@law
def area(overlap, first, second):
    """A [m^2] of two spheres of radii ``first``, ``second`` [m]; ``second`` 0 stands for a wall."""
    if second == 0.0:
        return math.pi * overlap * (2.0 * first - overlap)
    s = first + second
    d = s - overlap
    return math.pi * overlap * (2.0 * s - overlap) * (2.0 * first - overlap) * (2.0 * second - overlap) / (4.0 * d * d)


@law
def volume(overlap, first, second):
    """Integral of A over the overlap [m^3]: three Gauss points, since the closed form loses its digits at small
    overlaps."""
    low, high = 0.5 - math.sqrt(0.15), 0.5 + math.sqrt(0.15)
    return (
        overlap
        * (
            5.0 * area(low * overlap, first, second)
            + 8.0 * area(0.5 * overlap, first, second)
            + 5.0 * area(high * overlap, first, second)
        )
        / 18.0
    )


@law(forceinline=True)
def pull(overlap, bodies, p):
    """k A [N]."""
    return p.cohesion * area(overlap, bodies.first, bodies.second)


@law(forceinline=True)
def binding_energy(overlap, bodies, p):
    """k times the integral of A over the overlap [J]."""
    return p.cohesion * volume(overlap, bodies.first, bodies.second)
