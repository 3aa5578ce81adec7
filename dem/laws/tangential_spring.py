"""Tangential contact force: spring and dashpot under a Coulomb limit.

    F_t = k_t S + C_t u_t,    |F_t| <= mu_s |F_n|
    k_t = kappa k_n (kappa = 2/7 by default),  C_t = -2 ln(e_t) sqrt(k_t m_red / (pi^2 + ln^2 e_t))

S tangential spring [m], the integral of the slip velocity u_t of grain 2 relative to grain 1 at the contact [m/s]; F_t
acts on grain 1. S turns with the contact: it is rotated about the normal with the mean spin and kept in the contact
plane.

At the limit the force has the magnitude mu_s |F_n| along k_t S + C_t u_t, and the spring is only ever shortened, to
mu_s |F_n| / k_t when it is longer: as LIGGGHTS does, with the dashpot also under the limit. Slow slip carries the full
static friction into rest, and a contact never gains energy, for the force is the projection of k_t S + C_t u_t onto
the disc of the limit, in which k_t S lies, so (F_t - k_t S) . u_t >= 0. LAMMPS instead lets the spring carry what the
dashpot leaves of the limit.

Source: Cundall & Strack 1979, Géotechnique 29, 47; Schwartz, Richardson & Michel 2012, Granular Matter 14, 363, eqs
8-14. LIGGGHTS: ``tangential history``; LAMMPS: ``tangential linear_history``.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.identity_fields import Follows
from matter.compilation.jit import law

SOURCES = ("CundallStrack1979", "Schwartz2012")


class Parameters(NamedTuple):
    """``friction``: mu_s; ``restitution_tangential``: e_t in (0, 1]."""

    friction: Annotated[float, Field(ge=0.0, le=2.0, description="Coulomb friction, mu_s.")] = 0.5
    restitution_tangential: Annotated[
        float,
        Field(gt=0.0, le=1.0, description="Tangential coefficient of restitution, e_t: sets the tangential dashpot."),
        Follows(),
    ] = 0.55


STIFFNESS_RATIO = 2.0 / 7.0
"""k_t / k_n."""


def stiffness_ratio(one: object, two: object) -> float:
    """k_t / k_n of two species: the same for all."""
    return STIFFNESS_RATIO


@law
def force(sx, sy, sz, ux, uy, uz, stiffness, damping, limit):
    """Force and spring after the Coulomb test.

    ``s`` the spring with this step's slip added [m], ``u`` slip velocity [m/s], ``limit`` = mu_s |F_n| [N]; returns
    (F_x, F_y, F_z, s_x, s_y, s_z).
    """
    fx = stiffness * sx + damping * ux
    fy = stiffness * sy + damping * uy
    fz = stiffness * sz + damping * uz
    f = math.sqrt(fx * fx + fy * fy + fz * fz)
    if f > limit:
        q = limit / f
        fx *= q
        fy *= q
        fz *= q
        s = stiffness * math.sqrt(sx * sx + sy * sy + sz * sz)
        q = limit / s if s > limit else 1.0
        return fx, fy, fz, sx * q, sy * q, sz * q
    return fx, fy, fz, sx, sy, sz
