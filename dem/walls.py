"""Walls: plane, sphere from outside (a core), sphere from inside (a bowl), cone with its apex at a body's centre.

A wall is a row of numbers so that one kernel serves all kinds. The distance of a grain's centre from the wall is positive inside the domain;
the overlap is r - distance. A wall is rigid and at rest: the contact uses the grain's own k_n and its whole mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from matter.errors import InputError
from matter.jit import law

PLANE, SPHERE_OUTSIDE, SPHERE_INSIDE, CONE = range(4)

# columns of a wall's row
COLUMNS = 12


@dataclass(frozen=True)
class Wall:
    """One wall.

    ``kind`` one of PLANE, SPHERE_OUTSIDE, SPHERE_INSIDE, CONE; ``point`` a point of the plane, or the centre or apex; ``direction`` the normal
    of the plane into the domain, or the axis of the cone; ``radius`` of the sphere [m]; ``half_angle`` of the cone [rad];
    ``top`` distance from the apex above which the cone ends [m]; ``species`` index whose pair with the grain's species gives the
    contact parameters, or -1 for a frictionless wall with the grain's own restitution.
    """

    kind: int
    point: Sequence[float] = (0.0, 0.0, 0.0)
    direction: Sequence[float] = (0.0, 0.0, 1.0)
    radius: float = 0.0
    half_angle: float = 0.0
    top: float = np.inf
    species: int = -1

    def row(self) -> np.ndarray:
        """The numbers that the kernel reads, shape (COLUMNS,)."""
        length = float(np.linalg.norm(self.direction))
        if length == 0.0:
            raise InputError("a wall needs a direction of non-zero length")
        row = np.zeros(COLUMNS)
        row[0] = self.kind
        row[1:4] = self.point
        row[4:7] = np.asarray(self.direction, dtype=float) / length
        row[7] = self.radius
        row[8], row[9] = np.sin(self.half_angle), np.cos(self.half_angle)
        row[10] = self.top
        return row


def rows(walls: Sequence[Wall]) -> np.ndarray:
    """Rows of all walls, shape (w, COLUMNS)."""
    return np.array([wall.row() for wall in walls]).reshape(len(walls), COLUMNS)


def tables(walls: Sequence[Wall], pair_table: np.ndarray) -> np.ndarray:
    """Contact parameters of each wall with each species, shape (w, s, columns)."""
    out = np.empty((len(walls), pair_table.shape[0], pair_table.shape[2]))
    for w, wall in enumerate(walls):
        for s in range(pair_table.shape[0]):
            out[w, s] = pair_table[wall.species, s] if wall.species >= 0 else pair_table[s, s]
            if wall.species < 0:
                out[w, s, 2:6] = 0.0
    return out


@law
def distance(wall, x, y, z):
    """Distance of a point from the wall [m] (inf where the wall does not reach) and the unit vector from the point towards the wall."""
    x -= wall[1]
    y -= wall[2]
    z -= wall[3]
    kind = int(wall[0])
    if kind == 0:
        return x * wall[4] + y * wall[5] + z * wall[6], -wall[4], -wall[5], -wall[6]
    r = np.sqrt(x * x + y * y + z * z)
    if r == 0.0:
        return np.inf, 0.0, 0.0, 1.0
    if kind == 1:
        return r - wall[7], -x / r, -y / r, -z / r
    if kind == 2:
        return wall[7] - r, x / r, y / r, z / r
    along = x * wall[4] + y * wall[5] + z * wall[6]
    px, py, pz = x - along * wall[4], y - along * wall[5], z - along * wall[6]
    p = np.sqrt(px * px + py * py + pz * pz)
    gap = along * wall[8] - p * wall[9]
    if p == 0.0 or r > wall[10] or gap < 0.0:
        # a centre outside the cone has left the domain: it is booked, not pushed back
        return np.inf, 0.0, 0.0, 1.0
    q = wall[9] / p
    return gap, px * q - wall[8] * wall[4], py * q - wall[8] * wall[5], pz * q - wall[8] * wall[6]
