"""Weighted estimator: how often would a moon be where the particle crosses its orbit?

The moon's longitude is uniform in time and its orbit a circle, so a particle enters the Hill sphere with the chance
that the moon stands on that arc of its orbit from which the particle's path comes within r_H: possible only while the
path is inside the torus of minor radius r_H around the orbit. For each passage of the torus the moon's phase is drawn
uniformly from the window of width D that contains the arc, path and moon are followed, and if they meet, one entry of
weight D / 2 pi is booked with the speed and position that they have there.

For straight paths the expected weight is sqrt(r_H^2 - delta^2) / (pi a sin psi), delta the distance between the lines
of path and orbit, psi the angle between relative motion and orbit. Spreading the moon over the torus instead, weight u
dt r_H^2 / (2 pi a s^2), is simpler but counts paths that run along the orbit wrongly: for the population ``literal``
it gives 0.1 (s = r_H) and 0.2 km/s (s = 2 r_H) less for retrograde entries.

Closest approach, exit and collision follow on the two-body hyperbola; its focusing onto the Hill sphere, 1 + 2 GM/(r_H
u^2), is in the weight. The moons do not pull the particle on its way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from matter.compilation.jit import kernel, law
from matter.errors import UnphysicalState
from nbody.integrators.arc import Arc, curve, struck
from nbody.integrators.fast import FLYING, LEFT, OUTER, SCREEN, TOLERANCE, Limits, fate, misses
from nbody.masses import bplane, ephemeris
from nbody.masses.dop853 import STAGES
from nbody.masses.state_vector import POSITION, VELOCITY, distance2, speed2
from nbody.masses.system import Body, System, hill_radius
from nbody.masses.test_particle import field, step
from nbody.population import encounters
from nbody.population.conditions import Batch
from nbody.population.encounters import APPROACH, ENTRY, EXIT, HIT_PLANET

SAMPLES = 96  # points along a passage
PARTICLE, MOON, DURATION, BEGIN, STATE, PASSAGE = *range(5), 10
"""Columns of a passage (``PASSAGE``,): particle, moon, duration and begin [s]; the state at the begin from ``STATE``
on."""
STREAM = 4  # spawn key of this module's random numbers


class Rings(NamedTuple):
    """The tori about the moons' orbits: radii ``orbit`` and minor radii ``tube`` (moons,) [m]."""

    orbit: np.ndarray
    tube: np.ndarray


class Inside(NamedTuple):
    """Per torus, when the particle went in [s], negative outside, and its state then: (moons,), (moons, 6)."""

    entered: np.ndarray
    begun: np.ndarray


@law
def from_ring(x, orbit):
    """Distance of a position from the circle of radius ``orbit`` in the plane z = 0."""
    rho = (x[0] * x[0] + x[1] * x[1]) ** 0.5 - orbit
    return (rho * rho + x[2] * x[2]) ** 0.5


@kernel
def thread(starts, first, limits, orbits, rings, rows, ends):
    """Fly particles ``starts`` (n, 6) without moons and note each passage through a torus: rows (particle, moon, dt,
    t, x, v at its begin).

    ``ends`` (n, 2) as in ``fast.fly``. Returns (status, count, particle): 1 full table, 2 step too small.
    """
    kx, kv = np.empty((STAGES, 3)), np.empty((STAGES, 3))
    y, new, last, out = np.empty(6), np.empty(6), np.empty(3), np.empty(6)
    duration, gm, orbit, tube = limits.duration, orbits.gm, rings.orbit, rings.tube
    moons, count, widest = orbit.shape[0], 0, 0.0
    for m in range(moons):
        widest = max(widest, orbit[m] + 2.0 * tube[m])
    entered, begun = np.empty(moons), np.empty((moons, 6))
    inside = Inside(entered, begun)
    for p in range(starts.shape[0]):
        for d in range(6):
            y[d] = starts[p, d]
        for m in range(moons):
            entered[m] = -1.0
        t, h, taken, end, screened = 0.0, 2e5, 0, FLYING, False
        kv[0, 0], kv[0, 1], kv[0, 2] = field(t, y[0], y[1], y[2], False, orbits)
        while end == FLYING:
            h = min(h, duration - t)
            error = step(t, y, h, False, orbits, kx, kv, new) / limits.tolerance
            taken += 1
            if not error <= 1.0:
                h *= max(0.2, 0.9 * error**-0.125) if error == error else 0.1
                if h < 1e-6:
                    return 2, count, first + p
                continue
            last[0], last[1], last[2] = field(t + h, new[0], new[1], new[2], False, orbits)
            r0 = distance2(y) ** 0.5
            r = distance2(new) ** 0.5
            v2 = max(speed2(y), speed2(new))
            if min(r0, r) < widest + 1.5 * v2**0.5 * h:
                count = passages(
                    first + p, t, Arc(y, new, kv[0], last, h), rings, 1.5 * v2**0.5, inside, rows, count, out
                )
                if count < 0:
                    return 1, 0, first + p
            if struck(limits.planet_radius, Arc(y, new, kv[0], last, h), out) >= 0.0:
                end = HIT_PLANET
                break
            t += h
            h *= min(5.0, 0.9 * max(error, 1e-8) ** -0.125)
            for d in range(6):
                y[d] = new[d]
            kv[0, 0], kv[0, 1], kv[0, 2] = last[0], last[1], last[2]
            end = fate(t, y, duration, False, gm, limits.outer, 3.0 * widest)
            if end == FLYING and not screened and r < SCREEN * widest:
                screened = True
                if misses(t, y, duration, gm, widest):
                    end = LEFT
        ends[p, 0], ends[p, 1] = end, taken
    return 0, count, -1


@law
def passages(particle, t, arc, rings, speed, inside, rows, count, out):
    """Follow one step along its curve and write a row for every torus left; returns the count, -1 when the table is
    full.

    Boundaries are found by advancing no further than
    the distance to them allows (to 1/500 of the tube), so that no passage is skipped.
    """
    orbit, tube, entered, begun, h = rings.orbit, rings.tube, inside.entered, inside.begun, arc.h
    for m in range(orbit.shape[0]):
        tau = 0.0
        while True:
            curve(tau / h, arc, out)
            gap = from_ring(out, orbit[m]) - tube[m]
            if entered[m] < 0.0 and gap < 0.0:
                entered[m] = t + tau
                for d in range(6):
                    begun[m, d] = out[d]
            elif entered[m] >= 0.0 and gap > 0.0:
                if count >= rows.shape[0]:
                    return -1
                row = rows[count]
                row[PARTICLE], row[MOON], row[DURATION], row[BEGIN] = particle, m, t + tau - entered[m], entered[m]
                for d in range(6):
                    row[STATE + d] = begun[m, d]
                count += 1
                entered[m] = -1.0
            if tau >= h:
                break
            tau = min(h, tau + max(abs(gap), 2e-3 * tube[m]) / speed)
    return count


@dataclass(frozen=True)
class Flights:
    """Weighted events of a lot, ``ends`` (n, 2), and the ephemeris (of the Sun) that was used."""

    table: dict[str, np.ndarray]
    ends: np.ndarray
    ephemeris: ephemeris.Ephemeris


def run(system: System, batch: Batch, duration: float, seed: int, tolerance: float = TOLERANCE) -> Flights:
    """Weighted entries, closest approaches and exits of all particles of ``batch``; raises ``UnphysicalState``."""
    orbits = ephemeris.compute(system, batch.start, duration)
    orbit, hill = np.array([moon.semi_major_axis for moon in system.moons]), system.hill_radii
    ends = np.zeros((len(batch.state), 2), np.int64)
    capacity = 64 + 2 * len(batch.state)
    while True:
        rows = np.zeros((capacity, PASSAGE))
        status, events, particle = thread(
            batch.state,
            batch.first,
            Limits(duration, system.planet.radius, OUTER * system.start_radius, tolerance),
            orbits.orbits._replace(ring=0.0),
            Rings(orbit, hill),
            rows,
            ends,
        )
        if status != 1:
            break
        capacity *= 4
    if status != 0:
        raise UnphysicalState(
            f"n-body: the step of particle {particle} became too small (start {batch.state[particle - batch.first]})"
        )
    table = _events(system, rows[:events], batch, seed)
    return Flights(table, ends, orbits)


def _events(system: System, rows: np.ndarray, batch: Batch, seed: int) -> dict[str, np.ndarray]:
    """Entries, closest approaches and exits that the passages stand for."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, batch.first)))
    tables = []
    for index, moon in enumerate(system.moons):
        mine = rows[rows[:, MOON] == index]
        if not len(mine):
            continue
        state = mine[:, STATE:]
        met = meetings(state[:, POSITION], state[:, VELOCITY], mine[:, DURATION], moon, system.planet.gm, rng)
        mine = mine[met.row]
        hill = hill_radius(moon)
        u2 = bplane.dot(met.velocity, met.velocity)
        boost = 1.0 + 2.0 * moon.gm / (hill * u2)
        velocity = met.velocity * np.sqrt(boost)[:, None]
        weight = met.window / (2.0 * math.pi) * boost * batch.weight[mine[:, PARTICLE].astype(int) - batch.first]
        mine[:, BEGIN] += met.time
        tables += _three(mine, index, met.position, velocity, met.moon, met.motion, weight, moon.gm)
    return encounters.join(tables)


class Meetings(NamedTuple):
    """Entries into a Hill sphere: ``row`` of the passage, ``window`` of phases [rad], time since the passage began
    [s], states."""

    row: np.ndarray
    window: np.ndarray
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    moon: np.ndarray
    motion: np.ndarray


def meetings(
    x: np.ndarray, v: np.ndarray, duration: np.ndarray, moon: Body, gm: float, rng: np.random.Generator
) -> Meetings:
    """Put the moon at random on its orbit for each passage that begins at (x, v) (n, 3) and keep those that it meets
    within its Hill radius.

    The path is followed under the planet alone for ``duration`` [s] (hours), the moon on its circle; position and
    velocity of an entry are relative to the moon.
    """
    hill, a = hill_radius(moon), moon.semi_major_axis
    rate = math.sqrt((gm + moon.gm) / a**3)
    h = duration / SAMPLES
    paths, motions = _followed(x, v, h, gm)
    times = np.arange(SAMPLES + 1)[:, None] * h
    phase = np.unwrap(np.arctan2(paths[..., 1], paths[..., 0]), axis=0) - rate * times
    margin = 1.05 * hill / a
    low, high = phase.min(axis=0) - margin, phase.max(axis=0) + margin
    longitude = low + (high - low) * rng.random(len(x)) + rate * times
    c, s = np.cos(longitude), np.sin(longitude)
    zero = np.zeros_like(c)
    moons, moving = a * np.stack([c, s, zero], axis=-1), rate * a * np.stack([-s, c, zero], axis=-1)
    inside = np.linalg.norm(paths - moons, axis=-1) < hill
    met = np.flatnonzero(inside.any(axis=0) & ~inside[0])
    last = inside[:, met].argmax(axis=0) - 1  # the sample before the entry
    position, velocity = (paths - moons)[last, met], (motions - moving)[last, met]
    u2, xu = bplane.dot(velocity, velocity), bplane.dot(position, velocity)
    root = np.sqrt(np.maximum(xu**2 - u2 * (bplane.dot(position, position) - hill**2), 0.0))
    part = (-xu - root) / u2
    position = position + part[:, None] * velocity
    position *= hill / np.linalg.norm(position, axis=1)[:, None]
    return Meetings(
        met, (high - low)[met], last * h[met] + part, position, velocity, moons[last, met], moving[last, met]
    )


def _followed(x: np.ndarray, v: np.ndarray, h: np.ndarray, gm: float) -> tuple[np.ndarray, np.ndarray]:
    """Two-body paths from (x, v) in ``SAMPLES`` steps of length ``h`` (n,): arrays (SAMPLES + 1, n, 3); leapfrog, good
    to (h v/r)^2."""
    paths, motions = np.empty((SAMPLES + 1, *x.shape)), np.empty((SAMPLES + 1, *x.shape))
    k = h[:, None]
    x, v = x.copy(), v.copy()
    acceleration = -gm * x / np.linalg.norm(x, axis=1)[:, None] ** 3
    for sample in range(SAMPLES + 1):
        paths[sample], motions[sample] = x, v
        v = v + 0.5 * k * acceleration
        x = x + k * v
        acceleration = -gm * x / np.linalg.norm(x, axis=1)[:, None] ** 3
        v = v + 0.5 * k * acceleration
    return paths, motions


def _three(mine, index, position, velocity, moon_position, moon_motion, weight, gm) -> list[dict[str, np.ndarray]]:
    """Tables of entries, closest approaches and exits."""
    nearest, speed, time = bplane.pericentre(position, velocity, gm)
    up, out = bplane.apsis(position, velocity, gm)
    tables = []
    for kind, x, v, later in (
        (ENTRY, position, velocity, 0.0),
        (APPROACH, nearest[:, None] * up, speed[:, None] * out, time),
        (EXIT, *bplane.mirrored(position, velocity, up), 2.0 * time),
    ):
        rows = np.zeros((len(mine), encounters.RAW))
        rows[:, encounters.PARTICLE], rows[:, encounters.MOON] = mine[:, PARTICLE], index
        rows[:, encounters.KIND], rows[:, encounters.TIME] = kind, mine[:, BEGIN] + later
        rows[:, encounters.STEP] = mine[:, DURATION]
        rows[:, encounters.TO_MOON : encounters.TO_PLANET] = np.hstack([x, v])
        rows[:, encounters.TO_PLANET : encounters.STEP] = np.hstack([moon_position + x, moon_motion + v])
        tables.append(encounters.from_rows(rows, weight))
    return tables
