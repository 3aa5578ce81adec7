"""The friction angle of a bed of grains, measured: steady shear, or a bed that is tilted until it flows; and contact
parameters for a wanted angle.

``shear``  simple shear of a periodic cell at constant normal stress (``dem.trials.shear_cell``), slow against the
grains' own motion: inertial
           number I = (dgamma/dt) d sqrt(rho / P) = 0.002, without friction 0.0005 (there the excess falls with sqrt(I)
           only). The steady state has forgotten how the grains were packed.
``tilt``   a deep bed (20 d) on a rough base, turned slowly until it flows (``start``), far, and back until it rests
           (``stop``). ``start`` depends on the packing, and a loose bed slumps before it flows; ``stop`` lags behind,
           as what flows has to be braked. To be compared with ``shear`` are the angles while it slows down: at the
           base by the balance of momentum, and of the stresses inside.

Each gives two angles:

``mohr_coulomb_deg``  sin phi = (s1 - s3) / (s1 + s3) of the principal stresses in the plane of the flow: what
compression tests of sand give, and what
                      ``friction_angle`` means, here as in ``drucker_prager`` of the shock stage;
``angle_deg``         tan phi = tau / sigma_n on the plane of shear: what slopes of these grains follow. It is the
                      smaller one: were the axes of stress those of the rate of strain, its tangent would be the sine
                      of the other (Davis 1968).

Both use the contact laws of the stage with k_n = ``STIFFNESS`` P d (overlaps of some thousandths of a diameter): from
there on the angle does not depend on k_n. An angle is kept under a hash of everything that it depends on, in
``friction_angle/`` beside the compiled kernels.

Command: ``python -m dem.friction_angle [--case CASE] [--friction MU] [--shape BETA] [--method shear|tilt] [--find "30
deg"]``.

Sources: Davis 1968, in Soil Mechanics: Selected Topics, ch. 6; GDR MiDi 2004, Eur. Phys. J. E 14, 341 (both flows, I);
Peyneau & Roux 2008, Phys. Rev. E 78, 011307 (frictionless spheres: 5.76 deg).
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dem.columns import MASS, RADIUS
from dem.contact_settings import Contact
from dem.trials.shear_cell import Cell
from matter import archive, jit
from matter.errors import InputError, Unsound
from matter.progress import Progress, stop_here

STIFFNESS = 150.0
SLOW, SLOW_SMOOTH = 2e-3, 5e-4
BLOCK = 0.1
"""Strain of one block of the mean; its error comes from the scatter of the blocks, taken singly and in twos and
fours."""
WANTED_ERROR = 0.35
"""Degrees: a measurement goes on until its standard error is below this, between the smallest and the largest
strain."""
LEAST, MOST = 2.0, 6.0
DEPTH, WIDTH = 20.0, 8.0
TURN = 0.04
"""Degrees per sqrt(d/g) while a bed is tilted."""
FLOWS, RESTS = 0.1, 0.01
"""Mean speed over sqrt(g d) above which a tilted bed flows, and below which it rests again."""
FAST, FAR = 0.3, 1.0
"""Mean speed that a tilted bed has to reach, and way in depths that it has to go, before it is turned back: I is then
below 0.01."""

Method = Literal["shear", "tilt"]


def _sample(count: int, seed: int, spread: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Grains on a loose cubic lattice with a little disorder, their radii, and the lattice's side."""
    rng = np.random.default_rng(seed)
    radius = 0.5 * rng.uniform(1.0 - spread, 1.0 + spread, count)
    side = math.ceil(count ** (1.0 / 3.0))
    apart = 2.0 * radius.max() + 0.02
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[
        rng.permutation(side**3)[:count]
    ]
    return apart * lattice + rng.uniform(-0.01, 0.01, (count, 3)), radius, side


def shear(contact: Contact, seed: int = 1, count: int = 1000, spread: float = 0.15) -> dict[str, float]:
    """Steady simple shear: both angles and their errors (``error_deg``, ``mohr_coulomb_error_deg``), ``fraction``,
    ``coordination``, ``strain``."""
    x, radius, side = _sample(count, seed, spread)
    length = (2.0 * radius.max() + 0.02) * side
    cell = Cell(x, radius, np.array([length, length, 1.2 * length]), contact, STIFFNESS)
    smooth = contact.shell.friction == 0.0
    slow = SLOW_SMOOTH if smooth else SLOW
    cell.pressure = 1.0
    # the loose lattice is pressed together while it is sheared quickly, then brought to the slow state
    for rate, strain in ((0.05, 1.0), (0.02, 0.6), (5.0 * slow, 0.2), (slow, 0.2)):
        cell.rate = rate
        cell.run(max(1, int(strain / rate / cell.dt)))
    steps = max(1, int(BLOCK / slow / cell.dt))
    rows: list[list[float]] = []
    progress = Progress("friction angle", MOST)
    while True:
        mean = cell.run(steps)
        tau, normal = -mean["xz"], mean["zz"]
        half, middle = 0.5 * (mean["xx"] - normal), 0.5 * (mean["xx"] + normal)
        rows.append([tau / normal, math.hypot(half, tau) / middle, mean["fraction"], mean["coordination"]])
        strain = BLOCK * len(rows)
        table = np.array(rows)
        error = math.degrees(_error(table[:, 0]) / (1.0 + table[:, 0].mean() ** 2))
        sine_error = math.degrees(_error(table[:, 1]) / math.sqrt(max(1.0 - table[:, 1].mean() ** 2, 1e-12)))
        progress.update(strain, f"{math.degrees(math.atan(table[:, 0].mean())):.2f} +- {error:.2f} deg")
        stop_here("friction angle")
        if strain >= MOST or (strain >= LEAST and error < WANTED_ERROR):
            break
    mu, sine, fraction, coordination = table.mean(axis=0)
    return {
        "angle_deg": math.degrees(math.atan(mu)), "error_deg": error,
        "mohr_coulomb_deg": math.degrees(math.asin(min(1.0, sine))),
        "mohr_coulomb_error_deg": sine_error, "fraction": float(fraction), "coordination": float(coordination),
        "strain": strain, "inertial": slow,
    }  # fmt: skip


def _error(values: np.ndarray) -> float:
    """Standard error of the mean of correlated values: the largest over blocks of one, two and four."""
    found = []
    for size in (1, 2, 4):
        whole = len(values) // size
        if whole >= 4:
            means = values[: whole * size].reshape(whole, size).mean(axis=1)
            found.append(float(means.std(ddof=1)) / math.sqrt(whole))
    return max(found, default=math.inf)


def tilt(contact: Contact, seed: int = 1, spread: float = 0.15, begin: float = 0.0) -> dict[str, float]:
    """A bed tilted from ``begin`` [deg] until it flows and back until it rests: ``start_deg``, ``stop_deg``,
    ``fraction``, ``coordination``.

    ``angle_deg`` is the friction at its base while it comes to rest from a mean speed of ``FAST``, after it has flowed
    over ``FAR`` depths (a strain of some two): tan phi = (integral of g sin theta - change of v_x) / (integral of g
    cos theta + change of v_z), the balance of momentum of all that moves. ``mohr_coulomb_deg`` is that of the stresses
    of the contacts between 3 d and 3/4 of the depth over that time. Standard errors from four parts of it,
    ``duration`` [sqrt(d/g)].
    """
    x, radius, held = _bed_on_a_base(seed, spread)
    slick = contact.model_copy(update={"shell": contact.shell.model_copy(update={"restitution": 0.3})})
    # the period along z is out of reach: the bed is open above
    cell = Cell(x, radius, np.array([WIDTH, WIDTH, 40.0 * DEPTH]), slick, STIFFNESS * 0.6 * DEPTH, held)
    cell.gravity[2] = -1.0
    cell.slab[:] = 3.0, 0.75 * DEPTH
    # the lattice is more than twice as high as the bed: without it the last grains would burst those at the base
    cell.drag = 0.3
    cell.run(int(50.0 / cell.dt))
    cell.set_law(contact)
    cell.drag = 0.5
    cell.run(int(20.0 / cell.dt))
    cell.drag = 0.0
    rest = cell.run(int(5.0 / cell.dt))
    stretch = max(1, int(1.0 / cell.dt))
    angle, way, start, gone = begin, 1.0, math.nan, 0.0
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
        if cell.X[:, 2].min() < -1.0:
            raise Unsound("grains have fallen through the base of the tilted bed")
        progress.update(angle, f"{angle:.2f} deg, {flow:.3g} sqrt(g d)")
        stop_here("friction angle")
        if way > 0.0 and flow > FLOWS and math.isnan(start):
            start = angle
        gone = gone + flow * time if flow > FLOWS else 0.0  # a jerk that comes to rest again is no flow
        if way > 0.0 and flow > FAST and gone > FAR * DEPTH:
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
    found, principal = _angles(along)
    errors = np.std(parts, axis=0, ddof=1) / math.sqrt(len(parts))
    inside = (cell.X[:, 2] > 3.0) & (cell.X[:, 2] < 0.75 * DEPTH)
    volume = float(np.sum(math.pi / 6.0 * (2.0 * cell.X[inside, RADIUS]) ** 3)) / (
        WIDTH * WIDTH * (0.75 * DEPTH - 3.0)
    )
    return {
        "angle_deg": found, "error_deg": float(errors[0]), "mohr_coulomb_deg": principal,
        "mohr_coulomb_error_deg": float(errors[1]),
        "start_deg": start, "stop_deg": angle, "fraction": volume, "coordination": rest["coordination"],
        "duration": float(along[:, 0].sum()),
    }  # fmt: skip


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
    apart, place = WIDTH / across, np.arange(count)
    x = apart * np.column_stack([place % across, place // across % across, place // across**2]) + rng.uniform(
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
    return np.asarray(cell.V[free, MASS] @ cell.W[free, :3] / cell.V[free, MASS].sum())


# -- kept results
# --------------------------------------------------------------------------------------------------------------


def _sources() -> list[str]:
    """What of the code an angle depends on: the contact laws and the cell."""
    here = Path(__file__).resolve()
    own = here.read_text().split("# -- kept results")[0]
    trees = [
        ast.dump(ast.parse(text)) for text in (here.with_name("trials").joinpath("shear_cell.py").read_text(), own)
    ]  # comments and lay-out do not matter
    return [jit.source_key(here.with_name("contact.py")), hashlib.sha256("".join(trees).encode()).hexdigest()]


def _place(contact: Contact, method: str, options: dict[str, Any]) -> Path:
    law = contact.model_dump(include={"shell", "tangential_stiffness_ratio", "sliding", "attractive_tail"})
    constants = [
        STIFFNESS,
        SLOW,
        SLOW_SMOOTH,
        BLOCK,
        WANTED_ERROR,
        LEAST,
        MOST,
        DEPTH,
        WIDTH,
        TURN,
        FLOWS,
        RESTS,
        FAST,
        FAR,
    ]
    text = json.dumps([law, method, options, constants, _sources()], sort_keys=True)
    return jit.cache_root().parent / "friction_angle" / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.json"


def measure(contact: Contact, method: Method = "shear", **options: Any) -> dict[str, float]:
    """The angle of the solid grains (``contact.shell``) by ``shear`` or ``tilt``, taken from the kept results when it
    was measured before."""
    place = _place(contact, method, options)
    if place.is_file():
        return json.loads(place.read_text())
    found = shear(contact, **options) if method == "shear" else tilt(contact, **options)
    place.parent.mkdir(parents=True, exist_ok=True)
    archive.write_text(place, json.dumps(found, indent=1))
    return found


def with_friction(contact: Contact, friction: float) -> Contact:
    """The same law with another friction mu_s of the solid grains."""
    return contact.model_copy(update={"shell": contact.shell.model_copy(update={"friction": round(friction, 4)})})


TRIAL = (0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0)
"""Frictions that are tried, from the middle outwards, until two enclose the wanted angle."""


def friction_for(angle_deg: float, contact: Contact, seeds: Sequence[int] = (1, 2)) -> tuple[float, float, float]:
    """mu_s at which the solid grains of ``contact`` have this Mohr-Coulomb angle: (mu_s, angle by the fitted line, its
    standard error [deg]).

    mu_s and not beta, because the angle goes on rising with mu_s while it saturates in beta. The two neighbouring
    trials that enclose the angle are measured with all ``seeds``; the line through their means gives mu_s. Raises
    ``InputError`` with the reachable range when no trial reaches the angle.
    """

    def look(friction: float, seed: int) -> dict[str, float]:
        return measure(with_friction(contact, friction), "shear", seed=seed)

    k = len(TRIAL) // 2
    found = {k: look(TRIAL[k], seeds[0])["mohr_coulomb_deg"]}
    step = 1 if found[k] < angle_deg else -1
    while (found[k] < angle_deg) == (step > 0):
        k += step
        if not 0 <= k < len(TRIAL):
            have, edge = found[k - step], "most" if step > 0 else "least"
            raise InputError(
                f"a friction angle of {angle_deg:.3g} deg cannot be reached with shape = {contact.shell.shape:g} "
                f"({edge}: {have:.3g} deg)"
            )
        found[k] = look(TRIAL[k], seeds[0])["mohr_coulomb_deg"]
    ends = sorted((TRIAL[k], TRIAL[k - step]))
    known = [[look(end, seed) for seed in seeds] for end in ends]
    low, high = (float(np.mean([one["mohr_coulomb_deg"] for one in row])) for row in known)
    errors = [math.sqrt(sum(one["mohr_coulomb_error_deg"] ** 2 for one in row)) / len(row) for row in known]
    part = min(1.0, max(0.0, (angle_deg - low) / (high - low))) if high > low else 0.5
    return (
        round(ends[0] + part * (ends[1] - ends[0]), 4),
        low + part * (high - low),
        math.hypot((1.0 - part) * errors[0], part * errors[1]),
    )


def resolved(contact: Contact) -> Contact:
    """The settings with the friction that gives ``friction_angle``, when that is set; the calibration is kept, the
    first takes minutes."""
    if contact.friction_angle is None:
        return contact
    friction, _, _ = friction_for(math.degrees(contact.friction_angle), contact)
    return with_friction(contact, friction).model_copy(update={"friction_angle": None})


# -- the command
# ---------------------------------------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m dem.friction_angle", description="The friction angle of grains, measured."
    )
    parser.add_argument("--case", type=Path, help="a case file: its [dem.contact] is taken")
    parser.add_argument("--friction", type=float, help="mu_s instead of the case's")
    parser.add_argument("--shape", type=float, help="beta instead of the case's")
    parser.add_argument("--method", choices=("shear", "tilt"), default="shear")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--find", metavar="ANGLE", help='the friction that gives this angle, "30 deg" for example')
    options = parser.parse_args(arguments)
    try:
        contact = _contact_of(options)
        if options.find:
            friction, angle, error = friction_for(_degrees(options.find), contact)
            print(
                f"friction = {friction:.4g}  gives {angle:.2f} +- {error:.2f} deg with shape {contact.shell.shape:g}"
            )
            return 0
        found = measure(contact, options.method, seed=options.seed)
    except (InputError, Unsound) as reason:
        print(f"{parser.prog}: {reason}", file=sys.stderr)
        return reason.exit_code
    print(
        f"friction {contact.shell.friction:g}, shape {contact.shell.shape:g}: {found['mohr_coulomb_deg']:.2f} +- "
        f"{found['mohr_coulomb_error_deg']:.2f} deg "
        f"(Mohr-Coulomb); slopes of {found['angle_deg']:.2f} +- {found['error_deg']:.2f} deg"
    )
    print("\n".join(f"{name:18s}{value:10.4g}" for name, value in found.items()))
    return 0


def _degrees(text: str) -> float:
    from matter.quantity import parse

    try:
        return math.degrees(parse(text, "rad"))
    except ValueError as reason:
        raise InputError(f"--find: {reason}") from None


def _contact_of(options: argparse.Namespace) -> Contact:
    contact = Contact()
    if options.case:
        import tomllib

        path = options.case / "case.toml" if options.case.is_dir() else options.case
        try:
            table = tomllib.loads(path.read_text())
            contact = Contact.model_validate(table.get("dem", {}).get("contact", {}))
        except (OSError, ValueError) as reason:  # pydantic and tomllib raise ValueErrors
            raise InputError(f"{path}: {reason}") from None
    changes = {
        name: value for name, value in (("friction", options.friction), ("shape", options.shape)) if value is not None
    }
    try:
        shell = type(contact.shell).model_validate({**contact.shell.model_dump(), **changes})
    except ValueError as reason:
        raise InputError(str(reason)) from None
    return contact.model_copy(update={"shell": shell})


if __name__ == "__main__":
    sys.exit(main())
