"""Cohesion: a constant pull over the area by which angular grains bear on each other.

    F_c = c (2 beta R)^2        while the grains touch

c interparticle tensile strength [Pa], beta shape parameter, R = r1 r2 / (r1 + r2) [m] (on a wall the radius of the
grain): the pull of a square of side 2 beta R. It does not depend on the overlap, so the force that pulls a contact
open slowly is F_c itself. Energy -F_c x.

The Coulomb limit and those of rolling and twisting stay those of the contact force without the pull: a cohesive
contact at rest is pressed by F_c, and cohesion adds to shear strength as in Mohr's law.

Source: Zhang, Richardson, Barnouin, Michel, Schwartz & Ballouz 2018, ApJ 857, 15 (pkdgrav). LIGGGHTS: none; LAMMPS:
none (``dmt`` pulls with 4 pi gamma R, the same force for one pair of radii with gamma = c beta^2 R / pi).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from dem.laws.rolling_sds import Shape
from matter.case.quantity import Pressure
from matter.compilation.jit import law

SOURCES = ("Zhang2018",)


EXAMPLE = {"cohesion": 100.0, "shape": 0.5}


class Parameters(NamedTuple):
    """``cohesion``: c [Pa]; ``shape``: beta."""

    cohesion: Annotated[Pressure, Field(ge=0.0, description="Interparticle tensile strength c.")] = 0.0
    shape: Shape = 0.4


def fault(p: Parameters) -> str:
    """What is wrong with the values together."""
    return (
        "pulls over an area (2 beta R)^2: a species with cohesion needs shape above zero"
        if p.cohesion > 0.0 and p.shape == 0.0
        else ""
    )


def constant_pull(radius: np.ndarray, p: Parameters) -> np.ndarray:
    """F_c [N] of two equal grains, whatever their overlap."""
    return np.asarray(p.cohesion * (p.shape * radius) ** 2)


@law(forceinline=True)
def pull(overlap, bodies, p):
    """F_c [N] at any overlap."""
    side = 2.0 * p.shape * bodies.radius
    return p.cohesion * side * side


@law(forceinline=True)
def binding_energy(overlap, bodies, p):
    """F_c x [J]."""
    return pull(overlap, bodies, p) * overlap
