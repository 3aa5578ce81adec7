"""Starts for control runs: the bed as it would go on without an impact.

``at_rest``: carved by the source's surface, with the masses that the transfer gave, and nothing moves: what happens
then is slope failure alone. ``uncarved``: the settled bed without its headroom, carved at the datum, with its own
masses: nothing should happen.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains import domain
from handoff.domains.whole_body import WholeBody
from handoff.transfer import carve
from handoff.transfer.handed import Handoff
from matter.errors import InputError
from matter.geometry.alpha_shape import alpha_shape
from matter.particles import Particles

Kind = Literal["none", "at_rest", "uncarved"]
_SKIN = 1.5


def start(kind: Kind, handoff: Handoff, bed: Particles) -> Particles:
    """The grains of a control run, at the time of the ``handoff``; at rest against the ground. Raises ``InputError``
    when no grain lies below the datum."""
    if kind == "at_rest":
        count = int(handoff.carving.stays.sum())
        taken = np.arange(len(handoff.start)) < count
        if "block" in handoff.start:
            taken |= handoff.start.block >= 0
        grains = handoff.start.select(taken)
        grains.tables = dict(handoff.start.tables)
    else:
        region = handoff.region
        below = region.frame.height(bed.position) <= 0.0
        if not below.any():
            raise InputError("no grain of the bed lies below the datum: a control run has nothing to follow")
        grains = bed.select(below)
        grains.tables = carve.surviving_tables(bed, below)
        grains.attributes["time"] = handoff.start.attributes["time"]
    still = np.zeros((len(grains), 3))
    grains["velocity"] = still - handoff.region.flow(grains.position, still)
    grains["angular_velocity"] = still + (handoff.region.omega if isinstance(handoff.region, WholeBody) else 0.0)
    grains["headroom"] = np.zeros(len(grains), dtype=np.int8)
    grains["state"] = np.zeros(len(grains), dtype=np.int8)
    grains.attributes |= {"stage": "handoff", "control": kind, "bed_grains": int(bed.identity.max()) + 1}
    return grains


def moved(before: Particles, after: Particles) -> np.ndarray:
    """(n,) distance [m] that each grain of ``before`` has moved; NaN for those that ``after`` no longer holds."""
    order = np.argsort(after.identity)
    index = np.minimum(np.searchsorted(after.identity, before.identity, sorter=order), len(order) - 1)
    row = order[index]
    way = np.linalg.norm(after.position[row] - before.position, axis=1)
    return np.where(after.identity[row] == before.identity, way, np.nan)


def depth_below_surface(grains: Particles) -> np.ndarray:
    """(n,) distance [m] from each grain to the free surface of the heap, by its nearest point, so that a grain behind
    a steep wall is not deep.

    The surface is the topmost grain in each cell of two mean grain radii across on the datum, and between cells of
    different height the wall down to the lower one. Of a whole body it is that of the alpha-shape of its grains.
    """
    if grains.attributes.get("frame") == "solid":
        spacing = np.cbrt(grains.mass / grains.density)
        shape = alpha_shape(grains.position, spacing, _SKIN).only(1)
        return cKDTree(shape.points[np.unique(shape.triangles)]).query(grains.position)[0]
    region = domain.read(grains.attributes)
    frame, size = region.frame, 2.0 * float(grains.radius.mean())
    height, up = frame.height(grains.position), frame.up(grains.position)
    foot = (grains.position - height[:, None] * up)[:, :2]
    low = foot.min(axis=0)
    cell = np.floor((foot - low) / size).astype(np.int64) + 1
    top = np.full(tuple(cell.max(axis=0) + 2), -np.inf)
    np.maximum.at(top, (cell[:, 0], cell[:, 1]), height)
    sides = np.array([np.roll(top, shift, axis=(0, 1)) for shift in ((1, 0), (-1, 0), (0, 1), (0, -1))])
    lowest = np.min(np.where(np.isfinite(sides), sides, np.inf), axis=0)
    rows, columns = np.nonzero(np.isfinite(top))
    high, bottom = top[rows, columns], np.minimum(lowest[rows, columns], top[rows, columns])
    steps = np.floor((high - bottom) / size).astype(np.int64) + 1
    which = np.repeat(np.arange(len(rows)), steps)
    level = high[which] - size * (np.arange(len(which)) - np.repeat(np.cumsum(steps) - steps, steps))
    flat = low + (np.column_stack([rows, columns])[which] - 0.5) * size
    if isinstance(region, domain.Cone):
        base = np.column_stack([flat, np.sqrt(np.maximum(region.datum**2 - np.einsum("ij,ij->i", flat, flat), 0.0))])
    else:
        base = np.column_stack([flat, np.full(len(flat), region.datum)])
    return cKDTree(base + level[:, None] * frame.up(base)).query(grains.position)[0]
