"""A granular assembly: grains, their contacts and walls, and one step of time.

Arrays, list of pairs and what is saved: ``dem.grains.grain_list``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from dem.contact import walls
from dem.contact.columns import (
    ANGULAR_IMPULSE,
    AT_WALLS,
    BOOKS,
    DISSIPATED,
    DRAGGED,
    ENERGY_REMOVED,
    EXCESS,
    IMPULSE,
    SUMS,
    TOUCHING,
    WX,
)
from dem.contact.contact_scheme import Boundaries, ExternalField, Grains, Halo, Listed, Step
from dem.contact.gravity import Field
from dem.contact.settings import OVERLAP_WARN, RETURNING_SPEED_LIMIT, Contact, shortest_contact_time
from dem.grains import cached_gravity, contact_tables, forces, grain_integrator, removed_grains, shaking
from dem.grains.grain_list import ACTIVE, BALLISTIC, LEFT, PER_GRAIN, PULLED, SHAKEN, GrainList, check
from dem.grains.self_gravity import SelfGravity
from dem.grains.shaking import Vibration
from matter.errors import InputError, UnphysicalState
from matter.files import checkpoint
from matter.particles import Particles

FIELDS = "identity position velocity angular_velocity mass radius material species stiffness".split()
"""What grains have to bring."""
REASONS = ("escaped", "landed_outside", "through_the_side")


class Extras(NamedTuple):
    """``offset``: contacts can carry an offset (``dem.stiffness.change``: k_n changes in the run, or differs from that
    in which the bed settled); ``self_gravity``: the grains attract each other; ``outer``: what acts on them besides
    (``dem.grains.cached_gravity``); ``shaking``: of grains with the field ``vibration``, how it dies away."""

    offset: bool = False
    self_gravity: SelfGravity | None = None
    outer: tuple[cached_gravity.ExternalForce, ...] = ()
    shaking: Vibration | None = None


class Assembly(GrainList):
    """Grains in contact.

    Parameters
    ----------
    grains : fields identity position velocity angular_velocity mass radius material species stiffness (density,
        headroom, state optional), tables ``contacts/*`` optional: history of the contacts by the identities of the
        grains.
    contact : laws and parameters.
    walls : boundaries, at rest.
    gravity : uniform or central field.
    dt : time step [s]; None takes that of ``contact.time_step``.
    overlap_limit : instead of ``contact.overlap_stop`` (a packing starts with any overlap).
    extras : what most beds do without.
    threads : chunks of the half list, one per thread; results are bitwise repeatable at one number.
    """

    def __init__(
        self,
        grains: Particles,
        contact: Contact,
        walls_: Sequence[walls.Wall] = (),
        gravity: Field | None = None,
        dt: float | None = None,
        threads: int = 1,
        skin: float = 0.2,
        overlap_limit: float | None = None,
        extras: Extras = Extras(),  # noqa: B008  (a tuple)
    ):
        grains.need(*FIELDS)
        check(grains)
        offset, self.self_gravity, self.outer, self.shaking = extras
        self.contact, self.gravity = contact, gravity or Field.constant((0.0, 0.0, 0.0))
        self.walls = walls.rows(walls_)
        attract = self.self_gravity is not None or len(self.outer) > 0
        flags = dict(offset=int(offset), attract=int(attract), shaken=int(self.shaking is not None))
        self.scheme = contact.scheme()._replace(**flags)
        if offset and not contact.springs_can_change:
            raise InputError(f"a stiffness that changes in the run needs {contact.springs_that_change}")
        self._per_grain = PER_GRAIN + (PULLED if attract else ()) + (SHAKEN if self.shaking else ())
        self.self_acceleration, self.cached_acceleration = (
            np.zeros((len(grains) if attract else 1, 3)) for _ in PULLED
        )
        self.pull_state = np.zeros(cached_gravity.STATE)
        self.pull_interval = self.self_gravity.time_between(grains.mass, grains.radius) if self.self_gravity else 0.0
        self._pair_loop, self._kick_loop = forces.pair_loop(self.scheme), grain_integrator.kick_loop(self.scheme)
        self.pair_table = contact.pair_table()
        self.wall_tables = contact.wall_table(walls_, self.pair_table)
        self._tables(grains, len(walls_))
        self.lost_in_flight = 0.0  # what collisions of flying grains have lost, part of what contacts dissipated [J]
        # factor of k_n against its start; energy of the springs at rest at that start; what changes of k_n have put
        # into springs, of that what the weight has taken, and the sum of the amounts of the rest [J]
        self.softness, self.rest_energy, self.stiffness_energy, self.weight_energy = 1.0, 0.0, 0.0, 0.0
        self.stiffness_excess = 0.0
        self.row = np.zeros(1, dtype=np.int64)
        self.col, self.first = np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.int32)
        self.hist = np.zeros((0, self.scheme.history))
        self.mean_radius = float(grains.radius.mean())
        self.skin = skin * self.mean_radius
        self.dt = dt if dt is not None else contact.time_step(grains, self.gravity)
        self.steps, self.builds, self.since_build = 0, 0, 0
        self.start_time = float(grains.attributes.get("time", 0.0))
        self.overlap_limit = contact.overlap_stop if overlap_limit is None else overlap_limit
        # sums over the run: dissipated in contacts, excess taken from returned grains, dissipated by drag and at
        # walls, impulse (6)
        self.report = np.zeros(SUMS)
        # of grains that left, by reason: count, mass, momentum (3), angular momentum (3), energy
        self.booked = np.zeros((len(REASONS), BOOKS))
        self.elastic, self.contacts, self.over_warn, self.worst, self.speed = 0.0, 0, 0, 0.0, 0.0
        self.threads = max(1, threads)
        self._pool = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None
        self._workspace()
        self._rebuild(contact_tables.pairs(grains, self.identity, self.scheme.history, offset))
        contact_tables.take_walls(grains, self.identity, self.wall_history[:, : len(self.walls)], offset)
        self.wall_history[self.active :] = 0.0
        self._begin_forces()

    def _begin_forces(self) -> None:
        if self.scheme.attract:
            cached_gravity.attract(self, renew=True)
        if self.shaking:
            self._look_at_vibration(self.shaking)
        self._forces(initial=True)

    def _tables(self, grains: Particles, walls: int) -> None:
        """What is kept of each grain (``dem.contact.columns``)."""
        n = len(grains)
        self.X = np.column_stack([grains.position, grains.radius])
        self.W = np.column_stack([grains.velocity, grains.angular_velocity])
        self.V = np.column_stack([self.W, grains.mass, grains.stiffness])
        self.A, self.E, self.F = (np.zeros((n, 6)) for _ in range(3))
        self.identity, self.material = grains.identity.copy(), grains.material.copy()
        self.kind = grains.species.copy()
        self.state = grains.state.copy() if "state" in grains else np.zeros(n, dtype=np.int8)
        self.headroom = grains.headroom.copy() if "headroom" in grains else np.zeros(n, dtype=np.int8)
        self.density = (
            grains.density.copy() if "density" in grains else grains.mass / (4.0 / 3.0 * np.pi * grains.radius**3)
        )
        # ejecta, from the start or after their flight: light and fast, stopped by contacts scaled to them rather than
        # by a limit on overlap
        ejecta = self.identity >= grains.attributes.get("bed_grains", np.iinfo(np.int64).max)
        self.returned = ((self.state == BALLISTIC) | ejecta).astype(np.int8)
        self.drag, self.weight = np.zeros(n), np.ones(n)
        self.wall_history = np.zeros((n, max(1, walls), self.scheme.history))
        self.reference = np.zeros((n, 3))
        self.vibration = grains.vibration.copy() if self.shaking else np.zeros(1)
        self.bearing = np.ones(len(self.vibration))
        self.vibration_time = float(grains.attributes.get("time", 0.0))

    # -- lists

    def _workspace(self) -> None:
        n, c = len(self.X), self.threads
        self._halo = np.zeros((c, n if c > 1 else 1, 6))
        self._pair_report = np.zeros((c, forces.REPORT))
        self._kick_report = np.zeros((c, grain_integrator.REPORT))
        self._last = np.zeros(c, dtype=np.int64)

    def renew(self) -> None:
        """Sort, list and evaluate again after positions and velocities were set from outside: contacts begin
        unloaded."""
        nobody = np.zeros(0, dtype=np.int64)
        self._rebuild((nobody, nobody, np.zeros((0, self.scheme.history))))
        self._begin_forces()

    # -- time

    def step(self) -> None:
        """Advance by dt.

        Raises ``UnphysicalState`` when a grain is no longer finite or two bed grains overlap beyond ``overlap_stop``.
        """
        moved = self._each(self._drift)
        self.steps += 1
        self.since_build += 1
        if 4.0 * max(moved) > self.skin**2:
            self._rebuild(forces_follow=True)
        if self.scheme.attract:
            cached_gravity.attract(self)
        if self.shaking and self.steps % shaking.EVERY == 0:
            self._look_at_vibration(self.shaking)
        self._forces()

    def change_step(self, dt: float) -> None:
        """Another time step [s] from the next step on."""
        now = self.time
        self.dt = dt
        self.start_time = now - self.steps * dt

    def _look_at_vibration(self, how: Vibration) -> None:
        """Bring the vibration to the present time, and find the friction that it leaves."""
        elapsed, self.vibration_time = self.time - self.vibration_time, self.time
        listed = self.first, self.col, self.hist, self.pair_table
        boundaries = self.walls, self.walled, self.wall_tables, self.wall_history
        pressure = shaking.pressures(
            self.X, self.V, self.kind, self.density, self.active, listed, boundaries, self.scheme
        )
        shaking.lower(elapsed, self.material, self.density, pressure, tuple(how), self.vibration, self.bearing)

    # What the loops are given goes as plain tuples, which they name again: numba looks up the class of a named tuple
    # at every call, a microsecond each.

    def _grains(self) -> tuple:
        return tuple(Grains(self.X, self.V, self.W, self.A, self.E, self.F, self.kind, self.returned))

    def _step_of(self, dt: float, over_speed: float = 0.0) -> tuple:
        return tuple(Step(float(dt), 0.5 * float(dt), over_speed, OVERLAP_WARN))

    def _drift(self, c: int) -> float:
        return grain_integrator.drift(
            self._moving_chunks[c], self._grains(), self.reference, float(self.dt), self._kick_report[c]
        )

    def _pairs(self, c: int, step: tuple) -> None:
        listed = tuple(Listed(self.first, self.col, self._known, self.hist, self.pair_table, self.bearing))
        self._last[c] = self._pair_loop(
            self._chunks[c], self._grains(), listed, step, self._halo[c], self._pair_report[c]
        )

    def _kick(self, c: int, step: tuple) -> int:
        g = self.gravity
        boundaries = tuple(Boundaries(self.walls, self.walled, self.wall_tables, self.wall_history))
        external = tuple(
            ExternalField(g.uniform, g.table, float(g.radius), self.weight, self.drag, self.self_acceleration)
        )
        halo = tuple(Halo(self._halo, self._last))
        return self._kick_loop(
            self._moving_chunks[c],
            self._grains(),
            halo,
            boundaries,
            external,
            step,
            self._kick_report[c],
        )

    def _forces(self, initial: bool = False) -> None:
        step = self._step_of(0.0) if initial else self._step_of(self.dt, RETURNING_SPEED_LIMIT)
        kept = (self.hist.copy(), self.wall_history.copy()) if initial else None
        self._each(lambda c: self._pairs(c, step))
        bad = max(self._each(lambda c: self._kick(c, step)))
        if kept:  # a first evaluation only marks the contacts: springs are as they were given
            self.hist[:, :TOUCHING], self.wall_history[:, :, :TOUCHING] = (
                kept[0][:, :TOUCHING],
                kept[1][:, :, :TOUCHING],
            )
        pair, single = self._pair_report, self._kick_report
        self.elastic = float(pair[:, forces.ELASTIC].sum() + single[:, grain_integrator.WALL_ELASTIC].sum())
        self.contacts = int(pair[:, forces.CONTACTS].sum())
        self.over_warn = int(pair[:, forces.OVER_WARN].sum())
        self.worst = float(pair[:, forces.OVERLAP].max())
        self.speed = math.sqrt(float(single[:, grain_integrator.SPEED].max()))
        self.report[DISSIPATED] += pair[:, forces.DISSIPATED].sum()
        self.report[EXCESS] += pair[:, forces.EXCESS].sum()
        self.report[DRAGGED] += single[:, grain_integrator.DRAG].sum()
        self.report[AT_WALLS] += single[:, grain_integrator.WALL_DISSIPATED].sum()
        given = single[:, grain_integrator.IMPULSE : grain_integrator.WALL_OVERLAP].sum(axis=0)
        self.report[IMPULSE] += given[:WX]
        self.report[ANGULAR_IMPULSE] += given[WX:]
        single[:, : grain_integrator.WALL_OVERLAP] = 0.0
        if bad >= 0:
            raise UnphysicalState(f"grain {self.identity[bad]} is not finite: {self.where(bad)}")
        if self.worst > self.overlap_limit:
            self._refuse_overlap()
        if single[:, grain_integrator.WALL_OVERLAP].max() > self.overlap_limit:
            c = int(np.argmax(single[:, grain_integrator.WALL_OVERLAP]))
            i = int(single[c, grain_integrator.WALL_GRAIN])
            raise UnphysicalState(
                f"grain {self.identity[i]} overlaps a wall by "
                f"{single[c, grain_integrator.WALL_OVERLAP]:.3f} of its radius "
                f"(limit {self.overlap_limit:g}): {self.where(i)}. The springs are too soft for this load or speed"
            )

    def _refuse_overlap(self) -> None:
        c = int(np.argmax(self._pair_report[:, forces.OVERLAP]))
        i, j = (int(self._pair_report[c, k]) for k in (forces.OVERLAP_I, forces.OVERLAP_J))
        closing = float(np.linalg.norm(self.velocity[j] - self.velocity[i]))
        raise UnphysicalState(
            f"grains {self.identity[i]} and {self.identity[j]} overlap by {self.worst:.3f} of the smaller radius "
            f"(limit {self.overlap_limit:g}) at a relative speed of {closing:.4g} m/s; first: {self.where(i)}; "
            f"second: {self.where(j)}. "
            "The springs are too soft for this load or speed, or the bed was started with overlaps"
        )

    # -- what the state holds

    def change_states(self, where: np.ndarray, state: int, reason: str = REASONS[0]) -> None:
        """Move grains (mask in the present order) into or out of the contact search, or out of the run, at a full
        step.

        The order of the grains changes: masks made before are void.

        What leaves is booked under ``reason`` with the half kick that its contacts have just given it, so that the
        sums stay exact.
        """
        where = where & (self.state != state)
        if not where.any():
            return
        if state == LEFT:
            tables = self.mass[where], self.X[where], self.W[where], self.F[where]
            removed_grains.book(self.booked[REASONS.index(reason)], *tables, 0.5 * self.dt, self.gravity)
            self.booked[REASONS.index(reason), ENERGY_REMOVED] += cached_gravity.energy_with(self, where)
        if state == BALLISTIC:
            self.returned[where] = 1
        self.state[where] = state
        self._rebuild()
        if state == ACTIVE and self.scheme.offset:
            self._begin_unloaded()

    def restore(self, saved: checkpoint.State) -> None:
        """Take up what was ``saved``, bit for bit."""
        super().restore(saved)
        self._workspace()
        self._cut()


__all__ = ["ACTIVE", "BALLISTIC", "LEFT", "REASONS", "Assembly", "Extras", "shortest_contact_time"]
