"""Curved walls as triangles, for an engine that knows planes and meshes only.

Facets are chords of the surface they stand for; the vertices are moved outwards so that facets lie as far inside it as
outside, by at most ``DEVIATION`` grain radii. A sphere's facets come from a subdivided icosahedron, cut where no grain
can touch it; a cone's are strips of about square halves.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from dem.contact.walls import CONE, PLANE, SPHERE_INSIDE, Wall
from matter.errors import InputError

DEVIATION = 0.005
MOST_SUBDIVISIONS = 7
TILES = 16
"""Tiles of a plane along half the edge of the box."""


def write(wall: Wall, grain: float, path: Path, reach: float, lower: float = 0.0) -> None:
    """Write the wall as binary STL; arguments as for ``mesh``."""
    import trimesh

    vertices, faces = mesh(wall, grain, reach, lower)
    trimesh.Trimesh(vertices, faces, process=False).export(path)


def mesh(wall: Wall, grain: float, reach: float, lower: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) [m] and faces (f, 3).

    ``grain`` mean radius [m]; ``reach`` half the edge of the box [m]; ``lower`` distance from a cone's apex below
    which no grain can be [m].
    """
    if wall.kind == SPHERE_INSIDE:
        return _sphere(wall, grain)
    if wall.kind == CONE:
        return _cone(wall, grain, reach, lower)
    if wall.kind == PLANE:
        return _plane(wall, reach)
    if wall.cylinder():
        return _cylinder(wall, grain)
    raise InputError(f"no triangles for a wall of this kind ({wall})")


def _sphere(wall: Wall, grain: float) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    # the deepest chord of a subdivision: the circumcentre of a facet with edge e lies e^2 / (6 R) below the sphere
    for level in range(2, MOST_SUBDIVISIONS + 1):
        ball = trimesh.creation.icosphere(subdivisions=level, radius=wall.radius)
        depth = wall.radius - float(np.min(np.linalg.norm(ball.triangles_center, axis=1)))
        if 0.5 * depth <= DEVIATION * grain:
            break
    vertices = np.asarray(ball.vertices) * (1.0 + 0.5 * depth / wall.radius)
    faces = np.asarray(ball.faces)
    if np.isfinite(wall.top):  # a ragged edge, half a facet to both sides of the top: far below a grain's radius
        faces = faces[vertices[faces, 2].mean(axis=1) <= wall.top]
        used, faces = np.unique(faces, return_inverse=True)
        vertices, faces = vertices[used], faces.reshape(-1, 3)
    return vertices + np.asarray(wall.point, dtype=float), faces


def _cone(wall: Wall, grain: float, reach: float, lower: float) -> tuple[np.ndarray, np.ndarray]:
    axis = np.asarray(wall.direction, dtype=float)
    axis = axis / np.linalg.norm(axis)
    one = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    one /= np.linalg.norm(one)
    two = np.cross(axis, one)
    top = wall.top if np.isfinite(wall.top) else reach
    low = min(max(lower, 1e-3 * top), 0.9 * top)
    widest = top * math.sin(wall.half_angle)
    around = _around(widest, grain * math.cos(wall.half_angle))
    along = max(1, math.ceil((top - low) / (2.0 * math.pi * widest / around)))
    shift = 1.0 + 0.25 * (math.pi / around) ** 2  # half the depth of the chord
    angle = 2.0 * math.pi * np.arange(around) / around
    slant = np.linspace(low, top, along + 1)
    ring = np.outer(np.cos(angle), one) + np.outer(np.sin(angle), two)
    vertices = slant[:, None, None] * (
        math.cos(wall.half_angle) * axis + math.sin(wall.half_angle) * shift * ring[None]
    )
    return vertices.reshape(-1, 3) + np.asarray(wall.point, dtype=float), _strips(along, around)


def _cylinder(wall: Wall, grain: float) -> tuple[np.ndarray, np.ndarray]:
    sides = wall.cylinder()
    assert sides is not None
    radius, low, high = sides
    around = _around(radius, grain)
    along = max(1, math.ceil((high - low) / (2.0 * math.pi * radius / around)))
    angle, height = 2.0 * math.pi * np.arange(around) / around, np.linspace(low, high, along + 1)
    width = radius * (1.0 + 0.25 * (math.pi / around) ** 2)
    ring = np.tile(width * np.column_stack([np.cos(angle), np.sin(angle)]), (along + 1, 1))
    return np.column_stack([ring, np.repeat(height, around)]) + np.asarray(wall.point, dtype=float), _strips(
        along, around
    )


def _around(radius: float, grain: float) -> int:
    """Facets around a circle of ``radius`` [m] whose chords are off by ``DEVIATION`` grain radii at most."""
    return max(24, math.ceil(math.pi / math.sqrt(4.0 * DEVIATION * grain / radius)))


def _strips(along: int, around: int) -> np.ndarray:
    """Faces (f, 3) of ``along`` closed strips between rings of ``around`` vertices."""
    k, i = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    a, b = k * around + i, k * around + (i + 1) % around
    c, d = a + around, b + around
    return np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])


def _plane(wall: Wall, reach: float) -> tuple[np.ndarray, np.ndarray]:
    n = np.asarray(wall.direction, dtype=float)
    n = n / np.linalg.norm(n)
    one = np.cross(n, (1.0, 0.0, 0.0) if abs(n[0]) < 0.9 else (0.0, 1.0, 0.0))
    one /= np.linalg.norm(one)
    two = np.cross(n, one)
    # tiles whose centre lies in the box: the program drops a mesh that reaches beyond it
    edge = reach / TILES
    k = np.arange(-2 * TILES, 2 * TILES)
    i, j = (index.reshape(-1) for index in np.meshgrid(k, k, indexing="ij"))
    centre = np.asarray(wall.point, dtype=float)
    position = centre + edge * ((i[:, None] + 0.5) * one + (j[:, None] + 0.5) * two)
    inside = np.all(np.abs(position) < reach - edge, axis=1) & (position[:, 2] - centre[2] <= wall.top)
    i, j = i[inside], j[inside]
    corners = np.stack([np.stack([i + a, j + b], -1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1)
    positions, at = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    at = at.reshape(-1, 4)
    return centre + edge * (positions[:, :1] * one + positions[:, 1:] * two), np.concatenate(
        [at[:, [0, 1, 2]], at[:, [0, 2, 3]]]
    )
