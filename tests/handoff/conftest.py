"""Synthetic clouds and beds: a graded, disordered source with a crater, and a random packing of grains, flat or on a sphere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from matter.particles import Particles

Field = Callable[[np.ndarray], np.ndarray]


def spread_points(points: np.ndarray, spacing: Callable[[np.ndarray], np.ndarray], sweeps: int, clip) -> np.ndarray:
    """Points pushed apart until they are spread with the local ``spacing`` (soft repulsion of the nearest ones)."""
    for sweep in range(sweeps):
        s = spacing(points)
        distance, near = cKDTree(points).query(points, k=9)
        away = points[:, None] - points[near[:, 1:]]
        q = distance[:, 1:] / (1.2 * s[:, None])
        push = np.where(q < 1.0, (1.0 - q) ** 2, 0.0) / np.maximum(distance[:, 1:], 1e-300)
        points = clip(points + (0.5 - 0.3 * sweep / sweeps) * s[:, None] * np.einsum("ik,ika->ia", push, away))
    return points


def lattice(extent: tuple[float, float, float], spacing: float) -> np.ndarray:
    """Close-packed points around the origin, turned by odd angles."""
    a = spacing * 2.0 ** (1.0 / 6.0)
    n = [int(np.linalg.norm(extent) / a * 1.3) + 2] * 3
    k, j, i = np.meshgrid(*(np.arange(-m, m + 1) for m in n), indexing="ij")
    points = a * np.stack([(2 * i + (j + k) % 2) * 0.5, np.sqrt(3) / 2 * (j + (k % 2) / 3), np.sqrt(6) / 3 * k], axis=-1).reshape(-1, 3)
    c, s = np.cos(0.4), np.sin(0.4)
    points = points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return points[np.all(np.abs(points) < np.array(extent), axis=1)]


def flat_source(
    spacing: float,
    radius: float,
    depth: float,
    height: Field,
    velocity: Field,
    density: float = 1000.0,
    disorder: float = 0.15,
    seed: int = 1,
) -> Particles:
    """A source under the surface z = ``height(points)``: a close-packed lattice with Gaussian disorder (in spacings)."""
    rng = np.random.default_rng(seed)
    points = lattice((radius * 1.5, radius * 1.5, depth * 1.5), spacing)
    points = points + rng.normal(0.0, disorder * spacing, points.shape)
    surface = height(points)
    points = points[(points[:, 2] < surface) & (points[:, 2] > -1.35 * depth) & (np.hypot(points[:, 0], points[:, 1]) < 1.35 * radius)]
    return source_of(points, np.full(len(points), spacing**3), velocity(points), density)


def source_of(points: np.ndarray, volume: np.ndarray, velocity: np.ndarray, density: float, **attributes) -> Particles:
    n = len(points)
    rho = np.full(n, density)
    return Particles(
        {
            "identity": np.arange(n),
            "position": points,
            "velocity": velocity,
            "mass": rho * volume,
            "density": rho,
            "smoothing_length": 2.0 * np.cbrt(volume),
            "material": np.zeros(n),
            "layer": np.zeros(n),
        },
        {"time": 100.0, "stage": "sph", "materials": ["ice"], "layers": ["shell"], **attributes},
    )


def packed(count: int, radius: float, draw, clip, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A random packing: positions (count, 3) and radii, uniform within 15 %, pushed apart until the overlaps are small."""
    rng = np.random.default_rng(seed)
    radii = radius * rng.uniform(0.85, 1.15, count)
    points = draw(rng, count)
    for _ in range(120):
        pairs = cKDTree(points).query_pairs(2.3 * radius, output_type="ndarray")
        arm = points[pairs[:, 0]] - points[pairs[:, 1]]
        distance = np.linalg.norm(arm, axis=1)
        overlap = np.maximum(radii[pairs].sum(axis=1) - distance, 0.0)
        step = 0.45 * (overlap / np.maximum(distance, 1e-300))[:, None] * arm
        move = np.zeros_like(points)
        for axis in range(3):
            move[:, axis] = np.bincount(pairs[:, 0], step[:, axis], count) - np.bincount(pairs[:, 1], step[:, axis], count)
        points = clip(points + move, radii)
    return points, radii


def bed_of(points: np.ndarray, radii: np.ndarray, frame: str, domain: dict, packing: float, density: float = 950.0) -> Particles:
    n = len(points)
    rng = np.random.default_rng(5)
    pairs = cKDTree(points).query_pairs(2.0 * float(radii.max()), output_type="ndarray")
    touching = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1) < radii[pairs].sum(axis=1)
    identity = 1000 + rng.permutation(n)
    pair = np.sort(identity[pairs[touching]], axis=1)
    wall = identity[rng.choice(n, n // 20, replace=False)]
    bed = Particles(
        {
            "identity": identity,
            "position": points,
            "velocity": np.zeros((n, 3)),
            "angular_velocity": np.zeros((n, 3)),
            "mass": density / packing * 4.0 / 3.0 * np.pi * radii**3,
            "radius": radii,
            "material": np.zeros(n),
            "species": np.zeros(n),
            "headroom": np.zeros(n),
            "density": np.full(n, density),
            "stiffness": 1e9 * radii,
        },
        {
            "time": 0.0,
            "stage": "bed",
            "frame": frame,
            "materials": ["ice"],
            "species": ["shell", "ocean"],
            "domain": domain,
            "residual_speed_over_sqrt_g_r": 2e-4,
            "packing_fraction": packing,
        },
        {
            "contacts/pair": pair,
            "contacts/history": rng.normal(size=(len(pair), 7)),
            "contacts/wall_pair": np.column_stack([wall, np.zeros(len(wall), dtype=np.int64)]),
            "contacts/wall_history": rng.normal(size=(len(wall), 7)),
        },
    )
    height = np.linalg.norm(points, axis=1) - domain["datum_radius_m"] if frame == "sphere" else points[:, 2] - domain["datum_m"]
    bed["headroom"] = height > 0.0
    return bed


def flat_bed(grain: float, radius: float, depth: float, headroom: float, packing: float = 0.6, seed: int = 2) -> Particles:
    """Random grains in an upright cylinder from -depth to the headroom above z = 0."""
    tall = depth + headroom
    count = int(packing * np.pi * radius**2 * tall / (4.0 / 3.0 * np.pi * grain**3 * 1.0225))

    def draw(rng, n):
        rho, phi = radius * np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
        return np.stack([rho * np.cos(phi), rho * np.sin(phi), -depth + tall * rng.random(n)], axis=1)

    def clip(points, radii):
        rho = np.hypot(points[:, 0], points[:, 1])
        shrink = np.minimum(1.0, (radius - radii) / np.maximum(rho, 1e-300))
        return np.column_stack([points[:, :2] * shrink[:, None], np.clip(points[:, 2], -depth + radii, headroom - radii)])

    points, radii = packed(count, grain, draw, clip, seed)
    return bed_of(points, radii, "plane", {"radius_m": radius, "floor_m": -depth, "datum_m": 0.0, "top_m": headroom}, packing)
