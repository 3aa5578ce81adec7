"""How dense a material is at rest, and how a body of such materials attracts: what a stage expects before anything is
computed.

    bulk = solid / alpha0,   g = G sum_layers (4/3) pi (r_outer^3 - r_inner^3) bulk / R^2

A case may give a material another density or other pores than its file (``[sph.materials.NAME]``). The laws that say
so belong to the shock stage, so the roof asks it and hands the others what differs from the file, their settings'
``densities`` (``pipeline.settings.checking``). After the shock stage nothing of this counts any more: bodies and
matter are as dense as its files say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated

from matter.case import material
from matter.case.body import Model, Target
from matter.case.identity_fields import Follows, NotIdentity
from matter.case.quantity import PositiveDensity
from matter.constants import G


class AtRest(Model):
    """Densities of one material at rest."""

    solid: PositiveDensity
    """Density of the solid, rho0 of its equation of state."""
    bulk: PositiveDensity
    """Density with the pores that it has before anything is crushed."""


Densities = Annotated[Mapping[str, AtRest], NotIdentity(), Follows()]
"""By name those materials of a case that are not as their files say. No result goes by it directly: defaults that
follow from it decide by their own values."""


def of_file(name: str) -> AtRest:
    """What the material's own file says, with the pores of the law that it takes by itself. Raises ``InputError`` for
    an unknown name."""
    solid, law = material.reference_density(name), material.choices(name).get("porosity", "none")
    alpha0 = material.section(name, law)["alpha0"] if law in material.load(name) else 1.0
    return AtRest(solid=solid, bulk=solid / alpha0)


def densities_at_rest(name: str, densities: Mapping[str, AtRest]) -> AtRest:
    """The case's own densities of a material, where it has any; those of its file otherwise."""
    return densities[name] if name in densities else of_file(name)


def own(found: Mapping[str, AtRest]) -> dict[str, AtRest]:
    """Those of ``found`` that are not as their materials' files say."""
    return {name: densities for name, densities in found.items() if densities != of_file(name)}


def surface_gravity(target: Target, densities: Mapping[str, AtRest]) -> float:
    """Gravity at the surface [m/s^2]: that of flat ground, or of a body at uniform densities, an ellipsoid or mesh
    taken as the ball of its volume."""
    if target.flat:
        return target.gravity
    mass, inner = 0.0, 0.0
    for layer, outer in zip(target.layers, target.outer_radii):
        mass += 4.0 / 3.0 * math.pi * (outer**3 - inner**3) * densities_at_rest(layer.material, densities).bulk
        inner = outer
    return G * mass / target.radius**2
