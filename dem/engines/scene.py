"""What an engine is given to run: grains, laws, boundaries, gravity, damping, the step, and what to leave behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dem.beds.bed_walls import Domain
from dem.contact.gravity import Field
from dem.contact.settings import Contact
from dem.contact.walls import Wall
from dem.engines.grain_classes import Classes
from matter.files import archive
from matter.formats import lammps_data
from matter.particles import Particles

COLUMNS = ("id", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz")
DATA = "start.data"
HOLD_STEPS = 5
"""Steps for which g(r)/r and the damping rate of a grain are held: evaluating the formulas in each would cost as much
as the contacts."""


@dataclass(frozen=True)
class Scene:
    """Physics. ``domain`` gives the damped layer, or None; ``reach`` half the edge of the cube that the grains may not
    leave [m]."""

    grains: Particles
    contact: Contact
    walls: Sequence[Wall]
    gravity: Field
    dt: float
    reach: float
    domain: Domain | None = None
    skin: float = 0.3
    """In mean radii."""
    classes: Classes = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "classes", Classes.sort(self.grains))

    @property
    def skin_length(self) -> float:
        """Skin of the neighbour list [m]."""
        return self.skin * float(self.grains.radius.mean())

    @property
    def lower(self) -> float:
        """Distance of the innermost grain's centre from the origin [m]."""
        return float(np.min(np.linalg.norm(self.grains.position, axis=1)))

    def write_data(self, folder: Path, walls: int = 0) -> None:
        """Write the data file; types are the classes, and ``walls`` more for boundaries."""
        classes = self.classes
        names = [
            f"species {s} k_n {k:.4g} m {m:.4g}" for s, k, m in zip(classes.species, classes.stiffness, classes.mass)
        ]
        typed = Particles(
            {**self.grains, "species": classes.of},
            {**self.grains.attributes, "species": names + [f"wall {w}" for w in range(walls)]},
        )
        lammps_data.write(typed, folder / DATA)


@dataclass(frozen=True)
class Plan:
    """Until which step, what is written every how many steps, and the restart to go on from (its step), if any.

    ``integrate`` False leaves the grains where they are with the velocities they have: springs load at a known rate (a
    test of the laws).
    """

    steps: int
    dump_every: int
    restart_every: int = 0
    resume: int | None = None
    integrate: bool = True
    forces: bool = False
    dumps: bool = True
    settle: int = 0
    """Steps before those that a benchmark times: a run of their own."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the dumps."""
        return COLUMNS + (("fx", "fy", "fz", "tqx", "tqy", "tqz") if self.forces else ())


def write_deck(lines: Sequence[str], path: Path) -> None:
    """Write a deck; blank entries are left out."""
    archive.write_text(path, "\n".join(line for line in lines if line) + "\n")
