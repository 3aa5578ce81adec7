"""The massive bodies: data files, Hill radii, and where they stand at the start.

A body is one TOML file in ``bodies/`` (values with unit and source). Frame of the whole room: the barycentre of
Jupiter and its moons is the origin, the axes do not rotate, Jupiter's orbit and those of its moons lie in the plane z
= 0 (Winter 2017, section 2.2.1: all inclinations neglected), +x is the direction of Jupiter's perihelion.
"""

from __future__ import annotations

import difflib
import functools
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from matter.case import quantity
from matter.errors import InputError

SOURCES = ("Winter2017",)

FOLDER = Path(__file__).parent.parent / "bodies"
GALILEAN = ("io", "europa", "ganymede", "callisto")


@dataclass(frozen=True)
class Body:
    """One massive body: ``gm`` [m^3/s^2], ``radius`` [m], orbit about ``around`` with ``semi_major_axis`` [m] and
    ``eccentricity``."""

    name: str
    title: str
    gm: float
    radius: float
    around: str | None = None
    semi_major_axis: float = 0.0
    eccentricity: float = 0.0


def names() -> list[str]:
    """Names of all bodies that ship with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


@functools.cache
def load(name: str) -> Body:
    """The body ``name``; raises ``InputError`` with the nearest known name for an unknown one."""
    if name not in names():
        near = difflib.get_close_matches(name.lower(), names(), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"unknown body {name!r}{hint} (known: {', '.join(names())})")
    content = tomllib.loads((FOLDER / f"{name}.toml").read_text())
    physical, orbit = content["physical"], content.get("orbit", {})
    return Body(
        name=name,
        title=content["title"],
        gm=quantity.parse(physical["gm"], "m^3/s^2"),
        radius=quantity.parse(physical["radius"], "m"),
        around=content.get("around"),
        semi_major_axis=quantity.parse(orbit["semi_major_axis"], "m") if orbit else 0.0,
        eccentricity=quantity.parse(orbit["eccentricity"]) if orbit else 0.0,
    )


def hill_radius(body: Body, eccentric: bool = False) -> float:
    """Hill radius a (m/3M)^(1/3) [m] about the body's primary; ``eccentric`` multiplies by 1 - e (Winter 2017, eq.
    7)."""
    primary = load(body.around)
    shrink = 1.0 - body.eccentricity if eccentric else 1.0
    return body.semi_major_axis * shrink * (body.gm / (3.0 * primary.gm)) ** (1.0 / 3.0)


@dataclass(frozen=True)
class System:
    """Sun, planet and moons (Winter 2017, section 2.2.1); ``moons`` in order from the planet outwards."""

    sun: Body
    planet: Body
    moons: tuple[Body, ...]

    @property
    def start_radius(self) -> float:
        """Hill radius of the planet as in Winter 2017, eq. 7 [m]: where test particles start."""
        return hill_radius(self.planet, eccentric=True)

    @property
    def hill_radii(self) -> np.ndarray:
        """Hill radius of each moon [m]."""
        return np.array([hill_radius(moon) for moon in self.moons])

    @property
    def gm(self) -> np.ndarray:
        """GM of Sun, planet, moons [m^3/s^2]."""
        return np.array([self.sun.gm, self.planet.gm, *(moon.gm for moon in self.moons)])

    def moon(self, name: str) -> int:
        """Index of the moon ``name``; raises ``InputError`` when it is none of this system's."""
        for index, moon in enumerate(self.moons):
            if moon.name == name:
                return index
        raise InputError(
            f"{load(name).title} is not a moon of this system (its moons: {', '.join(m.name for m in self.moons)})"
        )


def jovian(target: str, others: tuple[str, ...] = ("ganymede", "callisto")) -> System:
    """Sun, Jupiter and the moons ``others`` and ``target``; raises ``InputError`` when the target is not a moon of
    Jupiter."""
    if load(target).around != "jupiter":
        raise InputError(f"{target!r} is not a moon of Jupiter: take one of {', '.join(GALILEAN)}")
    moons = sorted({*others, target}, key=lambda name: load(name).semi_major_axis)
    return System(load("sun"), load("jupiter"), tuple(load(name) for name in moons))


def eccentric_anomaly(mean_anomaly: float, eccentricity: float) -> float:
    """Solve Kepler's equation M = E - e sin E for E [rad] (Newton; e < 0.9)."""
    anomaly = mean_anomaly
    for _ in range(50):
        change = (anomaly - eccentricity * math.sin(anomaly) - mean_anomaly) / (1.0 - eccentricity * math.cos(anomaly))
        anomaly -= change
        if abs(change) < 1e-15:
            break
    return anomaly


@dataclass(frozen=True)
class Start:
    """Massive bodies at t = 0: ``position`` and ``velocity`` (2 + moons, 3) [m, m/s] of Sun, planet, moons in the
    frame of the room."""

    position: np.ndarray
    velocity: np.ndarray

    @property
    def sun_direction(self) -> np.ndarray:
        """Unit vector Sun -> planetary system."""
        return -self.position[0] / np.linalg.norm(self.position[0])


def start(system: System, mean_anomaly: float, longitudes: np.ndarray) -> Start:
    """Place the bodies: the planetary system on its ellipse at ``mean_anomaly`` [rad], moons on circles at
    ``longitudes`` [rad].

    The barycentre of planet and moons moves on the two-body ellipse about the Sun; each moon moves on a circle about
    the planet with v^2 = G (m_planet + m_moon) / a.
    """
    gm, planet = system.gm, system.planet
    mu, a, e = gm.sum(), planet.semi_major_axis, planet.eccentricity
    anomaly = eccentric_anomaly(mean_anomaly, e)
    b = math.sqrt(1.0 - e * e)
    rate = math.sqrt(mu / a**3) / (1.0 - e * math.cos(anomaly))
    heliocentric = a * np.array([math.cos(anomaly) - e, b * math.sin(anomaly), 0.0])
    motion = a * rate * np.array([-math.sin(anomaly), b * math.cos(anomaly), 0.0])

    position, velocity = np.zeros((len(gm), 3)), np.zeros((len(gm), 3))
    for index, (moon, longitude) in enumerate(zip(system.moons, longitudes), start=2):
        speed = math.sqrt((planet.gm + moon.gm) / moon.semi_major_axis)
        position[index] = moon.semi_major_axis * np.array([math.cos(longitude), math.sin(longitude), 0.0])
        velocity[index] = speed * np.array([-math.sin(longitude), math.cos(longitude), 0.0])
    weights = gm[1:] / gm[1:].sum()
    position[1:] -= weights @ position[1:]
    velocity[1:] -= weights @ velocity[1:]
    position[0], velocity[0] = -heliocentric, -motion
    return Start(position, velocity)
