"""Normal contact force: linear spring and dashpot (Hooke).

    F_n = k_n x - C_n u_n            repulsion, positive pushes the grains apart
    C_n = -2 ln(e_n) sqrt(k_n m_red / (pi^2 + ln^2 e_n))

x overlap [m], u_n separation speed of the two grains along their line of centres [m/s] (negative while they approach),
k_n stiffness [N/m], m_red = m1 m2 / (m1 + m2) reduced mass [kg], e_n coefficient of restitution.

The force may pull at the end of a contact: so a pair rebounds with exactly e_n after t_c = pi / sqrt(k_n/m_red -
(C_n / 2 m_red)^2).

Valid for overlaps that are small against the radii; the linear law has no material stiffness of its own.

Source: Cundall & Strack 1979, Géotechnique 29, 47; Schwartz, Richardson & Michel 2012, Granular Matter 14, 363, eqs
4-7 and 15. LIGGGHTS: ``model hooke/stiffness`` with ``limitForce off``; LAMMPS: ``hooke`` with ``damping
coeff_restitution``.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.compilation.jit import law

SOURCES = ("CundallStrack1979", "Schwartz2012")

LINEAR = True
"""k_n is a grain's own, so that it may change in the run (``dem.stiffness.change``)."""
TANGENTIAL = "spring"
"""The tangential law that goes with it."""

Restitution = Annotated[float, Field(gt=0.0, le=1.0, description="Normal coefficient of restitution, e_n.")]


class Parameters(NamedTuple):
    """``restitution``: e_n in (0, 1]."""

    restitution: Restitution = 0.55


Row, WIDTH = None, 0
"""The spring takes no number of the pair: k_n is that of the softer grain."""


def row(one: Parameters, two: Parameters | None) -> tuple[float, ...]:
    """No numbers."""
    return ()


def damping_number(restitution: float) -> float:
    """C / sqrt(k m_red) = -2 ln e / sqrt(pi^2 + ln^2 e), dimensionless."""
    ln_e = math.log(restitution)
    return -2.0 * ln_e / math.sqrt(math.pi**2 + ln_e**2)


def contact_time(stiffness: float, reduced_mass: float, restitution: float = 1.0) -> float:
    """Duration t_c of a binary contact [s]."""
    number = damping_number(restitution)
    return math.pi / math.sqrt(stiffness / reduced_mass * (1.0 - 0.25 * number * number))


@law(forceinline=True)
def stiffness(overlap, bodies, row):
    """k_n [N/m]."""
    return bodies.stiffness


@law(forceinline=True)
def elastic_force(overlap, stiffness):
    """k_n x [N]."""
    return stiffness * overlap


@law(forceinline=True)
def elastic_energy(overlap, stiffness):
    """k_n x^2 / 2 [J]."""
    return 0.5 * stiffness * overlap * overlap


@law
def force(overlap, separation_speed, stiffness, damping):
    """F_n [N] from overlap [m], u_n [m/s], k_n [N/m], C_n [kg/s]; it may pull at the end of a contact."""
    return stiffness * overlap - damping * separation_speed
