"""The ejecta catalogue: every particle that the shock stage threw out, where it left the ground, when, how fast, what
it is, how strongly it was shocked, and where it ends in free flight (``crater.ejecta.ejecta_flight``).

A particle is thrown out when it first stands higher than ``above`` and rises; from there it is led back to the ground
and on to its fate. What is pushed later by its neighbours is not followed, nor what rises less high: fates hold where
matter flies freely, and matter near the axis that rises as one body (a central uplift) stands in the catalogue as
falling back inside.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from crater.ejecta import ejecta_flight
from crater.ground.datum import Datum
from matter.errors import InputError
from matter.files import archive
from matter.particles import Particles

FIELDS = ("position", "velocity", "mass", "layer")
"""What of each snapshot is read."""
INSIDE, BEYOND, ESCAPES, CIRCLES = "falls back inside", "lands beyond", "escapes", "circles"
STAYS = "not thrown out"


class Catalogue(NamedTuple):
    """One row a particle of ``number`` in the snapshots; positions in the frame of the run. ``position`` (n, 3) [m],
    ``time`` [s] after the first contact, ``velocity`` (n, 3) [m/s], ``speed`` [m/s] and ``angle`` [rad] above the
    horizontal, where it left the ground; ``mass`` [kg], ``layer`` (-1 the projectile), ``fate`` (``flight.FATES``),
    ``landing`` (n, 3) [m] and the time of it [s], NaN where it does not land. Of target and projectile [kg]:
    ``total``, the mass of all particles of the first frame, and ``kept``, that of the last frame's which were not
    thrown out."""

    number: np.ndarray
    position: np.ndarray
    time: np.ndarray
    velocity: np.ndarray
    speed: np.ndarray
    angle: np.ndarray
    mass: np.ndarray
    layer: np.ndarray
    fate: np.ndarray
    landing: np.ndarray
    landing_time: np.ndarray
    total: tuple[float, float]
    kept: tuple[float, float]


def ejecta_catalogue(
    frames: Iterable[Particles], datum: Datum, gravity: float, above: float, escape_speed: float
) -> Catalogue:
    """The catalogue of ``frames`` in the order of time (the same particles in each), with the height ``above`` [m] at
    which they count as flying; ``gravity`` [m/s^2] > 0, ``escape_speed`` [m/s] of flat ground (0: nothing escapes).

    Raises ``InputError`` where a frame lacks a field, or holds other particles than the first.
    """
    seen, total, kept, axes = np.zeros(0, dtype=bool), (0.0, 0.0), (0.0, 0.0), np.asarray(datum.axes)
    parts: list[tuple[np.ndarray, ...]] = []
    for frame in frames:
        frame.need(*FIELDS)
        if not len(seen):
            seen = np.zeros(len(frame), dtype=bool)
            total = _bodies(frame.mass, frame.layer)
        if len(frame) != len(seen):
            raise InputError("the snapshots do not hold the same particles")
        height, up = datum.polar(frame.position)[2], datum.vertical(frame.position, frame.velocity)
        new = ~seen & (height > above) & (up > 0.0)
        seen |= new
        kept = _bodies(frame.mass[~seen], frame.layer[~seen])
        flights = ejecta_flight.flight(
            datum, gravity, escape_speed, datum.local(frame.position[new]), frame.velocity[new] @ axes.T
        )
        now = float(frame.attributes.get("time", np.nan))
        upward = (
            flights.position / np.linalg.norm(flights.position, axis=1)[:, None]
            if datum.is_sphere
            else np.array([0, 0, 1.0])
        )
        speed = np.linalg.norm(flights.velocity, axis=1)
        rise = (flights.velocity * upward).sum(axis=1)
        parts.append(
            (
                np.flatnonzero(new), datum.outside(flights.position), now - flights.since, flights.velocity @ axes,
                speed, np.arcsin(np.clip(rise / np.maximum(speed, 1e-300), -1.0, 1.0)), frame.mass[new],
                frame.layer[new], flights.fate, datum.outside(flights.landing), now + flights.until,
            )
        )  # fmt: skip
    return Catalogue._make([*(np.concatenate(column) for column in zip(*parts)), total, kept])


def _bodies(mass: np.ndarray, layer: np.ndarray) -> tuple[float, float]:
    return float(mass[layer >= 0].sum()), float(mass[layer < 0].sum())


def distance(catalogue: Catalogue, crater: Datum) -> np.ndarray:
    """Distance of the landing from the axis of the ``crater`` along its datum [m]; NaN where it does not land."""
    return crater.polar(catalogue.landing)[0]


def where(catalogue: Catalogue, crater: Datum, radius: float) -> dict[str, np.ndarray]:
    """Which rows have which fate, what falls back inside ``radius`` [m] of the crater's axis apart from what lands
    beyond."""
    falls, far = catalogue.fate == ejecta_flight.FALLS, distance(catalogue, crater) > radius
    return {
        INSIDE: falls & ~far,
        BEYOND: falls & far,
        ESCAPES: catalogue.fate == ejecta_flight.ESCAPES,
        CIRCLES: catalogue.fate == ejecta_flight.CIRCLES,
    }


def masses(catalogue: Catalogue, crater: Datum, radius: float, last: Particles) -> dict[str, Any]:
    """Mass [kg] of target and projectile by fate, with what was not thrown out; ``closure`` is how much their sum
    misses the mass of all particles at the start, over that.

    ``landed``: how many should have come down before the ``last`` snapshot, and how far from the axis they then are
    over where free flight says (median; None of none): matter that is pushed on, or slides, is further.
    """
    found: dict[str, Any] = {"crater_radius_m": radius, "particles": len(catalogue.mass)}
    fates, bodies = where(catalogue, crater, radius), (catalogue.layer >= 0, catalogue.layer < 0)
    for body, mine, kept in zip(("target", "projectile"), bodies, catalogue.kept):
        by_fate = {name: float(catalogue.mass[mine & rows].sum()) for name, rows in fates.items()}
        found[f"{body}_kg"] = {**by_fate, STAYS: kept}
    summed = sum(sum(found[f"{body}_kg"].values()) for body in ("target", "projectile"))
    found["closure"] = abs(summed - sum(catalogue.total)) / sum(catalogue.total)
    down = catalogue.landing_time < float(last.attributes.get("time", np.nan))
    now, foretold = crater.polar(last.position[catalogue.number[down]])[0], distance(catalogue, crater)[down]
    ratio = float(np.median(now / np.maximum(foretold, 1e-300))) if down.any() else None
    return {**found, "landed": {"particles": int(down.sum()), "distance_over_free_flight": ratio}}


def write(
    catalogue: Catalogue,
    last: Particles,
    datum: Datum,
    gravity: float,
    path: Path,
    more: Mapping[str, Any] | None = None,
    facts: Mapping[str, Any] | None = None,
) -> None:
    """Write the catalogue as HDF5; what the particles are and how strongly they were shocked is read from the ``last``
    snapshot. The file also says on what ground they were led back: ``datum``, and ``gravity`` [m/s^2] there.
    ``more`` columns and ``facts`` are written as they are."""
    arrays = {
        "number": (catalogue.number, "1", "number of the particle in the snapshots"),
        "place": (catalogue.position, "m", "where it left the ground"),
        "time": (catalogue.time, "s", "when it left the ground, after the first contact"),
        "velocity": (catalogue.velocity, "m/s", "its velocity there"),
        "speed": (catalogue.speed, "m/s", "its speed there"),
        "angle": (catalogue.angle, "rad", "its angle above the horizontal there"),
        "mass": (catalogue.mass, "kg", "mass"),
        "layer": (catalogue.layer, "1", "layer of the target, counted from the centre; -1 is the projectile"),
        "fate": (catalogue.fate, "1", "index into the file's attribute 'fates'"),
        "landing": (catalogue.landing, "m", "where it lands in free flight; NaN where it does not"),
        "landing_time": (catalogue.landing_time, "s", "when it lands; NaN where it does not"),
    }
    known = {
        "material": ("1", "index into the file's attribute 'materials'"),
        "peak_pressure": ("Pa", "largest pressure in the shock stage"),
        "initial_position": ("m", "position at the start of the impact"),
    }
    arrays |= {name: (last[name][catalogue.number], *words) for name, words in known.items() if name in last}
    arrays |= more or {}
    materials = [str(name) for name in last.attributes.get("materials", ())]
    ground = {
        "frame": datum.kind,
        "centre_m": np.asarray(datum.centre),
        "axes": np.asarray(datum.axes),
        "gravity_m_s2": gravity,
        **({"radius_m": datum.radius} if datum.is_sphere else {}),
    }
    archive.write(
        path, arrays, {"fates": list(ejecta_flight.FATES), "materials": materials, **ground, **(facts or {})}
    )
