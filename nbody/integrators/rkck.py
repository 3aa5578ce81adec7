"""As published: all bodies together, Runge-Kutta-Cash-Karp 4(5) with the step rules of the thesis.

Cash and Karp 1990, ACM Trans. Math. Softw. 16, 201; step control of Press et al., Numerical Recipes, section 16.2.
Winter 2017, section 2.1.3: the fifth-order solution is carried on, a step is accepted when

    |y5 - y4| < 0.1 eps mean|x_rel| (positions),  < eps mean|v_rel| (velocities),  eps = 1e-11,

the means taken over all pairs of bodies. Eq. 5, h_max = 0.01 d_min/v_rel, acts in moon mode only: the steps at impact
printed for normal mode (5-20 s) are several times too long for it, those of moon mode are not. Events are placed on
the cubic Hermite interpolant of a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from matter.errors import UnphysicalState
from matter.jit import kernel, law
from nbody import bplane, encounters
from nbody.conditions import Lot
from nbody.encounters import APPROACH, COLLISION, ENTRY, EXIT, KIND, MOON, PARTICLE, STEP, TIME, TO_MOON, TO_PLANET
from nbody.gravity import newton
from nbody.integrators import fast
from nbody.integrators.fast import FLYING, HIT_MOON, HIT_PLANET, LEFT, TIMED_OUT
from nbody.system import System

SOURCES = ("CashKarp1990", "Winter2017")

EPSILON = 1e-11
LARGEST_FRACTION = 0.01  # eq. 5
A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0],
        [3 / 10, -9 / 10, 6 / 5, 0.0, 0.0],
        [-11 / 54, 5 / 2, -70 / 27, 35 / 27, 0.0],
        [1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096],
    ]
)
B5 = np.array([37 / 378, 0.0, 250 / 621, 125 / 594, 0.0, 512 / 1771])
B4 = np.array([2825 / 27648, 0.0, 18575 / 48384, 13525 / 55296, 277 / 14336, 1 / 4])
E = B5 - B4


class Leg(NamedTuple):
    """A step of all bodies: length ``h`` [s], states at both ends (n, 3)."""

    h: float
    x: np.ndarray
    v: np.ndarray
    x_new: np.ndarray
    v_new: np.ndarray


class Bodies(NamedTuple):
    """The massive bodies (Sun, planet, moons): states (bodies, 3) and masses ``gm`` (bodies,), Hill radii of the
    moons, radii of moons and planet [m]."""

    position: np.ndarray
    velocity: np.ndarray
    gm: np.ndarray
    hill: np.ndarray
    radii: np.ndarray


@law
def rkck(x, v, h, gm, kx, kv, xs, x_new, v_new):
    """One step of length ``h`` from (x, v), shape (n, 3); kv[0] holds the accelerations. Returns the error over the
    tolerances."""
    n = x.shape[0]
    for i in range(n):
        for d in range(3):
            kx[0, i, d] = v[i, d]
    for s in range(1, 6):
        for i in range(n):
            for d in range(3):
                dx, dv = 0.0, 0.0
                for j in range(s):
                    dx += A[s, j] * kx[j, i, d]
                    dv += A[s, j] * kv[j, i, d]
                xs[i, d] = x[i, d] + h * dx
                kx[s, i, d] = v[i, d] + h * dv
        newton(xs, gm, kv[s])
    worst_x, worst_v = 0.0, 0.0
    for i in range(n):
        for d in range(3):
            dx, dv, ex, ev = 0.0, 0.0, 0.0, 0.0
            for s in range(6):
                dx += B5[s] * kx[s, i, d]
                dv += B5[s] * kv[s, i, d]
                ex += E[s] * kx[s, i, d]
                ev += E[s] * kv[s, i, d]
            x_new[i, d] = x[i, d] + h * dx
            v_new[i, d] = v[i, d] + h * dv
            worst_x, worst_v = max(worst_x, abs(ex)), max(worst_v, abs(ev))
    distance, speed = 0.0, 0.0
    for i in range(n):
        for j in range(i + 1, n):
            dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
            distance += (dx * dx + dy * dy + dz * dz) ** 0.5
            dx, dy, dz = v[i, 0] - v[j, 0], v[i, 1] - v[j, 1], v[i, 2] - v[j, 2]
            speed += (dx * dx + dy * dy + dz * dz) ** 0.5
    pairs = 0.5 * n * (n - 1)
    return h * max(worst_x / (0.1 * EPSILON * distance / pairs), worst_v / (EPSILON * speed / pairs))


@law
def copy(x, v, x_to, v_to):
    """Copy states (n, 3)."""
    for i in range(x.shape[0]):
        for d in range(3):
            x_to[i, d], v_to[i, d] = x[i, d], v[i, d]


@law
def after(h, error):
    """Next step length by Numerical Recipes' rule."""
    if error > 1.0:
        return h * max(0.9 * error**-0.25, 0.1)
    return h * min(5.0, 0.9 * error**-0.2) if error > 0.0 else 5.0 * h


@law
def between(u, leg, last, other, out):
    """Relative state of bodies ``last`` and ``other`` at fraction ``u`` of a step (cubic Hermite) into ``out``;
    returns distance, r.v."""
    h, x, v, x_new, v_new = leg.h, leg.x, leg.v, leg.x_new, leg.v_new
    for d in range(3):
        x0, x1 = x[last, d] - x[other, d], x_new[last, d] - x_new[other, d]
        v0, v1 = h * (v[last, d] - v[other, d]), h * (v_new[last, d] - v_new[other, d])
        c2, c3 = 3.0 * (x1 - x0) - 2.0 * v0 - v1, 2.0 * (x0 - x1) + v0 + v1
        out[d] = ((c3 * u + c2) * u + v0) * u + x0
        out[3 + d] = ((3.0 * c3 * u + 2.0 * c2) * u + v0) / h
    r2 = out[0] * out[0] + out[1] * out[1] + out[2] * out[2]
    return r2**0.5, out[0] * out[3] + out[1] * out[4] + out[2] * out[5]


@law
def place(kind, size, leg, last, other, out):
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
                    u = place(np.int64(APPROACH), 0.0, leg, last, inside + 2, out)
                    count = record(rows, count, first + p, inside, np.int64(APPROACH), t, u, leg, out)
                    approached = True
                if end == FLYING and d > hill[inside]:
                    u = place(np.int64(EXIT), hill[inside], leg, last, inside + 2, out)
                    count = record(rows, count, first + p, inside, np.int64(EXIT), t, u, leg, out)
                    inside = np.int64(-1)
            else:
                for m in range(moons):
                    d, rv = between(1.0, leg, last, m + 2, out)
                    if d < hill[m]:
                        u = place(np.int64(ENTRY), hill[m], leg, last, m + 2, out)
                        for i in range(n):
                            for k in range(3):
                                saved[count, i, k], saved[count, i, 3 + k] = x_new[i, k], v_new[i, k]
                        count = record(rows, count, first + p, m, np.int64(ENTRY), t, u, leg, out)
                        inside, approached = m, never
                        d, rv = between(1.0, leg, last, m + 2, out)
                        if rv >= 0.0:  # entered and passed the closest point within one step
                            w = place(np.int64(APPROACH), 0.0, leg, last, m + 2, out)
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


@kernel
def moon_mode(states, moon, gm, radius, hill, places, out, result):
    """Restart from the saved ``states`` (n, 6) with the particle at moon + ``places[i]`` until one run hits.

    ``result`` receives relative state, state relative to the planet, time, step (14 numbers). Returns (index of the
    place that hit or -1, steps).
    """
    n = states.shape[0]
    last, other = n - 1, moon + 2
    masses = np.zeros(n)
    masses[: n - 1] = gm
    kx, kv = np.empty((6, n, 3)), np.empty((6, n, 3))
    x, v, x_new, v_new, xs = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    taken = 0
    for i in range(places.shape[0]):
        for j in range(n):
            for k in range(3):
                x[j, k], v[j, k] = states[j, k], states[j, 3 + k]
        for k in range(3):
            x[last, k] = x[other, k] + places[i, k]
        t, h = 0.0, 1e6
        newton(x, masses, kv[0])
        while True:
            d, rv = between(0.0, Leg(1.0, x, v, x, v), last, other, out)
            w = (out[3] * out[3] + out[4] * out[4] + out[5] * out[5]) ** 0.5
            h = min(h, LARGEST_FRACTION * d / w)
            error = rkck(x, v, h, masses, kx, kv, xs, x_new, v_new)
            taken += 1
            if not error <= 1.0:
                h = after(h, error)
                continue
            d, rv = between(1.0, Leg(h, x, v, x_new, v_new), last, other, out)
            t += h
            if d <= radius:
                for k in range(6):
                    result[k] = out[k]
                between(1.0, Leg(h, x, v, x_new, v_new), last, np.int64(1), out)
                for k in range(6):
                    result[6 + k] = out[k]
                result[12], result[13] = t, h
                return i, taken
            if rv >= 0.0 or d > 1.001 * hill:
                break
            h = after(h, error)
            copy(x_new, v_new, x, v)
            newton(x, masses, kv[0])
    return -1, taken


@dataclass(frozen=True)
class Flights:
    """What became of a lot: table of events with collisions constructed in moon mode, ``ends`` (n, 2), steps taken in
    moon mode."""

    table: dict[str, np.ndarray]
    ends: np.ndarray
    moon_steps: int


def run(
    system: System, lot: Lot, duration: float, seed: int, screened: bool = True, to_the_end: bool = False
) -> Flights:
    """Fly ``lot`` as published, moon mode included.

    ``screened``: only particles that the fast path sees within 1.3 Hill radii of a moon are integrated, and moon-mode
    draws whose hyperbola misses by more than a third are not: the rest cannot give an event (the fast path is right to
    a kilometre), but would cost 99.8 % of the time. ``to_the_end``: particles that have left are integrated on, as in
    the thesis. Raises ``UnphysicalState``.
    """
    picked = np.arange(len(lot.state))
    if screened:
        near = fast.run(system, lot, duration, reach=1.3).table
        picked = np.unique(near["particle"]) - lot.first
    gm, radii = system.gm, np.array([*(moon.radius for moon in system.moons), system.planet.radius])
    rows, saved = np.zeros((64 + 8 * len(picked), encounters.RAW)), np.zeros((64 + 8 * len(picked), len(gm) + 1, 6))
    ends = np.zeros((len(lot.state), 2), np.int64)
    ends[:, 0] = LEFT
    done, part = 0, np.zeros((len(picked), 2), np.int64)
    status, done, particle = normal_mode(
        Bodies(lot.start.position, lot.start.velocity, gm, system.hill_radii, radii),
        np.ascontiguousarray(lot.state[picked]),
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
        raise UnphysicalState(f"n-body: particle {lot.first + int(picked[particle])}: {reason}")
    ends[picked] = part
    rows, saved = rows[:done], saved[:done]
    local = picked[rows[:, 0].astype(int)]
    rows[:, 0] = local + lot.first
    table = encounters.from_rows(rows, lot.weight[local])
    hits, steps = _collisions(system, table, saved, seed, screened)
    return Flights(encounters.join([table, hits]), ends, steps)


def _collisions(system: System, table: dict[str, np.ndarray], saved: np.ndarray, seed: int, screened: bool):
    """Moon mode for every entry of ``table`` that is not followed by a direct collision; fills ``hit_probability`` of
    the entries."""
    direct = {(p, m) for p, m in zip(*(table[name][table["direct"] == 1] for name in ("particle", "moon")))}
    made, out, result, total = [], np.zeros(6), np.zeros(14), 0
    number: dict[int, int] = {}
    for row in np.flatnonzero(table["event"] == ENTRY):
        particle, moon = int(table["particle"][row]), int(table["moon"][row])
        number[particle] = number.get(particle, -1) + 1
        body, hill = system.moons[moon], system.hill_radii[moon]
        velocity = saved[row, -1, 3:] - saved[row, moon + 2, 3:]
        speed = float(np.linalg.norm(velocity))
        chance = float(bplane.hit_probability(body.radius, body.gm, hill, speed))
        table["hit_probability"][row] = chance
        if (particle, moon) in direct:
            continue
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(3, particle, number[particle])))
        entry = table["position"][row] / table["distance"][row]
        draws = 0
        while draws < 200_000:
            normals = rng.normal(size=(4096, 3))
            normals /= np.linalg.norm(normals, axis=1)[:, None]
            normals *= np.where(normals @ entry < 0.0, -1.0, 1.0)[:, None]
            wanted = np.arange(4096)
            if screened:
                lever = np.linalg.norm(np.cross(normals, velocity / speed), axis=1)
                wanted = np.flatnonzero((lever < 1.3 * math.sqrt(chance)) & (normals @ velocity < 0.0))
            hit, steps = moon_mode(saved[row], moon, system.gm, body.radius, hill, hill * normals[wanted], out, result)
            total += steps
            if hit >= 0:
                draws += int(wanted[hit]) + 1
                break
            draws += 4096
        else:
            continue  # no place on the facing hemisphere leads to a hit
        line = encounters.select(table, np.array([row]))
        line["event"][:], line["draws"][:], line["step"][:] = COLLISION, draws, result[13]
        line["time"][:] += result[12]
        line["position"][0], line["velocity"][0] = result[:3], result[3:6]
        line["jovicentric_position"][0], line["jovicentric_velocity"][0] = result[6:9], result[9:12]
        flags = line["retrograde"].copy(), line["periapsis"].copy()
        encounters.derive(line)
        line["retrograde"][:], line["periapsis"][:] = flags
        made.append(line)
    return encounters.join(made), total
