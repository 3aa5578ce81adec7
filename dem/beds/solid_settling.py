"""From random points to a whole body at rest, without walls: under its own pull, its rotation and a companion's tide.

======= ======== ========== ======== ==================================================================================
phase   friction steering   weight   purpose
======= ======== ========== ======== ==================================================================================
pack    off      FIRE       none     random points become a close packing, held in by the body's surface
ease    off      FIRE       none     (twice) radii shrink by the mean overlap: just no longer jammed
grip    on       drag       whole    the surface is gone; grains come down onto each other, friction holds the shape
rest    on       drag       whole    until grains move at a tenth of the limit, and none faster than half of it
free    on       none       whole    proof, in the inertial frame: by itself the body stays below the limit, no grain
                                     beyond four times it
======= ======== ========== ======== ==================================================================================

All phases but ``free`` stand in the frame that turns with the body (``dem.grains.turning_frame``), where the bed
rests: weight is the grains' own pull, the centrifugal force and the tide, of which net force and torque are taken out.
Without friction no body settles: it would flow into the figure of a liquid.

k_n is that of the load at rest (``dem.beds.flat_settling.stiffness``) for the pressure at the centre of a ball of the
body's mass and volume, at least what a constant cohesion asks for. Lengths of the phases with friction count in
sqrt(r/g), the time in which a grain falls by half its radius.
"""

from __future__ import annotations

import math

import numpy as np

from dem.beds import flat_settling, solid_masses, solid_packing
from dem.beds.relaxation import Fire
from dem.beds.settling import LOOSE, QUIET, Settling, threads_for
from dem.beds.settling_phases import Phase
from dem.beds.solid_body import SolidBody
from dem.contact.columns import MASS, RADIUS, STIFFNESS
from dem.contact.gravity import Field
from dem.contact.settings import OCEAN, Contact
from dem.grains import cached_gravity, turning_frame
from dem.grains.assembly import Assembly, Extras
from dem.grains.cached_gravity import ExternalForce
from dem.grains.self_gravity import SelfGravity
from matter.particles import Particles

PHASES = (
    Phase("pack", 4.0, True, (0.0, 0.0)),
    Phase("ease", 2.0, True, (0.0, 0.0)),
    Phase("ease", 2.0, True, (0.0, 0.0)),
    Phase("grip", 4.0, False, (1.0, 1.0)),
    Phase("rest", 3.0, False, (1.0, 1.0)),
    Phase("free", 2.0, False, (1.0, 1.0)),
)
"""Lengths: with FIRE in travel times of a wave through the body, then in sqrt(r/g)."""
DRAG = 2.0
"""Rate of the drag times sqrt(r/g): what topples is damped as fast as it can."""


def stiffness(radius: np.ndarray, mass: np.ndarray, body: SolidBody, contact: Contact) -> np.ndarray:
    """k_n [N/m] of the grains of a body at rest."""
    at_rest = flat_settling.stiffness(radius, mass, contact, body.central_pressure, None)
    pull = contact.constant_pull(radius, contact.species_of(body.material))
    return np.maximum(at_rest, pull / (contact.static_overlap * radius) * contact.stiffness_factor)


class SolidSettling(Settling):
    """The settling of a whole body, which stands out of its surface by what it ``sinks`` [m] by later."""

    plan = PHASES
    rest_limit = 40
    own = (*Settling.own, "most_removed", "correction")

    def __init__(
        self, points: np.ndarray, radius: np.ndarray, body: SolidBody, contact: Contact, limit: float,
        sinks: float = 0.0,
    ):  # fmt: skip
        self.ground = body
        self.stand = solid_packing.PROUD * float(radius.mean()) + sinks
        self.most_removed, self.correction = 0.0, 0.0
        self.contact, self.limit = contact, limit
        smooth = OCEAN.model_copy(update={"restitution": 0.5})
        self.smooth_contact = contact.model_copy(update={"shell": smooth, "ocean": smooth, "cohesion": "none"})
        self.gravity = Field.constant((0.0, 0.0, 0.0))
        self.phase, self.done, self.repeats, self.total = 0, 0, 0, 0
        self.aside: Particles | None = None
        self.rested: Particles | None = None
        self.free_speed = math.nan
        self._begin(self.initial_grains(points, radius))

    # -- phases

    def surface_gravity(self) -> float:
        """g [m/s^2] that speeds are measured against."""
        return self.ground.surface_gravity

    def outer(self) -> tuple[ExternalForce, ...]:
        """What acts in the present phase besides the grains' own pull."""
        now = self.plan[self.phase]
        if now.fire:
            return (solid_packing.Inside(self.ground.distance, self.stand),)
        if now.name == "free":
            tide = self.ground.tide(turning=False)
            return () if tide is None else (tide,)
        tide = self.ground.tide(turning=True)
        turning = turning_frame.Centrifugal(self.ground.omega), turning_frame.Held()
        return turning if tide is None else (tide, *turning)

    def _begin(self, grains: Particles) -> None:
        """Grains with the laws and the forces of the present phase."""
        now = self.plan[self.phase]
        pull = None if now.fire else SelfGravity()
        self.bed = Assembly(
            grains,
            self.smooth_contact if now.fire else self.contact,
            gravity=self.gravity,
            threads=threads_for(len(grains)),
            overlap_limit=np.inf if now.fire else None,
            extras=Extras(self_gravity=pull, outer=self.outer()),
        )
        unit = math.sqrt(self.bed.mean_radius / self.surface_gravity())
        self.bed.drag[:] = 0.0 if now.fire or now.name == "free" else DRAG / unit
        if now.fire:
            wave = 2.0 * self.bed.X[:, RADIUS] * np.sqrt(self.bed.V[:, STIFFNESS] / self.bed.V[:, MASS])
            unit = 2.0 * self.ground.solid.extent / float(np.median(wave))
        self.steps = max(20, int(now.length * unit / self.bed.dt))
        self.fire = Fire(self.bed)
        self.done = 0

    def step(self) -> None:
        """One step of the present phase."""
        if self.plan[self.phase].fire:
            self.fire.step()
        else:
            self.bed.step()
            self.most_removed = max(self.most_removed, float(self.bed.pull_state[cached_gravity.WORST]))
        self.done += 1
        self.total += 1

    def next(self) -> bool:
        """Go to the next phase at the end of one; False when the body is at rest or has been given up."""
        now, rest, free = self.plan[self.phase], self.phase_index("rest"), self.phase_index("free")
        grains = self.bed.particles({"time": 0.0})
        if now.name == "free":
            moving = self.moving(self.bed)
            self.free_speed = moving["rms"]
            quiet = moving["rms"] < self.limit and moving["max"] < LOOSE * self.limit
            if quiet or self.repeats >= self.rest_limit:
                return False
            assert self.rested is not None
            grains, self.phase = self.rested, rest
        elif now.name == "rest":
            moving = self.moving(self.bed)
            quiet = moving["rms"] < QUIET * self.limit and moving["max"] < 0.5 * self.limit
            self.repeats += 1
            if quiet or self.repeats >= self.rest_limit:
                self.phase = free
                self.rested = grains
                grains = self.in_motion(grains)
        else:
            self.phase += 1
            if now.fire:
                grains = self._eased(grains)
                self.aside = grains
            for name in ("velocity", "angular_velocity"):
                grains[name] = np.zeros_like(grains[name])
            if now.fire:  # contacts without friction bring no springs
                grains.tables["contacts/history"] = np.zeros_like(grains.tables["contacts/history"])
        self._begin(grains)
        return True

    def _eased(self, grains: Particles) -> Particles:
        """The grains smaller by the mean overlap, with masses for where they are."""
        first, second, _ = self.bed.touching()
        r = self.bed.X[:, RADIUS]
        overlap = r[first] + r[second] - np.linalg.norm(self.bed.position[first] - self.bed.position[second], axis=1)
        mean = float(np.mean(np.maximum(overlap, 0.0) / (r[first] + r[second]))) if len(first) else 0.0
        return self._weighed(grains.position, (1.0 - mean) * grains.radius, grains)

    def moved(self, bed: Assembly) -> np.ndarray:
        """How far each grain has come (n,) [m] since the body's surface let go, in the present order."""
        assert self.aside is not None
        position = np.empty_like(self.aside.position)
        position[self.aside.identity] = self.aside.position
        return np.asarray(np.linalg.norm(bed.position - position[bed.identity], axis=1))

    def moving(self, bed: Assembly) -> dict[str, float]:
        """Rms and largest speed against the rotation of the body as a whole, over sqrt(g r)."""
        k = slice(0, bed.moving)
        m, x, v = bed.mass[k], bed.position[k], bed.velocity[k]
        centre, drift = m @ x / m.sum(), m @ v / m.sum()
        rest = v - drift - np.cross(cached_gravity.angular_velocity(bed), x - centre)
        speed, unit = np.linalg.norm(rest, axis=1), math.sqrt(self.surface_gravity() * bed.mean_radius)
        return {"rms": float(np.sqrt(np.mean(speed**2)) / unit), "max": float(speed.max() / unit), "unit_m_s": unit}

    def in_motion(self, grains: Particles) -> Particles:
        """Grains that rest in the turning frame as they move in the inertial one."""
        fields = dict(grains)
        _, fields["velocity"], fields["angular_velocity"] = turning_frame.inertial(
            grains.position, grains.velocity, grains.angular_velocity, self.ground.omega
        )
        return Particles(fields, grains.attributes, grains.tables)

    def result(self) -> Assembly:
        """The body at rest, moving with its rotation, with its contact history."""
        assert self.rested is not None
        tide = self.ground.tide(turning=False)
        return Assembly(
            self.in_motion(self.rested),
            self.contact,
            gravity=self.gravity,
            threads=threads_for(len(self.rested)),
            extras=Extras(self_gravity=SelfGravity(), outer=() if tide is None else (tide,)),
        )

    # -- grains

    def initial_grains(self, points: np.ndarray, radius: np.ndarray) -> Particles:
        """Grains at rest at the random points."""
        n, zero = len(points), np.zeros((len(points), 3))
        fields = dict(
            identity=np.arange(n), position=points, velocity=zero, angular_velocity=zero, radius=radius,
            mass=np.ones(n), material=np.zeros(n),
            species=np.full(n, self.contact.species_of(self.ground.material)), density=np.zeros(n),
            stiffness=np.ones(n), headroom=np.zeros(n),
        )  # fmt: skip
        return self._weighed(points, radius, Particles(fields))

    def _weighed(self, position: np.ndarray, radius: np.ndarray, grains: Particles) -> Particles:
        """The grains with mass, bulk density and stiffness for these positions and radii."""
        mass, self.correction = solid_masses.matched(position, radius, self.ground)
        fields = dict(grains)
        fields.update(
            radius=radius,
            mass=mass,
            density=np.full(len(mass), self.ground.density),
            stiffness=stiffness(radius, mass, self.ground, self.contact),
        )
        return Particles(fields, grains.attributes, grains.tables)
