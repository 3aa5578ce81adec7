"""Fast path: one particle at a time through the shared ephemeris, DOP853, events found on the way.

Entering a moon's Hill sphere is found by advancing along the quintic Hermite interpolant of a step by (distance - r_H)
/ (largest possible relative speed), which cannot jump over a sphere; the event is then placed by repeating the step
with partial lengths (regula falsi), so that it is as exact as the integration. Inside the Hill sphere steps are short
and closest approach, surface and exit are placed the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from matter.errors import UnphysicalState
from matter.jit import kernel, law
from nbody import encounters, ephemeris
from nbody.conditions import Lot
from nbody.encounters import APPROACH, COLLISION, ENTRY, EXIT, KIND, MOON, PARTICLE, STEP, TIME, TO_MOON, TO_PLANET
from nbody.ephemeris import motion, place
from nbody.flight import field, step, swing
from nbody.integrators.dop853 import STAGES
from nbody.system import System

TOLERANCE = 1e-9
FLYING, TIMED_OUT, LEFT, HIT_PLANET, HIT_MOON = 0, 1, 2, 3, 4
SCREEN = 10.0  # inside this many orbits of the outermost moon a particle is asked whether it will miss them all
OUTER = 1.5  # of the start radius: beyond it a particle that moves outwards is lost
# moons one by one inside this many orbits of the outermost: 0.1-0.4 km against IAS15 after a year, 0.2-1.7 km with 5
NEAR = 8.0


class Moons(NamedTuple):
    """The moons as spheres: Hill radii (or multiples of them) ``hill``, radii and radii of the orbits, each (moons,)
    [m]."""

    hill: np.ndarray
    radius: np.ndarray
    orbit: np.ndarray


class Limits(NamedTuple):
    """What ends a flight: its ``duration`` [s], the planet's radius and the radius ``outer`` beyond which it has left
    [m]; and the ``tolerance`` of a step."""

    duration: float
    planet_radius: float
    outer: float
    tolerance: float


class Step(NamedTuple):
    """A step: its time [s], the state ``y`` (6,) at its begin, its length ``h`` [s], and whether the moons pull one by
    one (``near``)."""

    t: float
    y: np.ndarray
    h: float
    near: bool


class Work(NamedTuple):
    """Room for a step: slopes ``kx``, ``kv`` (stages, 3), the ``new`` state (6,), and a state relative to a moon,
    ``out`` (6,)."""

    kx: np.ndarray
    kv: np.ndarray
    new: np.ndarray
    out: np.ndarray


@law
def relative(t, y, moon, orbits, out):
    """State of the particle relative to ``moon`` into ``out`` (6,); returns distance [m] and r.v [m^2/s]."""
    mx, my, mz = place(orbits.polynomial, orbits.interval, moon + 1, t)
    ux, uy, uz = motion(orbits.polynomial, orbits.interval, moon + 1, t)
    out[0], out[1], out[2] = y[0] - mx, y[1] - my, y[2] - mz
    out[3], out[4], out[5] = y[3] - ux, y[4] - uy, y[5] - uz
    d = (out[0] * out[0] + out[1] * out[1] + out[2] * out[2]) ** 0.5
    return d, out[0] * out[3] + out[1] * out[4] + out[2] * out[5]


@law
def record(events, count, particle, moon, kind, t, y, h, orbits, out):
    """Write one event; returns the new count, or -1 when the table is (or was) full."""
    if count < 0 or count >= events.shape[0]:
        return -1
    relative(t, y, moon, orbits, out)
    row = events[count]
    row[PARTICLE], row[MOON], row[KIND], row[TIME], row[STEP] = particle, moon, kind, t, h
    for d in range(6):  # assigning slices would compile numba's broadcasting: seconds
        row[TO_MOON + d], row[TO_PLANET + d] = out[d], y[d]
    for m in range(orbits.polynomial.shape[1] - 1):  # the planet is opposite to its moons
        w = orbits.gm[m + 2] / orbits.gm[1]
        px, py, pz = place(orbits.polynomial, orbits.interval, m + 1, t)
        ux, uy, uz = motion(orbits.polynomial, orbits.interval, m + 1, t)
        row[TO_PLANET] += w * px
        row[TO_PLANET + 1] += w * py
        row[TO_PLANET + 2] += w * pz
        row[TO_PLANET + 3] += w * ux
        row[TO_PLANET + 4] += w * uy
        row[TO_PLANET + 5] += w * uz
    return count + 1


@law
def locate(kind, moon, size, low, high, now, orbits, work):
    """Partial step length in [low, high] at which the event happens; ``work.new`` holds the state there (Illinois
    regula falsi)."""
    t = now.t
    f_low, f_high, h, side = 0.0, 0.0, low, 0
    for trial in range(
        62
    ):  # one call of ``step`` for both ends and all trials: it is large, and every copy costs a second of compilation
        if trial == 1:
            h = high
        elif trial > 1:
            h = (low * f_high - high * f_low) / (f_high - f_low) if f_high != f_low else 0.5 * (low + high)
            if not low <= h <= high:
                h = 0.5 * (low + high)
        step(t, now.y, h, now.near, orbits, work.kx, work.kv, work.new)
        d, rv = relative(t + h, work.new, moon, orbits, work.out)
        f = rv if kind == APPROACH else d - size
        if trial == 0:
            f_low = f
        elif trial == 1:
            f_high = f
        elif f * f_high > 0.0:
            high, f_high = h, f
            f_low *= 0.5 if side == -1 else 1.0
            side = -1
        else:
            low, f_low = h, f
            f_high *= 0.5 if side == 1 else 1.0
            side = 1
        if trial > 1 and (high - low < 1e-6 or f == 0.0):  # 1e-6 s: centimetres
            break
    return h


@law
def first_entry(now, new, kv, last, orbits, moons, coefficient):
    """Earliest bracket (moon, low, high) within a step in which the distance to a moon falls below its Hill radius;
    moon -1 if none.

    ``kv[0]`` and ``last`` hold the accelerations at both ends.
    """
    t, y, h, gm, hill, orbit = now.t, now.y, now.h, orbits.gm, moons.hill, moons.orbit
    found, found_low, found_high = -1, 0.0, h
    r0 = (y[0] * y[0] + y[1] * y[1] + y[2] * y[2]) ** 0.5
    fastest = (
        1.5 * max(y[3] * y[3] + y[4] * y[4] + y[5] * y[5], new[3] * new[3] + new[4] * new[4] + new[5] * new[5]) ** 0.5
    )
    fitted = False
    for m in range(hill.shape[0]):
        speed = fastest + 1.02 * (gm[1] / orbit[m]) ** 0.5
        if abs(r0 - orbit[m]) > 1.01 * hill[m] + speed * h:
            continue
        if not fitted:
            fitted = True
            for d in range(3):
                rise = new[d] - y[d]
                v0, v1, a0, a1 = y[d + 3] * h, new[d + 3] * h, kv[0, d] * h * h, last[d] * h * h
                coefficient[d, 0], coefficient[d, 1], coefficient[d, 2] = y[d], v0, 0.5 * a0
                coefficient[d, 3] = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
                coefficient[d, 4] = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
                coefficient[d, 5] = 6.0 * rise - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
        low, tau = 0.0, 0.0
        while True:
            u = tau / h
            px, py, pz = place(orbits.polynomial, orbits.interval, m + 1, t + tau)
            d2 = 0.0
            for d in range(3):
                c = coefficient[d]
                q = ((((c[5] * u + c[4]) * u + c[3]) * u + c[2]) * u + c[1]) * u + c[0]
                q -= px if d == 0 else (py if d == 1 else pz)
                d2 += q * q
            gap = d2**0.5 - hill[m]
            if gap <= 0.0:
                if tau <= found_high:
                    found, found_low, found_high = m, low, tau
                break
            low = tau
            if tau >= h:
                break
            tau = min(h, tau + max(gap / speed, 1e-3 * hill[m] / speed))
    return found, found_low, found_high


@law
def within(particle, moon, approached, rv_before, moons, now, orbits, work, events, count):
    """Events of one step inside the Hill sphere of ``moon``: closest approach, collision, exit.

    Returns (count, step length, passed, end): ``passed`` 1 after the closest approach, 2 after the exit (then the step
    ends there).
    """
    passed, end = 0, FLYING
    t, y, h, near, new, out = now.t, now.y, now.h, now.near, work.new, work.out
    radius, hill = moons.radius[moon], moons.hill[moon]
    d, rv = relative(t + h, new, moon, orbits, out)
    if not approached and rv_before < 0.0 and rv >= 0.0:
        part = locate(np.int64(APPROACH), moon, 0.0, 0.0, h, now, orbits, work)
        d, _ = relative(t + part, new, moon, orbits, out)
        passed = 1
        if d > radius:
            count = record(events, count, particle, moon, np.int64(APPROACH), t + part, new, h, orbits, out)
            step(t, y, h, near, orbits, work.kx, work.kv, new)
            d, rv = relative(t + h, new, moon, orbits, out)
        else:
            h = part
    if d <= radius:
        part = locate(np.int64(COLLISION), moon, radius, 0.0, h, now, orbits, work)
        count = record(events, count, particle, moon, np.int64(COLLISION), t + part, new, h, orbits, out)
        end = HIT_MOON
    elif d > hill:
        h = locate(np.int64(EXIT), moon, hill, 0.0, h, now, orbits, work)
        count = record(events, count, particle, moon, np.int64(EXIT), t + h, new, h, orbits, out)
        passed = 2
    return count, h, passed, end


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
def fate(t, y, duration, inside, gm, planet_radius, outer, far):
    """Whether a flight goes on: FLYING, TIMED_OUT, HIT_PLANET, or LEFT when it is beyond ``outer`` or cannot come back
    in time.

    A bound orbit that goes out beyond ``far`` is taken to come back after four fifths of an osculating period: the
    Sun's pull has room.
    """
    if t >= duration * (1.0 - 1e-14):
        return TIMED_OUT
    r = (y[0] * y[0] + y[1] * y[1] + y[2] * y[2]) ** 0.5
    if r < planet_radius:
        return HIT_PLANET
    if y[0] * y[3] + y[1] * y[4] + y[2] * y[5] <= 0.0:
        return FLYING
    if r > outer:
        return LEFT
    if inside or r <= far:
        return FLYING
    energy = 0.5 * (y[3] * y[3] + y[4] * y[4] + y[5] * y[5]) - gm[1] / r
    if energy >= 0.0 or 0.8 * 2.0 * math.pi * ((-0.5 * gm[1] / energy) ** 3 / gm[1]) ** 0.5 > duration - t:
        return LEFT
    return FLYING


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
    coefficient, work = np.empty((3, 6)), Work(kx, kv, new, out)
    duration, gm, hill, orbit = limits.duration, orbits.gm, moons.hill, moons.orbit
    # typed, not literal: numba compiles a called function anew for every literal that it is given
    count, never = np.int64(0), duration < 0.0
    widest, reach = 0.0, 0.0
    for m in range(orbit.shape[0]):
        widest, reach = max(widest, orbit[m]), max(reach, orbit[m] + 2.0 * hill[m])
    switch = NEAR * widest
    for p in range(starts.shape[0]):
        for d in range(6):
            y[d] = starts[p, d]
        t, h, inside, leaving, approached, taken = 0.0, 2e5, np.int64(-1), np.int64(-1), never, 0
        near_before, fresh, end, screened = True, True, FLYING, False
        while end == FLYING:
            r = (y[0] * y[0] + y[1] * y[1] + y[2] * y[2]) ** 0.5
            v = (y[3] * y[3] + y[4] * y[4] + y[5] * y[5]) ** 0.5
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
                w = (out[3] * out[3] + out[4] * out[4] + out[5] * out[5]) ** 0.5
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
            t += h
            for d in range(6):
                y[d] = new[d]
            kv[0, 0], kv[0, 1], kv[0, 2] = last[0], last[1], last[2]
            h *= growth
            if end == FLYING:
                end = fate(t, y, duration, inside >= 0, gm, limits.planet_radius, limits.outer, 3.0 * widest)
            if end == FLYING and not screened and y[0] * y[0] + y[1] * y[1] + y[2] * y[2] < (SCREEN * widest) ** 2:
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


def run(system: System, lot: Lot, duration: float, tolerance: float = TOLERANCE, reach: float = 1.0) -> Flights:
    """Fly all particles of ``lot`` for ``duration`` [s]; entries are those into ``reach`` Hill radii.

    Raises ``UnphysicalState`` when a particle cannot be integrated.
    """
    orbits = ephemeris.compute(system, lot.start, duration)
    count = len(lot.state)
    ends, finals = np.zeros((count, 2), np.int64), np.zeros((count, 7))
    capacity = 64 + count // 8
    radii, paths = (np.array([getattr(moon, name) for moon in system.moons]) for name in ("radius", "semi_major_axis"))
    moons = Moons(reach * system.hill_radii, radii, paths)
    while True:
        rows = np.zeros((capacity, encounters.RAW))
        status, found, particle = fly(
            lot.state,
            lot.first,
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
            f"n-body: the step of particle {particle} became too small (start {lot.state[particle - lot.first]})"
        )
    rows = rows[:found]
    return Flights(encounters.from_rows(rows, lot.weight[rows[:, 0].astype(int) - lot.first]), ends, finals, orbits)
