"""Arrangements of points: hexagonal close packing, and a graded glass whose spacing varies smoothly from point to
point.

Spacing means the edge of the cube that one point stands for: s = (volume per point)^(1/3).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from matter.compilation.jit import kernel
from matter.geometry import neighbours
from matter.points.regions import Region, Shell

FOUND = 0.8
"""Largest density among even samples, over the true one, from which on they are drawn by: points there would be too
few by 1 / (1.05 FOUND)."""
RARE = 1e-3
"""Share of even samples that would be kept, below which points are not drawn by them: a million would be tried for a
thousand points."""
PROBES = 20_000
"""Samples of a shell about a point that the spacing grows from."""
WIDER = 1.5
"""Outer over inner radius of such a shell."""


def hexagonal(spacing: float, radius: float, rotate: bool = True) -> np.ndarray:
    """Points (n, 3) [m] of a hexagonal close packing inside a sphere about the origin.

    ``rotate`` turns the lattice by fixed odd angles: a close-packed plane square to an impact leaves a facet in the
    crater.
    """
    a = spacing * 2.0 ** (1.0 / 6.0)  # nearest distance: volume per point is a^3 / sqrt(2)
    n = int(radius / a * 1.3) + 3
    k, j, i = np.meshgrid(*(np.arange(-n, n + 1),) * 3, indexing="ij")
    x = (2 * i + (j + k) % 2) * 0.5
    y = math.sqrt(3.0) / 2.0 * (j + (k % 2) / 3.0)
    z = math.sqrt(6.0) / 3.0 * k
    points = a * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    points += a * np.array([0.25, 0.15, 0.2])  # no point, no symmetry plane at the very centre
    if rotate:
        points = points @ _rotation(0.37, 0.71, 1.13).T
    return np.ascontiguousarray(points[np.einsum("ij,ij->i", points, points) < radius * radius])


def _rotation(a: float, b: float, c: float) -> np.ndarray:
    def about(axis: int, angle: float) -> np.ndarray:
        turn = np.eye(3)
        i, j = [k for k in range(3) if k != axis]
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[i, j], turn[j, i] = -math.sin(angle), math.sin(angle)
        return turn

    return about(0, a) @ about(1, b) @ about(2, c)


@kernel
def _repel(position, spacing, index, entry, count, moves, move):
    """One sweep: neighbours closer than 1.7 spacings push each other apart: fills ``move`` (first ``moves``
    points)."""
    for i in range(moves):
        mx, my, mz = 0.0, 0.0, 0.0
        for k in range(count[i]):
            j = index[entry[i] + k]
            dx, dy, dz = (
                position[i, 0] - position[j, 0],
                position[i, 1] - position[j, 1],
                position[i, 2] - position[j, 2],
            )
            r = math.sqrt(dx * dx + dy * dy + dz * dz) + 1e-300
            q = r / (0.85 * (spacing[i] + spacing[j]))
            if q < 1.0:
                # a force that grows as s^2 is the same pressure everywhere: else the fine region would swell into the
                # coarse one
                repulsion = (1.0 - q) ** 2 / r * (0.5 * (spacing[i] + spacing[j]) / spacing[i]) ** 2
                mx += repulsion * dx
                my += repulsion * dy
                mz += repulsion * dz
        move[i, 0], move[i, 1], move[i, 2] = mx * spacing[i], my * spacing[i], mz * spacing[i]


@kernel
def _number_density(position, spacing, index, entry, count, wanted, out):
    for i in range(wanted):
        h = 2.0 * spacing[i]
        norm = 8.0 / (math.pi * h**3)
        total = norm
        for k in range(count[i]):
            j = index[entry[i] + k]
            dx, dy, dz = (
                position[i, 0] - position[j, 0],
                position[i, 1] - position[j, 1],
                position[i, 2] - position[j, 2],
            )
            q = math.sqrt(dx * dx + dy * dy + dz * dz) / (0.5 * h + spacing[j])
            h3 = norm * (2.0 * spacing[i] / (spacing[i] + spacing[j])) ** 3
            if q < 0.5:
                total += h3 * (1.0 + 6.0 * q * q * (q - 1.0))
            elif q < 1.0:
                total += h3 * 2.0 * (1.0 - q) ** 3
        out[i] = total


def graded(
    spacing: Callable[[np.ndarray], np.ndarray],
    region: Region,
    rng: np.random.Generator,
    sweeps: int = 120,
    finest: float | None = None,
    grown_from: tuple[np.ndarray, float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """A graded glass in a region: evenly spread points with the local spacing ``spacing(points)`` [m].

    Points drawn at random with the density 1/s^3 repel each other and their mirror images behind the walls, until they
    are spread evenly; the walls are met by smooth layers of points. ``finest`` : the smallest spacing, where it holds
    in too small a part of the region for samples to find it. ``grown_from`` : the point from which the spacing grows,
    and its least in the region; where samples miss that part, or hardly find it, as about an impact of a metre on a
    body of hundreds, points are drawn distance by distance from there (``_by_distance``).

    Returns
    -------
    points (n, 3) [m], volume (n,) [m^3] that each stands for (from the local number density, scaled to
    the volume of the region).
    """
    probe = region.random_points(rng, 200_000)
    density = spacing(probe) ** -3.0
    most = float(density.max()) if finest is None else max(finest**-3.0, float(density.max()))
    if grown_from is not None and (
        float(density.max()) < FOUND * grown_from[1] ** -3.0 or float(density.mean()) < RARE * most
    ):
        reach = 1.05 * float(np.linalg.norm(probe - grown_from[0], axis=1).max())
        points = _by_distance(spacing, region, rng, grown_from[0], reach)
    else:
        wanted = max(round(region.volume * float(density.mean())), 1)
        points = np.empty((0, 3))
        while len(points) < wanted:
            trial = region.random_points(rng, 200_000)
            points = np.concatenate([points, trial[rng.random(len(trial)) < spacing(trial) ** -3.0 / (1.05 * most)]])
        points = points[:wanted]
    for sweep in range(sweeps):
        s = spacing(points)
        everyone, owner = region.mirrored(points, s)
        moved = _moves(everyone, s[owner], len(points))
        size = np.linalg.norm(moved, axis=1)
        limit = 0.25 * s * (1.0 - 0.8 * sweep / sweeps)
        points = region.off_walls(
            points + 0.6 * moved * np.minimum(1.0, limit / np.maximum(0.6 * size, 1e-300))[:, None], s
        )
    s = spacing(points)
    everyone, owner = region.mirrored(points, s)
    number = np.empty(len(everyone))
    order, *listed = _listed(everyone, s[owner])
    _number_density(everyone[order], s[owner][order], *listed, len(order), number)
    back = np.empty_like(number)
    back[order] = number
    weight = 1.0 / back[: len(points)]
    return points, weight * (region.volume / weight.sum())


def _by_distance(
    spacing: Callable[[np.ndarray], np.ndarray],
    region: Region,
    rng: np.random.Generator,
    about: np.ndarray,
    reach: float,
) -> np.ndarray:
    """Random points of a region with the density 1/s^3, out to ``reach`` [m] from ``about``: as many in each of a row
    of shells, each half as wide again as the one before, as 1/s^3 over its part of the region makes."""
    first = float(spacing(about[None, :])[0])
    edges = first * WIDER ** np.arange(math.ceil(math.log(reach / first) / math.log(WIDER)) + 1)
    chosen, due = [], 0.0
    for inner, outer in zip((0.0, *edges[:-1]), edges):
        shell = Shell(float(inner), float(outer))

        def probes(shell: Shell = shell) -> np.ndarray:
            points = shell.random_points(rng, PROBES) + about
            return points[region.inside(points)]

        probe = probes()
        if len(probe) == 0:
            continue
        density = spacing(probe) ** -3.0
        due += shell.volume * float(density.sum()) / PROBES
        points, wanted = np.empty((0, 3)), round(due)
        while len(points) < wanted:
            trial = probes()
            keep = rng.random(len(trial)) < spacing(trial) ** -3.0 / (1.05 * float(density.max()))
            points = np.concatenate([points, trial[keep]])
        chosen.append(points[:wanted])
        due -= wanted
    return np.concatenate(chosen)


def _listed(points: np.ndarray, spacing: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    order, grid = neighbours.sort(points, 2.0 * spacing)
    pairs = neighbours.build(points[order], 2.0 * spacing[order], grid)
    return order, pairs.index, pairs.entry, pairs.count


def _moves(points: np.ndarray, spacing: np.ndarray, wanted: int) -> np.ndarray:
    order, *listed = _listed(points, spacing)
    move = np.empty_like(points)
    _repel(points[order], spacing[order], *listed, len(points), move)
    back = np.empty_like(move)
    back[order] = move
    return back[:wanted]
