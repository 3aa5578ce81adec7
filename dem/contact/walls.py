"""Walls: plane, sphere, cone about a body's centre, surface of revolution (cylinder, funnel, disc).

A wall is a row of numbers so that one kernel serves all kinds. The distance of a grain's centre from the wall is
positive inside the domain; the overlap is r - distance. A wall is rigid and at rest: the contact uses the grain's own
k_n and its whole mass.

One wall touches a grain at one point at a time, the nearest. Walls that meet in a corner are therefore separate walls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dem.contact.columns import FRICTION, ROLLING, SHAPE, TWISTING
from matter.compilation.jit import kernel, law
from matter.errors import InputError

PLANE, SPHERE_OUTSIDE, SPHERE_INSIDE, CONE, REVOLVED = range(5)

COLUMNS = 16
"""Columns of a wall's row."""
KIND, POINT, DIRECTION, WALL_RADIUS, SINE, COSINE, TOP = 0, 1, 4, 7, 8, 9, 10
"""Of them: ``PLANE`` ..., point and direction (three columns each), radius [m], sine and cosine of the half angle, top
[m]."""
LINE_P, LINE_A, LINE_DP, LINE_DA, LINE_LOW, LINE_HIGH, RIM_LOW, RIM_HIGH = range(7, 15)
"""Of a surface of revolution: start of the line (p, a) [m], its direction, its ends along it [m], and whether they are
rims."""


@dataclass(frozen=True)
class Wall:
    """One wall.

    ``kind`` one of PLANE, SPHERE_OUTSIDE, SPHERE_INSIDE, CONE, REVOLVED; ``point`` a point of the plane, or the
    centre, apex or origin of the axis; ``direction`` the normal of the plane into the domain, or the axis; ``radius``
    of the sphere [m]; ``half_angle`` of the cone [rad]; ``top`` distance from the apex above which the cone ends, or
    height along z above ``point`` above which a plane or the inside of a sphere ends [m]; ``species`` index whose pair
    with the grain's species gives the contact parameters, or -1 for a frictionless wall with the grain's own
    restitution; ``ends`` of the revolved line, (distance from the axis, height along it) each [m], felt from the left
    of the way from the first to the second; ``rims`` whether each end is a free edge that a grain can touch, rather
    than a joint with another wall.
    """

    kind: int
    point: Sequence[float] = (0.0, 0.0, 0.0)
    direction: Sequence[float] = (0.0, 0.0, 1.0)
    radius: float = 0.0
    half_angle: float = 0.0
    top: float = np.inf
    species: int = -1
    ends: tuple[tuple[float, float], tuple[float, float]] | None = None
    rims: tuple[bool, bool] = (True, True)

    def row(self) -> np.ndarray:
        """The numbers that the kernel reads, shape (COLUMNS,)."""
        length = float(np.linalg.norm(self.direction))
        if length == 0.0:
            raise InputError("a wall needs a direction of non-zero length")
        row = np.zeros(COLUMNS)
        row[KIND] = self.kind
        row[POINT:DIRECTION] = self.point
        row[DIRECTION:WALL_RADIUS] = np.asarray(self.direction, dtype=float) / length
        row[WALL_RADIUS] = self.radius
        row[SINE], row[COSINE] = np.sin(self.half_angle), np.cos(self.half_angle)
        row[TOP] = self.top
        if self.kind == REVOLVED:
            row[LINE_P : RIM_HIGH + 1] = self._line()
        return row

    def cylinder(self) -> tuple[float, float, float] | None:
        """Radius, bottom and top along the axis [m] of an upright cylinder about z that is felt from inside; None of
        any other wall."""
        if self.kind != REVOLVED or self.ends is None or not np.allclose(self.direction, (0.0, 0.0, 1.0)):
            return None
        (p0, a0), (p1, a1) = self.ends
        return (p0, a0, a1) if p0 == p1 and a0 < a1 else None

    def _line(self) -> list[float]:
        """Start, direction, lower and upper end along it, and whether the ends are rims, of the line that is
        revolved."""
        if self.ends is None:
            raise InputError("a wall of revolution needs the two ends of its line")
        (p0, a0), (p1, a1) = self.ends
        if min(p0, p1) < 0.0:
            raise InputError(f"a wall of revolution has a radius below zero: {self.ends}")
        if p0 == p1 and math.isinf(a0) and math.isinf(a1):  # an endless cylinder
            return [p0, 0.0, 0.0, math.copysign(1.0, a1 - a0), -math.inf, math.inf, 0.0, 0.0]
        length = math.hypot(p1 - p0, a1 - a0)
        if not 0.0 < length < math.inf:
            raise InputError(f"a wall of revolution needs two different ends at finite positions: {self.ends}")
        return [p0, a0, (p1 - p0) / length, (a1 - a0) / length, 0.0, length, float(self.rims[0]), float(self.rims[1])]


def cylinder(
    radius: float,
    bottom: float = -math.inf,
    top: float = math.inf,
    point: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    species: int = -1,
    rims: tuple[bool, bool] = (False, True),
    outside: bool = False,
) -> Wall:
    """A cylinder of ``radius`` [m] between the heights ``bottom`` and ``top`` [m] along its axis, felt from inside, or
    from ``outside`` (a post).

    ``rims``: whether a grain can touch the edge at the bottom, at the top.
    """
    if not radius > 0.0 or not bottom < top:
        raise InputError(
            f"a cylinder needs a positive radius and bottom below top: radius {radius:.6g} m, {bottom:.6g} to "
            f"{top:.6g} m"
        )
    if math.isinf(bottom) != math.isinf(top):
        raise InputError("a cylinder is endless in both directions or in none")
    low, high = (radius, bottom), (radius, top)
    return Wall(
        REVOLVED,
        point,
        axis,
        species=species,
        ends=(high, low) if outside else (low, high),
        rims=rims[::-1] if outside else rims,
    )


def rows(walls: Sequence[Wall]) -> np.ndarray:
    """Rows of all walls, shape (w, COLUMNS)."""
    return np.array([wall.row() for wall in walls]).reshape(-1, COLUMNS)


def tables(walls: Sequence[Wall], pair_table: np.ndarray) -> np.ndarray:
    """Contact parameters of each wall with each species, shape (w, s, columns)."""
    out = np.empty((len(walls), pair_table.shape[0], pair_table.shape[2]))
    for w, wall in enumerate(walls):
        for s in range(pair_table.shape[0]):
            out[w, s] = pair_table[wall.species, s] if wall.species >= 0 else pair_table[s, s]
            if wall.species < 0:
                out[w, s, [FRICTION, SHAPE, ROLLING, TWISTING]] = 0.0
    return out


@law
def distance(wall, x, y, z):
    """Distance of a point from the wall [m] (inf where the wall does not reach) and the unit vector from the point
    towards the wall."""
    kind = int(wall[KIND])
    x -= wall[POINT]
    y -= wall[POINT + 1]
    z -= wall[POINT + 2]
    if kind == PLANE:
        if z > wall[TOP]:
            return np.inf, 0.0, 0.0, 1.0
        return (
            x * wall[DIRECTION] + y * wall[DIRECTION + 1] + z * wall[DIRECTION + 2],
            -wall[DIRECTION],
            -wall[DIRECTION + 1],
            -wall[DIRECTION + 2],
        )
    if kind == REVOLVED:
        return _revolved(wall, x, y, z)
    r = math.sqrt(x * x + y * y + z * z)
    if r == 0.0:
        return np.inf, 0.0, 0.0, 1.0
    if kind == SPHERE_OUTSIDE:
        return r - wall[WALL_RADIUS], -x / r, -y / r, -z / r
    if kind == SPHERE_INSIDE:
        if z > wall[TOP]:
            return np.inf, 0.0, 0.0, 1.0
        return wall[WALL_RADIUS] - r, x / r, y / r, z / r
    along = x * wall[DIRECTION] + y * wall[DIRECTION + 1] + z * wall[DIRECTION + 2]
    px, py, pz = x - along * wall[DIRECTION], y - along * wall[DIRECTION + 1], z - along * wall[DIRECTION + 2]
    p = math.sqrt(px * px + py * py + pz * pz)
    gap = along * wall[SINE] - p * wall[COSINE]
    if p == 0.0 or r > wall[TOP] or gap < 0.0:
        # a centre outside the cone has left the domain: it is booked, not pushed back
        return np.inf, 0.0, 0.0, 1.0
    q = wall[COSINE] / p
    return (
        gap,
        px * q - wall[SINE] * wall[DIRECTION],
        py * q - wall[SINE] * wall[DIRECTION + 1],
        pz * q - wall[SINE] * wall[DIRECTION + 2],
    )


@law
def distance_of(walls, w, x, y, z):
    """``distance`` from row ``w`` of ``walls``; a plane is read where it stands, since a row cut out of a table is
    counted atomically, twice."""
    if walls[w, KIND] == PLANE:
        if z - walls[w, POINT + 2] > walls[w, TOP]:
            return np.inf, 0.0, 0.0, 1.0
        px, py, pz = x - walls[w, POINT], y - walls[w, POINT + 1], z - walls[w, POINT + 2]
        d = px * walls[w, DIRECTION] + py * walls[w, DIRECTION + 1] + pz * walls[w, DIRECTION + 2]
        return d, -walls[w, DIRECTION], -walls[w, DIRECTION + 1], -walls[w, DIRECTION + 2]
    return distance(walls[w], x, y, z)


@kernel
def distances(walls, which, position):
    """``distance`` [m] of each point (n, 3 or more) from the wall ``which`` (n,) of it."""
    out = np.empty(which.shape[0])
    for i in range(which.shape[0]):
        out[i] = distance_of(walls, which[i], position[i, 0], position[i, 1], position[i, 2])[0]
    return out


@law
def _revolved(wall, x, y, z):
    """``distance`` of a surface of revolution: the distance from a line, or its ends, in the half-plane (p, a) through
    the axis and the point."""
    a = x * wall[DIRECTION] + y * wall[DIRECTION + 1] + z * wall[DIRECTION + 2]
    px, py, pz = x - a * wall[DIRECTION], y - a * wall[DIRECTION + 1], z - a * wall[DIRECTION + 2]
    p = math.sqrt(px * px + py * py + pz * pz)
    if p > 0.0:
        px, py, pz = px / p, py / p, pz / p
    elif abs(wall[DIRECTION + 2]) < 0.9:  # on the axis every direction is as good: one across it
        q = math.sqrt(wall[DIRECTION] * wall[DIRECTION] + wall[DIRECTION + 1] * wall[DIRECTION + 1])
        px, py, pz = wall[DIRECTION + 1] / q, -wall[DIRECTION] / q, 0.0
    else:
        q = math.sqrt(wall[DIRECTION + 1] * wall[DIRECTION + 1] + wall[DIRECTION + 2] * wall[DIRECTION + 2])
        px, py, pz = 0.0, wall[DIRECTION + 2] / q, -wall[DIRECTION + 1] / q
    dp, da = wall[LINE_DP], wall[LINE_DA]
    fp, fa = p - wall[LINE_P], a - wall[LINE_A]
    s = fp * dp + fa * da
    if s < wall[LINE_LOW] or s > wall[LINE_HIGH]:
        below = s < wall[LINE_LOW]
        if (below and wall[RIM_LOW] == 0.0) or (not below and wall[RIM_HIGH] == 0.0):
            return np.inf, 0.0, 0.0, 1.0
        end = wall[LINE_LOW] if below else wall[LINE_HIGH]
        up, ua = end * dp - fp, end * da - fa
        d = math.sqrt(up * up + ua * ua)
        if d == 0.0:
            return np.inf, 0.0, 0.0, 1.0
        up, ua = up / d, ua / d
    else:
        d = fa * dp - fp * da
        if d < 0.0:  # behind the wall: out of the domain
            return np.inf, 0.0, 0.0, 1.0
        up, ua = da, -dp
    return d, up * px + ua * wall[DIRECTION], up * py + ua * wall[DIRECTION + 1], up * pz + ua * wall[DIRECTION + 2]


@kernel
def within_reach(lo, hi, position, radius, walls, margin, out):
    """Mark those of the grains lo to hi whose surface is nearer to a wall than ``margin`` [m] and a tenth of their
    radius, or of which a wall says nothing."""
    for i in range(lo, hi):
        out[i] = 0
        for w in range(walls.shape[0]):
            d = distance_of(walls, w, position[i, 0], position[i, 1], position[i, 2])[0]
            if d < 1.1 * radius[i] + margin or d == np.inf:
                out[i] = 1
                break
