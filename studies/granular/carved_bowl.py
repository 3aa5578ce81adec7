"""A bowl of settled grains with a steep cavity carved into it, let go: how a packing holds its slopes, without any
impact.

The cavity is a paraboloid about the axis, depth (1 - (s/S)^2) below the datum within the distance S; its rim slope is
2 depth / S. Grains whose centres lie in it and the headroom are taken away, the others keep their contacts. What is
measured is the profile (mean top of the grains in rings) and the steepest slope over a third of S.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dem.beds import bed_walls
from dem.contact.gravity import Field
from dem.contact.settings import Contact
from dem.grains.assembly import Assembly
from matter.cadence import Cadence
from matter.errors import InputError
from matter.files import checkpoint
from matter.geometry.ground_region import Upright
from matter.particles import Particles
from matter.progress import Progress, stop_here


class Relaxed(NamedTuple):
    """Rings [m], heights [m] at the start and the end; steepest slope [deg] at both; depth on the axis [m];
    mass-weighted mean move over r; time [s]."""

    ring: list[float]
    before: list[float]
    after: list[float]
    slope_before_deg: float
    slope_deg: float
    depth_m: float
    moved_radii: float
    time_s: float
    still: bool


def carved(bed: Particles, width: float, depth: float) -> Particles:
    """The bed without its headroom and the grains of the cavity of radius ``width`` S and ``depth`` [m]; contacts of
    the others are kept."""
    if bed.attributes.get("frame") != "plane":
        raise InputError("a cavity of this kind is carved into flat ground: the bed's frame is not 'plane'")
    across = np.hypot(bed.position[:, 0], bed.position[:, 1])
    surface = np.where(across < width, -depth * (1.0 - (across / width) ** 2), 0.0)
    stays = (bed.headroom == 0) & (bed.position[:, 2] < surface)
    left = bed.select(stays)
    left.tables.update(bed.tables)  # contacts of grains that are gone are dropped where the tables are read
    return left


def profile(grains: Particles, width: float, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles of rings of ``width`` [m] up to ``reach`` and the mean over cells of that size of the highest top in
    them; nan where a ring is empty."""
    x, top = grains.position, grains.position[:, 2] + grains.radius
    size = width
    cells: dict[tuple[int, int], float] = {}
    for key, z in zip(map(tuple, np.floor(x[:, :2] / size).astype(int)), top):
        cells[key] = max(cells.get(key, -np.inf), z)
    centre = size * (np.array(list(cells)) + 0.5)
    ring = (np.hypot(centre[:, 0], centre[:, 1]) / width).astype(int)
    count = int(reach / width)
    number = np.bincount(ring, minlength=count)[:count]
    total = np.bincount(ring, np.array(list(cells.values())), minlength=count)[:count]
    return width * (np.arange(count) + 0.5), np.where(number > 0, total / np.maximum(number, 1), np.nan)


def steepest(ring: np.ndarray, height: np.ndarray, over: float) -> float:
    """Largest slope [deg] of a straight line over the distance ``over`` [m] along the profile."""
    width = max(3, round(over / (ring[1] - ring[0])))
    slopes = [
        np.polyfit(ring[k : k + width], height[k : k + width], 1)[0]
        for k in range(len(ring) - width + 1)
        if np.isfinite(height[k : k + width]).all()
    ]
    return math.degrees(math.atan(max(slopes)))


def relax(
    bed: Particles, contact: Contact, g: float, width: float, depth: float, longest: float = 60.0, threads: int = 1,
    out: Path | None = None,
) -> Relaxed:  # fmt: skip
    """Carve and step until the rms speed is below 0.002 sqrt(g r), at most ``longest`` sqrt(r/g).

    With a folder ``out`` it goes on from the checkpoint there.
    """
    box = Upright.of_attribute(bed.attributes["domain"])
    start = carved(bed, width, depth)
    run = Assembly(start, contact, bed_walls.walls(box), Field.constant((0.0, 0.0, -g)), threads=threads)
    saved = checkpoint.newest(out) if out else None
    if saved is not None:
        run.restore(checkpoint.SavedState(*saved))
    radius = run.mean_radius
    unit = math.sqrt(radius / g)
    cell, reach = 2.5 * radius, min(1.5 * width, box.radius - 2.0 * radius)
    ring, before = profile(start, cell, reach)
    progress, still, cadence = Progress("carved bowl", longest), False, Cadence()
    while run.time < longest * unit and not still:
        for _ in range(max(1, round(2.0 * unit / run.dt))):
            run.step()
        speed = math.sqrt(float(np.mean(np.sum(run.velocity**2, axis=1))))
        still = run.time > 10.0 * unit and speed < 0.002 * math.sqrt(g * radius)
        progress.update(run.time / unit, f"{speed:.3g} m/s")
        if out and cadence.due():
            with cadence.writing():
                checkpoint.save(out, run.steps, *checkpoint.arrays_and_numbers(run.saved()))
        stop_here("carved bowl")
    end = run.particles({}, tables=False)
    _, after = profile(end, cell, reach)
    moved = np.linalg.norm(end.position - start.position[np.argsort(start.identity, kind="stable")], axis=1)
    return Relaxed(
        ring.tolist(), before.tolist(), after.tolist(), steepest(ring, before, width / 3.0), steepest(ring, after,
        width / 3.0), -float(after[0]),
        float(np.average(moved, weights=end.mass) / radius), run.time, still,
    )  # fmt: skip
