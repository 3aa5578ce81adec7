"""Events at a moon within a step of the fast path: entry into its Hill sphere, closest approach, collision, exit.

Entering is found by advancing along the quintic Hermite interpolant of the step by (distance - r_H) / (largest
possible relative speed), which cannot jump over a sphere; the event is then placed by repeating the step with partial
lengths (regula falsi), so that it is as exact as the integration.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.compilation.jit import law
from nbody.masses.ephemeris import body_position, motion
from nbody.masses.state_vector import VX, VY, VZ, distance2, r_dot_v, speed2
from nbody.masses.test_particle import step
from nbody.population.encounters import (
    APPROACH,
    COLLISION,
    EXIT,
    FLYING,
    HIT_MOON,
    KIND,
    MOON,
    PARTICLE,
    STEP,
    TIME,
    TO_MOON,
    TO_PLANET,
)


class Moons(NamedTuple):
    """The moons as spheres: Hill radii (or multiples of them) ``hill``, radii and radii of the orbits, each (moons,)
    [m]."""

    hill: np.ndarray
    radius: np.ndarray
    orbit: np.ndarray


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
    mx, my, mz = body_position(orbits.polynomial, orbits.interval, moon + 1, t)
    ux, uy, uz = motion(orbits.polynomial, orbits.interval, moon + 1, t)
    out[0], out[1], out[2] = y[0] - mx, y[1] - my, y[2] - mz
    out[VX], out[VY], out[VZ] = y[VX] - ux, y[VY] - uy, y[VZ] - uz
    d = distance2(out) ** 0.5
    return d, r_dot_v(out)


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
        px, py, pz = body_position(orbits.polynomial, orbits.interval, m + 1, t)
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
    moon, bracket_low, bracket_high = -1, 0.0, h
    r0 = distance2(y) ** 0.5
    fastest = 1.5 * max(speed2(y), speed2(new)) ** 0.5
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
            px, py, pz = body_position(orbits.polynomial, orbits.interval, m + 1, t + tau)
            d2 = 0.0
            for d in range(3):
                c = coefficient[d]
                q = ((((c[5] * u + c[4]) * u + c[3]) * u + c[2]) * u + c[1]) * u + c[0]
                q -= px if d == 0 else (py if d == 1 else pz)
                d2 += q * q
            gap = d2**0.5 - hill[m]
            if gap <= 0.0:
                if tau <= bracket_high:
                    moon, bracket_low, bracket_high = m, low, tau
                break
            low = tau
            if tau >= h:
                break
            tau = min(h, tau + max(gap / speed, 1e-3 * hill[m] / speed))
    return moon, bracket_low, bracket_high


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
