"""Particles thrown from the surface of a body, through the shared ephemeris until they hit something, leave, or time
is up.

The field is that of ``nbody.masses.test_particle`` with the moons one by one, the steps are DOP853's. A step is cut so
that no body is jumped over: towards each, at the distance d from its centre with its radius R, pull g = GM / d^2,
relative speed w and its radial part w_r, it is at most

    max( 0.3 (d - R) / w,  min( 0.05 R / w,  0.3 (|w_r| + sqrt(2 g (d - R))) / g ) ),

a part of the way to the ground or, there, of the flight. Only a path that cuts less than (0.05 R)^2 / (8 R) = 3e-4 R
deep into a body may be missed. The moment of a hit is found by repeating the step with partial lengths.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.compilation.jit import kernel, law
from nbody.masses.dop853 import STAGES
from nbody.masses.ephemeris import body_position, motion
from nbody.masses.state_vector import VX, VY, VZ, distance2, r_dot_v, speed2
from nbody.masses.test_particle import field, step

HIT, LEFT, TIMED_OUT, STUCK = 1, 2, 3, 4
"""How a flight ended: on a body, beyond ``Bounds.outer``, flying, or with a step that became too small."""


class Bounds(NamedTuple):
    """What ends a flight: the time ``until`` [s], the distance ``outer`` from the origin [m] beyond which what moves
    outwards has left (where ``unbound`` is 1: only on a hyperbola about the origin), and the ``radius`` (1 + moons,)
    [m] of planet and moons; ``tolerance`` of a step."""

    until: float
    outer: float
    unbound: int
    radius: np.ndarray
    tolerance: float


@law
def about(t, y, body, orbits, out):
    """State of the particle relative to ``body`` (0 the planet, then the moons) into ``out`` (6,); returns distance
    [m] and r.v [m^2/s]."""
    for d in range(6):
        out[d] = y[d]
    first, last = (body - 1, body) if body > 0 else (0, orbits.polynomial.shape[1] - 1)
    for m in range(first, last):
        # the planet is opposite to its moons
        w = -1.0 if body > 0 else orbits.gm[m + 2] / orbits.gm[1]
        px, py, pz = body_position(orbits.polynomial, orbits.interval, m + 1, t)
        ux, uy, uz = motion(orbits.polynomial, orbits.interval, m + 1, t)
        out[0] += w * px
        out[1] += w * py
        out[2] += w * pz
        out[VX] += w * ux
        out[VY] += w * uy
        out[VZ] += w * uz
    d = distance2(out) ** 0.5
    return d, r_dot_v(out)


@law
def longest(t, y, orbits, bounds, out):
    """The longest step [s] that jumps over no body."""
    h = 1e30
    for body in range(bounds.radius.shape[0]):
        d, rv = about(t, y, body, orbits, out)
        w = speed2(out) ** 0.5 + 1e-300
        radius, pull = bounds.radius[body], orbits.gm[body + 1] / (d * d)
        room = max(d - radius, 0.0)
        fall = 0.3 * (abs(rv) / d + (2.0 * pull * room) ** 0.5) / pull
        h = min(h, max(0.3 * room / w, min(0.05 * radius / w, fall)))
    return h


@law
def landing(t, y, h, body, orbits, radius, kx, kv, new, out):
    """Length [s] of the part of a step of length ``h`` at whose end the distance to ``body`` is its ``radius``;
    ``new`` holds the state there (bisection: the path may be tangential)."""
    low, high = 0.0, h
    while high - low > 1e-14 * max(abs(t), 1.0) + 1e-12 * h:
        part = 0.5 * (low + high)
        if part <= low or part >= high:
            break
        step(t, y, part, True, orbits, kx, kv, new)
        d, _ = about(t + part, new, body, orbits, out)
        if d > radius:
            low = part
        else:
            high = part
    step(t, y, high, True, orbits, kx, kv, new)
    return high


@kernel
def fly(starts, times, home, orbits, bounds, ends, finals):
    """Integrate the particles ``starts`` (n, 6), each from its time ``times`` (n,) [s] and from the surface of the
    body ``home``.

    ``ends`` (n, 3): how each flight ended, on which body (-1: none), after how many steps; ``finals`` (n, 7): when,
    and the state.
    """
    kx, kv = np.empty((STAGES, 3)), np.empty((STAGES, 3))
    y, new, out = np.empty(6), np.empty(6), np.empty(6)
    gm = orbits.gm
    for p in range(starts.shape[0]):
        for d in range(6):
            y[d] = starts[p, d]
        t, end, body, taken = times[p], 0, -1, 0
        _, rv = about(t, y, home, orbits, out)
        if rv <= 0.0:  # it never rises
            end, body = HIT, home
        h = longest(t, y, orbits, bounds, out)
        while end == 0:
            h = min(h, longest(t, y, orbits, bounds, out), bounds.until - t)
            kv[0, 0], kv[0, 1], kv[0, 2] = field(t, y[0], y[1], y[2], True, orbits)
            error = step(t, y, h, True, orbits, kx, kv, new) / bounds.tolerance
            taken += 1
            if not error <= 1.0:
                h *= max(0.2, 0.9 * error**-0.125) if error == error else 0.1
                if h < 1e-9:
                    end = STUCK
                continue
            for b in range(bounds.radius.shape[0]):
                distance, _ = about(t + h, new, b, orbits, out)
                if distance < bounds.radius[b]:
                    h = landing(t, y, h, b, orbits, bounds.radius[b], kx, kv, new, out)
                    end, body = HIT, b
                    break
            t += h
            for d in range(6):
                y[d] = new[d]
            h *= min(5.0, 0.9 * max(error, 1e-8) ** -0.125)
            if end == 0:
                r = distance2(y) ** 0.5
                outwards = r_dot_v(y) > 0.0
                energy = 0.5 * speed2(y) - gm[1] / r
                if r > bounds.outer and outwards and (bounds.unbound == 0 or energy > 0.0):
                    end = LEFT
                elif t >= bounds.until * (1.0 - 1e-14):
                    end = TIMED_OUT
        ends[p, 0], ends[p, 1], ends[p, 2] = end, body, taken
        finals[p, 0] = t
        for d in range(6):
            finals[p, 1 + d] = y[d]
