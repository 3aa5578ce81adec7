"""The contact settings that the bed and the collapse share, and the tables that the kernels read."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from dem.laws import normal_hooke, rolling_sds, tangential_spring, twisting_sds
from matter import material
from matter.body import Model

SPECIES = ("shell", "ocean")

# columns of the pair table that the force kernel reads
DAMPING_N, DAMPING_T, FRICTION, SHAPE, ROLLING, TWISTING, RATIO = range(7)
COLUMNS = 8

Fraction = Annotated[float, Field(gt=0.0, le=1.0)]


class GrainLaw(Model):
    """Contact parameters of one species of grain (laws ``normal_hooke``, ``tangential_spring``, ``rolling_sds``, ``twisting_sds``)."""

    restitution: Fraction = 0.55
    """Normal coefficient of restitution, e_n."""
    restitution_tangential: Fraction = 0.55
    """Sets the tangential dashpot, e_t."""
    friction: Annotated[float, Field(ge=0.0, le=2.0)] = 0.5
    """Coulomb friction, mu_s."""
    shape: Annotated[float, Field(ge=0.0, le=2.0)] = 0.4
    """Shape parameter beta: 0 sphere, 1 strongly angular."""
    rolling: Annotated[float, Field(ge=0.0, le=5.0)] = 1.05
    """Rolling friction, mu_r."""
    twisting: Annotated[float, Field(ge=0.0, le=5.0)] = 1.3
    """Twisting friction, mu_t."""


OCEAN = GrainLaw(restitution=0.1, restitution_tangential=0.1, friction=0.0, shape=0.0, rolling=0.0, twisting=0.0)


class Contact(Model):
    """How grains touch: one set of parameters for solid grains (``shell``), one for liquid ones (``ocean``).

    A pair of different species takes the softer spring and the smaller of each friction, shape and restitution: a solid grain
    slides on water as water does.
    """

    shell: GrainLaw = GrainLaw()
    ocean: GrainLaw = OCEAN
    liquids: tuple[str, ...] = ("water", "water_thesis")
    """Materials whose grains are of the species ``ocean``; all others are ``shell``."""
    tangential_stiffness_ratio: Fraction = 2.0 / 7.0
    """k_t / k_n."""
    sliding: Literal["clamp", "reset"] = "clamp"
    """What the tangential spring does at the Coulomb limit; see ``dem.laws.tangential_spring``."""
    attractive_tail: bool = True
    """Whether the normal force may pull at the end of a contact (then the restitution is exact)."""
    static_overlap: Annotated[float, Field(gt=0.0, le=0.2)] = 0.02
    """x_max of the stiffness rule, in radii: k_n = max(P_floor r / x_max, 2 K r)."""
    wave_speed_limit: Annotated[float, Field(gt=0.0, le=10.0)] = 2.0
    """The contact wave speed 2 r sqrt(k_n / m) never exceeds this times the sound speed of the grain's material."""
    stiffness_factor: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
    """Multiplies k_n of every grain after the rule and its limit (a sensitivity test doubles it)."""
    steps_per_contact: Annotated[int, Field(ge=8, le=1000)] = 30
    """Time step = shortest contact time / this."""
    overlap_warn: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.15
    """Overlaps above this, in radii of the smaller grain, are reported."""
    overlap_stop: Annotated[float, Field(gt=0.0, lt=2.0)] = 0.5
    """An overlap of two bed grains above this, in radii of the smaller grain, stops the run."""
    returning_speed_limit: Annotated[float, Field(gt=0.0, le=1.0)] = 0.3
    """Closing speed of a returned ejecta grain, over the contact wave speed, above which the excess is taken out by a dashpot and booked."""

    def species_of(self, name: str) -> int:
        """Index into ``SPECIES`` for a material."""
        return SPECIES.index("ocean" if name in self.liquids else "shell")

    def pair_table(self) -> np.ndarray:
        """Parameters of a contact between two species, shape (2, 2, COLUMNS); the smaller of each value wins."""
        laws = (self.shell, self.ocean)
        table = np.zeros((len(SPECIES), len(SPECIES), COLUMNS))
        for a, one in enumerate(laws):
            for b, two in enumerate(laws):
                row = table[a, b]
                row[DAMPING_N] = normal_hooke.damping_number(min(one.restitution, two.restitution))
                # C_t = number sqrt(k_t m) = number sqrt(k_t / k_n) sqrt(k_n m)
                number = normal_hooke.damping_number(min(one.restitution_tangential, two.restitution_tangential))
                row[DAMPING_T] = number * np.sqrt(self.tangential_stiffness_ratio)
                row[FRICTION] = min(one.friction, two.friction)
                row[SHAPE] = min(one.shape, two.shape)
                row[ROLLING] = min(one.rolling, two.rolling)
                row[TWISTING] = min(one.twisting, two.twisting)
                row[RATIO] = self.tangential_stiffness_ratio
        return table

    def stiffness(self, radius: np.ndarray, mass: np.ndarray, material_name: str, floor_pressure: float) -> np.ndarray:
        """k_n of grains of one material [N/m]: max(P_floor r / x_max, 2 K r), limited by the contact wave speed.

        ``floor_pressure`` = g rho H of the bed [Pa]. The wave speed of a chain of such grains is 2 r sqrt(k_n / m).
        """
        bulk, sound = elastic(material_name)
        k = np.maximum(floor_pressure * radius / self.static_overlap, 2.0 * bulk * radius)
        return np.minimum(k, self.stiffness_limit(radius, mass, sound)) * self.stiffness_factor

    def stiffness_limit(self, radius: np.ndarray, mass: np.ndarray, sound_speed: float) -> np.ndarray:
        """Largest k_n [N/m] at which the contact wave speed stays below ``wave_speed_limit`` times ``sound_speed`` [m/s]."""
        return mass * (self.wave_speed_limit * sound_speed / (2.0 * radius)) ** 2

    def as_attribute(self) -> dict[str, Any]:
        """What a snapshot records of these settings, with the species of each material that ships with the project."""
        return {
            **self.model_dump(),
            "laws": ["normal_hooke", "tangential_spring", "rolling_sds", "twisting_sds"],
            "species": list(SPECIES),
            "species_of_material": {name: SPECIES[self.species_of(name)] for name in material.names()},
        }


def elastic(material_name: str) -> tuple[float, float]:
    """Bulk modulus [Pa] and bulk sound speed sqrt(K / rho0) [m/s] of a material."""
    bulk = material.section(material_name, "elastic")["bulk_modulus"]
    return bulk, float(np.sqrt(bulk / material.reference_density(material_name)))


__all__ = ["SPECIES", "Contact", "GrainLaw", "elastic", "normal_hooke", "rolling_sds", "tangential_spring", "twisting_sds"]
