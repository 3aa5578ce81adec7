"""The walls of a bed (``matter.geometry.ground_region``): they end at its top. Those of flat ground are as rough as
the grains that lie on them, for the seed's bowl by the same contact parameters as between grains."""

from __future__ import annotations

import numpy as np

from dem.beds.whole_body_bed import WholeBody
from dem.contact.walls import CONE, PLANE, SPHERE_INSIDE, SPHERE_OUTSIDE, Wall, cylinder
from matter.geometry.ground_region import Cone, Upright

Domain = Cone | Upright
"""The volume that a bed with walls fills."""


def walls(domain: Domain | WholeBody) -> tuple[Wall, ...]:
    """Wall 0 is what carries the bed: the core's surface, the floor, or the bowl; then the sides, a cone's without
    friction. A whole body has none."""
    if isinstance(domain, WholeBody):
        return ()
    if isinstance(domain, Cone):
        return (
            Wall(SPHERE_OUTSIDE, radius=domain.floor, species=domain.floor_species),
            Wall(CONE, half_angle=domain.half_angle, top=domain.top),
        )
    radius, top, species = domain.radius, domain.top, domain.side_species
    if domain.shape == "bowl":
        side = cylinder(radius, 0.0, max(top, 1e-9 * radius), species=species, rims=(False, False))
        return (Wall(SPHERE_INSIDE, radius=radius, top=0.0, species=domain.floor_species), side)
    floor = Wall(PLANE, point=(0.0, 0.0, domain.floor), species=domain.floor_species)
    if domain.shape == "cylinder":
        return (floor, cylinder(radius, domain.floor, top, species=species, rims=(False, False)))
    sides = [
        Wall(PLANE, point=tuple(-radius * d), direction=tuple(d), top=top, species=species)
        for d in np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]])
    ]
    return (floor, *sides)


def lid(domain: Domain) -> Wall:
    """What closes the top while a random packing is made: a sphere over a cone, else a plane."""
    if isinstance(domain, Cone):
        return Wall(SPHERE_INSIDE, radius=domain.top)
    return Wall(PLANE, point=(0.0, 0.0, domain.top), direction=(0.0, 0.0, -1.0))
