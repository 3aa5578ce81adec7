"""The vibration of grains (``dem.laws.shaken_friction``): how it dies away, the pressure on each grain, and the
friction that it leaves.

Pressures are found every ``EVERY`` steps, a third of a shortest contact time with 30 steps in it, and held in between;
the speed of a vibration is exact at any time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from dem.contact.columns import MASS, OFFSET, RADIUS, STIFFNESS
from dem.contact.contact import Bodies, numbers_of
from dem.contact.walls import distance_of
from dem.laws import dispatch as chosen
from dem.laws import shaken_friction
from matter.compilation.jit import kernel
from matter.errors import InputError
from matter.particles import Particles

EVERY = 10
"""Steps between two looks at the pressures."""
ATTRIBUTE = "block_model"
"""Attribute of a start: ``{material: {"decay_time_s": ..., "sound_m_s": ...}}`` of those that shake."""


class Vibration(NamedTuple):
    """``decay_time`` [s] and speed of ``sound`` [m/s] of each material, (m,); of those that do not shake infinite and
    0."""

    decay_time: np.ndarray
    sound: np.ndarray


def of_start(start: Particles) -> Vibration | None:
    """The vibration that grains begin with; None where nothing shakes. Raises ``InputError`` for grains that shake of
    materials whose decay nobody gives."""
    if "vibration" not in start or not np.any(start.vibration > 0.0):
        return None
    given: Mapping[str, Any] = start.attributes.get(ATTRIBUTE, {})
    names = list(start.attributes["materials"])
    shaking = {names[k] for k in np.unique(start.material[start.vibration > 0.0])}
    if lacking := sorted(shaking - set(given)):
        raise InputError(
            f"the grains shake, but the start's attribute {ATTRIBUTE!r} has no decay time of {', '.join(lacking)}"
        )
    values = [given.get(name, {"decay_time_s": math.inf, "sound_m_s": 0.0}) for name in names]
    return Vibration(*(np.array([float(row[key]) for row in values]) for key in ("decay_time_s", "sound_m_s")))


def speeds(vibration: np.ndarray, material: np.ndarray, elapsed: float, how: Vibration) -> np.ndarray:
    """Speeds of the vibration [m/s] of grains, (n,), a time ``elapsed`` [s] after they were ``vibration``."""
    return np.asarray(vibration * np.exp(-elapsed / how.decay_time[material]))


@kernel
def pressures(X, V, kind, density, active, listed, boundaries, scheme):
    """P (n,) [Pa] of each grain by the normal springs of its contacts (``dem.laws.shaken_friction``)."""
    first, col, hist, table = listed
    rows, walled, wall_tables, wall_history = boundaries
    offset, pressure = scheme.offset != 0, np.zeros(len(X))
    for e in range(len(first)):
        i, j = first[e], col[e]
        ri, rj = X[i, RADIUS], X[j, RADIUS]
        x, y, z = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
        touch = ri + rj
        if offset:
            touch += hist[e, OFFSET]
        d2 = x * x + y * y + z * z
        if d2 >= touch * touch:
            continue
        d = math.sqrt(d2)
        softer = min(V[i, STIFFNESS], V[j, STIFFNESS])
        bodies = Bodies(softer, 0.0, ri * rj / (ri + rj), ri, rj, 0.0)
        row = numbers_of(table, np.int64(kind[i]), np.int64(kind[j])).normal
        k = chosen.stiffness(scheme.normal, row, touch - d, bodies)
        force = chosen.elastic_force(scheme.normal, touch - d, k)
        arm = 0.5 * (d + (ri * ri - rj * rj) / d)
        pressure[i] += force * arm
        pressure[j] += force * (d - arm)
    for i in range(active):
        for w in range(rows.shape[0] if walled[i] != 0 else 0):
            d, _, _, _ = distance_of(rows, w, X[i, 0], X[i, 1], X[i, 2])
            touch = X[i, RADIUS]
            if offset:
                touch += wall_history[i, w, OFFSET]
            if d < touch:
                bodies = Bodies(V[i, STIFFNESS], 0.0, X[i, RADIUS], X[i, RADIUS], 0.0, 0.0)
                row = numbers_of(wall_tables, np.int64(w), np.int64(kind[i])).normal
                k = chosen.stiffness(scheme.normal, row, touch - d, bodies)
                pressure[i] += chosen.elastic_force(scheme.normal, touch - d, k) * d
        pressure[i] *= density[i] / (3.0 * V[i, MASS])
    return pressure


@kernel
def lower(elapsed, material, density, pressure, how, vibration, bearing):
    """``vibration`` (n,) [m/s] after the time ``elapsed`` [s], and f (n,) under each ``pressure`` [Pa]; in place."""
    decay_time, sound = how
    for i in range(len(vibration)):
        m = material[i]
        vibration[i] = shaken_friction.speed_after(vibration[i], elapsed, decay_time[m])
        bearing[i] = shaken_friction.bearing_fraction(vibration[i], pressure[i], density[i], sound[m])
