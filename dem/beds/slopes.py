"""Slopes of a body's surface: the angle between what is up there and the normal of the surface.

    cos(slope) = -n . a / |a|,   a = g - omega x (omega x x) + tide   in the turning frame (``SolidBody.felt``)

g is that of the body at uniform density, summed over an even lattice inside it. Where the slope is above the angle
that slopes of its grains follow (``dem.trials.friction_angle``) friction alone does not hold the surface: it slides,
or cohesion must hold it. The surface is looked at with the eyes of the grains: positions spread evenly over it, with
the direction of the distance one mean grain radius below. Against closed forms (a Maclaurin spheroid, an ellipsoid at
rest) a slope is off by half a degree in the mean and by two at most.

Source: Scheeres et al. 1996, Icarus 121, 67 (slopes of small bodies).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from dem.beds.solid_body import SolidBody
from matter.compilation.jit import kernel
from matter.constants import G
from matter.points import packing

SOURCES = ("Scheeres1996",)

POINTS, LATTICE = 4000, 30_000
"""Places on the surface, and points inside that the field is summed over."""


class Slopes(NamedTuple):
    """``position`` (n, 3) [m] on the surface, each for the same area, and its ``slope`` (n,) [deg]."""

    position: np.ndarray
    slope: np.ndarray

    def against(self, angle: float, body: SolidBody) -> dict[str, Any]:
        """What stands in the report: the largest slope and where it is, and the fraction of the area above ``angle``
        [deg]."""
        worst = int(np.argmax(self.slope))
        latitude, longitude = body.latitude_longitude(self.position[worst : worst + 1])
        return {
            "friction_angle_deg": angle,
            "mean_deg": float(self.slope.mean()),
            "largest_deg": float(self.slope[worst]),
            "largest_at_m": self.position[worst].tolist(),
            "largest_at_latitude_deg": float(latitude[0]),
            "largest_at_longitude_deg": float(longitude[0]),
            "share_above_friction_angle": float(np.mean(self.slope > angle)),
        }


def surface_slopes(body: SolidBody, radius: float) -> Slopes:
    """Slopes of the body's surface for grains of this mean ``radius`` [m]."""
    position = _spread(body, np.random.default_rng(0))
    inwards = body.distance.at(position + radius * (body.distance.at(position)[1]))[1]
    a = body.felt(position, _attraction(body, position))
    down = np.einsum("ij,ij->i", inwards, a) / np.maximum(np.linalg.norm(a, axis=1), 1e-300)
    return Slopes(position, np.degrees(np.arccos(np.clip(down, -1.0, 1.0))))


def _spread(body: SolidBody, rng: np.random.Generator) -> np.ndarray:
    """Places (n, 3) spread over the surface by area."""
    corner = body.solid.vertices[body.solid.triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    edges = np.cumsum(area)
    # one point in each of POINTS equal parts of the area
    part = (np.arange(POINTS) + rng.random(POINTS)) / POINTS * edges[-1]
    chosen = corner[np.minimum(np.searchsorted(edges, part), len(area) - 1)]
    u, v = np.sqrt(rng.random(POINTS)), rng.random(POINTS)
    weights = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
    return np.asarray(np.einsum("ij,ijk->ik", weights, chosen))


def _attraction(body: SolidBody, position: np.ndarray) -> np.ndarray:
    """Attraction (n, 3) [m/s^2] of the body at uniform density: points of a lattice, each with the part of its cell
    that lies below the surface, and soft over half of its spacing."""
    spacing = (body.solid.volume / LATTICE) ** (1.0 / 3.0)
    points = packing.hexagonal(spacing, body.solid.extent + spacing)
    weight = np.clip(body.distance.at(points)[0] / spacing + 0.5, 0.0, 1.0)
    points, weight = points[weight > 0.0], weight[weight > 0.0]
    found = np.empty_like(position)
    _pull(np.ascontiguousarray(position), points, weight, (0.5 * spacing) ** 2, found)
    return G * body.mass / weight.sum() * found


@kernel(fastmath=True)
def _pull(position, points, weight, softening, found):
    """Sum of fraction x / (x^2 + ``softening``)^(3/2) over ``points`` at each ``position``."""
    for i in range(position.shape[0]):
        a, b, c = 0.0, 0.0, 0.0
        for j in range(points.shape[0]):
            x, y, z = points[j, 0] - position[i, 0], points[j, 1] - position[i, 1], points[j, 2] - position[i, 2]
            q = 1.0 / math.sqrt(x * x + y * y + z * z + softening)
            q *= weight[j] * q * q
            a += q * x
            b += q * y
            c += q * z
        found[i, 0], found[i, 1], found[i, 2] = a, b, c
