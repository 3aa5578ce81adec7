"""The contact settings that the bed and the collapse share, and the tables that the kernels read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from dem.columns import COHESION, DAMPING_N, DAMPING_T, FRICTION, MODULUS, PAIR_COLUMNS, RATIO, ROLLING, SHAPE, TWISTING
from dem.gravity import Field as Gravity
from dem.laws import cohesion_sjkr, cohesion_zhang, normal_hertz, normal_hooke, rolling_sds, tangential_mindlin, tangential_spring, twisting_sds
from dem.scheme import HERTZ, HOOKE, NO_COHESION, SJKR, ZHANG, Scheme
from dem.walls import Wall
from matter import material
from matter.body import Model
from matter.particles import Particles
from matter.quantity import Angle, PositivePressure, PositiveSpeed, Pressure

SPECIES = ("shell", "ocean")

Fraction = Annotated[float, Field(gt=0.0, le=1.0)]


class GrainLaw(Model):
    """Contact parameters of one species of grain, for whichever of the laws in ``dem.laws`` the case names."""

    restitution: Fraction = 0.55
    """Normal coefficient of restitution, e_n."""
    restitution_tangential: Fraction = 0.55
    """Tangential coefficient of restitution, e_t: sets the tangential dashpot."""
    friction: Annotated[float, Field(ge=0.0, le=2.0)] = 0.5
    """Coulomb friction, mu_s."""
    shape: Annotated[float, Field(ge=0.0, le=2.0)] = 0.4
    """Shape parameter beta: 0 is a sphere, 1 is strongly angular."""
    rolling: Annotated[float, Field(ge=0.0, le=5.0)] = 1.05
    """Rolling friction, mu_r."""
    twisting: Annotated[float, Field(ge=0.0, le=5.0)] = 1.3
    """Twisting friction, mu_t."""
    elastic_modulus: PositivePressure | None = None
    """Young's modulus E, for ``normal = "hertz"``; an ocean without one takes the shell's."""
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)] = 0.25
    """Poisson's ratio nu, for ``normal = "hertz"``."""
    cohesion: Annotated[Pressure, Field(ge=0.0)] = 0.0
    """Interparticle tensile strength c (``cohesion = "zhang"``) or cohesion energy density k (``"sjkr"``)."""


OCEAN = GrainLaw(restitution=0.1, restitution_tangential=0.1, friction=0.0, shape=0.0, rolling=0.0, twisting=0.0)


class Contact(Model):
    """How grains touch: one set of parameters for solid grains (``shell``), one for liquid ones (``ocean``).

    A pair of different species takes the softer spring and the smaller of each friction, shape, restitution and cohesion: a solid grain
    slides on water as water does. With ``hertz`` springs act in series.
    """

    normal: Literal["hooke", "hertz"] = "hooke"
    """Normal law; see ``dem.laws``."""
    tangential: Literal["spring", "mindlin"] = "spring"
    """Tangential law: ``spring`` goes with ``hooke``, ``mindlin`` with ``hertz``."""
    mindlin_history: Literal["force", "displacement"] = "force"
    """What a spring keeps while the area of its contact grows; see ``dem.laws.tangential_mindlin``."""
    cohesion: Literal["none", "zhang", "sjkr"] = "none"
    """Cohesion of grains in contact; see ``dem.laws``."""

    shell: GrainLaw = GrainLaw()
    """Contact parameters of solid grains, ``[dem.contact.shell]``."""
    ocean: GrainLaw = OCEAN
    """Contact parameters of liquid grains, ``[dem.contact.ocean]``."""
    liquids: tuple[str, ...] = ("water", "water_thesis")
    """Materials whose grains are of the species ``ocean``; all others are ``shell``."""
    friction_angle: Angle | None = None
    """Friction angle by principal stresses; when it is set, ``shell.friction`` is chosen so that steady shear of the grains has it (``dem.friction_angle``)."""
    tangential_stiffness_ratio: Fraction = 2.0 / 7.0
    """Tangential over normal stiffness, k_t / k_n."""
    sliding: Literal["cap", "clamp", "reset"] = "cap"
    """What the tangential spring does at the Coulomb limit; see ``dem.laws.tangential_spring``."""
    attractive_tail: bool = True
    """Whether the normal force may pull at the end of a contact (then the restitution is exact)."""
    stiffness_rule: Literal["elastic", "kinetic"] = "elastic"
    """``elastic``: k_n = max(P_floor r / x_max, 2 K r). ``kinetic``: max(P_floor r / x_max, m (v / (x_max r))^2) with v = ``expected_speed`` (pkdgrav)."""
    static_overlap: Annotated[float, Field(gt=0.0, le=0.2)] = 0.02
    """Overlap under the static load, x_max of ``stiffness_rule``, in grain radii."""
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

    expected_speed: PositiveSpeed | None = None
    """Largest closing speed: of ``stiffness_rule = "kinetic"``, and that the step must resolve with ``hertz`` (the grains' own at the start where larger)."""
    rayleigh_fraction: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2
    """Largest step with ``hertz``, over the Rayleigh time of the smallest grain."""

    @model_validator(mode="after")
    def _combination(self) -> Contact:
        laws = {"shell": self.shell, "ocean": self.ocean}
        if (self.normal == "hertz") != (self.tangential == "mindlin"):
            wanted = "mindlin" if self.normal == "hertz" else "spring"
            raise ValueError(f'normal = "{self.normal}" goes with tangential = "{wanted}", not with "{self.tangential}"')
        if self.normal == "hertz" and self.shell.elastic_modulus is None:
            raise ValueError('normal = "hertz" needs shell.elastic_modulus (Young\'s modulus)')
        if self.stiffness_rule == "kinetic" and (self.expected_speed is None or self.normal == "hertz"):
            raise ValueError('stiffness_rule = "kinetic" needs expected_speed, and normal = "hooke"')
        sticky = {name: law for name, law in laws.items() if law.cohesion > 0.0}
        if self.cohesion == "none" and sticky:
            raise ValueError(f'{", ".join(sticky)}: cohesion is given, but cohesion = "none" names no law for it ("zhang" or "sjkr")')
        if self.cohesion != "none" and not sticky:
            raise ValueError(f'cohesion = "{self.cohesion}" needs shell.cohesion or ocean.cohesion above zero')
        if self.cohesion == "zhang" and any(law.shape == 0.0 for law in sticky.values()):
            raise ValueError('cohesion = "zhang" pulls over an area (2 beta R)^2: a species with cohesion needs shape above zero')
        return self

    def scheme(self) -> Scheme:
        """What the kernels are compiled for."""
        return Scheme(
            HERTZ if self.normal == "hertz" else HOOKE,
            tangential_mindlin.RULES[self.mindlin_history] if self.tangential == "mindlin" else 0,
            {"none": NO_COHESION, "zhang": ZHANG, "sjkr": SJKR}[self.cohesion],
            tangential_spring.RULES[self.sliding],
        )

    def elastic_constants(self, species: int) -> tuple[float, float]:
        """Young's modulus [Pa], times ``stiffness_factor``, and Poisson's ratio of a species; ``hertz`` only."""
        law = (self.shell, self.ocean)[species]
        if law.elastic_modulus is None:
            law = self.shell
        assert law.elastic_modulus is not None
        return law.elastic_modulus * self.stiffness_factor, law.poisson_ratio

    def species_of(self, name: str) -> int:
        """Index into ``SPECIES`` for a material."""
        return SPECIES.index("ocean" if name in self.liquids else "shell")

    def pair_table(self) -> np.ndarray:
        """Parameters of a contact between two species, shape (2, 2, PAIR_COLUMNS); the smaller of each value wins."""
        laws = (self.shell, self.ocean)
        table = np.zeros((len(SPECIES), len(SPECIES), PAIR_COLUMNS))
        for a, one in enumerate(laws):
            for b, two in enumerate(laws):
                row = table[a, b]
                ratio, damping_number = self.tangential_stiffness_ratio, normal_hooke.damping_number
                if self.normal == "hertz":
                    pair = self.elastic_constants(a), self.elastic_constants(b)
                    row[MODULUS] = normal_hertz.effective_modulus(*pair)
                    ratio = 4.0 * tangential_mindlin.effective_shear_modulus(*pair) / row[MODULUS]
                    damping_number = normal_hertz.damping_number
                row[DAMPING_N] = damping_number(min(one.restitution, two.restitution))
                # C_t = number sqrt(k_t m) = number sqrt(k_t / k_n) sqrt(k_n m)
                number = damping_number(min(one.restitution_tangential, two.restitution_tangential))
                row[DAMPING_T] = number * np.sqrt(ratio)
                row[FRICTION] = min(one.friction, two.friction)
                row[SHAPE] = min(one.shape, two.shape)
                row[ROLLING] = min(one.rolling, two.rolling)
                row[TWISTING] = min(one.twisting, two.twisting)
                row[RATIO] = ratio
                row[COHESION] = min(one.cohesion, two.cohesion)
        return table

    def stiffness(self, radius: np.ndarray, mass: np.ndarray, material_name: str, floor_pressure: float) -> np.ndarray:
        """k_n of grains of one material [N/m] by ``stiffness_rule``, at least F_c / (x_max r), limited by the contact wave speed.

        ``floor_pressure`` = g rho H of the bed [Pa]. The wave speed of a chain of such grains is 2 r sqrt(k_n / m). F_c is the pull of two such
        grains by Zhang's cohesion. With ``hertz`` it is the tangent stiffness of two such grains at the overlap x_max r.
        """
        if self.normal == "hertz":
            species = self.species_of(material_name)
            modulus = normal_hertz.effective_modulus(self.elastic_constants(species), self.elastic_constants(species))
            return np.asarray(2.0 * modulus * radius * np.sqrt(0.5 * self.static_overlap))
        bulk, sound = elastic(material_name)
        moving = 2.0 * bulk * radius
        if self.stiffness_rule == "kinetic":
            assert self.expected_speed is not None
            moving = mass * (self.expected_speed / (self.static_overlap * radius)) ** 2
        k = np.maximum(floor_pressure * radius / self.static_overlap, moving)
        if self.cohesion == "zhang":
            law = (self.shell, self.ocean)[self.species_of(material_name)]
            k = np.maximum(k, law.cohesion * (law.shape * radius) ** 2 / (self.static_overlap * radius))
        return np.minimum(k, self.stiffness_limit(radius, mass, sound)) * self.stiffness_factor

    def stiffness_limit(self, radius: np.ndarray, mass: np.ndarray, sound_speed: float) -> np.ndarray:
        """Largest k_n [N/m] at which the contact wave speed stays below ``wave_speed_limit`` times ``sound_speed`` [m/s]."""
        return mass * (self.wave_speed_limit * sound_speed / (2.0 * radius)) ** 2

    def time_step(self, grains: Particles, gravity: Gravity | None = None) -> float:
        """Time step [s]: shortest contact time / ``steps_per_contact``.

        ``hooke``: pi sqrt(m / 2 k_n), the undamped contact of two equal grains. ``hertz``: the undamped contact of a grain with a rigid wall at the
        largest of ``expected_speed``, the grains' own speed and sqrt(2 g r), and at most ``rayleigh_fraction`` of the Rayleigh time.
        """
        if self.normal == "hooke":
            return shortest_contact_time(grains.mass, grains.stiffness) / self.steps_per_contact
        speed = float(np.sqrt(np.max(np.einsum("ij,ij->i", grains.velocity, grains.velocity))))
        if gravity is not None:
            speed = max(speed, float(np.sqrt(2.0 * np.max(gravity.strength(np.linalg.norm(grains.position, axis=1)) * grains.radius))))
        speed = max(speed, self.expected_speed or 0.0)
        longest = np.inf
        for species in range(len(SPECIES)):
            here = grains.species == species
            if not here.any():
                continue
            modulus, nu = self.elastic_constants(species)
            r, m = grains.radius[here], grains.mass[here]
            density = m / (4.0 / 3.0 * np.pi * r**3)
            step = self.rayleigh_fraction * float(np.min(normal_hertz.rayleigh_time(r, density, modulus / (2.0 * (1.0 + nu)), nu)))
            if speed > 0.0:
                quick = int(np.argmin(m**2 / r))
                wall = normal_hertz.contact_time(modulus / (1.0 - nu * nu), float(r[quick]), float(m[quick]), speed)
                step = min(step, wall / self.steps_per_contact)
            longest = min(longest, step)
        return longest

    def as_attribute(self) -> dict[str, Any]:
        """What a snapshot records of these settings, with the species of each material that ships with the project."""
        return {
            **self.model_dump(exclude={"friction_angle"} if self.friction_angle is None else None),
            "laws": [
                f"normal_{self.normal}",
                f"tangential_{self.tangential}",
                "rolling_sds",
                "twisting_sds",
                *([] if self.cohesion == "none" else [f"cohesion_{self.cohesion}"]),
            ],
            "species": list(SPECIES),
            "species_of_material": {name: SPECIES[self.species_of(name)] for name in material.names()},
        }


def rigid(tables: np.ndarray, pair_table: np.ndarray, walls: Sequence[Wall]) -> np.ndarray:
    """The walls' contact parameters (w, s, PAIR_COLUMNS) with a rigid partner's E*, G* / E*; a frictionless wall does not hold grains by cohesion."""
    tables = tables.copy()
    for w, wall in enumerate(walls):
        if wall.species < 0:
            tables[w, :, COHESION] = 0.0
        for s in range(pair_table.shape[0]):
            own = pair_table[s, s]
            if own[MODULUS] > 0.0:
                tables[w, s, MODULUS] = 2.0 * own[MODULUS]
                tables[w, s, DAMPING_T] *= np.sqrt(own[RATIO] / tables[w, s, RATIO])
                tables[w, s, RATIO] = own[RATIO]
    return tables


def shortest_contact_time(mass: np.ndarray, stiffness: np.ndarray) -> float:
    """Shortest undamped contact time of any pair of these grains [s]: pi sqrt(m / 2 k_n), its smallest value."""
    return float(np.pi * np.sqrt(0.5 * np.min(mass / stiffness)))


def elastic(material_name: str) -> tuple[float, float]:
    """Bulk modulus [Pa] and bulk sound speed sqrt(K / rho0) [m/s] of a material."""
    bulk = material.section(material_name, "elastic")["bulk_modulus"]
    return bulk, float(np.sqrt(bulk / material.reference_density(material_name)))


__all__ = [
    "SPECIES", "Contact", "GrainLaw", "cohesion_sjkr", "cohesion_zhang", "elastic", "normal_hertz", "normal_hooke", "rolling_sds",
    "tangential_mindlin", "tangential_spring", "twisting_sds",
]  # fmt: skip
