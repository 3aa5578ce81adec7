"""Moon mode of the published integration: from the entry into a Hill sphere the particle is flown again from positions
on the sphere until one of them leads to a hit.

Winter 2017, section 2.1.3; eq. 5, h_max = 0.01 d_min/v_rel, acts here only: the steps at impact printed for
normal mode (5-20 s) are several times too long for it, those of moon mode are not.
"""

from __future__ import annotations

import math

import numpy as np

from matter.compilation.jit import kernel
from nbody.integrators.cash_karp import Leg, after, between, copy, rkck
from nbody.masses import bplane
from nbody.masses.newtonian import newton
from nbody.masses.state_vector import POSITION, VELOCITY, speed2
from nbody.masses.system import System
from nbody.population import encounters
from nbody.population.encounters import COLLISION, ENTRY

SOURCES = ("Winter2017",)

LARGEST_FRACTION = 0.01  # eq. 5
TO_MOON, TO_PLANET, TIME, STEP, RESULT = 0, 6, 12, 13, 14
"""Columns of the ``result`` (14,): states relative to moon and planet from ``TO_MOON`` and ``TO_PLANET`` on, time and
step [s]."""


@kernel
def moon_mode(states, moon, gm, radius, hill, positions, out, result):
    """Restart from the saved ``states`` (n, 6) with the particle at moon + ``positions[i]`` until one run hits.

    ``result`` (14,) receives the columns above. Returns (index of the
    position that hit or -1, steps).
    """
    n = states.shape[0]
    last, other = n - 1, moon + 2
    masses = np.zeros(n)
    masses[: n - 1] = gm
    kx, kv = np.empty((6, n, 3)), np.empty((6, n, 3))
    x, v, x_new, v_new, xs = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    taken = 0
    for i in range(positions.shape[0]):
        for j in range(n):
            for k in range(3):
                x[j, k], v[j, k] = states[j, k], states[j, 3 + k]
        for k in range(3):
            x[last, k] = x[other, k] + positions[i, k]
        t, h = 0.0, 1e6
        newton(x, masses, kv[0])
        while True:
            d, rv = between(0.0, Leg(1.0, x, v, x, v), last, other, out)
            w = speed2(out) ** 0.5
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
                    result[TO_MOON + k] = out[k]
                between(1.0, Leg(h, x, v, x_new, v_new), last, np.int64(1), out)
                for k in range(6):
                    result[TO_PLANET + k] = out[k]
                result[TIME], result[STEP] = t, h
                return i, taken
            if rv >= 0.0 or d > 1.001 * hill:
                break
            h = after(h, error)
            copy(x_new, v_new, x, v)
            newton(x, masses, kv[0])
    return -1, taken


def collisions(system: System, table: dict[str, np.ndarray], saved: np.ndarray, seed: int, screened: bool):
    """Moon mode for every entry of ``table`` that is not followed by a direct collision; fills ``hit_probability`` of
    the entries."""
    direct = {(p, m) for p, m in zip(*(table[name][table["direct"] == 1] for name in ("particle", "moon")))}
    tables, out, result, total = [], np.zeros(6), np.zeros(RESULT), 0
    number: dict[int, int] = {}
    for row in np.flatnonzero(table["event"] == ENTRY):
        particle, moon = int(table["particle"][row]), int(table["moon"][row])
        number[particle] = number.get(particle, -1) + 1
        body, hill = system.moons[moon], system.hill_radii[moon]
        velocity = saved[row, -1, VELOCITY] - saved[row, moon + 2, VELOCITY]
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
            continue  # no position on the facing hemisphere leads to a hit
        line = encounters.select(table, np.array([row]))
        line["event"][:], line["draws"][:], line["step"][:] = COLLISION, draws, result[STEP]
        line["time"][:] += result[TIME]
        for whose, state in (("", result[TO_MOON:TO_PLANET]), ("jovicentric_", result[TO_PLANET:TIME])):
            line[f"{whose}position"][0], line[f"{whose}velocity"][0] = state[POSITION], state[VELOCITY]
        flags = line["retrograde"].copy(), line["periapsis"].copy()
        encounters.derive(line)
        line["retrograde"][:], line["periapsis"][:] = flags
        tables.append(line)
    return encounters.join(tables), total
