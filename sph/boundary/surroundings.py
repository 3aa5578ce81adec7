"""The boundaries that a case asks for: ``[sph] sides`` and ``floor`` of flat ground as images and edge."""

from __future__ import annotations

import numpy as np

from matter.body import Target
from sph import ground
from sph.boundary.edge import Edge
from sph.boundary.images import Images
from sph.boundary.periodic import Periodic
from sph.boundary.wall import Wall
from sph.target import Body


def chosen(target: Target, sides: str | None, floor: str | None) -> tuple[str, str]:
    """Sides and floor with their defaults: quiet under gravity and for a half-space, else free; a half-sphere has no
    floor, a sphere neither."""
    default = "quiet" if target.flat and (target.gravity > 0.0 or target.shape == "half_space") else "free"
    return sides or default, "free" if target.shape in ("half_sphere", "sphere") else floor or default


def fault(target: Target, sides: str | None, floor: str | None, width: float) -> str:
    """What is wrong with the choice, or an empty text."""
    if not target.flat and (sides or floor):
        return "sides and floor belong to flat ground: a sphere has neither"
    if target.shape == "half_sphere" and floor:
        return "a half_sphere has no floor: its bowl is its sides"
    side, bottom = chosen(target, sides, floor)
    if side in ("wall", "periodic") and target.shape != "block":
        return f"sides = {side!r} needs the flat sides of a block"
    if target.gravity > 0.0 and "free" == (side if target.shape == "half_sphere" else bottom):
        return "under gravity the ground needs something to stand on: fixed, quiet or wall"
    if "quiet" in (side, bottom) and width >= min(target.radius, target.half_width):
        return (
            f"the quiet layer of {width:.4g} m (edge_width) leaves no ground: it is {target.radius:.4g} m deep and "
            f"{2.0 * target.half_width:.4g} m wide"
        )
    return ""


def images(target: Target, sides: str | None, floor: str | None, bottom: float) -> Images | None:
    """Periodic sides, walls at sides and floor (``bottom``, its height [m]); None where there are none."""
    side, under = chosen(target, sides, floor)
    half = target.half_width
    planes: list[Periodic | Wall] = []
    if side == "periodic":
        planes += [Periodic(axis, -half, half) for axis in (0, 1)]
    elif side == "wall":
        planes += [Wall(axis, end) for axis in (0, 1) for end in (-half, half)]
    if under == "wall":
        planes.append(Wall(2, bottom))
    return Images(tuple(planes)) if planes else None


def edge(
    target: Target,
    sides: str | None,
    floor: str | None,
    bottom: float,
    width: float,
    body: Body,
    energy: np.ndarray,
    count: int,
) -> Edge | None:
    """The fixed rim and quiet layer about ``body`` (in order of identity, its ``energy`` [J/kg]) among ``count``
    particles; None where there is neither."""
    side, under = chosen(target, sides, floor)
    if not {side, under} & {"fixed", "quiet"}:
        return None
    far = np.full(len(body.mass), np.inf)
    from_side = ground.depth_from_sides(target, body.position) if side in ("fixed", "quiet") else far
    from_floor = body.position[:, 2] - bottom if under in ("fixed", "quiet") else far
    widths = np.where(from_side <= from_floor, width * (side == "quiet"), width * (under == "quiet"))
    more = count - len(far)
    depth = np.concatenate([np.minimum(from_side, from_floor), np.full(more, np.inf)])
    h, density, energy = (np.concatenate([a, np.zeros(more)]) for a in (body.h, body.density, energy))
    return Edge(depth, h, density, energy, np.concatenate([widths, np.zeros(more)]))
