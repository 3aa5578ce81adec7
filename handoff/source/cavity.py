"""Size of the cavity below the datum from the heights of even columns: where it lies, radius, depth, volume, rim."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains.domain import Cone, Domain
from handoff.source.heights import surface_heights

RESOLVED_RADIUS, RESOLVED_DEPTH = 5.0, 2.0
"""Least radius and depth of a crater in mean grain radii: what is smaller the grains cannot take over."""
_SECTORS = 12
# the radius is taken where the wall is this fraction of the depth below the datum, then carried to the datum along a
# parabola
_LEVEL = 0.1
# the centre is that of what lies below this fraction of the greatest depth
_DEEP = 0.5
_COLUMNS = 800
_NEAR = 0.2
# a point holds matter when it is nearer to a particle than this many spacings; such a surface lies 0.2 spacings
# outside the true one
_FILLED, _OUTSIDE = 0.75, 0.2
_LEVEL_GROUND = 0.5
# of a disc that a cavity is looked for in: its least radius in units of the noise, and the fraction of it that a
# cavity may fill
_LEAST_DISC, _ROOM = 10.0, 0.6


@dataclass(frozen=True)
class Cavity:
    """Lengths in m along the datum or the vertical, ``volume`` in m^3 below the datum, ``centre`` (3,) on the datum
    [m]; all zero when there is none."""

    radius: float
    depth: float
    volume: float
    rim_height: float
    centre: np.ndarray

    def distance(self, position: np.ndarray, domain: Domain) -> np.ndarray:
        """(n,) distance along the datum [m] of points from the cavity's centre."""
        return domain.polar(position, self.centre)[0]


def resolved(radius: float, depth: float, grain_radius: float) -> bool:
    """Whether grains of that mean radius take a cavity over: the one rule of what a crater is, for the choice of the
    time, the transfer and the ledger."""
    return radius >= RESOLVED_RADIUS * grain_radius and depth > RESOLVED_DEPTH * grain_radius


def of_particles(position: np.ndarray, spacing: np.ndarray, domain: Domain) -> Cavity:
    """The cavity in a cloud of compact particles, positions (n, 3) [m] and spacings (n,) [m]; one shallower than the
    spacing near the axis is none."""
    near = domain.cut_depth(position) > -2.0 * spacing
    position, spacing = position[near], spacing[near]
    if len(position) == 0:
        return Cavity(0.0, 0.0, 0.0, 0.0, domain.pole)
    tree, reach = cKDTree(position), _FILLED * spacing

    def filled(points: np.ndarray) -> np.ndarray:
        distance, nearest = tree.query(points)
        return distance < reach[nearest]

    def heights_in(part: Domain) -> tuple[np.ndarray, np.ndarray]:
        foot, _, height = surface_heights(filled, part, _COLUMNS)
        below = spacing[tree.query(foot + height[:, None] * part.frame.up(foot))[1]]
        height = height - _OUTSIDE * below
        if not isinstance(
            part, Cone
        ):  # far from a small crater particles are coarse: what is within half of their spacing of the datum is level
            height = np.where(np.abs(height) < _LEVEL_GROUND * below, 0.0, height)
        return foot, height

    return seek(heights_in, domain, spacing_near_axis(position, spacing, domain))


def seek(heights_in: Callable[[Domain], tuple[np.ndarray, np.ndarray]], domain: Domain, noise: float) -> Cavity:
    """The cavity in the smallest disc about the axis that holds it with room to spare: columns as dense for a small
    crater as for a large one.

    ``heights_in`` gives the feet (m, 3) and heights (m,) [m] of even columns of a domain; ``noise`` as in ``measure``.
    A cone is looked at as a whole.
    """
    if not isinstance(domain, Cone):
        halvings = max(0, math.floor(math.log2(domain.arc / (_LEAST_DISC * noise))))
        for k in range(halvings, 0, -1):
            disc = domain.part(domain.arc / 2.0**k)
            cavity = measure(*heights_in(disc), disc, noise)
            off = float(disc.frame.distance(cavity.centre[None])[0])
            if 0.0 < cavity.radius and off + cavity.radius < _ROOM * disc.arc:
                return cavity
    return measure(*heights_in(domain), domain, noise)


def spacing_near_axis(position: np.ndarray, spacing: np.ndarray, domain: Domain) -> float:
    """Median spacing [m] of the particles within a fifth of the domain's radius of the axis; of all where there are
    none."""
    near = spacing[domain.frame.distance(position) < _NEAR * domain.arc]
    return float(np.median(near)) if len(near) else float(np.median(spacing))


def measure(foot: np.ndarray, height: np.ndarray, domain: Domain, noise: float) -> Cavity:
    """The cavity nearest to the axis.

    ``foot`` (m, 3) even points on the datum, ``height`` (m,) of the surface above them [m] (NaN: not known); a
    depression shallower than ``noise`` [m] is none. Centre: the centroid of what lies below half the greatest depth
    (an oblique impact's cavity lies downrange of the impact point). Depth: 3rd percentile of the height inside half
    the radius. Radius: mean over azimuth of the distance at which the wall crosses a tenth of the depth, carried to
    the datum along a parabola. Volume: inside that distance, of each sector's own wall, net of what stands above the
    datum, so that the roughness of a level surface adds nothing.
    """
    known = np.isfinite(height)
    foot, height = foot[known], height[known]
    centre = domain.pole
    if len(height) == 0:
        return Cavity(0.0, 0.0, 0.0, 0.0, centre)
    radius, depth = 0.3 * domain.arc, 0.0
    nothing = Cavity(0.0, 0.0, 0.0, float(max(0.0, np.percentile(height, 99))), centre)
    for _ in range(4):
        distance, azimuth = domain.polar(foot, centre)
        inner = distance < max(radius, np.sort(distance)[min(3, len(distance) - 1)])
        weight = np.where(inner, np.maximum(-height - _DEEP * -float(height[inner].min()), 0.0), 0.0)
        if float(height[inner].min()) >= 0.0 or weight.sum() == 0.0:
            return nothing
        centre = domain.on_datum(weight @ foot / weight.sum())
        distance, azimuth = domain.polar(foot, centre)
        inner = distance < max(0.5 * radius, np.sort(distance)[min(3, len(distance) - 1)])
        depth = -float(np.percentile(height[inner], 3))
        if depth < noise:
            return nothing
        walls = _walls(distance, azimuth, height, depth)
        radius = float(walls.mean())
        if radius <= 0.0:
            return nothing
    area = domain.area / max(known.size, 1)
    inside = height[distance < walls[_sector(azimuth)]]
    volume = domain.volume_below(inside, area)
    crest = height[(distance > 0.8 * radius) & (distance < 1.6 * radius)]
    return Cavity(radius, depth, volume, float(np.percentile(crest, 60)) if len(crest) else 0.0, centre)


def _sector(azimuth: np.ndarray) -> np.ndarray:
    return np.minimum((_SECTORS * (azimuth + math.pi) / (2.0 * math.pi)).astype(int), _SECTORS - 1)


def _walls(distance: np.ndarray, azimuth: np.ndarray, height: np.ndarray, depth: float) -> np.ndarray:
    """Radius at the datum of each sector, 0 where it has no cavity; by the area of the columns that lie deep, without
    a gap from the axis outwards."""
    sector = _sector(azimuth)
    walls = np.zeros(_SECTORS)
    for k in range(_SECTORS):
        mine = np.flatnonzero(sector == k)
        mine = mine[np.argsort(distance[mine])]
        deep = height[mine] < -_LEVEL * depth
        # the wall: the step that best separates deep columns inside from shallow ones outside
        edge = int(np.argmax(np.r_[0, np.cumsum(np.where(deep, 1, -1))]))
        if edge > 0:
            outer = distance[mine[edge]] if edge < len(mine) else distance[mine[-1]]
            walls[k] = 0.5 * (distance[mine[edge - 1]] + outer)
    return walls / math.sqrt(1.0 - _LEVEL)
