"""Which law each part of a contact follows: every law of this folder behind one call, chosen by ``kind``.

In a loop that is compiled for a ``dem.contact.contact_scheme.Scheme`` the choice is a constant and costs nothing.
``bodies`` is a ``dem.contact.Bodies``: stiffness k_n [N/m], reduced mass [kg], R [m], and the two radii [m]. The
``row`` holds the numbers of a pair of species (``between``); what each family's file brings is in CONTRIBUTING.md.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

from dem.laws import (
    cohesion_sjkr,
    cohesion_zhang,
    normal_hertz,
    normal_hooke,
    rolling_sds,
    tangential_mindlin,
    tangential_spring,
    twisting_sds,
)
from matter.compilation.law_family import Family

NORMAL = Family("normal", "normal law", (normal_hooke, normal_hertz), prefix="normal_")
TANGENTIAL = Family("tangential", "tangential law", (tangential_spring, tangential_mindlin), prefix="tangential_")
ROLLING = Family("rolling", "law of rolling resistance", (rolling_sds,), prefix="rolling_")
TWISTING = Family("twisting", "law of twisting resistance", (twisting_sds,), prefix="twisting_")
COHESION = Family("cohesion", "law of cohesion", (cohesion_zhang, cohesion_sjkr), prefix="cohesion_", none=True)

FAMILIES = (NORMAL, TANGENTIAL, ROLLING, TWISTING, COHESION)

stiffness = NORMAL.choose(
    "stiffness", "overlap, bodies", inline=True, about="k_n [N/m] at this overlap [m]: the tangent stiffness."
)
elastic_force = NORMAL.choose(
    "elastic_force",
    "overlap, k",
    rows=False,
    inline=True,
    about="The part of the normal force [N] that the spring holds.",
)
elastic_energy = NORMAL.choose(
    "elastic_energy", "overlap, k", rows=False, inline=True, about="What the normal spring holds [J]."
)
normal_force = NORMAL.choose(
    "force",
    "overlap, separation_speed, k, damping",
    rows=False,
    inline=True,
    about="F_n [N], which pushes apart; it may pull at the end of a contact.",
)
tangential_force = TANGENTIAL.choose(
    "force",
    "sx, sy, sz, ux, uy, uz, stiffness, damping, limit",
    rows=False,
    inline=True,
    about="F_t [N] and the tangential spring [m] after the Coulomb test.",
)
retained_fraction = TANGENTIAL.choose(
    "retained_fraction",
    "stiffness, before",
    otherwise="1.0",
    rows=False,
    inline=True,
    about="Part of the springs that stays when the tangent stiffness goes from ``before`` to ``stiffness`` [N/m].",
)
rolling_moment = ROLLING.choose(
    "moment",
    "ax, ay, az, wx, wy, wz, stiffness, damping, limit",
    rows=False,
    inline=True,
    about="Moment [N m] and the rolling spring [rad] after the test of the slider.",
)
twisting_moment = TWISTING.choose(
    "moment",
    "angle, rate, stiffness, damping, limit",
    rows=False,
    inline=True,
    about="Moment [N m] about n and the twisting spring [rad] after the test of the slider.",
)
pull = COHESION.choose(
    "pull", "overlap, bodies", otherwise="0.0", inline=True, about="Pull of cohesion [N] at this overlap [m]."
)
binding_energy = COHESION.choose(
    "binding_energy", "overlap, bodies", otherwise="0.0", inline=True, about="Binding energy of cohesion [J]."
)


def smaller(one: Any, two: Any) -> Any:
    """``Parameters`` of a contact of two species: the smaller of each value."""
    return type(one)(*map(min, one, two))


def between(module: ModuleType | None, one: Any, two: Any) -> tuple[float, ...]:
    """The row of a law (none: no numbers) for a contact of two species with these ``Parameters``; ``two`` None stands
    for a rigid wall.

    A law whose numbers are not the smaller of each value says how they combine: ``row(one, two)``.
    """
    if module is None:
        return ()
    law: Any = module
    if hasattr(law, "row"):
        return tuple(law.row(one, two))
    return tuple(one if two is None else smaller(one, two))
