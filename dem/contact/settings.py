"""The contact settings that the bed and the collapse share, and the tables that the kernels read."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from dem.contact import rest_springs, walls
from dem.contact.columns import (
    COHESION,
    DAMPING_N,
    DAMPING_T,
    FRICTION,
    NORMAL,
    PAIR_COLUMNS,
    RATIO,
    ROLLING,
    SHAPE,
    TWISTING,
)
from dem.contact.contact_scheme import Scheme
from dem.contact.grain_law import OCEAN, SPECIES, GrainLaw
from dem.contact.grain_solid import elastic
from dem.contact.gravity import Field as Gravity
from dem.laws import dispatch
from dem.laws.dispatch import FAMILIES, between, smaller
from matter.case import material
from matter.case.body import Model
from matter.case.identity_fields import Follows
from matter.case.quantity import Angle
from matter.compilation.law_family import Family
from matter.particles import Particles

LIQUIDS = ("water", "water_thesis")
"""Materials whose grains are of the species ``ocean``; all others are ``shell``."""
WAVE_SPEED_LIMIT = 2.0
"""The contact wave speed 2 r sqrt(k_n / m) never exceeds this times the sound speed of the grain's material."""
OVERLAP_WARN = 0.15
"""Overlaps above this, in radii of the smaller grain, are reported."""
RETURNING_SPEED_LIMIT = 0.3
"""Closing speed of a returned ejecta grain, over the contact wave speed, above which the excess is taken out by a
dashpot and booked."""

if TYPE_CHECKING:
    NormalName = str
    CohesionName = str
else:
    NormalName, CohesionName = (Literal.__getitem__(f.names) for f in (dispatch.NORMAL, dispatch.COHESION))


class Contact(Model):
    """How grains touch: one set of parameters for solid grains (``shell``), one for liquid ones (``ocean``).

    A pair of different species takes the softer spring and the smaller of each friction, shape, restitution and
    cohesion: a solid grain slides on water as water does. With ``hertz`` springs act in series.
    """

    normal: NormalName = "hooke"
    """Normal law, which brings its tangential law: ``spring`` with ``hooke``, ``mindlin`` with ``hertz``; see
    ``dem.laws``."""
    cohesion: CohesionName = "none"
    """Cohesion of grains in contact; see ``dem.laws``."""

    shell: GrainLaw = GrainLaw()
    """Contact parameters of solid grains, ``[dem.contact.shell]``."""
    ocean: Annotated[GrainLaw, Follows()] = OCEAN
    """Contact parameters of liquid grains: smooth and hardly bouncing."""
    friction_angle: Angle | None = None
    """Friction angle by principal stresses: ``shell.friction`` is chosen so that steady shear of the grains has it
    (``dem.trials.friction_angle``). By default that of the ground of the shock stage, where its strength is
    ``drucker_prager`` and the case gives neither friction nor shape of the grains."""
    static_overlap: Annotated[float, Field(gt=0.0, le=0.2)] = 0.02
    """Overlap under the static load, x_max, in grain radii: k_n = max(P_floor r / x_max, min(2 K r, 33 P_floor r /
    x_max)), the solid's own stiffness where the weight asks for it, else what holds the weight."""
    stiffness_factor: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
    """Multiplies k_n of every grain after its limits (a sensitivity test doubles it)."""
    steps_per_contact: Annotated[int, Field(ge=8, le=1000)] = 30
    """Time step = shortest contact time / this."""
    overlap_stop: Annotated[float, Field(gt=0.0, lt=2.0)] = 0.5
    """An overlap of two bed grains above this, in radii of the smaller grain, stops the run."""

    @model_validator(mode="after")
    def _combination(self) -> Contact:
        self._check_cohesion()
        for family in FAMILIES:
            for species in range(len(SPECIES) if self.law(family) else 0):
                if said := family.fault(self.kind(family), self.values(family, species)):
                    raise ValueError(f'{family.key} = "{self.name(family)}" {said}')
        return self

    def _check_cohesion(self) -> None:
        """A strength of cohesion and a law that reads it come together."""
        strengths = {
            key
            for law in dispatch.COHESION.laws
            for key, least in law.Parameters._field_defaults.items()
            if least == 0.0
        }
        sticky = {
            key: name for name in SPECIES for key in sorted(strengths) if getattr(getattr(self, name), key) > 0.0
        }
        law = self.law(dispatch.COHESION)
        read = set(law.Parameters._fields) if law else set()
        if idle := sorted(set(sticky) - read):
            laws = [
                f'"{name}"'
                for name, other in zip(dispatch.COHESION.names[1:], dispatch.COHESION.laws)
                if idle[0] in other.Parameters._fields
            ]
            raise ValueError(
                f'{sticky[idle[0]]}: {idle[0]} is given, but cohesion = "{self.cohesion}" names no law for it '
                f"({' or '.join(laws)})"
            )
        if law is not None and not strengths & read & set(sticky):
            own = " and ".join(sorted(strengths & read))
            raise ValueError(
                f'cohesion = "{self.cohesion}" needs {" or ".join(f"{name}.{own}" for name in SPECIES)} above zero'
            )

    @property
    def tangential(self) -> str:
        """The tangential law, that of the normal one."""
        return str(self.law(dispatch.NORMAL).TANGENTIAL)

    def name(self, family: Family) -> str:
        """The law that is taken of a family; a family of one law has no key."""
        return str(getattr(self, family.key, family.names[0]))

    def kind(self, family: Family) -> int:
        """Its number in the family."""
        return family.kind(self.name(family))

    def law(self, family: Family) -> Any:
        """Its file; None where it is ``none``."""
        return family.module(self.kind(family))

    def laws(self) -> list[ModuleType]:
        """The files of all laws that are taken."""
        return [law for law in map(self.law, FAMILIES) if law is not None]

    def values(self, family: Family, species: int) -> Any:
        """The ``Parameters`` of the law that is taken of a family, for a species; what an ocean leaves open is the
        shell's."""
        law = self.law(family)
        own = {key: getattr(getattr(self, SPECIES[species]), key) for key in law.Parameters._fields}
        own = {key: getattr(self.shell, key) if value is None else value for key, value in own.items()}
        for key in getattr(law, "STIFF", ()):
            own[key] = own[key] and own[key] * self.stiffness_factor
        return law.Parameters(**own)

    @property
    def linear(self) -> bool:
        """Whether k_n is a grain's own, at every overlap."""
        return bool(self.law(dispatch.NORMAL).LINEAR)

    @property
    def springs_can_change(self) -> bool:
        """Whether k_n may change in the run: linear springs, and a pull that does not depend on the overlap."""
        return self.linear and (self.cohesion == "none" or hasattr(self.law(dispatch.COHESION), "constant_pull"))

    @property
    def springs_that_change(self) -> str:
        """The laws that ``springs_can_change`` asks for, in words."""
        varying = ", ".join(
            f'"{name}"'
            for name, law in zip(dispatch.COHESION.names[1:], dispatch.COHESION.laws)
            if not hasattr(law, "constant_pull")
        )
        return (
            f"normal = {_one_of(dispatch.NORMAL, 'LINEAR')}, and no cohesion that depends on the overlap ({varying})"
        )

    def scheme(self) -> Scheme:
        """What the kernels are compiled for."""
        kinds = {family.key: self.kind(family) for family in FAMILIES}
        return Scheme(**kinds, rescale=int(hasattr(self.law(dispatch.TANGENTIAL), "retained_fraction")))

    def species_of(self, name: str) -> int:
        """Index into ``SPECIES`` for a material."""
        return SPECIES.index("ocean" if name in LIQUIDS else "shell")

    def pair_table(self) -> np.ndarray:
        """Parameters of a contact between two species, shape (2, 2, PAIR_COLUMNS); the smaller of each value wins."""
        table = np.zeros((len(SPECIES), len(SPECIES), PAIR_COLUMNS))
        normal = self.law(dispatch.NORMAL)
        for a in range(len(SPECIES)):
            for b in range(len(SPECIES)):
                row = table[a, b]
                one, two = (self.values(dispatch.NORMAL, k) for k in (a, b))
                sliding, rolling, twisting = (
                    smaller(self.values(family, a), self.values(family, b))
                    for family in (dispatch.TANGENTIAL, dispatch.ROLLING, dispatch.TWISTING)
                )
                ratio = self.law(dispatch.TANGENTIAL).stiffness_ratio(one, two)
                row[DAMPING_N] = normal.damping_number(smaller(one, two).restitution)
                # C_t = number sqrt(k_t m) = number sqrt(k_t / k_n) sqrt(k_n m)
                row[DAMPING_T] = normal.damping_number(sliding.restitution_tangential) * np.sqrt(ratio)
                row[FRICTION], row[RATIO] = sliding.friction, ratio
                row[SHAPE], row[ROLLING], row[TWISTING] = rolling.shape, rolling.rolling, twisting.twisting
                for family, columns in ((dispatch.NORMAL, NORMAL), (dispatch.COHESION, COHESION)):
                    numbers = self._between(family, a, b)
                    row[columns.start : columns.start + len(numbers)] = numbers
        return table

    def _between(self, family: Family, one: int, two: int | None) -> tuple[float, ...]:
        """The numbers of a family's law for two species, or for one and a rigid wall."""
        law = self.law(family)
        return (
            ()
            if law is None
            else between(law, self.values(family, one), None if two is None else self.values(family, two))
        )

    def wall_table(self, walls_: Sequence[walls.Wall], pair_table: np.ndarray) -> np.ndarray:
        """The walls' contact parameters (w, s, PAIR_COLUMNS), those of a rigid partner; a frictionless wall does not
        hold grains by cohesion."""
        tables = walls.tables(walls_, pair_table)
        for w, wall in enumerate(walls_):
            if wall.species < 0:
                tables[w, :, COHESION] = 0.0
            for s in range(len(SPECIES)):
                numbers = self._between(dispatch.NORMAL, s, None)
                tables[w, s, NORMAL.start : NORMAL.start + len(numbers)] = numbers
                tables[w, s, DAMPING_T] *= np.sqrt(pair_table[s, s, RATIO] / tables[w, s, RATIO])
                tables[w, s, RATIO] = pair_table[s, s, RATIO]
        return tables

    def stiffness(
        self, radius: np.ndarray, mass: np.ndarray, material_name: str, floor_pressure: float,
        solid_density: float | None = None,
    ) -> np.ndarray:  # fmt: skip
        """k_n of grains of one material [N/m] as ``static_overlap`` says, at least F_c / (x_max r), limited by the
        contact wave speed.

        ``floor_pressure`` = g rho H of the bed [Pa]; ``solid_density`` as ``elastic`` takes it. The wave speed of a
        chain of such grains is 2 r sqrt(k_n / m). F_c is the pull of two such grains by a cohesion that does not
        depend on the overlap. With ``hertz`` it is the tangent stiffness of two such grains at the overlap x_max r.
        """
        species = self.species_of(material_name)
        if not self.linear:
            law, values = self.law(dispatch.NORMAL), self.values(dispatch.NORMAL, species)
            return np.asarray(law.grain_stiffness(radius, self.static_overlap, values))
        bulk, sound = elastic(material_name, solid_density)
        moving = np.minimum(2.0 * bulk, rest_springs.modulus(self.static_overlap, floor_pressure)) * radius
        k = np.maximum(floor_pressure * radius / self.static_overlap, moving)
        k = np.maximum(k, self.constant_pull(radius, species) / (self.static_overlap * radius))
        return np.minimum(k, self.stiffness_limit(radius, mass, sound)) * self.stiffness_factor

    def of_weight(self, material_name: str, floor_pressure: float, solid_density: float | None = None) -> bool:
        """Whether ``stiffness`` gives springs for the weight, softer than the solid's own."""
        return self.linear and rest_springs.softer(self.static_overlap, floor_pressure, material_name, solid_density)

    def constant_pull(self, radius: np.ndarray, species: int = 0) -> np.ndarray:
        """Pull [N] of two equal grains by a cohesion that does not depend on the overlap; 0 for other laws."""
        law = self.law(dispatch.COHESION)
        return (
            np.asarray(law.constant_pull(radius, self.values(dispatch.COHESION, species)))
            if hasattr(law, "constant_pull")
            else np.zeros_like(radius)
        )

    def stiffness_limit(self, radius: np.ndarray, mass: np.ndarray, sound_speed: float) -> np.ndarray:
        """Largest k_n [N/m] at which the contact wave speed stays below ``WAVE_SPEED_LIMIT`` times ``sound_speed``
        [m/s]."""
        return mass * (WAVE_SPEED_LIMIT * sound_speed / (2.0 * radius)) ** 2

    def time_step(self, grains: Particles, gravity: Gravity | None = None) -> float:
        """Time step [s]: shortest contact time / ``steps_per_contact``.

        ``hooke``: pi sqrt(m / 2 k_n), the undamped contact of two equal grains. ``hertz``: the undamped contact of a
        grain with a rigid wall at the larger of the grains' own speed and sqrt(2 g r), and at most
        ``normal_hertz.RAYLEIGH_FRACTION`` of the Rayleigh time.
        """
        if self.linear:
            return shortest_contact_time(grains.mass, grains.stiffness) / self.steps_per_contact
        speed = float(np.sqrt(np.max(np.einsum("ij,ij->i", grains.velocity, grains.velocity))))
        if gravity is not None:
            speed = max(
                speed,
                float(
                    np.sqrt(2.0 * np.max(gravity.strength(np.linalg.norm(grains.position, axis=1)) * grains.radius))
                ),
            )
        longest = np.inf
        for species in range(len(SPECIES)):
            here = grains.species == species
            if here.any():
                values = self.values(dispatch.NORMAL, species), self.steps_per_contact
                step = self.law(dispatch.NORMAL).longest_step(grains.radius[here], grains.mass[here], speed, *values)
                longest = min(longest, step)
        return longest

    def as_attribute(self) -> dict[str, Any]:
        """What a snapshot records of these settings, with the species of each material that ships with the project."""
        return {
            **self.model_dump(exclude={"friction_angle"} if self.friction_angle is None else None),
            "laws": [Family.title(law) for law in self.laws()],
            "species": list(SPECIES),
            "species_of_material": {name: SPECIES[self.species_of(name)] for name in material.names()},
        }


def _one_of(family: Family, flag: str) -> str:
    """The laws of a family that set a flag, in words."""
    return " or ".join(f'"{name}"' for name, has in zip(family.names, family.having(flag), strict=True) if has)


def shortest_contact_time(mass: np.ndarray, stiffness: np.ndarray) -> float:
    """Shortest undamped contact time of any pair of these grains [s]: pi sqrt(m / 2 k_n), its smallest value."""
    return float(np.pi * np.sqrt(0.5 * np.min(mass / stiffness)))


__all__ = ["OCEAN", "SPECIES", "Contact", "GrainLaw", "shortest_contact_time"]
