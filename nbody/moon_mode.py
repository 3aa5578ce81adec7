"""A collision for every entry: the particle keeps its velocity and is put elsewhere on the Hill sphere until it hits.

Winter 2017, section 2.1.1 ("moon mode"). The last leg is the two-body hyperbola of ``nbody.bplane``; against full integration the speed
agrees to 1e-3 and the angle to a degree.
"""

from __future__ import annotations

import numpy as np

from nbody import bplane, encounters
from nbody.encounters import COLLISION, ENTRY
from nbody.system import System

STREAM = 1  # spawn key of this module's random numbers


def collide(table: dict[str, np.ndarray], system: System, seed: int) -> dict[str, np.ndarray]:
    """Collisions constructed from the entries of ``table``, one each, unless the particle hit that moon by itself.

    Also fills ``hit_probability`` of the entries. Random numbers depend on the seed, the particle and the entry's number only.
    """
    entries = np.flatnonzero(table["event"] == ENTRY)
    direct = {(p, m) for p, m in zip(*(table[name][table["direct"] == 1] for name in ("particle", "moon")))}
    made = encounters.select(table, entries)
    places, keep, number = np.zeros((len(entries), 3)), np.ones(len(entries), bool), {}
    for row in range(len(entries)):
        particle, moon = int(made["particle"][row]), int(made["moon"][row])
        number[particle] = number.get(particle, -1) + 1
        body = system.moons[moon]
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, particle, number[particle])))
        place, draws = bplane.resample(made["position"][row], made["velocity"][row], body.radius, body.gm, rng)
        keep[row] = place is not None and (particle, moon) not in direct
        if place is not None:
            places[row], made["draws"][row] = place, draws
    for moon, body in enumerate(system.moons):
        of = made["moon"] == moon
        if not of.any():
            continue
        chance = bplane.hit_probability(body.radius, body.gm, made["distance"][of], made["speed"][of])
        made["hit_probability"][of] = chance
        table["hit_probability"][entries[of]] = chance
        hit = bplane.fall(places[of], made["velocity"][of], body.radius, body.gm)
        # the moon goes on along its orbit meanwhile: Jupiter as seen from the particle turns by that much
        shift = made["jovicentric_position"][of] - made["position"][of]
        motion = made["jovicentric_velocity"][of] - made["velocity"][of]
        turn = np.linalg.norm(motion, axis=1) / np.linalg.norm(shift, axis=1) * hit.flight_time
        moon_place, moon_motion = _turned(shift, turn), _turned(motion, turn)
        made["position"][of], made["velocity"][of] = hit.position, hit.velocity
        made["jovicentric_position"][of] = moon_place + hit.position
        made["jovicentric_velocity"][of] = moon_motion + hit.velocity
        made["time"][of] += hit.flight_time
    flags = made["retrograde"].copy(), made["periapsis"].copy()
    made["event"][:], made["direct"][:] = COLLISION, 0
    encounters.derive(made)
    made["retrograde"][:], made["periapsis"][:] = flags  # those of the entry: what decides which side of the moon is hit
    return encounters.select(made, keep)


def _turned(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1], vectors[:, 2]], axis=1)
