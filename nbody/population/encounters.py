"""The table of encounters: what is recorded at each event (Winter 2017, section 2.3.1), and how it is stored.

Four kinds of events: 1 entry into a moon's Hill sphere, 2 collision, 3 closest approach, 4 exit. Collisions are of two
kinds: ``direct`` ones happened on the way (normal mode); the others are constructed from an entry (moon mode).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from matter.files import archive

ENTRY, COLLISION, APPROACH, EXIT = 1, 2, 3, 4
FLYING, TIMED_OUT, LEFT, HIT_PLANET, HIT_MOON = 0, 1, 2, 3, 4  # how a flight stands, or ended
KINDS = {ENTRY: "entry", COLLISION: "collision", APPROACH: "closest approach", EXIT: "exit"}


class Column(NamedTuple):
    """Trailing shape, dtype, unit and meaning of one column."""

    shape: tuple[int, ...]
    dtype: str
    unit: str
    meaning: str


TABLE: dict[str, Column] = {
    # the ten quantities of the thesis
    "moon": Column((), "int16", "1", "index into the file's attribute 'moons'"),
    "event": Column((), "int16", "1", "1 entry into the Hill sphere, 2 collision, 3 closest approach, 4 exit"),
    "retrograde": Column(
        (), "int8", "1", "1 if the particle moves about Jupiter against the moons (sign of its angular momentum)"
    ),
    "periapsis": Column((), "int8", "1", "1 if the particle has passed its smallest distance from Jupiter (r.v >= 0)"),
    "time": Column((), "float64", "s", "time since the start"),
    "speed": Column((), "float64", "m/s", "relative speed of particle and moon"),
    "angle": Column(
        (),
        "float64",
        "rad",
        "angle between -velocity and the position from the moon's centre; from the vertical for collisions",
    ),
    "distance": Column((), "float64", "m", "distance from the moon's centre"),
    "z": Column((), "float64", "m", "height of the particle above the orbital plane, which is the moon's equator"),
    "step": Column((), "float64", "s", "step size of the integration at the event"),
    # further ones
    "particle": Column((), "int64", "1", "index of the particle, from which with the seed it can be drawn again"),
    "weight": Column((), "float64", "1", "statistical weight of the event"),
    "direct": Column(
        (), "int8", "1", "1 for a collision that happened on the way, 0 for one constructed from an entry"
    ),
    "draws": Column((), "int64", "1", "draws that a constructed collision took (moon mode), else 0"),
    "hit_probability": Column(
        (), "float64", "1", "chance that an entry on this velocity hits the surface (gravitational focusing)"
    ),
    "position": Column((3,), "float64", "m", "particle minus moon"),
    "velocity": Column((3,), "float64", "m/s", "particle minus moon"),
    "jovicentric_position": Column((3,), "float64", "m", "particle minus Jupiter"),
    "jovicentric_velocity": Column((3,), "float64", "m/s", "particle minus Jupiter"),
    "leading": Column(
        (),
        "float64",
        "1",
        "cosine of the angle between the position on the moon and its direction of motion (+1 apex)",
    ),
    "longitude": Column(
        (),
        "float64",
        "rad",
        "east longitude from the meridian that faces Jupiter, synchronous rotation; the apex is at -pi/2",
    ),
}
# columns of the kernels' rows: states relative to moon and planet (x, v) from TO_MOON and TO_PLANET on, then the
# length of the step
PARTICLE, MOON, KIND, TIME, TO_MOON, TO_PLANET, STEP, RAW = 0, 1, 2, 3, 4, 10, 16, 17


def empty(count: int = 0) -> dict[str, np.ndarray]:
    """A table of ``count`` rows, all zero."""
    return {name: np.zeros((count, *column.shape), dtype=column.dtype) for name, column in TABLE.items()}


def from_rows(rows: np.ndarray, weight: np.ndarray | float = 1.0) -> dict[str, np.ndarray]:
    """Table of the kernels' rows (n, 17): particle, moon, event, time, particle - moon (x, v), particle - planet (x,
    v), step."""
    table = empty(len(rows))
    table["particle"][:], table["moon"][:], table["event"][:] = rows[:, PARTICLE], rows[:, MOON], rows[:, KIND]
    table["time"][:], table["step"][:], table["weight"][:] = rows[:, TIME], rows[:, STEP], weight
    table["position"][:], table["velocity"][:] = rows[:, TO_MOON : TO_MOON + 3], rows[:, TO_MOON + 3 : TO_PLANET]
    table["jovicentric_position"][:], table["jovicentric_velocity"][:] = (
        rows[:, TO_PLANET : TO_PLANET + 3],
        rows[:, TO_PLANET + 3 : STEP],
    )
    table["direct"][:] = table["event"] == COLLISION
    derive(table)
    return table


def derive(table: dict[str, np.ndarray]) -> None:
    """Fill the columns that follow from the two states: speed, angle, distance, z, flags, position on the moon."""
    x, v = table["position"], table["velocity"]
    planet, motion = table["jovicentric_position"], table["jovicentric_velocity"]
    distance, speed = np.linalg.norm(x, axis=1), np.linalg.norm(v, axis=1)
    table["distance"][:], table["speed"][:], table["z"][:] = distance, speed, x[:, 2]
    safe = np.maximum(distance * speed, 1e-300)
    table["angle"][:] = np.arccos(np.clip(-np.einsum("ij,ij->i", x, v) / safe, -1.0, 1.0))
    table["retrograde"][:] = planet[:, 0] * motion[:, 1] - planet[:, 1] * motion[:, 0] < 0.0
    table["periapsis"][:] = np.einsum("ij,ij->i", planet, motion) >= 0.0
    moon, flight = planet - x, motion - v
    apex = flight / np.maximum(np.linalg.norm(flight, axis=1), 1e-300)[:, None]
    inner = -moon / np.maximum(np.linalg.norm(moon, axis=1), 1e-300)[:, None]
    unit = x / np.maximum(distance, 1e-300)[:, None]
    table["leading"][:] = np.einsum("ij,ij->i", unit, apex)
    # prograde rotation about +z: east of the sub-Jovian meridian is the trailing side
    table["longitude"][:] = np.arctan2(
        np.einsum("ij,ij->i", unit, np.cross([0.0, 0.0, 1.0], inner)), np.einsum("ij,ij->i", unit, inner)
    )


def join(tables: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """One table out of several, in their order."""
    return {name: np.concatenate([table[name] for table in tables]) if tables else empty()[name] for name in TABLE}


def select(table: dict[str, np.ndarray], which: np.ndarray) -> dict[str, np.ndarray]:
    """The rows chosen by a mask or by indices."""
    return {name: column[which] for name, column in table.items()}


def latitude(table: dict[str, np.ndarray]) -> np.ndarray:
    """Latitude of the position on the moon [rad]."""
    return np.arcsin(np.clip(table["z"] / np.maximum(table["distance"], 1e-300), -1.0, 1.0))


def write(path: Path, table: dict[str, np.ndarray], attributes: dict) -> None:
    """Write ``encounters.h5``: one dataset per column with unit and meaning, facts on the census as attributes."""
    archive.write(
        path, {name: (table[name], column.unit, column.meaning) for name, column in TABLE.items()}, attributes
    )


def read(path: Path) -> tuple[dict[str, np.ndarray], dict]:
    """Table and attributes of an ``encounters.h5``; raises ``InputError`` when it is missing or lacks columns."""
    if not Path(path).is_file():
        raise InputError(f"no table of encounters at {path}")
    table, attributes = archive.read(path)
    missing = [name for name in TABLE if name not in table]
    if missing:
        raise InputError(f"{path} is not a table of encounters: it lacks {', '.join(missing)}")
    return table, attributes
