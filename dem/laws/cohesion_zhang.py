"""Cohesion: a constant pull over the area by which angular grains bear on each other.

    F_c = c (2 beta R)^2        while the grains touch

c interparticle tensile strength [Pa], beta shape parameter, R = r1 r2 / (r1 + r2) [m] (on a wall the radius of the grain): the pull of a
square of side 2 beta R. It does not depend on the overlap, so the force that pulls a contact open slowly is F_c itself. Energy -F_c x.

The Coulomb limit and those of rolling and twisting stay those of the contact force without the pull: a cohesive contact at rest is
pressed by F_c, and cohesion adds to shear strength as in Mohr's law.

Source: Zhang, Richardson, Barnouin, Michel, Schwartz & Ballouz 2018, ApJ 857, 15 (pkdgrav). LIGGGHTS: none; LAMMPS: none (``dmt``
pulls with 4 pi gamma R, the same force for one pair of radii with gamma = c beta^2 R / pi).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pydantic import Field

from matter.jit import law

SOURCES = ("Zhang2018",)


class Parameters(NamedTuple):
    """``strength``: c [Pa]."""

    strength: Annotated[float, Field(ge=0.0)] = 0.0


@law
def pull(strength, shape, radius):
    """F_c [N] from c [Pa], beta and R [m]."""
    side = 2.0 * shape * radius
    return strength * side * side
