"""What an engine cannot do as ``dem`` does it: refused by name, unless the case accepts it by that name.

``[dem] accept = ["no_twist", ...]``. Accepted deviations that a run made use of stand in its ``stage_report.json`` and
in ``measures.json``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np

from dem.contact.settings import Contact
from dem.contact.walls import SPHERE_OUTSIDE
from dem.engines import liggghts
from dem.engines.scene import Scene
from matter.errors import InputError

Deviation = Literal[
    "no_twist", "damping_by_size_class", "stiffness_by_size_class", "rolling_of_equal_spheres", "sliding_spring",
    "contacts_begin_unloaded",
    "ejecta_not_slowed", "spin_not_damped", "smooth_core", "springs_of_the_bed",
]  # fmt: skip

SENTENCES: dict[str, str] = {
    "no_twist": "contacts do not resist twisting",
    "damping_by_size_class": "dashpots (and in LAMMPS the twisting spring) are those of classes of grains of like "
    "stiffness and mass, not of each pair",
    "stiffness_by_size_class": "the stiffness of a grain is the mean of its class",
    "rolling_of_equal_spheres": "the rolling rate of unequal spheres lacks the term of their sizes",
    "sliding_spring": "at the limit of friction LIGGGHTS counts the spring without its dashpot; LAMMPS lets both "
    "together carry the limit",
    "contacts_begin_unloaded": "tangential, rolling and twisting springs of the start begin at zero",
    "ejecta_not_slowed": "returning ejecta are not slowed to what their contacts can stop: they may pass through the "
    "uppermost grains; those that begin inside grains of the bed are pushed out of them",
    "spin_not_damped": "the damped layer at the side damps velocities, not spins",
    "smooth_core": "the core pushes, but does not resist sliding and rolling on it",
    "springs_of_the_bed": "contacts keep the springs in which the bed settled, softer than springs_for asks; [bed] "
    "largest_speed settles it in such springs",
}
assert set(SENTENCES) == set(get_args(Deviation))

ROUNDING = 1e-6
"""Relative rounding by classes below which they count as exact."""


class Start(NamedTuple):
    """What the grains of a start ask for: ``loaded`` contacts, ``ejecta`` among them, springs ``stiffer`` than those
    of the bed."""

    loaded: bool = False
    ejecta: bool = False
    stiffer: bool = False


def needed(engine: str, scene: Scene, start: Start) -> list[str]:
    """Names of the deviations that this engine makes on this scene."""
    contact, grains = scene.contact, scene.grains
    laws = [getattr(contact, name) for k, name in enumerate(("shell", "ocean")) if np.any(grains.species == k)]
    rough = [law for law in laws if law.friction > 0.0]
    rolls = any(law.shape > 0.0 and law.rolling > 0.0 for law in rough)
    twists = any(law.shape > 0.0 and law.twisting > 0.0 for law in rough)
    off = scene.classes.rounding(grains)
    sizes = max(off["root_mass_max"], off["radius_max"], off["stiffness_max"]) > ROUNDING
    ours = engine == liggghts.NAME
    applies = {
        "no_twist": ours and twists,
        "damping_by_size_class": sizes and (ours or rolls or twists),
        "stiffness_by_size_class": off["stiffness_max"] > ROUNDING,
        "rolling_of_equal_spheres": rolls and float(np.ptp(grains.radius)) > ROUNDING * float(grains.radius.max()),
        "sliding_spring": bool(rough),
        "contacts_begin_unloaded": start.loaded,
        "ejecta_not_slowed": start.ejecta,
        "spin_not_damped": scene.domain is not None and scene.domain.damped_width > 0.0,
        "smooth_core": ours
        and bool(rough)
        and any(wall.kind == SPHERE_OUTSIDE and wall.species >= 0 for wall in scene.walls),
        "springs_of_the_bed": start.stiffer,
    }
    return [name for name in SENTENCES if applies[name]]


def check(engine: str, scene: Scene, needs: Sequence[str], accepted: Sequence[str]) -> None:
    """Raise ``InputError`` with every deviation that is needed and not accepted."""
    if engine == liggghts.NAME and len(frictions := liggghts.rolling_numbers(scene)) > 1:
        raise InputError(
            f"[dem] engine = {engine!r} takes one rolling friction for all contacts; this case has "
            f"{', '.join(f'{mu:g}' for mu in sorted(frictions))}"
        )
    missing = [name for name in needs if name not in accepted]
    if missing:
        listed = "".join(f"\n  {name}: {SENTENCES[name]}" for name in missing)
        text = ", ".join(f'"{name}"' for name in [*accepted, *missing])
        raise InputError(
            f"[dem] engine = {engine!r} cannot do all that this case asks for:{listed}\nto run it all the same: [dem] "
            f"accept = [{text}]"
        )


def laws_missing(engine: str, contact: Contact) -> str:
    """What the case asks of ``[dem.contact]`` that another engine is not given, or nothing."""
    given = (("normal", contact.normal, "hooke"), ("cohesion", contact.cohesion, "none"))
    return ", ".join(
        f'[dem.contact] {key} = "{law}" (engine = "{engine}" is given "{known}" only)'
        for key, law, known in given
        if engine != "native" and law != known
    )
