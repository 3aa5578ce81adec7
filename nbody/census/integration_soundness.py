"""How well the integration keeps what theory says is kept.

Circular restricted problem: with a circular planet and massless moons the Jacobi constant of every particle is exact,

    C = v^2/2 - GM_p/r - GM_s (1/|s - x| - 1/|s| - s.x/|s|^3) - n (x cross v)_z,   n^2 = G (M_s + M_p) / a^3,

in the frame of the planet (the Sun's pull on the frame included). Its change, over GM_p / a_moon, is the error
reported here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nbody.integrators import fast
from nbody.masses.state_vector import POSITION, VELOCITY
from nbody.masses.system import System
from nbody.population import conditions
from nbody.population.conditions import Population


def restricted(system: System) -> System:
    """The same bodies with a circular planet and massless moons."""
    planet = replace(system.planet, eccentricity=0.0)
    return replace(system, planet=planet, moons=tuple(replace(moon, gm=0.0) for moon in system.moons))


def jacobi(system: System, x: np.ndarray, v: np.ndarray, sun: np.ndarray) -> np.ndarray:
    """Jacobi constant [m^2/s^2] of states (n, 3) relative to the planet, Sun at ``sun`` (n, 3)."""
    s = np.linalg.norm(sun, axis=1)
    rate = np.sqrt((system.sun.gm + system.planet.gm) / system.planet.semi_major_axis**3)
    tide = 1.0 / np.linalg.norm(sun - x, axis=1) - 1.0 / s - np.einsum("ij,ij->i", sun, x) / s**3
    momentum = x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]
    kinetic = 0.5 * np.einsum("ij,ij->i", v, v)
    return kinetic - system.planet.gm / np.linalg.norm(x, axis=1) - system.sun.gm * tide - rate * momentum


def jacobi_drift(
    system: System, population: Population, seed: int, count: int = 128, tolerance: float = fast.TOLERANCE
) -> dict[str, float]:
    """Change of the Jacobi constant of ``count`` particles over their flights: median and maximum, over GM_p / a of
    the outermost moon."""
    simple = restricted(system)
    batch = conditions.batch(simple, population, seed, 0).part(0, count)
    # radii are kept, so that particles stop at the planet; the moons' Hill spheres have shrunk to nothing
    flights = fast.run(simple, batch, population.duration, tolerance)
    orbits = flights.ephemeris
    before = jacobi(simple, batch.state[:, POSITION], batch.state[:, VELOCITY], orbits.state(0, np.zeros(count))[0])
    t = flights.finals[:, 0]
    end = flights.finals[:, 1:]
    after = jacobi(simple, end[:, POSITION], end[:, VELOCITY], orbits.state(0, t)[0])
    drift = np.abs(after - before) / (system.planet.gm / max(moon.semi_major_axis for moon in system.moons))
    return {
        "median": float(np.median(drift)),
        "maximum": float(drift.max()),
        "particles": count,
        "tolerance": tolerance,
    }
