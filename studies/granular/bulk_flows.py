"""Fillings of many grains, and flows from them whose outcome is known from experiments: a hopper that drains, a heap
that is left on a plate (a column that collapses: ``collapsed_column``).

Units: mean diameter d = 1, density of a grain 1, g = 1; of column and heap a quarter between two smooth planes, of the
hopper all: in a quarter a vault of a dozen grains, held by its mirror images, blocks a hole of eight diameters. k_n =
600 rho g H d^2 for the height H of the filling, so that neither load nor fall makes overlaps above some hundredths of
a diameter.

Source: Beverloo, Leniger & van de Velde 1961, Chem. Eng. Sci. 15, 260.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dem.beds.relaxation import Fire
from dem.contact.columns import RADIUS
from dem.contact.gravity import Field
from dem.contact.settings import OCEAN, Contact
from dem.contact.walls import PLANE, REVOLVED, Wall, cylinder
from dem.grains.assembly import LEFT, Assembly
from matter.errors import InputError
from matter.particles import Particles
from matter.progress import stop_here

PACKED = 0.60
"""Share of a filling's volume that its grains take before they settle."""
SIDES = (Wall(PLANE, direction=(1.0, 0.0, 0.0)), Wall(PLANE, direction=(0.0, 1.0, 0.0)))
"""The two smooth planes that cut out a quarter."""
STIFFNESS = 600.0


def funnel(
    lower: tuple[float, float],
    upper: tuple[float, float],
    point: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    species: int = -1,
    rims: tuple[bool, bool] = (True, False),
    outside: bool = False,
) -> Wall:
    """A cut cone between the circles ``lower`` and ``upper``, (radius, height) each [m], felt from inside, or from
    ``outside`` (a mound).

    Equal heights give a flat disc, a floor with a hole, felt from above. ``rims``: whether a grain can touch the edge
    at the lower and upper circle; not so at a joint with a cylinder.
    """
    return Wall(
        REVOLVED,
        point,
        axis,
        species=species,
        ends=(upper, lower) if outside else (lower, upper),
        rims=rims[::-1] if outside else rims,
    )


def filled(
    radius: float, height: float, floor: Sequence[Wall], contact: Contact, seed: int = 1, spread: float = 0.15,
    sides: Sequence[Wall] = SIDES,
    stiffness: float = STIFFNESS,
) -> Assembly:  # fmt: skip
    """A quarter of an upright cylinder of grains, without ``sides`` the whole, at rest on the walls ``floor``; the
    last wall is the cylinder itself.

    ``stiffness``: k_n over rho g H d^2.

    Random points are relaxed without friction below a lid, then come to rest with friction under gravity.
    """
    rng = np.random.default_rng(seed)
    sector = 0.5 * math.pi if sides else 2.0 * math.pi
    count = int(PACKED * 0.5 * sector * radius**2 * height / (math.pi / 6.0))
    if count < 50:
        raise InputError(
            f"a cylinder of radius {radius:g} and height {height:g} diameters holds {count} grains: too few"
        )
    r = 0.5 * rng.uniform(1.0 - spread, 1.0 + spread, count)
    along, angle = (radius - r) * np.sqrt(rng.uniform(size=count)), rng.uniform(0.0, sector, count)
    x = np.column_stack([along * np.cos(angle), along * np.sin(angle), rng.uniform(r, height - r)])
    mass = 4.0 / 3.0 * math.pi * r**3
    zero, ones = np.zeros((count, 3)), np.ones(count)
    grains = Particles(
        dict(
            identity=np.arange(count), position=x, velocity=zero, angular_velocity=zero, mass=mass, radius=r,
            material=0 * ones, species=0 * ones,
            stiffness=stiffness * height * 2.0 * r,
        )
    )  # fmt: skip
    smooth = OCEAN.model_copy(update={"restitution": 0.5})
    walls = [*floor, *sides, cylinder(radius)]
    lid = Wall(PLANE, point=(0.0, 0.0, height), direction=(0.0, 0.0, -1.0))
    packing = Assembly(grains, contact.model_copy(update={"shell": smooth}), [*walls, lid], overlap_limit=np.inf)
    fire = Fire(packing)
    for _ in range(500):
        fire.step()
    grains = packing.particles({}, tables=False)
    grains["velocity"] = zero
    bed = Assembly(grains, contact, walls, Field.constant((0.0, 0.0, -1.0)), overlap_limit=np.inf)
    bed.drag[:] = 2.0
    advance(bed, 2.0 + 0.15 * height)
    bed.drag[:] = 0.2
    while advance(bed, 2.0) > 0.01:
        pass
    bed.drag[:] = 0.0
    bed.overlap_limit = contact.overlap_stop
    return bed


def advance(bed: Assembly, duration: float) -> float:
    """Step for ``duration`` [sqrt(d/g)]; returns the rms speed at its end."""
    for _ in range(max(1, round(duration / bed.dt))):
        bed.step()
    stop_here("bulk flow")
    here = bed.velocity[: bed.moving]
    return float(np.sqrt(np.mean(np.sum(here**2, axis=1)))) if len(here) else 0.0


def released(bed: Assembly, contact: Contact, walls: Sequence[Wall]) -> Assembly:
    """The same grains, contacts and springs among other walls (``walls`` keeps the places of those that stay)."""
    return Assembly(bed.particles({"time": 0.0}), contact, walls, bed.gravity)


def remove_fallen(bed: Assembly, below: float) -> int:
    """Take away the grains whose centres are lower than ``below``; returns how many."""
    fallen = (bed.position[:, 2] < below) & (bed.state != LEFT)
    count = int(fallen.sum())
    if count:
        bed.change_states(fallen, LEFT, "landed_outside")
    return count


class Hopper(NamedTuple):
    """Diameter of the hole [d]; mass per time [rho d^3 sqrt(g/d)] and its standard error; bulk fraction of the
    filling; grains that have fallen; the time of the rate [sqrt(d/g)]."""

    hole: float
    rate: float
    error: float
    fraction: float
    fallen: int
    duration: float


SHARES = (0.08, 0.35)
"""Shares of the filling between which the rate is taken: the flow has come to its pace, and the filling is still
higher than the hole is wide."""


def filling(radius: float, height: float, contact: Contact, seed: int = 1) -> Assembly:
    """The grains of a hopper, on a closed floor."""
    return filled(radius, height, [Wall(PLANE, species=0)], contact, seed, sides=())


def hopper(hole: float, full: Assembly, radius: float, contact: Contact) -> Hopper:
    """A flat-bottomed hopper of ``radius``, ``full`` (``filling``), drains through a round hole in its floor; the rate
    is that between ``SHARES``.

    Raises ``InputError`` when nothing has fallen for a time of 20 sqrt(d/g).
    """
    middle = 0.5 * float(full.position[:, 2].max())
    low = full.X[(full.position[:, 2] < middle), RADIUS]
    fraction = float(np.sum(4.0 / 3.0 * math.pi * low**3) / (math.pi * radius**2 * middle))
    bed = released(full, contact, [funnel((0.5 * hole, 0.0), (radius, 0.0), species=0), cylinder(radius)])
    whole, fallen, last = float(bed.mass.sum()), 0, 0.0
    times, out = [0.0], [0.0]
    while out[-1] < SHARES[1] * whole:
        advance(bed, 0.5)
        removed = remove_fallen(bed, -2.0)
        fallen, last = fallen + removed, bed.time if removed else last
        times.append(bed.time)
        out.append(whole - float(bed.mass[: bed.moving].sum()))
        if bed.time > last + 20.0:
            raise InputError(f"the hopper with a hole of {hole:g} diameters is blocked after {fallen} grains")
    time, mass = np.array(times), np.array(out)
    steady = mass > SHARES[0] * whole
    return Hopper(hole, *_slope(time[steady], mass[steady]), fraction, fallen, float(np.ptp(time[steady])))


def _slope(time: np.ndarray, mass: np.ndarray) -> tuple[float, float]:
    """Slope of a line and its standard error, from the scatter of the slopes of four stretches."""
    parts = [np.polyfit(time[k], mass[k], 1)[0] for k in np.array_split(np.arange(len(time)), 4) if len(k) > 2]
    error = float(np.std(parts, ddof=1) / math.sqrt(len(parts))) if len(parts) > 1 else math.inf
    return float(np.polyfit(time, mass, 1)[0]), error


def beverloo(hole: np.ndarray, fraction: float, c: float = 0.58, k: float = 1.4) -> np.ndarray:
    """W = C rho_b sqrt(g) (D - k d)^(5/2) [rho d^3 sqrt(g/d)]; rho_b = ``fraction`` in these units."""
    return c * fraction * (np.asarray(hole) - k) ** 2.5


class Heap(NamedTuple):
    """Slope of the heap's side [deg] by a straight line through the ring-wise surface, its standard error, and the
    grains left."""

    angle_deg: float
    error_deg: float
    grains: int


def heap(radius: float, contact: Contact, seed: int = 1, height: float | None = None) -> Heap:
    """What is left of a cylinder on a round plate of its own size when its side is taken away: the angle of repose.

    Nothing falls far or is loaded much here: k_n is a quarter of that of the other flows.
    """
    plate = [funnel((0.0, 0.0), (radius, 0.0), species=0, rims=(False, True))]
    bed = filled(radius, height or 0.9 * radius, plate, contact, seed, stiffness=0.25 * STIFFNESS)
    bed = released(bed, contact, [*plate, *SIDES])
    for _ in range(200):
        moving = advance(bed, 2.0)
        remove_fallen(bed, -3.0)
        if moving < 0.01 and bed.time > 20.0:
            break
    x = bed.X[: bed.moving]
    across, angle, top = np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0]), x[:, 2] + x[:, RADIUS]
    rings, heights = [], []
    for inner in np.arange(0.15 * radius, 0.85 * radius, 1.0):
        sectors = max(1, int(0.5 * math.pi * (inner + 0.5) / 1.5))
        here = (across >= inner) & (across < inner + 1.0)
        tops = [top[here & (np.floor(angle / (0.5 * math.pi) * sectors) == s)] for s in range(sectors)]
        tops = [t.max() for t in tops if len(t)]
        if tops:
            rings.append(inner + 0.5)
            heights.append(float(np.mean(tops)))
    (slope, _), covariance = np.polyfit(rings, heights, 1, cov=True)
    return Heap(-math.degrees(math.atan(slope)), math.degrees(math.sqrt(covariance[0, 0])), len(x))
