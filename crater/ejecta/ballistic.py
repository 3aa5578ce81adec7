"""The ballistic profile: every particle of the snapshot that was handed over flies freely, and the mass is balanced
ring by ring.

A particle at the height z with the velocity v under gravity g comes down on the level of the ground, z = 0, after

    t = (v_z + sqrt(v_z^2 + 2 g z)) / g,    at x + v_xy t;

below the ground only what rises and gets as far as z = 0 (v_z^2 >= 2 g |z|) flies, the rest stays where it is. What is
faster than the escape speed, where there is one, leaves. With the mass before (at the positions of the particles
before the impact) and after in a ring of area A, in ground of density rho,

    height = (mass after - mass before) / (rho A)

which leaves out compaction. No collision, no friction, no collapse: where the flow is nearly free, as on an asteroid,
its diameter is that of the crater, and what follows cannot change it by much; its depth is that of the matter thrown
out, whether its slopes stand or not. An independent check of what is handed over: matter taken for ejecta that is
none, or grains that gain energy, show as a diameter that differs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from crater.ground.radial_profile import Profile
from crater.measures.measure import Quantity
from crater.measures.profile_measures import measure_profile
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.particles import Particles

AGREE = 0.1
"""Difference of the two diameters, over the ballistic one, beyond which the page says so."""
RINGS = 40
SECTORS = 12
_POINTS = 16
"""A particle's mass is spread over so many points of a disc as wide as it is: the same before and after, so that what
has not moved leaves no trace."""


@dataclass(frozen=True)
class Ballistic:
    """``profile`` of the balance, its ``measures``, the mass that leaves [kg], and the snapshot [s] that flew."""

    profile: Profile
    measures: dict[str, Quantity]
    left: float
    time: float
    file: str

    def as_dict(self) -> dict[str, Any]:
        """For ``measures.json``."""
        named = {name: quantity.as_dict() for name, quantity in self.measures.items()}
        return {**named, "handed_over_s": self.time, "snapshot": self.file, "mass_left_kg": self.left}


def landing(position: np.ndarray, velocity: np.ndarray, gravity: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) [m] at which particles come down on z = 0, or where they stay, and which of them fly (n,)."""
    z, rise = position[:, 2], velocity[:, 2]
    square = rise**2 + 2.0 * gravity * z
    flies = (z >= 0.0) | ((rise > 0.0) & (square >= 0.0))
    time = np.where(flies, (rise + np.sqrt(np.maximum(square, 0.0))) / gravity, 0.0)
    return position[:, :2] + velocity[:, :2] * time[:, None], flies


def _disc() -> np.ndarray:
    number = np.arange(_POINTS) + 0.5
    radius, azimuth = np.sqrt(number / _POINTS), np.pi * (1.0 + np.sqrt(5.0)) * number
    return np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth)])


def _cells(position: np.ndarray, mass: np.ndarray, width: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mass [kg] in rings and sectors (rings, sectors) about the origin; every particle is a disc of radius
    ``width``."""
    total = np.zeros((len(edges) - 1, SECTORS))
    for offset in _disc():
        points = position + width[:, None] * offset
        ring = np.searchsorted(edges, np.hypot(points[:, 0], points[:, 1]), side="right") - 1
        sector = (
            np.floor((np.arctan2(points[:, 1], points[:, 0]) / (2.0 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
        )
        inside = (ring >= 0) & (ring < len(edges) - 1)
        np.add.at(total, (ring[inside], sector[inside]), mass[inside] / _POINTS)
    return total


def profile_of(
    particles: Particles, gravity: float, density: float, reach: float, escape_speed: float = 0.0
) -> tuple[Profile, float]:
    """The profile out to ``reach`` [m] about the impact point (the origin) in ground of ``density`` [kg/m^3], and the
    mass that leaves [kg].

    Raises ``InputError`` without ``initial_position``, velocity, mass and density.
    """
    particles.need("position", "initial_position", "velocity", "mass", "density")
    target = particles.layer >= 0 if "layer" in particles else np.ones(len(particles), dtype=bool)
    mass = particles.mass[target]
    width = np.cbrt(3.0 * mass / (4.0 * np.pi * density))
    velocity = particles.velocity[target]
    position, flies = landing(particles.position[target], velocity, gravity)
    leaves = (
        flies & (np.linalg.norm(velocity, axis=1) > escape_speed)
        if escape_speed > 0.0
        else np.zeros(len(mass), dtype=bool)
    )
    edges = np.linspace(0.0, reach, RINGS + 1)
    area = np.pi * np.diff(edges**2)
    after = _cells(position[~leaves], mass[~leaves], width[~leaves], edges)
    before = _cells(particles.initial_position[target][:, :2], mass, width, edges)
    height = (after - before) * SECTORS / (density * area[:, None])
    low, high = np.percentile(height, (16.0, 84.0), axis=1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    count = np.full(RINGS, SECTORS)
    return Profile(
        middle, height.mean(axis=1), low, high, count, {"of": "ballistic: free flight of the snapshot handed over"}
    ), float(mass[leaves].sum())


def of_run(inputs: Path, gravity: float, density: float, reach: float, escape_speed: float) -> Ballistic | None:
    """The ballistic profile of a run's handed-over snapshot (the last one where nothing was handed over), None without
    a shock stage.

    Raises ``InputError`` when the snapshot lacks a field.
    """
    paths = snapshot.series(inputs / "2_sph")
    if not paths:
        return None
    chosen, record = paths[-1], inputs / "4_handoff" / "handoff.json"
    if record.is_file():
        wanted = float(archive.read_json(record)["time_s"])
        chosen = min(paths, key=lambda path: abs(float(snapshot.attributes(path).get("time", 0.0)) - wanted))
    particles = snapshot.read(chosen)
    profile, left = profile_of(particles, gravity, density, reach, escape_speed)
    if not np.any(profile.height < 0.0):
        raise InputError("free flight takes nothing away from the impact point")
    return Ballistic(
        profile,
        measure_profile(profile),
        left,
        float(particles.attributes.get("time", np.nan)),
        f"2_sph/{chosen.name}",
    )


def words(ballistic: Ballistic, diameter: float | None, of: str) -> str:
    """A sentence: how the diameter of the crater ``of`` the grains compares with the ballistic one."""
    own = ballistic.measures.get("diameter_apparent_m")
    if own is None or own.value is None or diameter is None or not np.isfinite(diameter):
        return ""
    ratio = diameter / own.value
    near = "within" if abs(ratio - 1.0) <= AGREE else "NOT within"
    return f"The apparent diameter of {of} is {ratio:.2f} of the ballistic one, {near} {AGREE:.0%} of it."
