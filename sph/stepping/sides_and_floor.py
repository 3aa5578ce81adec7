"""The boundaries that a case asks for: ``[sph] sides`` and ``floor`` of flat ground as images and edge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from matter.case.body import Target
from sph.bodies import ground, symmetry
from sph.bodies.target import Body
from sph.boundary import dispatch, wall
from sph.boundary.edge import LAYERS, Edge
from sph.boundary.images import Images, Plane


def chosen(target: Target, sides: str | None, floor: str | None) -> tuple[str, str]:
    """Sides and floor with their defaults: quiet under gravity and for a half-space, else free; a half-sphere has no
    floor, a sphere neither."""
    default = "quiet" if target.flat and (target.gravity > 0.0 or target.shape == "half_space") else "free"
    return sides or default, "free" if target.shape == "half_sphere" or not target.flat else floor or default


def _chosen(settings: Any) -> tuple[Any, Any]:
    """The files of sides and floor."""
    side, floor = chosen(settings.target, settings.sides, settings.floor)
    return dispatch.module(side), dispatch.module(floor)


def idle_files(settings: Any) -> set[Path]:
    """Files of the boundaries that a run does not take."""
    laws = {file for law in _chosen(settings) for file in (law, *getattr(law, "RESTS_ON", ()))}
    return dispatch.FAMILY.idle_files({dispatch.FAMILY.laws.index(law) for law in laws})


def layers(settings: Any) -> dict[str, float]:
    """Widths [m] of the layers before the rim, by the names of their boundaries."""
    laws = {name: law for name, law in LAYERS.items() if law in _chosen(settings)}
    return {
        name: law.width(dispatch.values(law, settings), settings.target, settings.spacing_far)
        for name, law in laws.items()
    }


def fault(settings: Any) -> str:
    """What is wrong with the choice in the ``settings`` of the stage, or an empty text."""
    target, floor = settings.target, settings.floor
    if not target.flat and (settings.sides or floor):
        return "sides and floor belong to flat ground: a sphere has neither"
    if settings.symmetry != "none" and "periodic" in (settings.sides, floor):
        return f'symmetry = "{settings.symmetry}" and periodic sides exclude each other'
    if target.shape == "half_sphere" and floor:
        return "a half_sphere has no floor: its bowl is its sides"
    side, bottom = chosen(target, settings.sides, floor)
    if side in dispatch.having("NEEDS_BLOCK") and target.shape != "block":
        return f"sides = {side!r} needs the flat sides of a block"
    carrying = dispatch.having("TAKES_MOMENTUM")
    if target.gravity > 0.0 and (side if target.shape == "half_sphere" else bottom) not in carrying:
        *some, last = (name for name in carrying if name in dispatch.having("FLOOR"))
        return f"under gravity the ground needs something to stand on: {', '.join(some)} or {last}"
    for name, width in layers(settings).items():
        if width >= min(target.radius, target.half_width):
            return (
                f"the {name} layer of {width:.4g} m ({', '.join(LAYERS[name].Parameters._fields)}) leaves no ground: "
                f"it is {target.radius:.4g} m deep and {2.0 * target.half_width:.4g} m wide"
            )
    return ""


def images(settings: Any, bottom: float) -> Images | None:
    """Images at sides and floor (``bottom``, its height [m]); None where there are none."""
    side, floor = _chosen(settings)
    half = settings.target.half_width
    planes: list[Plane] = [wall.Wall(axis, 0.0) for axis in symmetry.MIRRORS[settings.symmetry]]
    if hasattr(side, "planes"):
        for axis in (0, 1):
            mirrored = axis in symmetry.MIRRORS[settings.symmetry]
            planes += side.planes(axis, half) if mirrored else side.planes(axis, -half, half)
    if hasattr(floor, "planes"):
        planes += floor.planes(2, bottom)
    return Images(tuple(planes)) if planes else None


def edge(settings: Any, bottom: float, body: Body, energy: np.ndarray, count: int) -> Edge | None:
    """The fixed rim and the layers before it about ``body`` (in order of identity, its ``energy`` [J/kg]) among
    ``count`` particles; None where there is neither."""
    side, floor = _chosen(settings)
    rims = [getattr(law, "RIM", False) for law in (side, floor)]
    if not any(rims):
        return None
    far = np.full(len(body.mass), np.inf)
    from_side = ground.depth_from_sides(settings.target, body.position) if rims[0] else far
    from_floor = body.position[:, 2] - bottom if rims[1] else far
    more = count - len(far)
    widths = {}
    for name, width in layers(settings).items():
        mine = np.where(from_side <= from_floor, side is LAYERS[name], floor is LAYERS[name])
        widths[name] = np.concatenate([width * mine, np.zeros(more)])
    depth = np.concatenate([np.minimum(from_side, from_floor), np.full(more, np.inf)])
    h, density, energy = (np.concatenate([a, np.zeros(more)]) for a in (body.h, body.density, energy))
    return Edge(depth, h, density, energy, widths)
