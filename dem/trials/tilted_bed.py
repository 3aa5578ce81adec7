"""A deep bed (20 d) on a rough base, turned slowly until it flows (``start``), far, and back until it rests
(``stop``).

``start`` depends on the packing, and a loose bed slumps before it flows; ``stop`` lags behind, as what flows has to be
braked. To be compared with steady shear are the angles while it slows down: at the base by the balance of momentum,
and of the stresses inside.
"""

from __future__ import annotations

import math

import numpy as np

from dem.contact.columns import MASS, RADIUS
from dem.contact.settings import Contact
from dem.trials.shear_cell import CELL_STIFFNESS, Cell
from matter.errors import Unsound
from matter.progress import Progress, stop_here

DEPTH, WIDTH = 20.0, 8.0
TURN = 0.04
"""Degrees per sqrt(d/g) while a bed is tilted."""
FLOWS, RESTS = 0.1, 0.01
"""Mean speed over sqrt(g d) above which a tilted bed flows, and below which it rests again."""
FAST, FAR = 0.3, 1.0
"""Mean speed that a tilted bed has to reach, and way in depths that it has to go, before it is turned back: I is then
below 0.01."""


def tilt(contact: Contact, seed: int = 1, spread: float = 0.15, begin: float = 0.0) -> dict[str, float]:
    """A bed tilted from ``begin`` [deg] until it flows and back until it rests: ``start_deg``, ``stop_deg``,
    ``fraction``, ``coordination``.

    ``angle_deg`` is the friction at its base while it comes to rest from a mean speed of ``FAST``, after it has flowed
    over ``FAR`` depths (a strain of some two): tan phi = (integral of g sin theta - change of v_x) / (integral of g
    cos theta + change of v_z), the balance of momentum of all that moves. ``mohr_coulomb_deg`` is that of the stresses
    of the contacts between 3 d and 3/4 of the depth over that time. Standard errors from four parts of it,
    ``duration`` [sqrt(d/g)].
    """
    cell, rest = _settled(contact, seed, spread)
    stretch = max(1, int(1.0 / cell.dt))
    angle, way, start, slid = begin, 1.0, math.nan, 0.0
    # of the stretches of the measurement: time, impulses per mass down the slope and onto it, mean stresses times time
    slowing: list[tuple[float, float, float, float, float, float]] = []
    before = _mean_velocity(cell)
    progress = Progress("tilt", 60.0)
    while True:
        angle += way * TURN * stretch * cell.dt
        cell.gravity[:] = math.sin(math.radians(angle)), 0.0, -math.cos(math.radians(angle))
        mean = cell.run(stretch)
        flow = mean["flow"]
        now, time = _mean_velocity(cell), stretch * cell.dt
        if cell.position[:, 2].min() < -1.0:
            raise Unsound("grains have fallen through the base of the tilted bed")
        progress.update(angle, f"{angle:.2f} deg, {flow:.3g} sqrt(g d)")
        stop_here("friction angle")
        if way > 0.0 and flow > FLOWS and math.isnan(start):
            start = angle
        slid = slid + flow * time if flow > FLOWS else 0.0  # a jerk that comes to rest again is no flow
        if way > 0.0 and flow > FAST and slid > FAR * DEPTH:
            way = -1.0
        if way < 0.0 and flow < FAST:
            impulse = time * cell.gravity - (now - before)
            slowing.append((time, impulse[0], -impulse[2], mean["xx"] * time, mean["zz"] * time, mean["xz"] * time))
        before = now
        if way < 0.0 and flow < RESTS:
            break
        if not begin - 10.0 < angle < 60.0:
            raise Unsound(f"the tilted bed neither flows nor rests at {angle:.3g} deg")
    along = np.array(slowing)
    parts = np.array([_angles(part) for part in np.array_split(along, 4) if len(part)])
    slope, principal = _angles(along)
    errors = np.std(parts, axis=0, ddof=1) / math.sqrt(len(parts))
    inside = (cell.position[:, 2] > 3.0) & (cell.position[:, 2] < 0.75 * DEPTH)
    volume = float(np.sum(math.pi / 6.0 * (2.0 * cell.X[inside, RADIUS]) ** 3)) / (
        WIDTH * WIDTH * (0.75 * DEPTH - 3.0)
    )
    return {
        "angle_deg": slope, "error_deg": float(errors[0]), "mohr_coulomb_deg": principal,
        "mohr_coulomb_error_deg": float(errors[1]),
        "start_deg": start, "stop_deg": angle, "fraction": volume, "coordination": rest["coordination"],
        "duration": float(along[:, 0].sum()),
    }  # fmt: skip


def _settled(contact: Contact, seed: int, spread: float) -> tuple[Cell, dict[str, float]]:
    """A bed at rest on its base, level, and its means over the last five sqrt(d/g)."""
    x, radius, held = _bed_on_a_base(seed, spread)
    slick = contact.model_copy(update={"shell": contact.shell.model_copy(update={"restitution": 0.3})})
    # the period along z is out of reach: the bed is open above
    cell = Cell(x, radius, np.array([WIDTH, WIDTH, 40.0 * DEPTH]), slick, CELL_STIFFNESS * 0.6 * DEPTH, held)
    cell.gravity[2] = -1.0
    cell.slab[:] = 3.0, 0.75 * DEPTH
    # the lattice is more than twice as high as the bed: without it the last grains would burst those at the base
    cell.drag = 0.3
    cell.run(int(50.0 / cell.dt))
    cell.set_law(contact)
    cell.drag = 0.5
    cell.run(int(20.0 / cell.dt))
    cell.drag = 0.0
    return cell, cell.run(int(5.0 / cell.dt))


def _angles(stretches: np.ndarray) -> tuple[float, float]:
    """Angle at the base and angle of the principal stresses [deg] of stretches of the tilted bed's slowing down."""
    _, down, onto, xx, zz, xz = stretches.sum(axis=0)
    return math.degrees(math.atan(down / onto)), math.degrees(
        math.asin(min(1.0, math.hypot(0.5 * (xx - zz), xz) / (0.5 * (xx + zz))))
    )


def _bed_on_a_base(seed: int, spread: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grains on a loose lattice above a rough base, their radii, and which are held: the base.

    The base is closed: grains of the mean size side by side, every second row a quarter of a diameter higher. (A base
    as loose as the lattice lets small grains fall through; they come back on top, through the far period, as fast as
    they have fallen.)
    """
    count = int(0.6 * WIDTH * WIDTH * DEPTH / (math.pi / 6.0))
    rng = np.random.default_rng(seed)
    free = 0.5 * rng.uniform(1.0 - spread, 1.0 + spread, count)
    across = math.floor(WIDTH / (2.0 * free.max()))
    spacing, index = WIDTH / across, np.arange(count)
    x = spacing * np.column_stack([index % across, index // across % across, index // across**2]) + rng.uniform(
        -0.02, 0.02, (count, 3)
    )
    x[:, 2] += 1.5
    rows = 2 * math.floor(0.5 * WIDTH)
    first, second = (side.ravel() for side in np.meshgrid(np.arange(rows), np.arange(rows), indexing="ij"))
    base = np.column_stack([first * WIDTH / rows, second * WIDTH / rows, 0.25 * (first % 2)])
    held = np.arange(len(base) + count) < len(base)
    return np.concatenate([base, x]), np.concatenate([np.full(len(base), 0.5), free]), held


def _mean_velocity(cell: Cell) -> np.ndarray:
    """Velocity (3,) of the centre of mass of the grains that are not held."""
    free = ~cell.held
    return np.asarray(cell.V[free, MASS] @ cell.velocity[free] / cell.V[free, MASS].sum())
