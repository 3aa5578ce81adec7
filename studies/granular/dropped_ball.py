"""A ball dropped onto a settled bed of beads: how deep it goes, how long that takes, how wide the hollow is; and the
laws that experiments found.

Units: mean diameter of a bead d = 1, density of a bead 1, g = 1. Lower gravity with the same beads is nothing but
stiffer springs in these units: k_n over rho g d^2 goes as 1 / g. Depths are those of the ball's lowest point below the
mean top of the ground (``carved_bowl.profile``), heights those of the same point at the release.

    d = (0.14 / mu) (rho_b / rho_g)^(1/2) D^(2/3) H^(1/3),   H = h + d     depth d, height h, ball's diameter D
    D_c ~ (rho_b D^3 H)^(1/4)                                              diameter of the hollow
    F = -m g + m v^2 / d_1 + k z                                           force on the ball at the depth z

mu: tangent of the beads' angle of friction; rho_b, rho_g: densities of the ball and of the ground in bulk.

Sources: Uehara, Ambroso, Ojha & Durian 2003, Phys. Rev. Lett. 90, 194301; Ambroso, Santore, Abate & Durian 2005, Phys.
Rev. E 71, 051305; Katsuragi & Durian 2007, Nature Phys. 3, 420.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq, least_squares

from dem.beds import flat_bed
from dem.beds.flat_ground import FlatGround
from dem.beds.settings import Settings
from dem.contact.columns import RADIUS
from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.contact.walls import PLANE, Wall, cylinder
from dem.grains.assembly import Assembly, Extras
from dem.stiffness import stiffening
from matter.case.body import Impact, Target
from matter.files import snapshot
from matter.geometry.ground_region import Upright
from matter.particles import Particles
from matter.progress import stop_here
from studies.granular import carved_bowl

BEADS = Contact(steps_per_contact=20, shell=GrainLaw(shape=0.0))
"""Spheres that roll: mu_s = 0.5, e = 0.55."""
BULK, SPREAD = 0.6, 0.15
"""Density of the ground over that of a bead, and radii within +- this of their mean."""
CELL = 1.25
"""Width of the cells and rings of a profile [d]."""
SAMPLE = 0.02
"""Time between two looks at the ball [sqrt(D / g)]."""
QUIET, LATEST = 0.03, 12.0
"""A drop ends when the ball has stopped and the beads' rms speed [sqrt(g d)] is below this, or at this time
[sqrt(D / g)]."""


def settled(seed: int, radius: float, height: float, out: Path) -> Particles:
    """Beads at rest in an upright cylinder of these sizes [d], filled to the height 0: the bed that a case has by
    default (``dem.beds.loose_packing``), made in the folder ``out``, or gone on with there."""
    ground = FlatGround(
        height, 1.0, "half_space", radius, ("beads",), ("basalt",), np.zeros(1),
        {"height_m": np.array([-height, 0.0]), "density_kg_m3": np.full(2, BULK),
         "pressure_Pa": np.array([BULK * height, 0.0]), "layer": np.zeros(2)},
    )  # fmt: skip
    layer = {"name": "beads", "material": "basalt", "thickness": height}
    shot = {"material": "basalt", "radius": 1.0}
    settings = Settings(
        target=Target.model_validate({"layers": [layer], "shape": "half_space", "gravity": 1.0}),
        impact=Impact.model_validate(
            {"speed": 1.0, "angle_from_vertical": 0.0, "projectile": shot, "expected_transient_diameter": radius}
        ),
        contact=BEADS, count=round(6.0 * BULK * radius**2 * height / (1.0 + SPREAD**2)), arc_radius=radius,
        depth=height, headroom_fraction=0.0, radius_spread=SPREAD, growth=0.0, seed=seed,
    )  # fmt: skip
    if not (out / "bed.vtkhdf").is_file():
        out.mkdir(parents=True, exist_ok=True)
        flat_bed.maker(settings, ground)(out)
    bed = snapshot.read(out / "bed.vtkhdf")
    beads = bed.select(bed.headroom == 0)
    beads.tables.update(bed.tables)  # contacts of headroom are dropped where the tables are read
    return beads


def walls(bed: Particles) -> list[Wall]:
    """Floor and side of the bed's cylinder, which has no upper end."""
    box = Upright.of_attribute(bed.attributes["domain"])
    return [Wall(PLANE, point=(0.0, 0.0, box.floor), species=box.floor_species), cylinder(box.radius)]


def level(bed: Particles) -> float:
    """Height of the ground [d]: mean over its area of the highest tops in cells of ``CELL``."""
    ring, height = _profile(bed)
    return float(np.average(height, weights=ring))


def bulk(bed: Particles) -> tuple[float, float]:
    """Solid fraction, and mass over volume, a bead and a half away from floor, side and surface."""
    box = Upright.of_attribute(bed.attributes["domain"])
    x, width, low, top = bed.position, box.radius - 1.5, box.floor + 1.5, level(bed) - 1.5
    inner = (np.hypot(x[:, 0], x[:, 1]) < width) & (x[:, 2] > low) & (x[:, 2] < top)
    volume = math.pi * width**2 * (top - low)
    solid = float(np.sum(4.0 / 3.0 * math.pi * bed.radius[inner] ** 3))
    return solid / volume, float(bed.mass[inner].sum()) / volume


def _profile(bed: Particles) -> tuple[np.ndarray, np.ndarray]:
    return carved_bowl.profile(bed, CELL, bed.attributes["domain"]["radius_m"] - 1.0)


class Ball(NamedTuple):
    """``diameter`` [d]; ``density`` over that of a bead; ``height`` of the release over its diameter."""

    diameter: float
    density: float
    height: float


class Fall(NamedTuple):
    """One drop.

    In diameters D of the ball: ``height`` of the release (a little above what was asked where a bead sticks out), the
    ``depth`` at the end and the ``deepest``, the ``width`` of the hollow where the ground is as high as before and
    from crest to ``crest``. ``froude`` = v / sqrt(g D) at the level; ``duration`` from the touch to the first stop
    [sqrt(D / g)]; ``overlap``: the largest seen, over the smaller radius. On the way: depth ``z`` [d] and ``speed``
    down [sqrt(g d)]. At the end: ``ring`` [d] and by how much the ``ground`` is higher in it than before [d].
    """

    height: float
    froude: float
    depth: float
    deepest: float
    duration: float
    width: float
    crest: float
    quiet: bool
    overlap: float
    steps: int
    z: list[float]
    speed: list[float]
    ring: list[float]
    ground: list[float]


def dropped(bed: Particles, ball: Ball) -> tuple[Particles, float]:
    """The bed with the ball, its last grain, where it first touches a bead, at the speed of its fall; and the height
    [D] of the release."""
    r, x = 0.5 * ball.diameter, bed.position
    reach, across = r + bed.radius, np.hypot(x[:, 0], x[:, 1])
    under = across < reach
    centre = float(np.max(x[under, 2] + np.sqrt(reach[under] ** 2 - across[under] ** 2)))
    touch = centre - r - level(bed)
    height = max(ball.height * ball.diameter, touch)
    mass = ball.density * 4.0 / 3.0 * math.pi * r**3
    one: dict[str, Any] = {
        "identity": bed.identity.max() + 1, "position": (0.0, 0.0, centre),
        "velocity": (0.0, 0.0, -math.sqrt(2.0 * (height - touch))), "angular_velocity": (0.0, 0.0, 0.0), "mass": mass,
        "radius": r, "stiffness": bed.stiffness.max(), "density": ball.density,
    }  # fmt: skip
    fields = {name: np.concatenate([bed[name], [one.get(name, 0)]]) for name in bed}
    return Particles(fields, bed.attributes, bed.tables), height / ball.diameter


def fall(bed: Particles, ball: Ball, springs: float = 1.0) -> Fall:
    """Drop the ball onto the bed; ``springs``: k_n over that in which it settled, g_bed / g in a lower gravity."""
    start, height = dropped(bed, ball)
    run = Assembly(start, BEADS, walls(bed), Field.constant((0.0, 0.0, -1.0)), extras=Extras(offset=springs != 1.0))
    if springs != 1.0:
        stiffening.stiffen(run, stiffening.Springs(factor=springs))
    ground, unit = level(bed), math.sqrt(ball.diameter)
    every = max(1, round(SAMPLE * unit / run.dt))
    t, (z, v), overlap, rms, stopped = [0.0], ([one] for one in _of_ball(run, ground)), 0.0, math.inf, None
    while run.time < LATEST * unit and (stopped is None or rms > QUIET):
        for _ in range(every):
            run.step()
        stop_here("drop")
        overlap = max(overlap, run.worst)
        depth, speed = _of_ball(run, ground)
        if stopped is None:
            for track, value in ((t, run.time), (z, depth), (v, speed)):
                track.append(value)
            if speed <= 0.0:
                stopped = t[-2] + (t[-1] - t[-2]) * v[-2] / (v[-2] - v[-1])
        rms = math.sqrt(float(np.mean(np.sum(run.velocity**2, axis=1))))
    end = run.particles(bed.attributes, tables=False)
    ring, top = _profile(end.select(end.identity <= bed.identity.max()))
    change = top - _profile(bed)[1]
    width, crest = hollow(ring, change)
    return Fall(
        height, math.sqrt(2.0 * height), _of_ball(run, ground)[0] / ball.diameter, max(z) / ball.diameter,
        math.nan if stopped is None else stopped / unit, width / ball.diameter, crest / ball.diameter, rms <= QUIET,
        overlap, run.steps, z, v, ring.tolist(), change.tolist(),
    )  # fmt: skip


def _of_ball(run: Assembly, ground: float) -> tuple[float, float]:
    """Depth of the ball's lowest point [d] and its speed down."""
    k = int(np.argmax(run.identity))
    return ground - float(run.position[k, 2] - run.X[k, RADIUS]), -float(run.velocity[k, 2])


def hollow(ring: np.ndarray, ground: np.ndarray) -> tuple[float, float]:
    """Diameters [d] of a hollow: where the ground first comes up to where it was, outwards from its lowest ring, and
    of its highest ring beyond; nan where there is no hollow."""
    low = int(np.nanargmin(ground))
    up = low + np.flatnonzero((ground[low:-1] < 0.0) & (ground[low + 1 :] >= 0.0))
    if not len(up):
        return math.nan, math.nan
    k = int(up[0])
    part = -ground[k] / (ground[k + 1] - ground[k])
    crest = k + 1 + int(np.nanargmax(ground[k + 1 :]))
    return 2.0 * float(ring[k] + part * (ring[k + 1] - ring[k])), 2.0 * float(ring[crest])


# -- the laws


def depth_by_law(mu: float, density_ratio: float, height: float) -> float:
    """d / D of a ball from the height h / D by Uehara's law: the root of d = c (h + d)^(1/3), c = (0.14 / mu)
    (rho_b / rho_g)^(1/2)."""
    c = 0.14 / mu * math.sqrt(density_ratio)
    return float(brentq(lambda d: d - c * (height + d) ** (1.0 / 3.0), 0.5 * c**1.5, 10.0 + 10.0 * c + height))


def bend(x: Sequence[float], y: Sequence[float]) -> float:
    """Largest distance of y from its straight line over x, over the largest y."""
    return float(np.max(np.abs(np.polyval(np.polyfit(x, y, 1), x) - y)) / np.max(y))


def energy(z: np.ndarray, start: float, d1: float, k: float) -> np.ndarray:
    """Kinetic energy per mass at the depth z under F / m = -1 + v^2 / d_1 + k z (k over the mass): the solution of
    dK/dz = 1 - 2 K / d_1 - k z with K(0) = ``start``."""
    b = -0.5 * k * d1
    a = 0.5 * d1 * (1.0 - b)
    return (start - a) * np.exp(-2.0 * z / d1) + a + b * z


def depth_by_force(start: float, d1: float, k: float) -> float:
    """Depth [d] at which that energy is used up."""
    z = np.linspace(0.0, 2.0 * start / (k * d1) + 2.0 / k + 0.5 * d1, 20001)  # the energy is below zero at its end
    left = energy(z, start, d1, k)
    left[: int(np.argmax(left))] = np.inf
    return float(z[int(np.argmax(left < 0.0))])


def force_law(falls: Sequence[Fall], diameter: float) -> tuple[float, float, list[float]]:
    """d_1 [d] and k over the ball's mass that fit the speeds of all these falls of one ball best, and the depth [D] of
    each by them."""
    starts = [fall.height * diameter for fall in falls]
    tracks = [(np.array(one.z), np.array(one.speed)) for one in falls]
    fastest = max(float(v.max()) for _, v in tracks)

    def misses(logs: np.ndarray) -> np.ndarray:
        rows = []
        for start, (z, v) in zip(starts, tracks, strict=True):
            inside = (z > 0.0) & (v > 0.0)
            rows.append(np.sqrt(2.0 * np.maximum(energy(z[inside], start, *np.exp(logs)), 0.0)) - v[inside])
        return np.concatenate(rows) / fastest

    d1, k = np.exp(least_squares(misses, np.log([diameter, 10.0 / diameter])).x)
    return float(d1), float(k), [depth_by_force(start, d1, k) / diameter for start in starts]
