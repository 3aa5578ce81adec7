"""Fast path: one particle at a time through the shared ephemeris, DOP853, events found on the way.

What happens at a moon is placed within a step by ``nbody.integrators.moon_events``; inside a Hill sphere steps are
short.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from matter.compilation.jit import kernel, law
from matter.errors import UnphysicalState
from nbody.integrators.arc import Arc, curve, struck
from nbody.integrators.launched import about
from nbody.integrators.moon_events import Moons, Step, Work, first_entry, locate, record, relative, within
from nbody.masses import ephemeris
from nbody.masses.dop853 import STAGES
from nbody.masses.state_vector import distance2, r_dot_v, speed2
from nbody.masses.system import System
from nbody.masses.test_particle import field, step, swing
from nbody.population import encounters
from nbody.population.conditions import Batch
from nbody.population.encounters import ENTRY, FLYING, HIT_PLANET, LEFT, TIMED_OUT

TOLERANCE = 1e-9
SCREEN = 10.0  # inside this many orbits of the outermost moon a particle is asked whether it will miss them all
OUTER = 1.5  # of the start radius: beyond it a particle that moves outwards is lost
# moons one by one inside this many orbits of the outermost: 0.1-0.4 km against IAS15 after a year, 0.2-1.7 km with 5
NEAR = 8.0


class Limits(NamedTuple):
    """What ends a flight: its ``duration`` [s], the planet's radius and the radius ``outer`` beyond which it has left
    [m]; and the ``tolerance`` of a step."""

    duration: float
    planet_radius: float
    outer: float
    tolerance: float


@law
def misses(t, y, duration, gm, widest):
    """Whether a particle that comes in will stay outside ``widest`` (orbits of the moons with their Hill spheres)
    until the end.

    Its osculating pericentre is beyond 1.2 ``widest``; inside 10 orbits the Sun changes the angular momentum by less
    than 1 % (pericentre 2 %).
    """
    r2, w2, rv = 0.0, 0.0, 0.0
    for d in range(3):
        r2 += y[d] * y[d]
        w2 += y[d + 3] * y[d + 3]
        rv += y[d] * y[d + 3]
    if rv >= 0.0:
        return False
    energy = 0.5 * w2 - gm[1] / r2**0.5
    p = (r2 * w2 - rv * rv) / gm[1]
    e = max(1.0 + 2.0 * energy * p / gm[1], 0.0) ** 0.5
    if p / (1.0 + e) < 1.2 * widest:
        return False
    return energy >= 0.0 or 0.8 * 2.0 * math.pi * ((-0.5 * gm[1] / energy) ** 3 / gm[1]) ** 0.5 > duration - t


@law
def fate(t, y, duration, inside, gm, outer, far):
    """Whether a flight goes on: FLYING, TIMED_OUT, or LEFT when it is beyond ``outer`` or cannot come back
    in time.

    A bound orbit that goes out beyond ``far`` is taken to come back after four fifths of an osculating period: the
    Sun's pull has room.
    """
    if t >= duration * (1.0 - 1e-14):
        return TIMED_OUT
    r = distance2(y) ** 0.5
    if r_dot_v(y) <= 0.0:
        return FLYING
    if r > outer:
        return LEFT
    if inside or r <= far:
        return FLYING
    energy = 0.5 * speed2(y) - gm[1] / r
    if energy >= 0.0 or 0.8 * 2.0 * math.pi * ((-0.5 * gm[1] / energy) ** 3 / gm[1]) ** 0.5 > duration - t:
        return LEFT
    return FLYING


@law
def reach_of_moons(limits, orbits, moons):
    """Radius of the outermost orbit, the same with Hill spheres, and the farthest that the planet's surface is from
    the barycentre [m]."""
    widest, reach, surface = 0.0, 0.0, limits.planet_radius
    for m in range(moons.orbit.shape[0]):
        surface += 1.1 * orbits.gm[m + 2] / orbits.gm[1] * moons.orbit[m]
        widest, reach = max(widest, moons.orbit[m]), max(reach, moons.orbit[m] + 2.0 * moons.hill[m])
    return widest, reach, surface


@law
def strike(now, new, first, last, radius, orbits, ends, out):
    """The part of the step ``now`` (``Step``) after which a particle strikes the planet, negative where it does not;
    ``new`` then becomes the state there. ``first`` and ``last``: accelerations; ``ends`` two states to work with."""
    begin, finish = ends
    about(now.t, now.y, np.int64(0), orbits, begin)
    about(now.t + now.h, new, np.int64(0), orbits, finish)
    part = struck(radius, Arc(begin, finish, first, last, now.h), out)
    if 0.0 <= part < 1.0:
        curve(part, Arc(now.y, new, first, last, now.h), out)
        for d in range(6):
            new[d] = out[d]
    return part


@kernel
def fly(starts, first, limits, orbits, moons, events, ends, finals):
    """Integrate the particles ``starts`` (n, 6); rows of events go to ``events``.

    ``ends`` (n, 2) says how each flight ended (TIMED_OUT, LEFT the radius ``outer``, HIT_PLANET, HIT_MOON) and after
    how many steps, ``finals`` (n, 7) when and in which state (a particle that leaves is followed no further than it
    can come back). Returns (status, count, particle): status 0 is good, 1 a full event table, 2 a step that became too
    small.
    """
    kx, kv = np.empty((STAGES, 3)), np.empty((STAGES, 3))
    y, new, last, out = np.empty(6), np.empty(6), np.empty(3), np.empty(6)
    spare, coefficient, work = (np.empty(6), np.empty(6)), np.empty((3, 6)), Work(kx, kv, new, out)
    duration, gm, hill = limits.duration, orbits.gm, moons.hill
    # typed, not literal: numba compiles a called function anew for every literal that it is given
    count, never = np.int64(0), duration < 0.0
    widest, reach, surface = reach_of_moons(limits, orbits, moons)
    switch = NEAR * widest
    for p in range(starts.shape[0]):
        for d in range(6):
            y[d] = starts[p, d]
        t, h, inside, leaving, approached, taken = 0.0, 2e5, np.int64(-1), np.int64(-1), never, 0
        near_before, fresh, end, screened = True, True, FLYING, False
        while end == FLYING:
            r = distance2(y) ** 0.5
            v = speed2(y) ** 0.5
            near = r < switch
            if near != near_before:
                swing(t, y, 1.0 if near else -1.0, orbits)
                fresh = True
            if fresh:
                kv[0, 0], kv[0, 1], kv[0, 2] = field(t, y[0], y[1], y[2], near, orbits)
            near_before, fresh = near, False
            if not near:
                h = min(h, max((r - switch) / v, 0.1 * r / v))
            rv_before = 0.0
            if inside >= 0:
                d, rv_before = relative(t, y, inside, orbits, out)
                w = speed2(out) ** 0.5
                h = min(h, max(0.2 * d, 0.05 * hill[inside]) / w)
            h = min(h, duration - t)
            error = step(t, y, h, near, orbits, kx, kv, new) / limits.tolerance
            taken += 1
            if not error <= 1.0:
                h *= max(0.2, 0.9 * error**-0.125) if error == error else 0.1
                if h < 1e-6:
                    return 2, count, first + p
                continue
            growth = min(5.0, 0.9 * max(error, 1e-8) ** -0.125)
            if inside >= 0:
                now = Step(t, y, h, near)
                count, h, passed, end = within(
                    first + p, inside, approached, rv_before, moons, now, orbits, work, events, count
                )
                approached = approached or passed > 0
                if passed == 2:
                    leaving, inside = inside, np.int64(-1)
                if count < 0:
                    return 1, 0, first + p
            last[0], last[1], last[2] = field(t + h, new[0], new[1], new[2], near, orbits)
            if inside < 0 and leaving < 0 and near:
                moon, low, high = first_entry(Step(t, y, h, near), new, kv, last, orbits, moons, coefficient)
                if moon >= 0:
                    size = hill[moon]
                    h = locate(np.int64(ENTRY), moon, size, low, high, Step(t, y, h, near), orbits, work)
                    count = record(events, count, first + p, moon, np.int64(ENTRY), t + h, new, h, orbits, out)
                    if count < 0:
                        return 1, 0, first + p
                    inside, approached, growth, fresh = moon, never, 1.0, True
            elif leaving >= 0:
                d, _ = relative(t + h, new, leaving, orbits, out)
                if d > 1.1 * hill[leaving]:  # no second entry on the way out
                    leaving = np.int64(-1)
            w = speed2(new) ** 0.5
            if near and inside < 0 and not fresh and r < surface + 1.5 * max(v, w) * h:
                part = strike(Step(t, y, h, near), new, kv[0], last, limits.planet_radius, orbits, spare, out)
                if part >= 0.0:
                    end = HIT_PLANET
                if 0.0 <= part < 1.0:
                    h *= part
            t += h
            for d in range(6):
                y[d] = new[d]
            kv[0, 0], kv[0, 1], kv[0, 2] = last[0], last[1], last[2]
            h *= growth
            if end == FLYING:
                end = fate(t, y, duration, inside >= 0, gm, limits.outer, 3.0 * widest)
            if end == FLYING and not screened and distance2(y) < (SCREEN * widest) ** 2:
                screened = True
                if misses(t, y, duration, gm, reach):
                    end = LEFT
        ends[p, 0], ends[p, 1] = end, taken
        finals[p, 0] = t
        for d in range(6):
            finals[p, 1 + d] = y[d]
    return 0, count, -1


@dataclass(frozen=True)
class Flights:
    """What became of a lot: ``table`` of events, ``ends`` (n, 2), ``finals`` (n, 7), and the ephemeris that all of
    them flew through."""

    table: dict[str, np.ndarray]
    ends: np.ndarray
    finals: np.ndarray
    ephemeris: ephemeris.Ephemeris


def run(system: System, batch: Batch, duration: float, tolerance: float = TOLERANCE, reach: float = 1.0) -> Flights:
    """Fly all particles of ``batch`` for ``duration`` [s]; entries are those into ``reach`` Hill radii.

    Raises ``UnphysicalState`` when a particle cannot be integrated.
    """
    orbits = ephemeris.compute(system, batch.start, duration)
    count = len(batch.state)
    ends, finals = np.zeros((count, 2), np.int64), np.zeros((count, 7))
    capacity = 64 + count // 8
    radii, paths = (np.array([getattr(moon, name) for moon in system.moons]) for name in ("radius", "semi_major_axis"))
    moons = Moons(reach * system.hill_radii, radii, paths)
    while True:
        rows = np.zeros((capacity, encounters.RAW))
        status, entries, particle = fly(
            batch.state,
            batch.first,
            Limits(duration, system.planet.radius, OUTER * system.start_radius, tolerance),
            orbits.orbits,
            moons,
            rows,
            ends,
            finals,
        )
        if status != 1:
            break
        capacity *= 4
    if status != 0:
        raise UnphysicalState(
            f"n-body: the step of particle {particle} became too small (start {batch.state[particle - batch.first]})"
        )
    rows = rows[:entries]
    return Flights(
        encounters.from_rows(rows, batch.weight[rows[:, 0].astype(int) - batch.first]), ends, finals, orbits
    )
