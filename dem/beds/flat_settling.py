"""From a packing to a bed at rest in a container of flat ground: the phases of ``dem.beds.settling`` under uniform
gravity.

A random packing goes through all of them; a hexagonal one begins with friction, since without it a crystal that the
container cuts flows.

Springs stiff enough for fast contacts to come (``stiffness``) would need tiny overlaps, which weak gravity takes long
to bring about. The bed is therefore settled under gravity inflated by I, up to the overlaps at the floor that the rule
for the load at rest gives, which is the same as softer springs. In the phase ``ease`` gravity is let down to its own
value, as 1/time^2, so that it falls by e in no less than three times sqrt(r/g) of the moment: grains stay in contact
while their overlaps go. Lengths of phases count in sqrt(r/g) where that is longer than a wave's way through the bed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from dem.beds import bed_measures
from dem.beds.flat_ground import FlatGround
from dem.beds.grain_packing import FRACTION, HEXAGONAL
from dem.beds.loose_packing import LooseBed
from dem.beds.settling import Settling
from dem.beds.settling_phases import PHASES, Phase
from dem.contact.gravity import Field
from dem.contact.rest_springs import REST_FRACTION
from dem.contact.settings import Contact
from dem.grains.assembly import Assembly
from matter.geometry.ground_region import Upright
from matter.particles import Particles

LOOSE = 8.0
"""Length of the phase ``grip`` of a hexagonal packing over its usual one."""
EASE = 6.0
"""Length of the phase ``ease`` in sqrt(r/g)."""


def stiffness(
    radius: np.ndarray, mass: np.ndarray, contact: Contact, pressure: float, speed: float | None
) -> np.ndarray:
    """k_n [N/m] from the ``pressure`` at the floor [Pa] and the largest ``speed`` v of contacts to come [m/s] (None:
    at rest)

    k_n = max(33 P_floor r / x_max, m (v / (x_max r))^2),   x_max = ``static_overlap``
    (Schwartz, Richardson & Michel 2012, section 2.4; pkdgrav's rule,
    which takes P_floor r / x_max: contacts at the floor then overlap by some 3 x_max).
    """
    x = contact.static_overlap
    moving = 0.0 if speed is None else mass * (speed / (x * radius)) ** 2
    return np.maximum(pressure * radius / (REST_FRACTION * x), moving) * contact.stiffness_factor


class FlatSettling(Settling):
    """The settling of a bed in a container; ``domain`` is the ``Upright``, ``body`` the ``FlatGround``."""

    own = (*Settling.own, "pull", "drag_rate")

    def __init__(
        self, points: np.ndarray, radius: np.ndarray, ground: FlatGround, container: Upright, contact: Contact,
        limit: float,
        hexagonal: bool = False, speed: float | None = None, loose: LooseBed | None = None,
    ):  # fmt: skip
        self.ground, self.container, self.speed = ground, container, speed
        self.nominal = loose.mean(loose.fraction) if loose else HEXAGONAL if hexagonal else FRACTION
        floor = float(ground.pressure(np.array(container.floor)))
        mean = np.array([float(radius.mean())])
        volume = 4.0 / 3.0 * math.pi * mean**3
        rho = float(ground.density(np.array([0.5 * container.floor]))[0])
        mass = rho * volume / self.nominal
        stiff = float(stiffness(mean, mass, contact, floor, speed)[0])
        self.inflation = stiff / float(stiffness(mean, mass, contact, floor, None)[0])
        wave = 2.0 * float(mean[0]) * math.sqrt(stiff / float(mass[0]))
        phases = loose.phases(float(mean[0])) if loose else PHASES
        plan = [phase for phase in phases if not (hexagonal and phase.fire and phase.name != "lay")]
        if hexagonal:  # what the container's sides leave unsupported has to fall first
            plan[0] = plan[0]._replace(length=LOOSE * plan[0].length)
        if self.inflation > 1.0:
            grip = next(k for k, phase in enumerate(plan) if phase.name == "grip")
            time = math.sqrt(float(mean[0]) / ground.g)
            unit = max((container.top - container.floor) / wave, time / math.sqrt(self.inflation))
            plan.insert(grip + 1, Phase("ease", EASE * time / unit, False, (0.0, 0.0)))
        self.plan = tuple(plan)
        super().__init__(points, radius, ground, container, contact, limit, loose)  # type: ignore[arg-type]

    # -- gravity

    def _begin(self, grains: Particles) -> None:
        before = "ease" not in [phase.name for phase in self.plan[: self.phase]]
        self._pull(self.inflation if before else 1.0)
        if self.plan[self.phase].name == "grip" and self.phase == 0 and self.aside is None:
            grains = self.matched(grains, grains)
            grains["state"] = np.zeros(len(grains))
            grains = self._take_headroom(grains)
        super()._begin(grains)
        self.drag_rate = float(self.bed.drag[0])

    def _pull(self, times: float) -> None:
        self.pull = times
        self.gravity = Field.constant((0.0, 0.0, -self.ground.g * times))

    def _weigh(self, part: float) -> None:
        super()._weigh(part)
        if self.plan[self.phase].name == "ease":
            least = 1.0 / math.sqrt(self.inflation)
            root = 1.0 / (least + (1.0 - least) * min(1.0, 1.05 * part))
            self._pull(root * root)
            self.bed.gravity = self.gravity
            self.bed.drag[:] = self.drag_rate * root * least

    def restore(self, arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any]) -> None:
        """Continue from a checkpoint, bit for bit."""
        super().restore(arrays, scalars)
        self._pull(self.pull)
        self.bed.gravity = self.gravity

    # -- what depends on the shape of the ground

    def springs_of_weight(self) -> bool:
        """Always: springs are for the weight, or harder."""
        return True

    def height(self) -> float:
        """Height of bed and headroom [m]."""
        return self.container.top - self.container.floor

    def surface_gravity(self) -> float:
        """g in force now [m/s^2]."""
        return float(np.linalg.norm(self.gravity.uniform))

    def sloshing(self, bed: Assembly) -> float:
        """Speed of the centre of mass of the bed [m/s]."""
        below = bed.headroom == 0
        return float(np.linalg.norm(bed.mass[below] @ bed.velocity[below]) / bed.mass[below].sum())

    def _level(self, grains: Particles, bed: Assembly, g: float) -> Particles:
        return grains

    def matched(self, grains: Particles, bed: Any) -> Particles:
        """The grains with material, species, mass and stiffness for where they are; ``bed`` None takes a nominal
        packing fraction.

        The mass of a grain is rho(z) V / phi with one phi for the whole bed, so that it weighs what the ground between
        floor and datum does.
        """
        ground, box = self.ground, self.container
        height = grains.position[:, 2]
        rho, volume = ground.density(height), 4.0 / 3.0 * np.pi * grains.radius**3
        mass = rho * volume / self.nominal
        if bed is not None:
            mass *= bed_measures.ground_mass(ground, box) / mass[height <= 0.0].sum()
        layer = ground.layer_of(height)
        names = list(dict.fromkeys(ground.materials))
        material, species, k = (np.empty(len(grains)) for _ in range(3))
        floor = float(ground.pressure(np.array(box.floor)))
        for l, name in enumerate(ground.materials):
            here = layer == l
            material[here], species[here] = names.index(name), self.contact.species_of(name)
            k[here] = stiffness(grains.radius[here], mass[here], self.contact, floor, self.speed)
        fields = dict(grains)
        fields.update(mass=mass, density=rho, material=material, species=species, stiffness=k)
        return Particles(fields, grains.attributes, grains.tables)
