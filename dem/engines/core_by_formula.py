"""A sphere on which grains lie, as a force by formula: LIGGGHTS knows no such wall, and cannot make it of triangles.

    F_n = k_n o - C_n v_r,  o = r + R - |x| > 0,   C_n = number sqrt(k_n m)

along the outward radius, with every grain's own k_n and e_n; no friction. Triangles fail on a convex wall: with edges
that touch, grains near an edge are pushed by two facets at once (the floor of a settled Valhalla bed pushed 18 % too
hard); with edges that do not, grains sink between two facets.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dem.contact.settings import SPECIES
from dem.contact.walls import Wall
from dem.engines.grain_classes import law_of
from dem.engines.scene import Scene
from dem.laws import normal_hooke
from matter.files import archive
from matter.formats import lammps_data

MARGIN = 4.0
"""Grains within this many mean radii of the sphere's contact are looked at; the group is rebuilt several times per
snapshot."""
REGROUP = '"group near_core region near_core"'


def write_constants(scene: Scene, wall: Wall, folder: Path) -> None:
    """Write k_n and C_n of every grain, as files that the engine reads into variables."""
    grains = scene.grains
    number = np.zeros(len(SPECIES))
    for k in range(len(SPECIES)):
        e = law_of(scene.contact, k).restitution
        number[k] = normal_hooke.damping_number(
            e if wall.species < 0 else min(e, law_of(scene.contact, wall.species).restitution)
        )
    damping = number[grains.species] * np.sqrt(grains.stiffness * grains.mass)
    who = lammps_data.identities(grains)
    for name, values in (("stiffness", grains.stiffness), ("damping", damping)):
        lines = [str(len(who)), *(f"{i} {v:.17g}" for i, v in zip(who, values))]
        archive.write_text(folder / f"core_{name}.dat", "\n".join(lines) + "\n")


def core_commands(scene: Scene, wall: Wall) -> list[str]:
    """Commands of the force."""
    radius = float(scene.grains.radius.mean())
    near = wall.radius + float(scene.grains.radius.max()) + MARGIN * radius
    centre = [f"{c:.17g}" for c in wall.point]
    squared = "+".join(f"({c}-({at}))^2" for c, at in zip("xyz", centre))
    along = "+".join(f"({c}-({at}))*v{c}" for c, at in zip("xyz", centre))
    return [
        f"region near_core sphere {' '.join(centre)} {near:.17g} side in",
        "group near_core region near_core",
        "variable core_stiffness atomfile core_stiffness.dat",
        "variable core_damping atomfile core_damping.dat",
        "compute core_radius all property/atom radius",
        "fix core_grain all store/state 0 v_core_stiffness v_core_damping c_core_radius",
        f'variable core_far atom "sqrt({squared})"',
        f'variable core_depth atom "f_core_grain[3]+{wall.radius:.17g}-v_core_far"',
        f"variable core_push atom "
        f'"(v_core_depth>0.0)*(f_core_grain[1]*v_core_depth-f_core_grain[2]*({along})/v_core_far)/v_core_far"',
        *(f'variable core_{c} atom "v_core_push*({c}-({at}))"' for c, at in zip("xyz", centre)),
        "fix core near_core addforce v_core_x v_core_y v_core_z",
    ]
