"""A collision for every entry: the particle keeps its velocity and is put elsewhere on the Hill sphere until it hits.

Winter 2017, section 2.1.1 ("moon mode"). The last leg is that of ``nbody.masses.bplane``: against full integration the
speed agrees to 1e-3 and the angle to a degree.
"""

from __future__ import annotations

import numpy as np

from matter.errors import UnphysicalState
from nbody.masses import bplane
from nbody.masses.system import Body, System
from nbody.population import encounters
from nbody.population.encounters import COLLISION, ENTRY

SOURCES = ("Winter2017",)

MARGIN = 1.15  # of b_max: the tide shifts the disc of hits by a few per cent for the slowest
STREAM = 1  # spawn key of this module's random numbers


def collide(
    table: dict[str, np.ndarray], system: System, seed: int, chunk: int, focused: bool
) -> dict[str, np.ndarray]:
    """Collisions constructed from the entries of ``table``, one each, unless the particle hit that moon by itself.

    Also fills ``hit_probability`` of the entries. ``focused``: a collision weighs its entry's weight times that chance
    (gravitational focusing, what a real flux would give); else each weighs as much as its entry (as published). Random
    numbers depend on seed and chunk.
    """
    entries = np.flatnonzero(table["event"] == ENTRY)
    collisions = encounters.select(table, entries)
    direct = table["direct"] == 1
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, chunk)))
    for moon, body in enumerate(system.moons):
        of = collisions["moon"] == moon
        if not of.any():
            continue
        chance = bplane.hit_probability(body.radius, body.gm, collisions["distance"][of], collisions["speed"][of])
        collisions["hit_probability"][of] = chance
        table["hit_probability"][entries[of]] = chance
        shift = collisions["jovicentric_position"][of] - collisions["position"][of]
        motion = collisions["jovicentric_velocity"][of] - collisions["velocity"][of]
        rate = np.linalg.norm(motion, axis=1) / np.linalg.norm(shift, axis=1)
        x, v, later, collisions["draws"][of] = last_leg(
            system, body, collisions["position"][of], collisions["velocity"][of], -shift, rate, rng
        )
        hit = bplane.fall(x, v, body.radius, body.gm)
        later += hit.flight_time
        turn = rate * later  # the moon goes on along its orbit meanwhile
        collisions["position"][of], collisions["velocity"][of] = hit.position, hit.velocity
        collisions["jovicentric_position"][of] = _turned(shift, turn) + hit.position
        collisions["jovicentric_velocity"][of] = _turned(motion, turn) + hit.velocity
        collisions["time"][of] += later
    if focused:
        collisions["weight"] *= collisions["hit_probability"]
    flags = collisions["retrograde"].copy(), collisions["periapsis"].copy()
    collisions["event"][:], collisions["direct"][:] = COLLISION, 0
    encounters.derive(collisions)
    collisions["retrograde"][:], collisions["periapsis"][:] = (
        flags  # those of the entry: what decides which side of the moon is hit
    )
    by_itself = set(zip(table["particle"][direct].tolist(), table["moon"][direct].tolist()))
    keep = [pair not in by_itself for pair in zip(collisions["particle"].tolist(), collisions["moon"].tolist())]
    return encounters.select(collisions, np.array(keep, bool))


def last_leg(
    system: System,
    body: Body,
    entry: np.ndarray,
    velocity: np.ndarray,
    planet: np.ndarray,
    rate: np.ndarray,
    rng: np.random.Generator,
):
    """Redraw positions on the Hill sphere until the flight under moon and planet hits the body.

    Returns states above the surface (n, 3) from which the hyperbola hits, the time to there [s] and how many draws
    over the facing hemisphere it took.
    """
    x, v, later, draws = (
        np.empty_like(entry),
        np.empty_like(entry),
        np.zeros(len(entry)),
        np.zeros(len(entry), np.int64),
    )
    waiting = np.arange(len(entry))
    for _ in range(1000):
        positions, tried = bplane.resample(entry[waiting], velocity[waiting], body.radius, body.gm, rng, MARGIN)
        draws[waiting] += tried
        x[waiting], v[waiting], later[waiting] = bplane.descend(
            positions, velocity[waiting], planet[waiting], rate[waiting], body.gm, system.planet.gm
        )
        nearest, _, _ = bplane.pericentre(x[waiting], v[waiting], body.gm)
        inwards = bplane.dot(x[waiting], v[waiting]) < 0.0
        waiting = waiting[(nearest > body.radius) | ~inwards]
        if not len(waiting):
            return x, v, later, draws
    raise UnphysicalState(
        f"n-body: no position on the Hill sphere of {body.title} leads to a hit at "
        f"{np.linalg.norm(velocity[waiting[0]]):.4g} m/s"
    )


def _turned(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(
        [c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1], vectors[:, 2]], axis=1
    )
