"""Cavities of known shape, in a half space and on a sphere, in lattices and random clouds; how well source and carved bed agree on them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handoff import account, hydrostatic, surface, transfer
from matter import packing, regions
from matter.particles import Particles
from tests.handoff import clouds

RADIUS, BOWL, RIM = 20.0, 9.0, 3.0
ARC, DEPTH, HEADROOM = 29.0, 13.0, 5.0
KINDS = ("lattice", "shaken", "glass", "graded")
SHAPES = ("bowl", "rim", "rim and curtain")
FINE = 1.8  # particle spacing of a fine source in grain radii (twenty of them in the radius)


def bowl(points: np.ndarray) -> np.ndarray:
    """A paraboloid that meets the plane at RADIUS."""
    rho = np.hypot(points[:, 0], points[:, 1])
    return np.where(rho < RADIUS, -BOWL * (1.0 - (rho / RADIUS) ** 2), 0.0)


def bowl_with_rim(points: np.ndarray) -> np.ndarray:
    """A paraboloid with a rim that falls as the cube of the distance."""
    rho = np.hypot(points[:, 0], points[:, 1])
    return np.where(rho < RADIUS, -BOWL + (BOWL + RIM) * (rho / RADIUS) ** 2, RIM * (RADIUS / np.maximum(rho, 1e-9)) ** 3)


def truth(shape: str) -> tuple[float, float]:
    """Radius at the datum and volume below it."""
    radius = RADIUS if shape == "bowl" else RADIUS * np.sqrt(BOWL / (BOWL + RIM))
    return radius, np.pi * BOWL * radius**2 / 2.0


def cloud(kind: str, spacing: float, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a cylinder wider, deeper and higher than the bed, and the volume of each.

    ``lattice``: exactly hexagonal; ``shaken``: with Gaussian disorder; ``glass``: random, pushed apart; ``graded``: the same with a spacing that grows
    from ``spacing`` in the middle to twice that at the edge. Volumes of the last two are those of the points' own number density.
    """
    wide, low, high = 1.35 * ARC, -1.35 * DEPTH, RIM + 1.0
    if kind in ("lattice", "shaken"):
        rng = np.random.default_rng(seed)
        points = clouds.lattice((1.5 * wide, 1.5 * wide, 1.5 * abs(low)), spacing)
        points = points + rng.normal(0.0, 0.15 * spacing * (kind == "shaken"), points.shape)
        points = points[(np.hypot(points[:, 0], points[:, 1]) < wide) & (points[:, 2] > low) & (points[:, 2] < high)]
        return points, np.full(len(points), spacing**3)

    def local(p: np.ndarray) -> np.ndarray:
        if kind == "glass":
            return np.full(len(p), spacing)
        return spacing * (1.0 + np.clip((np.linalg.norm(p, axis=1) - RADIUS) / (wide - RADIUS), 0.0, 1.0))

    return packing.graded(local, regions.Cylinder(wide, low, high), np.random.default_rng(seed), sweeps=60)


def source(shape: str, kind: str, spacing: float, seed: int = 1) -> Particles:
    """The ground under the shape at rest, with a conical curtain that flies up and out where asked for."""
    points, volume = cloud(kind, spacing, seed)
    height: Callable[[np.ndarray], np.ndarray] = bowl if shape == "bowl" else bowl_with_rim
    keep = points[:, 2] < height(points)
    points, volume = points[keep], volume[keep]
    velocity = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    if shape == "rim and curtain":
        rng = np.random.default_rng(3)
        azimuth, up = 2.0 * np.pi * rng.random(400), rng.random(400)
        outward = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(400)], axis=1)
        rise = np.array([0.0, 0.0, 1.0])
        thrown = (RADIUS + 1.0 + 6.0 * up)[:, None] * outward + (RIM + 0.5 * spacing + 8.0 * up)[:, None] * rise
        points = np.concatenate([points, thrown])
        volume = np.concatenate([volume, np.full(400, spacing**3)])
        velocity = np.concatenate([velocity, 250.0 * (outward + rise)])
    return clouds.source_of(points, volume, velocity, 1000.0)


def bed(grains_per_radius: float, seed: int = 2) -> Particles:
    """Random grains, ``grains_per_radius`` mean radii in RADIUS."""
    return clouds.flat_bed(RADIUS / grains_per_radius, ARC, DEPTH, HEADROOM, seed=seed)


def ground() -> hydrostatic.Column:
    """The limit sqrt(2 g headroom) is 100 m/s: the curtain (354 m/s) is faster, the ground slower."""
    return hydrostatic.uniform(1e3, 1000.0, 30.0)


def measured(shape: str, kind: str, grains_per_radius: float, grains: Particles, seed: int = 1) -> dict[str, float]:
    """The row of the table for one shape, in a cloud whose particles are FINE times the grain radius apart; ``seed`` of the cloud."""
    cloud_of = source(shape, kind, FINE * RADIUS / grains_per_radius, seed)
    made = transfer.hand_over(cloud_of, grains, surface.Rules(), ground())
    ledger = account.ledger_of(made, cloud_of, grains, ground(), {})
    radius, volume = truth(shape)
    samples = made.samples
    removed = np.where(samples.position[:, 2] < 0.0, ~made.stays[samples.grain], -1.0 * made.stays[samples.grain])
    carved = removed[np.hypot(*samples.position[:, :2].T) < radius]
    return {
        "grains_per_radius": grains_per_radius, "particles": len(cloud_of), "grains": int(made.stays.sum()), "offset": made.offset,
        "radius_rel": made.size.radius / radius - 1.0, "depth_rel": made.size.depth / BOWL - 1.0, "source_volume_rel": made.size.volume / volume - 1.0,
        "bed_volume_rel": carved.sum() * samples.volume / volume - 1.0, "bed_against_source": float(ledger["cavity_volume_rel"]["value"] or np.nan),
        "hausdorff_over_r": float(ledger["cavity_hausdorff_over_r"]["value"]), "mass_raw": float(ledger["mass_raw_rel"]["value"]),
        "ejecta": len(made.ejecta.mass), "watertight": bool(made.solid.mesh.is_watertight), "voids": int(made.solid.shape.voids_filled),
    }  # fmt: skip


def on_a_sphere(cloud_points, grains: Particles, radius: float, depth: float, rim: float, curtain: int) -> dict[str, float]:
    """The same for a bowl with a rim on the layered body of ``clouds``; ``curtain`` particles fly above it."""
    made_of = clouds.sphere_source(cloud_points, radius, depth, rim, velocity=lambda p: np.zeros_like(p), curtain=curtain)
    column = hydrostatic.from_target(clouds.target_table(), clouds.R_BODY)
    made = transfer.hand_over(made_of, grains, surface.Rules(), column)
    ledger = account.ledger_of(made, made_of, grains, column, {})
    arc = radius * np.sqrt(depth / (depth + rim))
    angle = np.linspace(0.0, arc / clouds.R_BODY, 4001)
    floor = clouds.R_BODY - depth + (depth + rim) * (angle * clouds.R_BODY / radius) ** 2
    volume = np.trapezoid(2.0 * np.pi * np.sin(angle) * (clouds.R_BODY**3 - floor**3) / 3.0, angle)
    samples, frame = made.samples, clouds.R_BODY
    removed = np.where(np.linalg.norm(samples.position, axis=1) < frame, ~made.stays[samples.grain], -1.0 * made.stays[samples.grain])
    carved = removed[frame * np.arctan2(np.hypot(*samples.position[:, :2].T), samples.position[:, 2]) < arc]
    return {
        "grains_per_radius": radius / float(grains.radius.mean()), "particles": len(made_of), "grains": int(made.stays.sum()), "offset": made.offset,
        "radius_rel": made.size.radius / arc - 1.0, "depth_rel": made.size.depth / depth - 1.0, "source_volume_rel": made.size.volume / volume - 1.0,
        "bed_volume_rel": carved.sum() * samples.volume / volume - 1.0, "bed_against_source": float(ledger["cavity_volume_rel"]["value"] or np.nan),
        "hausdorff_over_r": float(ledger["cavity_hausdorff_over_r"]["value"]), "mass_raw": float(ledger["mass_raw_rel"]["value"]),
        "ejecta": len(made.ejecta.mass), "watertight": bool(made.solid.mesh.is_watertight), "voids": int(made.solid.shape.voids_filled),
    }  # fmt: skip
