"""Craters drawn at random whose measures are known in closed form or by quadrature. Independent: numpy and scipy only, nothing of crater/ or matter/.

Ground: a paraboloid with a sharp crest and a power-law apron, or a smooth bowl whose raised rim has no corner. Bodies: a plane whose far field is
tilted, and spheres of 5 to 12 rim radii, turned. Matter: HCP in any orientation, HCP shaken by 0.15 spacings, or a dense random packing.
12 to 20 particles per rim radius, 5 % of them as ejecta above the ground.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.integrate import quad
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

PACKINGS = ("hcp", "shaken", "packed")
SHAPES = ("sharp", "smooth")
ACROSS = (12.0, 20.0)
EJECTA = 0.05


@dataclass(frozen=True)
class Ground:
    """Height ``h(s)`` over the datum at a distance ``s`` along it, with its crest at 1; ``rim_height``, ``depth`` and the ``apparent`` radius are exact."""

    h: Callable[[np.ndarray], np.ndarray]
    depth: float
    rim_height: float
    apparent: float


def sharp(depth: float, rim: float, fall: float) -> Ground:
    """-depth + (depth + rim) s^2 up to a corner at s = 1, rim s^-fall outside: meets the datum at s^2 = depth / (depth + rim)."""

    def h(s):
        return np.where(s < 1.0, -depth + (depth + rim) * s**2, rim * np.maximum(s, 1.0) ** -fall)

    return Ground(h, depth, rim, float(np.sqrt(depth / (depth + rim))))


def smooth(depth: float, apparent: float) -> Ground:
    """-depth (1 - s^2 / a^2) exp(-s^2 / w^2) with w^2 = 1 - a^2: level at s = 0 and at s^2 = a^2 + w^2 = 1, the crest.

    The crest stands depth w^2 / a^2 exp(-1 / w^2) high.
    """
    a2, w2 = apparent**2, 1.0 - apparent**2

    def h(s):
        return -depth * (1.0 - s**2 / a2) * np.exp(-(s**2) / w2)

    return Ground(h, depth, float(depth * w2 / a2 * np.exp(-1.0 / w2)), apparent)


@dataclass(frozen=True)
class Drawn:
    """A cloud: ``position`` (n, 3) [m], ``spacing`` [m] = (volume per particle)^(1/3), ``body`` radius [m] or None, ``centre`` of the body [m],
    ``truth`` by the names of measures.json, and ``facts`` on what was drawn."""

    position: np.ndarray
    spacing: float
    body: float | None
    centre: tuple[float, float, float]
    truth: dict[str, float]
    facts: dict[str, object]


def truth_of(ground: Ground, rim: float, body: float | None) -> dict[str, float]:
    """The exact measures [m, m^3]; on a sphere dV = (R^3 - (R + h)^3) / 3 dOmega, to the distance at which the wall meets it."""

    def plane_shell(s):
        return -2.0 * np.pi * s * rim**3 * float(ground.h(np.float64(s)))

    def sphere_shell(s):
        psi = s * rim / body
        return 2.0 * np.pi * np.sin(psi) * rim / body * (body**3 - (body + rim * float(ground.h(np.float64(s)))) ** 3) / 3.0

    volume = quad(plane_shell if body is None else sphere_shell, 0.0, ground.apparent, epsrel=1e-9)[0]
    return {
        "diameter_rim_m": 2.0 * rim,
        "diameter_apparent_m": 2.0 * rim * ground.apparent,
        "depth_m": rim * ground.depth,
        "depth_rim_to_floor_m": rim * (ground.depth + ground.rim_height),
        "rim_height_m": rim * ground.rim_height,
        "volume_m3": volume,
    }


def hcp(low: np.ndarray, high: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points of a hexagonal close packing, one per unit volume, in any orientation, that lie in a box."""
    a = 2.0 ** (1.0 / 6.0)
    cell = a * np.array([1.0, np.sqrt(3.0), np.sqrt(8.0 / 3.0)])  # orthorhombic cell of four points
    inside = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 5.0 / 6.0, 0.5], [0.0, 1.0 / 3.0, 0.5]])
    turn = Rotation.random(rng=rng).as_matrix()
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]) @ turn
    first, last = np.floor(corners.min(axis=0) / cell) - 1, np.ceil(corners.max(axis=0) / cell) + 1
    shift = rng.uniform(0.0, 1.0, 3)
    axes = [np.arange(first[k], last[k] + 1) for k in range(3)]
    kept = []
    for i in axes[0]:  # a sheet of cells at a time: a flat box fills little of the lattice's own box
        corner = np.stack(np.meshgrid([i], axes[1], axes[2], indexing="ij"), axis=-1).reshape(-1, 3) + shift
        place = (corner * cell) @ turn.T
        near = ((place > low - 4.0) & (place < high + 4.0)).all(axis=1)
        points = (((corner[near][:, None, :] + inside[None, :, :]).reshape(-1, 3)) * cell) @ turn.T
        kept.append(points[((points >= low) & (points < high)).all(axis=1)])
    return np.vstack(kept)


@lru_cache(maxsize=2)
def _packed_tile(seed: int, side: int = 18) -> np.ndarray:
    """A periodic dense random packing of side^3 points in a cube of that ``side``: random points pushed apart until the closest pairs are
    some 0.9 spacings apart, as in grains (solid fraction 0.6 of spheres that touch gives 1.05)."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, side, (side**3, 3))
    for step in range(90):
        pairs = cKDTree(points, boxsize=side).query_pairs(1.05, output_type="ndarray")
        apart = points[pairs[:, 0]] - points[pairs[:, 1]]
        apart -= side * np.round(apart / side)
        distance = np.linalg.norm(apart, axis=1)
        push = (0.5 * (1.05 - distance) / np.maximum(distance, 1e-9))[:, None] * apart * (0.6 if step < 50 else 0.4)
        np.add.at(points, pairs[:, 0], push)
        np.add.at(points, pairs[:, 1], -push)
        points = np.mod(points, side) % side
    return points


def packed(low: np.ndarray, high: np.ndarray, rng: np.random.Generator, side: int = 18) -> np.ndarray:
    """A dense random packing, one point per unit volume, of a box: one periodic tile, turned and shifted."""
    tile, turn, shift = _packed_tile(int(rng.integers(2)), side), Rotation.random(rng=rng).as_matrix(), rng.uniform(0.0, side, 3)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]) @ turn
    first, last = np.floor(corners.min(axis=0) / side) - 1, np.ceil(corners.max(axis=0) / side)
    axes = [np.arange(first[k], last[k] + 1) for k in range(3)]
    corner = side * np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) + shift
    middle = (corner + 0.5 * side) @ turn.T
    near = ((middle > low - 0.9 * side) & (middle < high + 0.9 * side)).all(axis=1)
    kept = []
    for place in corner[near]:
        points = (place + tile) @ turn.T
        kept.append(points[((points >= low) & (points < high)).all(axis=1)])
    return np.vstack(kept)


def fill(packing: str, low, high, rng: np.random.Generator) -> np.ndarray:
    """Points of a box in units of the spacing."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    if packing == "packed":
        return packed(low, high, rng)
    if packing == "hcp":
        return hcp(low, high, rng)
    points = hcp(low - 1.0, high + 1.0, rng)
    points = points + rng.normal(scale=0.15, size=points.shape)
    return points[((points >= low) & (points < high)).all(axis=1)]


def draw(seed: int, sphere: bool, packing: str | None = None, shape: str | None = None, reach: float | None = None) -> Drawn:
    """The crater of a ``seed`` on a sphere or a plane; what is not said is drawn too."""
    rng = np.random.default_rng([seed, int(sphere)])
    across = rng.uniform(*ACROSS)
    packing = packing or PACKINGS[rng.integers(3)]
    shape = shape or SHAPES[rng.integers(2)]
    depth = rng.uniform(0.3, 0.55)
    ground = sharp(depth, rng.uniform(0.06, 0.12), rng.uniform(2.6, 3.4)) if shape == "sharp" else smooth(depth, rng.uniform(0.7, 0.78))
    reach, rim = reach or rng.uniform(3.0, 4.2), 1e3 * rng.uniform(0.5, 2.0)
    spacing, body = rim / across, rng.uniform(5.0, 12.0) if sphere else None
    bottom = depth + 5.0 / across
    if body is None:
        away = rng.uniform(-0.2, 0.2, 2)
        points = fill(packing, across * np.array([-reach, -reach, -bottom]), across * np.array([reach, reach, 0.3]), rng) / across
        points = points[points[:, 2] < ground.h(np.hypot(*(points[:, :2] - away).T))]
        count = round(EJECTA * len(points))
        fly = np.column_stack([rng.uniform(-reach, reach, (count, 2)), rng.uniform(0.0, 2.0, count)])
        high = fly[:, 2] > ground.h(np.hypot(*(fly[:, :2] - away).T)) + 1.0 / across
        tilt = rng.uniform(-0.03, 0.03, 2)
        position = rim * Rotation.from_euler("xy", tilt).apply(np.vstack([points, fly[high]]))
        return Drawn(position, spacing, None, (0.0, 0.0, 0.0), truth_of(ground, rim, None), {"packing": packing, "shape": shape, "across": across})
    psi = reach / body
    wide, low = (body + 0.3) * np.sin(psi), (body - bottom) * np.cos(psi)
    points = fill(packing, across * np.array([-wide, -wide, low]), across * np.array([wide, wide, body + 0.3]), rng) / across
    s, r = body * np.arctan2(np.hypot(points[:, 0], points[:, 1]), points[:, 2]), np.linalg.norm(points, axis=1)
    points = points[(s < reach) & (r > body - bottom) & (r - body < ground.h(s))]
    count = round(EJECTA * len(points))
    cosine, around = rng.uniform(np.cos(psi), 1.0, count), rng.uniform(0.0, 2.0 * np.pi, count)
    sine = np.sqrt(1.0 - cosine**2)
    up = ground.h(body * np.arccos(cosine)) + 1.0 / across + rng.uniform(0.0, 2.0, count)
    fly = (body + up)[:, None] * np.column_stack([sine * np.cos(around), sine * np.sin(around), cosine])
    tilt, centre = rng.uniform(-0.2, 0.2, 2) / body, rim * rng.uniform(-0.02, 0.02, 3)
    position = rim * Rotation.from_euler("xy", tilt).apply(np.vstack([points, fly])) + centre
    facts = {"packing": packing, "shape": shape, "across": across, "body": body}
    return Drawn(position, spacing, body * rim, (float(centre[0]), float(centre[1]), float(centre[2])), truth_of(ground, rim, body * rim), facts)


def fields(drawn: Drawn, density: float = 2000.0) -> dict[str, np.ndarray]:
    """Position, mass and density of a snapshot of equal particles."""
    count = len(drawn.position)
    return {"position": drawn.position, "mass": np.full(count, density * drawn.spacing**3), "density": np.full(count, density)}
