"""As published: all bodies together, Runge-Kutta-Cash-Karp 4(5) with the step rules of the thesis.

``cash_karp`` holds the step, ``moon_mode`` what is made of an entry. Events are placed on the cubic Hermite
interpolant of a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from matter.compilation.jit import kernel, law
from matter.errors import UnphysicalState
from nbody.integrators import fast, moon_mode
from nbody.integrators.cash_karp import Leg, after, between, copy, rkck
from nbody.masses.newtonian import newton
from nbody.masses.system import System
from nbody.population import encounters
from nbody.population.conditions import Batch
from nbody.population.encounters import (
    APPROACH,
    COLLISION,
    ENTRY,
    EXIT,
    FLYING,
    HIT_MOON,
    HIT_PLANET,
    KIND,
    LEFT,
    MOON,
    PARTICLE,
    STEP,
    TIME,
    TIMED_OUT,
    TO_MOON,
    TO_PLANET,
)

SOURCES = ("Winter2017",)


class Bodies(NamedTuple):
    """The massive bodies (Sun, planet, moons): states (bodies, 3) and masses ``gm`` (bodies,), Hill radii of the
    moons, radii of moons and planet [m]."""

    position: np.ndarray
    velocity: np.ndarray
    gm: np.ndarray
    hill: np.ndarray
    radii: np.ndarray


@law
def step_fraction(kind, size, leg, last, other, out):
    """Fraction of the step at which the distance is ``size`` (or r.v = 0 for the closest approach), by bisection."""
    low, high = 0.0, 1.0
    d, rv = between(0.0, leg, last, other, out)
    sign = rv if kind == APPROACH else d - size
    for _ in range(50):
        u = 0.5 * (low + high)
        d, rv = between(u, leg, last, other, out)
        if (rv if kind == APPROACH else d - size) * sign > 0.0:
            low = u
        else:
            high = u
    return 0.5 * (low + high)


@law
def record(rows, count, particle, moon, kind, t, u, leg, out):
    """Write one event at fraction ``u`` of a step; returns the new count."""
    last = leg.x.shape[0] - 1
    row = rows[count]
    row[PARTICLE], row[MOON], row[KIND], row[TIME], row[STEP] = particle, moon, kind, t + u * leg.h, leg.h
    between(u, leg, last, moon + 2, out)
    for d in range(6):  # assigning slices would compile numba's broadcasting: seconds
        row[TO_MOON + d] = out[d]
    between(u, leg, last, np.int64(1), out)
    for d in range(6):
        row[TO_PLANET + d] = out[d]
    return count + 1


@kernel
def normal_mode(massive, state, first, duration, outer, to_the_end, rows, saved, ends):
    """Fly particles ``state`` (k, 6) one by one with the ``massive`` bodies (``Bodies``); ``saved[row]`` holds all
    states after an entry.

    ``ends`` (k, 2): how each flight ended, and after how many steps. Returns (status, count, particle): 1 table full,
    2 step too small.
    """
    x0, v0, gm, hill, radii = massive.position, massive.velocity, massive.gm, massive.hill, massive.radii
    bodies = x0.shape[0]
    n, last, moons = bodies + 1, bodies, bodies - 2
    masses = np.zeros(n)
    masses[:bodies] = gm
    kx, kv = np.empty((6, n, 3)), np.empty((6, n, 3))
    x, v, x_new, v_new, xs, out = (
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty(6),
    )
    count, never = np.int64(0), duration < 0.0  # typed, not literal: one compilation of each function called
    for p in range(state.shape[0]):
        for d in range(3):
            for i in range(bodies):
                x[i, d], v[i, d] = x0[i, d], v0[i, d]
            x[last, d], v[last, d] = state[p, d], state[p, 3 + d]
        t, h, inside, taken, end, approached = 0.0, 60.0, np.int64(-1), 0, FLYING, never
        newton(x, masses, kv[0])
        while end == FLYING:
            h = min(h, duration - t)
            error = rkck(x, v, h, masses, kx, kv, xs, x_new, v_new)
            taken += 1
            if not error <= 1.0:
                h = after(h, error) if error == error else 0.1 * h
                if h < 1e-6:
                    return 2, count, first + p
                continue
            if count + 4 > rows.shape[0]:
                return 1, 0, first + p
            leg = Leg(h, x, v, x_new, v_new)
            if inside >= 0:
                _, rv0 = between(0.0, leg, last, inside + 2, out)
                d, rv = between(1.0, leg, last, inside + 2, out)
                if d <= radii[inside]:
                    count = record(rows, count, first + p, inside, np.int64(COLLISION), t, 1.0, leg, out)
                    end = HIT_MOON
                elif rv0 < 0.0 and rv >= 0.0 and not approached:
                    u = step_fraction(np.int64(APPROACH), 0.0, leg, last, inside + 2, out)
                    count = record(rows, count, first + p, inside, np.int64(APPROACH), t, u, leg, out)
                    approached = True
                if end == FLYING and d > hill[inside]:
                    u = step_fraction(np.int64(EXIT), hill[inside], leg, last, inside + 2, out)
                    count = record(rows, count, first + p, inside, np.int64(EXIT), t, u, leg, out)
                    inside = np.int64(-1)
            else:
                for m in range(moons):
                    d, rv = between(1.0, leg, last, m + 2, out)
                    if d < hill[m]:
                        u = step_fraction(np.int64(ENTRY), hill[m], leg, last, m + 2, out)
                        for i in range(n):
                            for k in range(3):
                                saved[count, i, k], saved[count, i, 3 + k] = x_new[i, k], v_new[i, k]
                        count = record(rows, count, first + p, m, np.int64(ENTRY), t, u, leg, out)
                        inside, approached = m, never
                        d, rv = between(1.0, leg, last, m + 2, out)
                        if rv >= 0.0:  # entered and passed the closest point within one step
                            w = step_fraction(np.int64(APPROACH), 0.0, leg, last, m + 2, out)
                            count = record(rows, count, first + p, m, np.int64(APPROACH), t, w, leg, out)
                            approached = True
                        break
            t += h
            h = after(h, error)
            copy(x_new, v_new, x, v)
            newton(x, masses, kv[0])
            if end == FLYING:
                end = fate(x, v, t, duration, inside, gm, radii, outer, to_the_end)
        ends[p, 0], ends[p, 1] = end, taken
    return 0, count, -1


@law
def fate(x, v, t, duration, inside, gm, radii, outer, to_the_end):
    """Whether a flight goes on: FLYING, TIMED_OUT, HIT_PLANET, or LEFT (cannot come back in time; not tested if
    ``to_the_end``)."""
    last = x.shape[0] - 1
    if t >= duration * (1.0 - 1e-14):
        return TIMED_OUT
    r2, w2, rv, orbit2 = 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        dx, dv = x[last, d] - x[1, d], v[last, d] - v[1, d]
        r2 += dx * dx
        w2 += dv * dv
        rv += dx * dv
        dm = x[last - 1, d] - x[1, d]
        orbit2 += dm * dm
    if r2 < radii[radii.shape[0] - 1] ** 2:
        return HIT_PLANET
    if to_the_end or rv <= 0.0 or inside >= 0:
        return FLYING
    if r2 > outer * outer:
        return LEFT
    if r2 > 9.0 * orbit2:
        energy = 0.5 * w2 - gm[1] / r2**0.5
        if energy >= 0.0 or 0.8 * 2.0 * math.pi * ((-0.5 * gm[1] / energy) ** 3 / gm[1]) ** 0.5 > duration - t:
            return LEFT
    return FLYING


@dataclass(frozen=True)
class Flights:
    """What became of a lot: table of events with collisions constructed in moon mode, ``ends`` (n, 2), steps taken in
    moon mode."""

    table: dict[str, np.ndarray]
    ends: np.ndarray
    moon_steps: int


def run(
    system: System, batch: Batch, duration: float, seed: int, screened: bool = True, to_the_end: bool = False
) -> Flights:
    """Fly ``batch`` as published, moon mode included.

    ``screened``: only particles that the fast path sees within 1.3 Hill radii of a moon are integrated, and moon-mode
    draws whose hyperbola misses by more than a third are not: the rest cannot give an event (the fast path is right to
    a kilometre), but would cost 99.8 % of the time. ``to_the_end``: particles that have left are integrated on, as in
    the thesis. Raises ``UnphysicalState``.
    """
    picked = np.arange(len(batch.state))
    if screened:
        near = fast.run(system, batch, duration, reach=1.3).table
        picked = np.unique(near["particle"]) - batch.first
    gm, radii = system.gm, np.array([*(moon.radius for moon in system.moons), system.planet.radius])
    rows, saved = np.zeros((64 + 8 * len(picked), encounters.RAW)), np.zeros((64 + 8 * len(picked), len(gm) + 1, 6))
    ends = np.zeros((len(batch.state), 2), np.int64)
    ends[:, 0] = LEFT
    done, part = 0, np.zeros((len(picked), 2), np.int64)
    status, done, particle = normal_mode(
        Bodies(batch.start.position, batch.start.velocity, gm, system.hill_radii, radii),
        np.ascontiguousarray(batch.state[picked]),
        0,
        duration,
        fast.OUTER * system.start_radius,
        to_the_end,
        rows,
        saved,
        part,
    )
    if status != 0:
        reason = "more events than the table holds" if status == 1 else "its step became too small"
        raise UnphysicalState(f"n-body: particle {batch.first + int(picked[particle])}: {reason}")
    ends[picked] = part
    rows, saved = rows[:done], saved[:done]
    local = picked[rows[:, 0].astype(int)]
    rows[:, 0] = local + batch.first
    table = encounters.from_rows(rows, batch.weight[local])
    hits, steps = moon_mode.collisions(system, table, saved, seed, screened)
    return Flights(encounters.join([table, hits]), ends, steps)
