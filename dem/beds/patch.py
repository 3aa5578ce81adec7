"""A patch of the ground of an ellipsoid or mesh round the site, as a bed of flat ground: for craters that are small
against the body, whose grains would be far too coarse if they filled it.

The shock stage's matter is flattened by ``matter.solids.tangent_map`` at the handoff, and the grains lie in flat
ground under the gravity of the body at the site,

    g = -N . a,   a = attraction of the even body - omega x (omega x x) + tide        (``SolidBody.felt``)

with N the normal there, of the quadric that fits the ground within the bed. What is left out, and how far it goes with
the radius b of the bed and the least radius of curvature R of the ground within it:

* the part of a along the ground, |a| sin(slope): a ``slope`` above ``STEEPEST`` is refused (tan 2 deg = 3.5 % of g);
* verticals are parallel: on the body they part by b / R at the bed's edge, and the ground falls by b^2 / 2 R;
* a layer at the depth d has the area (1 - d / R)^2 of the ground above it.

A crater is some b / 2 wide in radius and a fifth of its diameter deep: with b = ``WIDEST`` R its rim lies 1 % of its
diameter lower than a plane, and its floor has 4 % less area than its ground. Wider and deeper beds are refused. So is
a bed whose floor is nearer to other ground than to that above it: the body is too thin there.

The Coriolis force, 2 omega v against g, is left out too; how large it is at v = sqrt(g D) stands in the report.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dem.beds import extent
from dem.beds.flat_ground import FlatGround
from dem.beds.settings import Settings
from dem.beds.solid_body import SolidBody
from matter.case.at_rest import AtRest
from matter.case.body import Target
from matter.errors import InputError
from matter.geometry.ground_region import OF_TARGET
from matter.solids import attraction
from matter.solids.body_shape import Shape
from matter.solids.placed import PATCH, Placed
from matter.solids.solid import Solid
from matter.wording import readable

STEEPEST = 2.0
"""Largest slope [deg] of the ground at the site."""
WIDEST = 0.1
"""Largest radius, and depth, of the bed over the least radius of curvature of the ground within it."""
THIN = 0.9
"""Least distance of the floor's middle from the ground, over its depth below the site."""
_SHAPES = {bed: ground for ground, bed in OF_TARGET.items()}
_FEWEST = 12


@dataclass(frozen=True)
class Patch:
    """``gravity`` [m/s^2] along the normal at the site, positive downwards; ``slope`` [deg]; ``density`` [kg/m^3];
    ``curvature_radius`` [m], the least of the ground within the bed (infinite where it is plane); ``facts`` of it as
    plain values."""

    gravity: float
    slope: float
    density: float
    curvature_radius: float
    facts: Mapping[str, Any]


@lru_cache(maxsize=4)
def _pull(solid: Solid, height: float) -> np.ndarray:
    return attraction.attraction_at(solid, np.array([0.0, 0.0, height]))


def felt_at_site(body: SolidBody, normal: np.ndarray) -> tuple[float, float]:
    """Gravity [m/s^2] at the site along a ``normal`` (3,), positive downwards, and the slope [deg] of ground with that
    normal."""
    site = np.array([[0.0, 0.0, body.placed.height]])
    a = body.felt(site, body.density * _pull(body.solid, body.placed.height)[None])[0]
    down = -float(a @ normal)
    return down, math.degrees(math.atan2(float(np.linalg.norm(a + down * normal)), down))


def expected_gravity(target: Target, densities: Mapping[str, AtRest]) -> float:
    """Gravity [m/s^2] at the site of an ellipsoid or mesh along the normal there, positive downwards, with spin and
    tide, before there is a ``target.json``."""
    return felt_at_site(SolidBody.expected(target, densities), target.placed.normal)[0]


class SiteGeometry(NamedTuple):
    """``normal`` (3,) of the ground at the site and its principal ``curvature`` (2,) [1/m], positive where convex."""

    normal: np.ndarray
    curvature: np.ndarray


def site_geometry(placed: Placed, axes: tuple[float, float, float] | None, within: float) -> SiteGeometry:
    """Normal and curvature of the ground within a chord [m] of the site: the least-squares quadric, weighted by area.
    The normal of the one triangle under the site may be off by half a degree.

        z = z_0 + t . x - x K x / 2        z along the normal of that triangle, x across it
    """
    site = np.array([0.0, 0.0, placed.height])
    points = Shape(placed, axes).surface_points(
        lambda position: np.maximum(within / 6.0, 0.5 * np.linalg.norm(position - site, axis=1) - 0.5 * within)
    )
    away = np.linalg.norm(points.position - site, axis=1)
    # the far side of a thin body may be as near
    facing = points.normal @ placed.normal > 0.0
    reach = max(within, float(np.sort(away[facing])[: _FEWEST + 1][-1])) if facing.any() else within
    near = facing & (away <= reach)
    x, y, z = placed.from_site(points.position[near]).T / within
    table = np.column_stack([np.ones(len(x)), x, y, -0.5 * x * x, -x * y, -0.5 * y * y])
    weight = np.sqrt(points.area[near])
    _, east, north, xx, xy, yy = np.linalg.lstsq(table * weight[:, None], z * weight, rcond=None)[0]
    normal = np.array([-east, -north, 1.0]) / math.sqrt(1.0 + east**2 + north**2)
    frame = placed.from_site(site + np.eye(3))  # rows: where the axes of the run lie in that frame
    return SiteGeometry(np.asarray(frame @ normal), np.linalg.eigvalsh([[xx, xy], [xy, yy]]) / within)


def target_of(settings: Settings) -> Target:
    """The target as the grains see it: flat ground where their bed is a patch of an ellipsoid's or mesh's, before
    there is a ``target.json``; the settings' own otherwise."""
    if not settings.on_patch:
        return settings.target
    body = SolidBody.expected(settings.target, settings.densities)
    layer, wide = settings.target.layers[0], settings.arc_radius
    gravity = felt_at_site(body, body.placed.normal)[0]
    if gravity <= 0.0:  # ``read`` says so
        return settings.target
    deep = wide
    if settings.shape != "bowl":
        deep = settings.depth or extent.depth(settings.impact.expected_transient_diameter, math.inf)
    ground: dict[str, Any] = {
        "shape": _SHAPES[settings.shape],
        "layers": [{"name": layer.name, "material": layer.material, "thickness": deep}],
        "gravity": gravity,
        "start": settings.target.start,
    }
    if settings.shape != "bowl":
        ground["width"] = 2.0 * wide
    return Target.model_validate(ground)


def read(settings: Settings, path: Path) -> Patch:
    """The patch that the settings ask for, of the body of a ``target.json``. Raises ``InputError`` where its ground
    cannot be laid flat."""
    body = SolidBody.read(path, settings.target)
    wide = settings.arc_radius
    deep = wide
    if settings.shape != "bowl":
        deep = settings.depth or extent.depth(settings.impact.expected_transient_diameter, math.inf)
    ground = site_geometry(body.placed, settings.target.axes, wide)
    gravity, slope = felt_at_site(body, ground.normal)
    if gravity <= 0.0:
        raise InputError(
            f"[bed] the ground at the site weighs nothing ({gravity:.3g} m/s^2 downwards): no grains rest there"
        )
    if slope > STEEPEST:
        raise InputError(
            f'[bed] shape = "{settings.shape}": the ground at the site slopes by {slope:.3g} deg against gravity, at '
            f"most {STEEPEST:g} deg are laid flat: move the site, or fill the whole body"
        )
    radius = 1.0 / max(float(np.abs(ground.curvature).max()), 1e-300)
    for key, length in (("arc_radius", wide), ("depth", deep)):
        if length > WIDEST * radius:
            raise InputError(
                f"[bed] {key} = {length:.6g} m: a patch that is laid flat is at most {WIDEST:g} of the least radius "
                f"of curvature of its ground, {readable.length(radius)}: make it {WIDEST * radius:.4g} m or less, or "
                f"fill the whole body"
            )
    floor = np.array([[0.0, 0.0, body.placed.height]]) - deep * body.placed.normal
    found, cell = float(body.distance.at(floor)[0][0]), body.distance.cell
    if found < THIN * deep - 0.5 * cell:
        raise InputError(
            f"[bed] the {settings.shape} reaches {deep:.6g} m down, and other ground of the body is only "
            f"{max(found, 0.0):.4g} m away from there: the body is too thin"
        )
    omega, size = float(np.linalg.norm(body.omega)), settings.impact.expected_transient_diameter
    facts = {
        "gravity_m_s2": gravity,
        "slope_deg": slope,
        "density_kg_m3": body.density,
        "layer": settings.target.layers[0].name,
        "material": body.material,
        "shape": _SHAPES[settings.shape],
        "depth_m": deep,
        "half_width_m": wide,
        "least_radius_of_curvature_m": radius,
        "fall_of_the_ground_at_the_edge_m": 0.5 * wide**2 / radius,
        "coriolis_over_gravity": 2.0 * omega * math.sqrt(size / gravity),
    }
    return Patch(gravity, slope, body.density, radius, facts)


def ground_of(facts: Mapping[str, Any]) -> FlatGround:
    """The flat ground that a bed's ``facts`` describe; ``InputError`` says what they lack."""
    try:
        depth, g, density = (float(facts[key]) for key in ("depth_m", "gravity_m_s2", "density_kg_m3"))
        half = float(facts["half_width_m"])
        shape, name, material = (str(facts[key]) for key in ("shape", "layer", "material"))
    except KeyError as missing:
        raise InputError(f"the bed's attribute {PATCH!r} lacks {missing}") from None
    height = np.array([-depth, 0.0])
    profile = {
        "height_m": height,
        "density_kg_m3": np.full(2, density),
        "pressure_Pa": -density * g * height,
        "layer": np.zeros(2),
    }
    return FlatGround(depth, g, shape, half, (name,), (material,), np.zeros(1), profile)
