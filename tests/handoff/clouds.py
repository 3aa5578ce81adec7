"""Synthetic clouds and beds: a graded, disordered source with a crater, and a random packing of grains, flat or on a sphere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from matter.particles import Particles

# flat tests: ten grain radii per cavity radius
CAVITY, ARC_FLAT, DEPTH = 10.0, 21.0, 19.0

Field = Callable[[np.ndarray], np.ndarray]


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


R_BODY, R_CORE, R_OCEAN, HEADROOM, ARC = 2100e3, 1800e3, 1950e3, 150e3, 1500e3
GRAVITY = 1.24
LAYERS = (("core", "basalt", 0.0, R_CORE, 2900.0), ("ocean", "water", R_CORE, R_OCEAN, 1050.0), ("shell", "ice", R_OCEAN, R_BODY, 930.0))
MATERIALS = ["basalt", "water", "ice"]
BULK = (30e9, 3e9, 9.5e9)


def body_column(radius: np.ndarray) -> np.ndarray:
    """Pressure [Pa] of the layered body at a radius, gravity taken as constant."""
    pressure = np.zeros(len(radius))
    for _, _, low, high, density in LAYERS:
        pressure += density * GRAVITY * np.clip(high - np.maximum(radius, low), 0.0, None)
    return pressure


def target_table() -> dict:
    """A ``target.json`` of the synthetic body."""
    radius = np.linspace(0.0, R_BODY, 400)
    return {
        "centre": [0.0, 0.0, 0.0],
        "radius_m": R_BODY,
        "mass_kg": 8.5e22,
        "surface_gravity_m_s2": GRAVITY,
        "layers": [
            {"name": name, "material": material, "inner_radius_m": low, "outer_radius_m": high, "mass_kg": 0.0} for name, material, low, high, _ in LAYERS
        ],
        "profile": {
            "radius_m": radius.tolist(),
            "density_kg_m3": np.select([radius < R_CORE, radius < R_OCEAN], [2900.0, 1050.0], 930.0).tolist(),
            "pressure_Pa": body_column(radius).tolist(),
            "gravity_m_s2": np.full(400, GRAVITY).tolist(),
            "layer": np.select([radius < R_CORE, radius < R_OCEAN], [0, 1], 2).tolist(),
        },
    }


def bowl_with_rim(position: np.ndarray, radius: float, depth: float, rim: float) -> np.ndarray:
    """Height [m] of a paraboloid crater with a rim falling as the cube of the distance, against the arc from the pole."""
    arc = R_BODY * np.arctan2(np.hypot(position[:, 0], position[:, 1]), position[:, 2])
    return np.where(arc < radius, -depth + (depth + rim) * (arc / radius) ** 2, rim * (radius / np.maximum(arc, 1.0)) ** 3)


def sphere_cloud(fine: float = 70e3, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Graded, disordered points of a ball that reaches to the headroom's top, and their volumes."""
    from matter.packing import graded_shell

    pole = np.array([0.0, 0.0, R_BODY])

    def spacing(points):
        return np.clip(fine + 0.1 * (np.linalg.norm(points - pole, axis=1) - 800e3), fine, 250e3)

    rng = np.random.default_rng(seed)
    pieces = [graded_shell(spacing, low, high, rng, sweeps=40) for low, high in ((0.0, R_CORE), (R_CORE, R_BODY + HEADROOM))]
    return np.concatenate([p for p, _ in pieces]), np.concatenate([v for _, v in pieces])


def sphere_source(
    cloud: tuple[np.ndarray, np.ndarray],
    radius: float = 450e3,
    depth: float = 220e3,
    rim: float = 60e3,
    time: float = 240.0,
    velocity: Field | None = None,
    curtain: int = 300,
) -> Particles:
    """The layered body with a crater, its rim, an ejecta curtain, and a projectile that has spread out over it."""
    points, volume = cloud
    reach = np.linalg.norm(points, axis=1)
    keep = reach - R_BODY < bowl_with_rim(points, radius, depth, rim)
    points, volume, reach = points[keep], volume[keep], reach[keep]
    layer = np.select([reach < R_CORE, reach < R_OCEAN], [0, 1], 2)
    density = np.array([row[4] for row in LAYERS])[layer]
    flow = velocity(points) if velocity else excavation(points, radius, 60.0)
    rng = np.random.default_rng(9)
    azimuth, along = 2 * np.pi * rng.random(curtain), rng.random(curtain)
    arc, height = radius * (1.1 + 0.6 * along), 1.6 * HEADROOM + 400e3 * along
    direction = np.stack([np.sin(arc / R_BODY) * np.cos(azimuth), np.sin(arc / R_BODY) * np.sin(azimuth), np.cos(arc / R_BODY)], axis=1)
    outward = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(curtain)], axis=1)
    speed = 700.0 + 1900.0 * along**3
    thrown = (R_BODY + height)[:, None] * direction
    thrown_velocity = speed[:, None] * (0.7 * direction + 0.7 * outward)
    projectile = np.arange(curtain) % 4 == 0
    thrown_volume = np.where(projectile, 25e3**3, float(volume[reach > R_OCEAN].min()) * 1.3)
    n, m = len(points), curtain
    position = np.concatenate([points, thrown])
    rho = np.concatenate([density, np.full(m, 700.0)])
    size = np.concatenate([volume, thrown_volume])
    number = np.concatenate([layer, np.full(m, 2)])
    bulk = np.array(BULK)[number]
    return Particles(
        {
            "identity": np.arange(n + m),
            "position": position,
            "velocity": np.concatenate([flow, thrown_velocity]),
            "mass": rho * size,
            "density": rho,
            "smoothing_length": 2.0 * np.cbrt(size),
            "pressure": np.concatenate([body_column(reach), np.zeros(m)]),
            "deviatoric_stress": np.zeros((n + m, 6)),
            "damage": np.concatenate([(reach > R_OCEAN) * 1.0, np.ones(m)]),
            "sound_speed": np.sqrt(bulk / rho),
            "material": number,
            "layer": np.concatenate([layer, np.where(projectile, -1, 2)]),
            "neighbours": np.concatenate([np.full(n, 33), np.full(m, 2)]),
        },
        {"time": time, "stage": "sph", "frame": "sphere", "materials": MATERIALS, "layers": [row[0] for row in LAYERS], "target_radius_m": R_BODY},
    )


def excavation(points: np.ndarray, radius: float, speed: float) -> np.ndarray:
    """Maxwell's Z-model (Z = 3) about the impact point: ``speed`` at one radius below it."""
    return z_model(points - np.array([0.0, 0.0, R_BODY]), 3.0, speed, radius)


def z_model(place: np.ndarray, z: float, speed: float, radius: float) -> np.ndarray:
    """u_r = speed (radius/r)^Z, u_theta = (Z - 2) sin(theta) / (1 + cos(theta)) u_r, theta from straight down (Maxwell 1977, eqs 1-2)."""
    r = np.maximum(np.linalg.norm(place, axis=1), 0.3 * radius)
    cosine = np.clip(-place[:, 2] / np.maximum(np.linalg.norm(place, axis=1), 1e-300), -0.95, 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    radial = speed * (radius / r) ** z
    turning = (z - 2.0) * sine / (1.0 + cosine) * radial
    rho = np.maximum(np.hypot(place[:, 0], place[:, 1]), 1e-300)
    across = np.stack([place[:, 0] / rho, place[:, 1] / rho], axis=1)
    flat = radial * sine + turning * cosine
    return np.column_stack([across * flat[:, None], -radial * cosine + turning * sine])


def sphere_bed(grain: float = 40e3, packing: float = 0.6, seed: int = 4) -> Particles:
    """Random grains between the core and the headroom's top, inside a cone."""
    half, top = ARC / R_BODY, R_BODY + HEADROOM
    volume = 2 * np.pi / 3 * (1 - np.cos(half)) * (top**3 - R_CORE**3)
    count = int(packing * volume / (4.0 / 3.0 * np.pi * grain**3 * 1.0225))

    def draw(rng, n):
        r = np.cbrt(R_CORE**3 + (top**3 - R_CORE**3) * rng.random(n))
        cosine, phi = 1 - (1 - np.cos(half)) * rng.random(n), 2 * np.pi * rng.random(n)
        sine = np.sqrt(1 - cosine**2)
        return r[:, None] * np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=1)

    def clip(points, radii):
        r = np.linalg.norm(points, axis=1)
        angle, phi = np.arccos(points[:, 2] / r), np.arctan2(points[:, 1], points[:, 0])
        r = np.clip(r, R_CORE + radii, top - radii)
        angle = np.minimum(angle, half - np.arcsin(radii / r))
        return r[:, None] * np.stack([np.sin(angle) * np.cos(phi), np.sin(angle) * np.sin(phi), np.cos(angle)], axis=1)

    points, radii = packed(count, grain, draw, clip, seed)
    domain = {"core_radius_m": R_CORE, "datum_radius_m": R_BODY, "top_radius_m": top, "cone_half_angle_rad": half, "arc_radius_m": ARC}
    bed = bed_of(points, radii, "sphere", domain, packing)
    bed["material"] = np.where(np.linalg.norm(points, axis=1) < R_OCEAN, 1, 2)
    bed["species"] = np.where(bed.material == 1, 1, 0)
    bed.attributes["materials"] = MATERIALS
    bed["stiffness"] = 1e13 * radii
    return bed
