"""Tangential contact force whose stiffness follows the area of a Hertzian contact (Mindlin, without micro-slip).

    dF_t = k_t dS,    k_t = 8 G* a = 8 G* sqrt(R x),    |F_t + C_t u_t| <= mu_s |F_n|
    1/G* = (2 - nu_1)/G_1 + (2 - nu_2)/G_2,   G = E / (2 (1 + nu)),
    C_t = -2 sqrt(5/6) ln(e_t) sqrt(k_t m_red / (pi^2 + ln^2 e_t))

Symbols as in ``tangential_spring`` and ``normal_hertz``. k_t / k = 4 G* / E* is one number per pair of species, with k
the tangent normal stiffness: the Coulomb test, the damping and its two rules are those of ``tangential_spring``. On a
wall, which is rigid, its own terms are left out of E* and G*.

What becomes of a spring (this one, and those of rolling and twisting) when the area changes between two slips: a
growing area keeps the force, a shrinking one lets go of it in proportion to a. A cycle never gains energy, and what it
loses is counted as dissipated. LAMMPS: ``mindlin_rescale/force``; LIGGGHTS: ``tangential history`` with ``model
hertz`` (its springs keep their length instead).

Source: Mindlin 1949, J. Appl. Mech. 16, 259; rule: Walton & Braun 1986, J. Rheol. 30, 949; Thornton, Cummins & Cleary
2013, Powder Technol. 233, 30.
"""

from __future__ import annotations

from dem.laws import normal_hertz, tangential_spring
from matter.compilation.jit import law

SOURCES = ("Mindlin1949", "WaltonBraun1986", "Thornton2013")

RESTS_ON = (tangential_spring,)
"""Laws whose files act in this one."""

Parameters, force = tangential_spring.Parameters, tangential_spring.force


def effective_shear_modulus(first: normal_hertz.Parameters, second: normal_hertz.Parameters) -> float:
    """G* [Pa] of two bodies."""
    return 1.0 / sum(
        2.0 * (2.0 - nu) * (1.0 + nu) / modulus for modulus, nu in map(normal_hertz.elastic_constants, (first, second))
    )


def stiffness_ratio(one: normal_hertz.Parameters, two: normal_hertz.Parameters) -> float:
    """k_t / k = 4 G* / E* of two species."""
    return 4.0 * effective_shear_modulus(one, two) / normal_hertz.effective_modulus(one, two)


@law
def retained_fraction(stiffness, before):
    """Part of the springs that stays when the tangent stiffness goes from ``before`` (0 at first touch) to
    ``stiffness`` [N/m]."""
    return before / stiffness if stiffness > before else 1.0
