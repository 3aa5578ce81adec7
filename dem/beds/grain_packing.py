"""Packings: random close packing, and hexagonal close packing cut to a container.

Random close packing: random points, overlaps relaxed away, and radii exchanged until every grain fits its cage.

Grains relaxed from random points alone keep giving way under load for as long as one cares to wait (power-law ageing;
Chacko, Sollich & Fielding 2019, Phys. Rev. Lett. 123, 108001): a frictionless ocean of them never comes to rest. When
the radii take part in the relaxation, the packing becomes stable (Hagh, Nagel, Liu, Manning & Corwin 2022, PNAS 119,
e2117622119). Here the *set* of radii stays exactly as drawn: only their order among the grains follows the pressure.
Measured at 20,000 grains: residual speed 2.3 m/s without, 0.1 m/s with the exchange, after the same number of steps.

Protocol of relaxation: O'Hern, Silbert, Liu & Nagel 2003, Phys. Rev. E 68, 011306.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dem.beds.bed_walls import Domain
from dem.beds.grading import Grading
from dem.contact import walls
from dem.contact.columns import RADIUS
from dem.grains.assembly import Assembly
from matter.compilation.jit import kernel
from matter.errors import InputError
from matter.geometry.ground_region import Cone, Upright
from matter.points.packing import hexagonal

SOURCES = ("OHern2003", "Hagh2022")

FRACTION = 0.665
"""Grain volume over the whole domain: slightly above random close packing (0.65 at this spread of radii), so that all
grains are caged."""
HEXAGONAL = math.pi / math.sqrt(18.0)
"""Grain volume over the whole of a hexagonal close packing."""
EXCHANGE = 0.01
"""Relative change of radius that is asked for per exchange, for a pressure twice that of the neighbours."""


def radii(count: int, spread: float, domain: Cone, seed: np.random.SeedSequence) -> np.ndarray:
    """Radii [m] uniform within +-``spread`` about a mean at which ``count`` grains fill the domain."""
    shape = np.random.default_rng(seed).uniform(1.0 - spread, 1.0 + spread, count)
    volume = domain.volume_between(domain.floor, domain.top)
    return shape * (FRACTION * volume / (4.0 / 3.0 * np.pi * np.sum(shape**3))) ** (1.0 / 3.0)


def random_points(radius: np.ndarray, domain: Cone, seed: np.random.SeedSequence) -> np.ndarray:
    """Centres uniform over the part of the domain that each grain can reach, shape (n, 3)."""
    rng = np.random.default_rng(seed)
    inner, outer = domain.floor + radius, domain.top - radius
    r = np.cbrt(rng.uniform(inner**3, outer**3))
    largest = domain.half_angle - np.arcsin(np.minimum(radius / r, 1.0))
    cosine = rng.uniform(np.cos(largest), 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    azimuth = rng.uniform(0.0, 2.0 * np.pi, len(radius))
    return r[:, None] * np.column_stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])


def contained(
    count: int,
    spread: float,
    container: Upright,
    grading: Grading,
    seed: np.random.SeedSequence,
    filling: Callable[[np.ndarray], np.ndarray] = lambda points: np.ones(len(points)),
) -> tuple[np.ndarray, np.ndarray]:
    """Centres (n, 3) [m] and radii (n,) [m] of random grains in a container of flat ground: each radius uniform within
    +-``spread`` about the mean of its position, the same volume of grains everywhere, up to ``FRACTION`` in all.

    Centres are as dense as ``filling`` (n,), at most 1, over r^3 in the whole container. Grains that reach through a
    wall are then moved inwards until they touch it: where a centre begins nearer to the wall than its radius, its
    neighbours can push it out (1 to 5 of 22,000 graded grains were).
    """
    seeds = seed.spawn(3)
    rng, keeps = np.random.default_rng(seeds[1]), np.random.default_rng(seeds[2])
    shape, radius = np.random.default_rng(seeds[0]).uniform(1.0 - spread, 1.0 + spread, count), np.empty(count)
    points, todo = np.empty((count, 3)), np.arange(count)
    low, high = (
        np.array([-container.radius, -container.radius, container.floor]),
        np.array([container.radius, container.radius, container.top]),
    )
    while len(todo):
        points[todo] = rng.uniform(low, high, (len(todo), 3))
        mean = grading.local(points[todo])
        radius[todo] = shape[todo] * mean
        wanted = keeps.random(len(todo)) < filling(points[todo]) * (grading.radius / mean) ** 3
        todo = todo[~wanted | (container.depth_inside(points[todo]) < 0.0)]
    points = container.drawn_in(points, radius)
    radius = shape * grading.local(points)
    volume = container.volume_between(container.floor, container.top)
    radius *= (FRACTION * volume / (4.0 / 3.0 * np.pi * np.sum(radius**3))) ** (1.0 / 3.0)
    return container.drawn_in(points, radius), radius


def hexagonal_in(count: int, container: Upright, tilted: bool = False) -> tuple[np.ndarray, float]:
    """Centres (n, 3) and radius [m] of touching equal grains in hexagonal close packing that fit into the container.

    Close-packed planes are level, the lowest on the floor; ``tilted``: turned by odd angles, so that none is level or
    upright.

    The radius is that at which about ``count`` fit. Raises ``InputError`` when the container holds too few for that.
    """
    reach = math.hypot(math.sqrt(2.0) * container.radius, max(container.top, -container.floor)) * 1.01
    volume = container.volume_between(container.floor, container.top)
    radius = (HEXAGONAL * volume / count * 3.0 / (4.0 * math.pi)) ** (1.0 / 3.0)
    best: tuple[int, np.ndarray, float] | None = None
    for _ in range(16):
        points = hexagonal(2.0 * radius / 2.0 ** (1.0 / 6.0), reach, rotate=tilted)  # nearest distance 2 r
        if not tilted:
            points[:, 2] += container.floor + radius - _lowest_level(points, container.floor + radius)
        points = points[container.depth_inside(points) >= radius * (1.0 - 1e-9)]
        off = abs(len(points) - count)
        if best is None or off < best[0]:
            best = (off, points, radius)
        if off < 0.01 * count or len(points) == 0:
            break
        radius *= (len(points) / count) ** (1.0 / 3.0)
    assert best is not None
    if len(best[1]) < 16:
        raise InputError(f"{count} grains in hexagonal packing do not fit into the {container.shape}")
    return best[1], best[2]


def _lowest_level(points: np.ndarray, floor: float) -> float:
    """Height of the lattice plane next to ``floor``."""
    return float(points[np.argmin(np.abs(points[:, 2] - floor)), 2])


@kernel
def _wall_overlaps(X, rows, out):
    """Add every grain's overlaps with all walls to ``out`` (n,)."""
    for i in range(X.shape[0]):
        for w in range(rows.shape[0]):
            d, _, _, _ = walls.distance(rows[w], X[i, 0], X[i, 1], X[i, 2])
            if d < X[i, RADIUS]:
                out[i] += X[i, RADIUS] - d


def exchange_radii(bed: Assembly, domain: Domain, lid: bool, which: np.ndarray) -> None:
    """Let the radii among the grains ``which`` (mask) be exchanged by a small step: squeezed grains shrink, loose
    ones grow.

    A grain's pressure, sum of overlaps / r^2, is compared with the mean of its neighbours'; the radii so asked for are
    ranked, and the grains take the unchanged set of radii in that order. The pair list stays as it is: changes are far
    below its skin.
    """
    n, radius = len(bed.X), bed.X[:, RADIUS].copy()
    first = np.repeat(np.arange(bed.active), np.diff(bed.row))
    second = bed.col
    overlap = radius[first] + radius[second] - np.linalg.norm(bed.position[first] - bed.position[second], axis=1)
    touch = overlap > 0.0
    first, second, overlap = first[touch], second[touch], overlap[touch]
    load = np.bincount(first, overlap, minlength=n) + np.bincount(second, overlap, minlength=n)
    if isinstance(domain, Upright):
        _wall_overlaps(bed.X, bed.walls, load)
    else:
        distance = np.linalg.norm(bed.position, axis=1)
        load += np.maximum(0.0, radius - distance + domain.floor)
        load += np.maximum(0.0, radius - distance * np.sin(domain.half_angle - domain.polar_angle(bed.position)))
        if lid:
            load += np.maximum(0.0, radius + distance - domain.top)
    pressure = load / radius**2
    around = np.bincount(first, pressure[second], minlength=n) + np.bincount(second, pressure[first], minlength=n)
    count = np.bincount(first, minlength=n) + np.bincount(second, minlength=n)
    mean = around / np.maximum(count, 1)
    excess = np.where(mean > 0.0, pressure / np.maximum(mean, 1e-300) - 1.0, 0.0)
    wanted = radius * (1.0 - EXCHANGE * np.clip(excess, -2.0, 2.0))
    here = np.flatnonzero(which)
    order = here[np.argsort(wanted[here], kind="stable")]
    bed.X[order, RADIUS] = np.sort(radius[here])
