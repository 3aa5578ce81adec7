"""A granular column that collapses onto a horizontal floor: how far it runs, how high it stays, what of it never
moves, and how long it takes; and what experiments found.

With R and H the radius and height of the column, a = H / R, R_f and H_f those of the deposit:

    (R_f - R) / R = 1.24 a (a < 1.7),  1.6 a^(1/2) (above)          Lube et al.
    H_f / R = a (low),  0.88 a^(1/6) (above 1.7) Lube et al.;  0.74 (above 0.74) Lajeunesse et al.
    t = 3 (H / g)^(1/2),  and a cone of 59 deg on the base that stays at rest    Lube et al.

Units as in ``bulk_flows``: mean diameter d = 1, density of a grain 1, g = 1; a quarter between two smooth planes.

Sources: Lube, Huppert, Sparks & Hallworth 2004, J. Fluid Mech. 508, 175; Lajeunesse, Mangeney-Castelnau & Vilotte
2004, Phys. Fluids 16, 2371; Lajeunesse, Monnier & Homsy 2005, Phys. Fluids 17, 103302.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from dem.contact.columns import FRICTION, RADIUS, SHAPE
from dem.contact.settings import Contact
from dem.contact.walls import PLANE, Wall
from dem.grains.assembly import Assembly
from studies.granular import carved_bowl
from studies.granular.bulk_flows import PACKED, SIDES, advance, filled, released

TURN = 1.7
"""Aspect ratio at which the law of the run-out changes."""
CELL, MIDDLE = 1.25, 2.5
"""Width of the cells and rings of a profile, and radius of what counts as its middle [d]."""
MOVED = 1.0
"""A grain that has moved by less than this [d] was not disturbed."""
FRONT = (0.5, 2.5)
"""Thicknesses [d] between which the outer slope of the deposit is fitted; where it comes to nothing is the run-out:
the last grains lie one by one."""
MOST, ARRIVED = 0.99, 0.98
"""The front, while it moves, is the radius that holds this fraction of the mass; it has arrived when this fraction of
its way is done."""
STILL = 0.02
"""Rms speed [sqrt(g d)] at which a collapse is over."""


class Floor(NamedTuple):
    """mu_s and beta of the contacts of grains with the floor."""

    friction: float
    shape: float


ROUGH = Floor(1.0, 0.8)
"""A floor that grains neither slide nor roll on, as sandpaper or one with glued grains is in the experiments. A plane
with the grains' own mu_s is one that grains of small mu_s slide on before they yield among themselves."""


class Column(NamedTuple):
    """Aspect ratio at the start (H: twice the height of the centre of mass); run-out (R_f - R) / R measured and after
    Lube et al.; height of the middle at the end over R, likewise; duration until the grains are still [sqrt(d/g)].

    ``radius`` R [d]; ``fraction``: solid, at the start; ``kept``: height of the middle at the end over that of the
    top before; ``cone_deg``: slope of the undisturbed cone; ``foot_deg``: of the deposit's foot; ``arrival`` of the
    front over (H / g)^(1/2); ``speed``: rms, at the end [sqrt(g d)]; ``overlap``: the largest seen, over the smaller
    radius; ``ring`` and ``top``: profile at the end [d].
    """

    aspect: float
    runout: float
    expected: float
    height: float
    expected_height: float
    duration: float
    grains: int
    radius: float
    fraction: float
    kept: float
    cone_deg: float
    foot_deg: float
    arrival: float
    speed: float
    overlap: float
    ring: list[float]
    top: list[float]


def runout_by_law(aspect: float) -> float:
    """(R_f - R) / R."""
    return 1.24 * aspect if aspect < TURN else 1.6 * math.sqrt(aspect)


def height_by_law(aspect: float) -> float:
    """H_f / R by Lube et al."""
    return min(aspect, 0.88 * aspect ** (1.0 / 6.0))


def column(
    aspect: float, radius: float, contact: Contact, seed: int = 1, floor: Floor | None = None
) -> Column:  # fmt: skip
    """A column of ``radius`` [d] and height ``aspect`` * radius let go on a plane with the grains' own friction, or on
    ``floor``."""
    plane = [Wall(PLANE, species=0)]
    start = filled(radius, aspect * radius, plane, contact, seed)
    high = 2.0 * float(start.mass @ start.position[:, 2] / start.mass.sum())
    level, before = _level(start, radius - 1.0), _places(start)
    run = released(start, contact, [*plane, *SIDES])
    if floor:
        run.wall_tables[0, :, [FRICTION, SHAPE]] = np.array(floor)[:, None]
    times, reach, overlap, speed = [0.0], [_reach(run)], 0.0, math.inf
    while run.time < 3.0 * math.sqrt(high) or (STILL < speed and run.time < 20.0 * math.sqrt(high)):
        speed = advance(run, 0.05 * math.sqrt(high))
        times.append(run.time)
        reach.append(_reach(run))
        overlap = max(overlap, run.worst)
    edge, slope = front(*thickness(run))
    middle, moved = _level(run, MIDDLE), np.linalg.norm(_places(run) - before, axis=1)
    volume, aspect = float(np.sum(4.0 / 3.0 * math.pi * run.X[:, RADIUS] ** 3)), high / radius
    return Column(
        aspect, edge / radius - 1.0, runout_by_law(aspect), middle / radius, height_by_law(aspect), run.time,
        len(run.X), radius, volume / (0.25 * math.pi * radius**2 * high), middle / level,
        cone(float(np.mean(moved < MOVED)), aspect), -math.degrees(math.atan(slope)),
        arrival(times, reach) / math.sqrt(high), speed, overlap, *(part.tolist() for part in _profile(run)),
    )  # fmt: skip


def thickness(run: Assembly, width: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Middles of rings [d] about the axis and the thickness of the deposit in them: grain volume over area and
    ``PACKED``."""
    x, across = run.X[: run.moving], _across(run)
    edges = np.arange(0.0, across.max() + 2.0 * width, width)
    volume = np.histogram(across, edges, weights=4.0 / 3.0 * math.pi * x[:, RADIUS] ** 3)[0]
    return 0.5 * (edges[1:] + edges[:-1]), volume / (0.25 * math.pi * np.diff(edges**2)) / PACKED


def front(position: np.ndarray, deep: np.ndarray) -> tuple[float, float]:
    """Distance [d] at which the straight line through the outer slope of a deposit comes to nothing, and its slope."""
    last = int(np.flatnonzero(deep > FRONT[0])[-1])
    first = last
    while first > 0 and deep[first - 1] < FRONT[1]:
        first -= 1
    first = min(first, last - 2)
    slope, offset = np.polyfit(position[first : last + 2], deep[first : last + 2], 1)
    return float(-offset / slope), float(slope)


def arrival(times: list[float], reach: list[float]) -> float:
    """When ``reach`` has done ``ARRIVED`` of its way, between two looks by a straight line."""
    goal = reach[0] + ARRIVED * (reach[-1] - reach[0])
    k = int(np.argmax(np.array(reach) >= goal))
    return times[k - 1] + (times[k] - times[k - 1]) * (goal - reach[k - 1]) / (reach[k] - reach[k - 1])


def of_cone(slope: float, aspect: float) -> float:
    """Fraction of a column that lies in the cone of this ``slope`` (a tangent) on its base."""
    return (1.0 - max(0.0, 1.0 - aspect / slope) ** 3) * slope / (3.0 * aspect)


def cone(fraction: float, aspect: float) -> float:
    """Slope [deg] of the cone on the column's base that holds this fraction of it; 0 of none, 90 of all."""
    low, high = 1e-3 * aspect, 1e3 * aspect
    if not of_cone(low, aspect) < fraction < of_cone(high, aspect):
        return 0.0 if fraction < 0.5 else 90.0
    return math.degrees(math.atan(brentq(lambda slope: of_cone(slope, aspect) - fraction, low, high)))


def _across(run: Assembly) -> np.ndarray:
    return np.hypot(run.position[: run.moving, 0], run.position[: run.moving, 1])


def _places(run: Assembly) -> np.ndarray:
    """Positions in the order of the grains' identities."""
    return run.position[np.argsort(run.identity)].copy()


def _reach(run: Assembly) -> float:
    """Radius [d] that holds ``MOST`` of the mass."""
    across, mass = _across(run), run.mass[: run.moving]
    order = np.argsort(across)
    held = np.cumsum(mass[order])
    return float(across[order[int(np.searchsorted(held, MOST * held[-1]))]])


def _profile(run: Assembly) -> tuple[np.ndarray, np.ndarray]:
    return carved_bowl.profile(run.particles({}, tables=False), CELL, float(_across(run).max()))


def _level(run: Assembly, within: float) -> float:
    """Mean over the area within this radius [d] of the highest tops in cells of ``CELL``."""
    ring, top = carved_bowl.profile(run.particles({}, tables=False), CELL, within)
    return float(np.average(top, weights=ring))
