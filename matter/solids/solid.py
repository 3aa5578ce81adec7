"""A solid body: a closed surface of triangles about its centre of mass, from axes or from a file.

Volume, centre and inertia are those of the polyhedron itself, exact for uniform density (divergence theorem: Eberly
2002, "Polyhedral mass properties"). An ellipsoid is meshed, with the volume of the ellipsoid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.solids import obj_file

SUFFIXES = (".obj", ".ply", ".stl")
"""Files of surfaces that are read; their numbers have no unit."""
SUBDIVISIONS = 6
"""Halvings of the edges of an icosahedron that an ellipsoid is made of: 81,920 triangles."""
LARGEST_FILE = 500_000_000
"""Bytes of a file that are read."""


@dataclass(frozen=True, eq=False)
class Solid:
    """Vertices (n, 3) [m] about the centre of mass and triangles (m, 3) int64, their normals outwards."""

    vertices: np.ndarray
    triangles: np.ndarray

    @cached_property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(self._properties["volume"])

    @cached_property
    def inertia(self) -> np.ndarray:
        """Inertia (3, 3) about the centre of mass for unit density [m^5]."""
        return np.asarray(self._properties["inertia"])

    @property
    def radius(self) -> float:
        """Radius of the ball of the same volume [m]."""
        return float((3.0 * self.volume / (4.0 * math.pi)) ** (1.0 / 3.0))

    @cached_property
    def extent(self) -> float:
        """Largest distance of the surface from the centre of mass [m]."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    @cached_property
    def _properties(self) -> Any:
        return _surface(self.vertices, self.triangles).mass_properties

    def turned(self, rotation: np.ndarray) -> Solid:
        """The body turned by a rotation (3, 3)."""
        return Solid(self.vertices @ rotation.T, self.triangles)

    def site(self, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where a ray from the centre of mass along ``direction`` leaves the body for good: position (3,) [m] and the
        outward normal (3,) of the triangle there (Moeller & Trumbore 1997, J. Graph. Tools 2, 21).

        Raises ``InputError`` where the ray meets no surface.
        """
        along = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        corner = self.vertices[self.triangles]
        one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        across = np.cross(along, two)
        det = np.einsum("ij,ij->i", one, across)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = -np.einsum("ij,ij->i", corner[:, 0], across) / det
            q = np.cross(-corner[:, 0], one)
            v = (q @ along) / det
            t = np.einsum("ij,ij->i", two, q) / det
            # a ray along an edge belongs to both triangles
            met = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (t > 0.0)
        if not met.any():
            raise InputError("a line from the centre of mass in the direction of the site meets no surface")
        last = int(np.flatnonzero(met)[np.argmax(t[met])])
        normal = np.cross(one[last], two[last])
        return along * float(t[last]), normal / np.linalg.norm(normal)


def surface_of(body: Solid) -> Any:
    """The body as a ``trimesh.Trimesh``."""
    return _surface(body.vertices, body.triangles)


def _surface(vertices: np.ndarray, triangles: np.ndarray) -> Any:
    import trimesh

    return trimesh.Trimesh(vertices, triangles, process=False)


def _centred(vertices: np.ndarray, triangles: np.ndarray) -> Solid:
    centre = np.asarray(_surface(vertices, triangles).mass_properties["center_mass"])
    return Solid(vertices - centre, triangles)


def _named(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The vertices that triangles name, the triangles with their new numbers, and the old ones."""
    used, index = np.unique(triangles, return_inverse=True)
    return vertices[used], index.reshape(-1, 3).astype(np.int64), used


@lru_cache(maxsize=4)
def ellipsoid(axes: tuple[float, float, float]) -> Solid:
    """An ellipsoid of these full axes [m] along x, y and z."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=SUBDIVISIONS)
    scale = (4.0 / 3.0 * math.pi / ball.volume) ** (1.0 / 3.0)
    vertices = np.asarray(ball.vertices) * scale * 0.5 * np.asarray(axes)
    return Solid(vertices, np.asarray(ball.faces, dtype=np.int64))


def read(path: Path, unit: float) -> Solid:
    """The body of a file of triangles (``SUFFIXES``) whose numbers are in ``unit`` [m], about its centre of mass.

    Raises ``InputError`` for a file that is no closed surface, with what is wrong.
    """
    import trimesh

    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"{path}: a shape is read from {', '.join(SUFFIXES)}, not {path.suffix or 'a file without one'}"
        )
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if path.stat().st_size > LARGEST_FILE:
        raise InputError(f"{path}: {path.stat().st_size:,} bytes, more than the {LARGEST_FILE:,} that are read")
    if path.suffix.lower() == ".obj":
        return checked(*obj_file.read(path), unit, str(path))
    try:
        # materials and textures of a file are not looked at, and no other file is opened for them
        mesh: Any = trimesh.load(path, force="mesh", process=False, skip_materials=True, maintain_order=True)
        vertices, triangles = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    except Exception as reason:  # readers of others raise anything on a damaged file
        raise InputError(f"{path}: no surface of triangles can be read from it ({type(reason).__name__})") from None
    return checked(vertices, triangles, unit, str(path))


def checked(vertices: np.ndarray, triangles: np.ndarray, unit: float, name: str) -> Solid:
    """A body of these triangles in ``unit`` [m]; raises ``InputError``, naming what keeps it from being one."""
    if vertices.ndim != 2 or len(vertices) < 4 or len(triangles) < 4:
        raise InputError(f"{name}: {len(triangles)} triangles enclose nothing; the least is 4")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InputError(f"{name}: a triangle names vertex {int(triangles.max()) + 1} of {len(vertices)}")
    vertices, triangles, used = _named(vertices, triangles)
    if not np.isfinite(vertices).all():
        bad = int(used[~np.isfinite(vertices).all(axis=1)][0])
        raise InputError(f"{name}: vertex {bad + 1} is not finite")
    # files of separate triangles (STL) name a corner once for each: equal corners are one
    merged, index = np.unique(vertices, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[triangles]
    whole = (
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    )
    if np.count_nonzero(whole) < 4:
        raise InputError(f"{name}: {np.count_nonzero(whole)} triangles with three corners enclose nothing")
    merged, triangles, _ = _named(merged, triangles[whole])
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    key, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    if (count != 2).any():
        bad = int(np.flatnonzero(count != 2)[0])
        what = "ends the surface" if count[bad] == 1 else f"belongs to {count[bad]} triangles"
        raise InputError(
            f"{name}: not watertight: {int((count != 2).sum()):,} of {len(count):,} edges do not join two triangles; "
            f"the one between {_position(merged[key[bad, 0]])} and {_position(merged[key[bad, 1]])} {what}"
        )
    if len(np.unique(edges, axis=0)) != len(edges):
        raise InputError(f"{name}: neighbouring triangles turn different ways round (normals point in and out)")
    surface = _surface(merged * unit, triangles)
    if surface.volume < 0.0:
        triangles = triangles[:, ::-1].copy()
    if not abs(surface.volume) > 1e-9 * float(np.prod(np.ptp(merged * unit, axis=0))):
        raise InputError(f"{name}: the surface encloses no volume")
    return _centred(merged * unit, triangles)


def _position(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"
