"""From random points to a bed at rest, in the phases of ``dem.beds.settling_phases``, resumable at any step.

The weight of a grain depends on its height: all of it below the datum, less above. Masses are set after ``load`` and
once more after the first ``trim``. Grains above the datum at the end of ``trim`` are the headroom. They are away while
the bed comes to rest, so that no bed grain can lean on them, and carving them later changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numba
import numpy as np

from dem.beds import bed_measures, bed_walls, grain_masses, grain_packing
from dem.beds.layered_body import LayeredBody
from dem.beds.loose_packing import LooseBed
from dem.beds.relaxation import Fire
from dem.beds.settling_phases import PHASES, Phase
from dem.contact.columns import MASS, RADIUS, STIFFNESS, WX
from dem.contact.settings import OCEAN, SPECIES, Contact
from dem.contact.walls import Wall
from dem.grains.assembly import Assembly
from matter.files import checkpoint
from matter.geometry.ground_region import Cone
from matter.particles import Particles

LOOK_EVERY = 10
"""Steps between two looks at which grains are above the datum."""
EXCHANGE_EVERY = 3
FADES = 3.0
"""Height above the datum over which the weight of grains fades out in ``load``, in mean radii."""
REST_LIMIT = 15
"""Times that ``rest`` and ``free`` are repeated before the bed is given up."""
SINK_DRAG = 2.0
"""Rate of the drag while loose grains come down, times sqrt(r/g): none falls faster than half of sqrt(g r)."""
TOPPLE_DRAG = 0.3
"""Rate of the drag in ``grip`` times the travel time of a wave: grains topple that leaned on the headroom."""
LOOSE = 4.0
"""Largest speed of any one grain after ``free``, over the limit on the rms speed."""
QUIET = 0.1
"""Rms speed of grains against their neighbours at the end of ``rest``, over the limit: slow modes that creep under the
drag run faster without it."""


def threads_for(count: int) -> int:
    """Threads that pay: below some ten thousand grains a step is shorter than the hand-over."""
    return int(numba.get_num_threads()) if count >= 10_000 else 1


class Settling:
    """The settling of one bed: which phase it is in, and the assembly."""

    plan: tuple[Phase, ...] = PHASES
    """The phases in their order."""
    rest_limit: int = REST_LIMIT
    own: tuple[str, ...] = ("phase", "done", "repeats", "total", "steps", "free_speed")
    """Numbers of the settling that a checkpoint holds besides the assembly."""

    def __init__(
        self, points: np.ndarray, radius: np.ndarray, body: LayeredBody, domain: Cone, contact: Contact,
        limit: float, loose: LooseBed | None = None,
    ):  # fmt: skip
        self.body, self.domain, self.contact, self.limit, self.loose = body, domain, contact, limit, loose
        self.settled_in = domain
        if loose:
            self.raised = loose.raised(radius)
            if self.plan is PHASES:
                self.plan = loose.phases(float(radius.mean()))
        smooth = OCEAN.model_copy(update={"restitution": 0.5})
        self.smooth_contact = contact.model_copy(update={"shell": smooth, "ocean": smooth})
        self.gravity = body.gravity()
        self.hard = self.springs_of_weight()
        self.falls = self.hard or loose is not None
        if self.falls:
            self.rest_limit = 4 * REST_LIMIT  # ``rest`` is short against their falls
        self.phase, self.done, self.repeats, self.total = 0, 0, 0, 0
        self.aside: Particles | None = None
        self.rested: Particles | None = None
        self.free_speed = float("nan")
        self._begin(self.initial_grains(points, radius))

    def phase_index(self, name: str) -> int:
        """Where a phase stands in the plan (the first of that name)."""
        return next(k for k, phase in enumerate(self.plan) if phase.name == name)

    # -- what depends on the shape of the ground

    def springs_of_weight(self) -> bool:
        """Whether grains wait for their fall, not for waves: springs for the weight alone, that of a small body."""
        floor = float(self.body.pressure(np.array(self.domain.floor)))
        top = len(self.body.materials) - 1
        return self.contact.of_weight(self.body.materials[top], floor, self.body.solid_densities[top])

    def height(self) -> float:
        """Height of bed and headroom [m]."""
        return self.domain.top - self.domain.floor

    def span(self) -> float:
        """Height of bed and headroom, or, of falling grains, the way of a wave in sqrt(r/g) if that is longer [m]."""
        if not self.falls:
            return self.height()
        fall = math.sqrt(self.bed.mean_radius / self.surface_gravity())
        return max(self.height(), float(np.median(self.waves())) * fall)

    def waves(self) -> np.ndarray:
        """Contact wave speed of each grain [m/s]."""
        return 2.0 * self.bed.X[:, RADIUS] * np.sqrt(self.bed.V[:, STIFFNESS] / self.bed.V[:, MASS])

    def surface_gravity(self) -> float:
        """g [m/s^2] that speeds are measured against."""
        return float(self.gravity.strength(np.array(self.body.radius)))

    def elevation(self, position: np.ndarray) -> np.ndarray:
        """Heights (n,) [m] of positions (n, 3) above the datum."""
        return self.domain.height(position) - self.domain.datum

    def deep(self) -> np.ndarray:
        """Which grains lie so far below the datum that their radii may be exchanged under load: at the datum the step
        in pressure would sort them by size."""
        return self.elevation(self.bed.position) < -2.5 * self.bed.mean_radius

    def over(self, grains: Particles) -> np.ndarray:
        """Which of these grains are headroom."""
        return self.elevation(grains.position) > 0.0

    def sloshing(self, bed: Assembly) -> float:
        """Speed of the bed as a whole [m/s]."""
        return float(np.linalg.norm(bed_measures.creep(bed)))

    # -- phases

    def _begin(self, grains: Particles) -> None:
        """Grains in the walls and with the laws of the present phase."""
        now = self.plan[self.phase]
        if self.loose:
            self.domain = self.raised if self.phase < self.phase_index("grip") else self.settled_in  # type: ignore[assignment]
        walls: tuple[Wall, ...] = bed_walls.walls(self.domain)
        if now.name in ("pack", "grow"):
            walls = (*walls, bed_walls.lid(self.domain))
        contact = self.contact if now.friction else self.smooth_contact
        limit = np.inf if now.fire else contact.overlap_stop
        self.bed = Assembly(
            grains, contact, walls, self.gravity, threads=threads_for(len(grains)), overlap_limit=limit
        )
        travel = self.span() / float(np.median(self.waves()))
        self.steps = max(20, int(now.length * travel / self.bed.dt))
        # a grain topples in sqrt(r/g), and under the drag of ``rest`` takes several times as long
        damped = TOPPLE_DRAG if now.name == "grip" else 1.0
        self.bed.drag[:] = 0.0 if now.fire or now.name == "free" else damped / travel
        if now.name in ("sink", "cover"):
            fall = math.sqrt(self.bed.mean_radius / self.surface_gravity())
            self.steps = int(now.length * fall / self.bed.dt)
            self.bed.drag[:] = SINK_DRAG / fall
        if now.name in ("cover", "lay"):
            self._hold()  # not even the first step may move the bed
        self.fire = Fire(self.bed)
        self.done = 0

    def step(self) -> None:
        """One step of the present phase."""
        now = self.plan[self.phase]
        if self.done % LOOK_EVERY == 0:
            self._weigh(self.done / self.steps)
        if now.fire:
            self.fire.step()
        else:
            self.bed.step()
        if now.name in ("cover", "lay"):
            self._hold()
        self.done += 1
        self.total += 1
        # hard grains come to rest without that, and exchanged radii pack tighter (0.67) than random ones
        if now.exchange and not self.hard and self.done % EXCHANGE_EVERY == 0 and 20 < self.done < 0.9 * self.steps:
            which = np.ones(len(self.bed.X), dtype=bool) if now.name == "pack" else self.deep()
            if self.loose:  # grains with friction hold without it
                which &= self.bed.kind == SPECIES.index("ocean")
            grain_packing.exchange_radii(self.bed, self.domain, now.name == "pack", which)

    def _hold(self) -> None:
        """Keep the grains of the bed still while the headroom moves."""
        still = self.bed.headroom == 0
        self.bed.W[still] = 0.0
        self.bed.A[still] = 0.0

    def _weigh(self, part: float) -> None:
        """Set the weights for the present position of the grains."""
        now, bed = self.plan[self.phase], self.bed
        if now.name in ("pack", "grow"):
            bed.weight[:] = 0.0
            return
        start, end = now.light
        light = max(end, start * (1.0 - 1.5 * part))
        if self.phase >= self.phase_index("grip"):
            full = (bed.headroom == 0).astype(float)
        else:
            height = self.elevation(bed.position)
            fading = np.clip(1.0 - height / (FADES * bed.mean_radius), 0.0, 1.0)
            full = fading if now.fades else (height <= 0.0).astype(float)
        bed.weight[:] = light + (1.0 - light) * full

    def next(self) -> bool:
        """Go to the next phase at the end of one; False when the bed is at rest or has been given up."""
        now, rest, free = self.plan[self.phase], self.phase_index("rest"), self.phase_index("free")
        bed = self.bed
        if self.phase == len(self.plan) - 1:
            return False
        grains = bed.particles({"time": 0.0})
        if self.phase in (rest, free):
            g = self.surface_gravity()
            residual = bed_measures.residual(bed, g)
            enough = self.repeats >= self.rest_limit
            self.repeats += 1
            if now.name == "rest":
                sloshing = self.sloshing(bed) / residual["unit_m_s"]
                quiet = (
                    max(bed_measures.rearrangement_speed(bed, g), sloshing) < QUIET * self.limit
                    and residual["max"] < 0.5 * self.limit
                )
                self.phase = free if quiet or enough else rest
                if self.phase == rest:
                    grains = self._level(grains, bed, g)
                self.rested = grains
            else:
                quiet = residual["rms"] < self.limit and residual["max"] < LOOSE * self.limit
                self.phase = free + 1 if quiet or enough else rest
                self.free_speed = residual["rms"]
        else:
            self.phase += 1
        if not now.friction:
            for name in ("contacts/history", "contacts/wall_history"):
                grains.tables[name] = np.zeros_like(grains.tables[name])
        if now.masses:
            grains = self.matched(grains, bed)
        if self.plan[self.phase].name == "grow":
            grains = self._grown(grains)
        if self.phase == self.phase_index("grip"):
            grains = self._take_headroom(grains)
        if self.phase == free + 1:
            assert self.rested is not None
            grains = self._give_headroom(self.rested)
        elif self.phase > free:
            grains = self._stopped(grains)
        self._begin(grains)
        return True

    def _level(self, grains: Particles, bed: Assembly, g: float) -> Particles:
        """The grains with their weight levelled (``dem.beds.grain_masses``)."""
        return grain_masses.levelled(grains, bed, self.domain, g)

    def _grown(self, grains: Particles) -> Particles:
        """The grains with the radii at which they fill each layer's bulk as a loose bed begins."""
        assert self.loose is not None
        grains["radius"] = self.loose.growth(grains, self.raised) * grains.radius
        return self.matched(grains, None)

    def _take_headroom(self, grains: Particles) -> Particles:
        """The grains below the datum; the others wait aside."""
        above = self.over(grains)
        grains["headroom"] = above
        self.aside = grains.select(above)
        bed = grains.select(~above)
        bed.tables.update(grains.tables)
        return bed

    def _give_headroom(self, grains: Particles) -> Particles:
        """The settled bed and the headroom, at rest, in one; the contacts of the bed keep their history."""
        assert self.aside is not None
        fields = {name: np.concatenate([grains[name], self.aside[name]]) for name in grains}
        return self._stopped(Particles(fields, grains.attributes))

    @staticmethod
    def _stopped(grains: Particles) -> Particles:
        """The grains at rest."""
        for name in ("velocity", "angular_velocity"):
            grains[name] = np.zeros_like(grains[name])
        return grains

    def result(self) -> Assembly:
        """The bed with its headroom, at rest, under the real contact laws, with the contact history of the bed."""
        grains = self.bed.particles({"time": 0.0}, tables=False)
        rested = self.rested
        assert rested is not None
        index = np.searchsorted(grains.identity, rested.identity)
        for name in ("velocity", "angular_velocity"):
            values = np.zeros_like(grains[name])
            values[index] = rested[name]
            grains[name] = values
        grains.tables.update(rested.tables)
        bed = Assembly(
            grains, self.contact, bed_walls.walls(self.domain), self.gravity, threads=threads_for(len(grains))
        )
        bed.weight[:] = np.where(bed.headroom > 0, 0.0, 1.0)
        return bed

    @property
    def progress(self) -> float:
        """Travel times done, in the plan without repetitions."""
        return sum(p.length for p in self.plan[: self.phase]) + self.plan[self.phase].length * self.done / self.steps

    # -- state

    def save(self, out: Path) -> None:
        """Write a checkpoint."""
        state = checkpoint.under("bed", self.bed.saved()) | checkpoint.under("fire", self.fire.state())
        for label in ("aside", "rested"):
            kept = getattr(self, label)
            if kept is not None:
                state |= checkpoint.under(f"{label}/fields", kept) | checkpoint.under(f"{label}/tables", kept.tables)
        state |= {name: getattr(self, name) for name in self.own}
        checkpoint.save(out, self.total, *checkpoint.arrays_and_numbers(state))

    def restore(self, arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any]) -> None:
        """Continue from a checkpoint, bit for bit."""
        saved = checkpoint.SavedState(arrays, scalars)
        self.phase = int(saved["phase"])
        for label in ("aside", "rested"):
            fields, tables = (
                {k.split("/", 2)[2]: v for k, v in saved.items() if k.startswith(f"{label}/{part}/")}
                for part in ("fields", "tables")
            )
            if fields:
                setattr(self, label, Particles(fields, {"time": 0.0}, tables))
        # with the grains of the checkpoint: random points would not pass the limit on overlaps of the later phases
        bed = checkpoint.Part(saved, "bed")
        x, v, w = bed["X"], bed["V"], bed["W"]
        names = {
            "identity": "identity",
            "material": "material",
            "species": "kind",
            "density": "density",
            "headroom": "headroom",
        }
        fields = {"position": x[:, :3], "radius": x[:, RADIUS], "velocity": w[:, :3], "angular_velocity": w[:, WX:]}
        fields |= {"mass": v[:, MASS], "stiffness": v[:, STIFFNESS]}
        self._begin(Particles({**fields, **{name: bed[here] for name, here in names.items()}}, {"time": 0.0}))
        for name in self.own:
            setattr(self, name, saved[name])
        self.bed.restore(bed)
        self.fire.restore(checkpoint.Part(saved, "fire"))

    # -- grains

    def initial_grains(self, points: np.ndarray, radius: np.ndarray) -> Particles:
        """Grains at rest at the random points, with masses for a nominal packing fraction."""
        n = len(points)
        zero = np.zeros((n, 3))
        grains = Particles(
            dict(
                identity=np.arange(n), position=points, velocity=zero, angular_velocity=zero, radius=radius,
                mass=np.ones(n),
                material=np.zeros(n), species=np.zeros(n), density=np.zeros(n), stiffness=np.ones(n),
                headroom=np.zeros(n),
            )
        )  # fmt: skip
        return self.matched(grains, None)

    def matched(self, grains: Particles, bed: Any) -> Particles:
        """The grains with material, species, mass and stiffness for where they are (``dem.beds.grain_masses``)."""
        return grain_masses.matched(grains, bed, self.body, self.domain, self.contact)
