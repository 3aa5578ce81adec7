"""Populations of test particles at the edge of Jupiter's Hill sphere.

Every population gives states relative to Jupiter and a weight per particle; ``phase`` says what Jupiter's start mean
anomaly is (a number, or None for random). A particle depends on the seed and its index alone: particles are drawn in
chunks of ``CHUNK`` whose random stream is ``SeedSequence(seed, spawn_key=(0, chunk))``.

``literal``    Winter 2017, section 2.2.2, read as its tables demand: shell 0.95-1 Hill radii, position fixed, velocity
               (eq. 12: 65 m/s
radial,
               670 m/s orbital, 4534 m/s vertical, relative to Jupiter) redrawn until it points within 15 deg of
               Jupiter.
``printed``    the same with eq. 6 as printed (cube corners): nothing reaches the moons in 1.4 years.
``corrected``  flux of heliocentric orbits, uniform in a, e < 0.1 and i < 10 deg with random angles, through Jupiter's
               Hill sphere.
``isotropic``  isotropic directions, one speed at infinity.
a file         CSV with ``speed_at_infinity_km_s``, ``inclination_deg``, ``weight``: rows of a distribution of incoming
               asymptotes.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from matter.errors import InputError
from nbody.masses.system import Start, System, hill_radius
from nbody.masses.system import start as place_bodies

SOURCES = ("Winter2017", "Kessler1981")

CHUNK = 8192
YEAR = 365.25 * 86400.0
POPULATIONS = ("literal", "printed", "corrected", "isotropic")

SHELL = (0.95, 1.0)  # of the Hill radius; Winter 2017, eq. 6
CONE = math.radians(15.0)
LITERAL_SPEEDS = np.array([65.0, 670.0, 4534.0])  # radial, orbital, vertical [m/s]; Winter 2017, eq. 12
LITERAL_MEAN_ANOMALY = math.radians(60.0)  # not given in the thesis: the value that fits its tables best
ECCENTRICITY, INCLINATION = 0.1, math.radians(10.0)
ISOTROPIC_SPEED = 5000.0  # m/s
COLUMNS = ("speed_at_infinity_km_s", "inclination_deg", "weight")


@dataclass(frozen=True)
class Population:
    """How particles start: ``states(system, start, count, rng) -> (position, velocity, weight)`` relative to Jupiter.

    ``mean_anomaly`` of Jupiter at the start [rad] (None: random in every chunk), ``duration`` of a flight [s],
    ``focused``: constructed collisions weigh by their chance to hit (not so in the thesis).
    """

    name: str
    states: Callable[[System, Start, int, np.random.Generator], tuple[np.ndarray, np.ndarray, np.ndarray]]
    mean_anomaly: float | None
    duration: float
    focused: bool = True
    notes: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Batch:
    """Particles ``first``, ``first`` + 1 ... that share the massive bodies' ``start``.

    ``state`` (n, 6) in the frame of the room [m, m/s], ``weight`` (n,).
    """

    first: int
    start: Start
    state: np.ndarray
    weight: np.ndarray

    def part(self, low: int, high: int) -> Batch:
        """Particles ``low`` to ``high`` of this lot."""
        return Batch(self.first + low, self.start, np.ascontiguousarray(self.state[low:high]), self.weight[low:high])


def batch(system: System, population: Population, seed: int, chunk: int) -> Batch:
    """Chunk number ``chunk`` of a population: the moons' longitudes (and Jupiter's anomaly, where random) are drawn
    once per chunk.

    Neither is given in the thesis; a chunk hosts about ten encounters, so that a census averages over them.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0, chunk)))
    rng.random()  # once the chunk's phase: still drawn, so that the particles of earlier censuses stay what they are
    # golden-ratio sequence from a random start: a few chunks already cover Jupiter's orbit evenly
    first = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(5,))).random()
    anomaly = 2.0 * math.pi * ((first + chunk * 0.5 * (math.sqrt(5.0) - 1.0)) % 1.0)
    longitudes = rng.uniform(0.0, 2.0 * math.pi, len(system.moons))
    begin = place_bodies(system, anomaly if population.mean_anomaly is None else population.mean_anomaly, longitudes)
    position, velocity, weight = population.states(system, begin, CHUNK, rng)
    state = np.hstack([position + begin.position[1], velocity + begin.velocity[1]])
    return Batch(chunk * CHUNK, begin, np.ascontiguousarray(state), weight)


def triad(start: Start) -> np.ndarray:
    """Rows: radial (Sun -> Jupiter), orbital (along Jupiter's motion) and vertical unit vectors."""
    radial = start.sun_direction
    vertical = np.array([0.0, 0.0, 1.0])
    return np.array([radial, np.cross(vertical, radial), vertical])


def directions(count: int, rng: np.random.Generator) -> np.ndarray:
    """Isotropic unit vectors, shape (count, 3)."""
    z, longitude = rng.uniform(-1.0, 1.0, count), rng.uniform(0.0, 2.0 * math.pi, count)
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(longitude), s * np.sin(longitude), z], axis=1)


def velocities_in_cone(aim: np.ndarray, box: np.ndarray, half_angle: float, rng: np.random.Generator) -> np.ndarray:
    """Velocities uniform in the box |v_k| < ``box[k]``, given that they lie within ``half_angle`` of the unit vectors
    ``aim`` (n, 3).

    The same distribution as drawing from the whole box until the cone is met, but drawn from the axis-parallel
    bounding box of cone and box: a direction in the cone has components between cos(off_axis_k + half_angle) and
    cos(off_axis_k - half_angle), which bounds the speed and so all components.
    """
    off_axis = np.arccos(np.clip(aim, -1.0, 1.0))
    least = np.cos(np.minimum(off_axis + half_angle, math.pi))
    most = np.cos(np.maximum(off_axis - half_angle, 0.0))
    smallest = np.where(least * most <= 0.0, 0.0, np.minimum(abs(least), abs(most)))
    with np.errstate(divide="ignore"):
        fastest = (box / smallest).min(axis=1, keepdims=True)
    low, high = (
        np.clip(np.minimum(least * fastest, 0.0), -box, box),
        np.clip(np.maximum(most * fastest, 0.0), -box, box),
    )
    velocity = np.empty_like(aim)
    waiting = np.arange(len(aim))
    while len(waiting):
        trial = low[waiting] + (high - low)[waiting] * rng.random((len(waiting), 3))
        speed = np.sqrt(np.einsum("ij,ij->i", trial, trial))
        good = np.einsum("ij,ij->i", trial, aim[waiting]) >= math.cos(half_angle) * speed
        velocity[waiting[good]] = trial[good]
        waiting = waiting[~good]
    return velocity


def _literal(system: System, start: Start, count: int, rng: np.random.Generator):
    position = directions(count, rng) * (system.start_radius * rng.uniform(*SHELL, count))[:, None]
    axes = triad(start)
    aim = -(position @ axes.T) / np.linalg.norm(position, axis=1)[:, None]
    return position, velocities_in_cone(aim, LITERAL_SPEEDS, CONE, rng) @ axes, np.ones(count)


def _printed(system: System, start: Start, count: int, rng: np.random.Generator):
    """Eq. 6 as printed: every coordinate is +-(0.95 ... 1) Hill radii, which puts particles at the corners of a cube,
    1.65-1.73 Hill radii away."""
    signs = rng.choice([-1.0, 1.0], (count, 3))
    axes = triad(start)
    position = signs * rng.uniform(*SHELL, (count, 3)) * system.start_radius
    aim = -position / np.linalg.norm(position, axis=1)[:, None]
    return position @ axes, velocities_in_cone(aim, LITERAL_SPEEDS, CONE, rng) @ axes, np.ones(count)


def _heliocentric(distance: np.ndarray, latitude: np.ndarray, mu: float, rng: np.random.Generator):
    """Velocities (radial, orbital, vertical) and density weights of orbits uniform in a, e, i with random angles, at
    given positions.

    Spatial density of one orbit at distance r and latitude beta (Kessler 1981, Icarus 48, 39): 1 / (2 pi^3 r a
    sqrt((sin^2 i - sin^2 beta) (r - q) (Q - r))). For orbits uniform in ``a`` this makes the eccentric anomaly
    uniform, and sin i = sin(beta) cosh(w) with w uniform up to its limit carries the rest: weight proportional to that
    limit.
    """
    count = len(distance)
    e, anomaly = rng.uniform(0.0, ECCENTRICITY, count), rng.uniform(0.0, 2.0 * math.pi, count)
    a = distance / (1.0 - e * np.cos(anomaly))
    radial = np.sqrt(mu * a) * e * np.sin(anomaly) / distance
    transverse = np.sqrt(mu * a * (1.0 - e * e)) / distance
    beta = np.maximum(np.abs(np.sin(latitude)), 1e-5)
    limit = np.arccosh(np.maximum(math.sin(INCLINATION) / beta, 1.0))
    sine = beta * np.cosh(limit * rng.random(count))
    cosine = np.sqrt(1.0 - sine**2)
    # angle of the motion against the parallel of latitude: cos = cos i / cos beta; either node
    along = np.minimum(cosine / np.cos(latitude), 1.0)
    across = np.sqrt(1.0 - along**2) * rng.choice([-1.0, 1.0], count)
    return np.stack([radial, transverse * along, transverse * across], axis=1), limit / cosine


def _corrected(system: System, start: Start, count: int, rng: np.random.Generator):
    mu = system.sun.gm
    radius = system.start_radius
    home, motion = start.position[1] - start.position[0], start.velocity[1] - start.velocity[0]
    position, velocity = np.empty((count, 3)), np.empty((count, 3))
    ceiling = 5.0 * 3500.0  # acceptance below uses weight x inward speed; larger values are below 1e-3 of all
    waiting = np.arange(count)
    while len(waiting):
        n = directions(len(waiting), rng)
        point = home + radius * n
        distance = np.linalg.norm(point, axis=1)
        up = point / distance[:, None]
        east = np.stack([-up[:, 1], up[:, 0], np.zeros(len(up))], axis=1)
        east /= np.linalg.norm(east, axis=1)[:, None]
        north = np.cross(up, east)
        v, weight = _heliocentric(distance, np.arcsin(up[:, 2]), mu, rng)
        v = v[:, :1] * up + v[:, 1:2] * east + v[:, 2:] * north - motion
        inward = -np.einsum("ij,ij->i", v, n)
        good = rng.random(len(n)) * ceiling < weight * inward
        chosen = waiting[good]
        position[chosen], velocity[chosen] = radius * n[good], v[good]
        waiting = waiting[~good]
    return position, velocity, np.ones(count)


def _beam(system: System, incoming: np.ndarray, speed: np.ndarray, weight: np.ndarray, rng: np.random.Generator):
    """Start states on hyperbolas with asymptotic velocity ``speed`` x ``incoming``, uniform over the disc that reaches
    the moons.

    The disc's area goes into the weight, so that ``weight`` is a number flux per area at infinity.
    """
    mu, radius = system.planet.gm, system.start_radius
    widest = max(m.semi_major_axis + 3.0 * hill_radius(m) for m in system.moons) * 1.1
    b_max = np.sqrt(widest**2 + 2.0 * mu * widest / speed**2)
    b = b_max * np.sqrt(rng.random(len(speed)))
    angle = rng.uniform(0.0, 2.0 * math.pi, len(speed))
    helper = np.where(abs(incoming[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    first = np.cross(incoming, helper)
    first /= np.linalg.norm(first, axis=1)[:, None]
    side = first * np.cos(angle)[:, None] + np.cross(incoming, first) * np.sin(angle)[:, None]
    # hyperbola with e = sqrt(1 + (b v^2/mu)^2); the asymptote's true anomaly is -acos(-1/e)
    k = b * speed**2 / mu
    e = np.sqrt(1.0 + k * k)
    p = (b * speed) ** 2 / mu
    anomaly = -np.arccos(np.clip((p / radius - 1.0) / e, -1.0, 1.0))
    asymptote = -np.arccos(-1.0 / e)
    turn = anomaly - asymptote  # the body moves from direction -incoming towards side
    x, y = -incoming, side
    position = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    across = -np.sin(turn)[:, None] * x + np.cos(turn)[:, None] * y
    momentum = b * speed
    radial, transverse = mu / momentum * e * np.sin(anomaly), momentum / radius
    return radius * position, radial[:, None] * position + transverse[:, None] * across, weight * b_max**2


def _isotropic(speed: float):
    def states(system: System, start: Start, count: int, rng: np.random.Generator):
        position, velocity, weight = _beam(system, directions(count, rng), np.full(count, speed), np.ones(count), rng)
        return position, velocity, weight / weight[0]

    return states


def read_asymptotes(path: Path) -> np.ndarray:
    """Rows (speed at infinity [m/s], inclination [rad], weight) of a population file; ``InputError`` says which row is
    wrong and why."""
    path = Path(path)
    if not path.is_file():
        raise InputError(
            f"unknown population {str(path)!r}: take one of {', '.join(POPULATIONS)} or a CSV file with columns "
            f"{', '.join(COLUMNS)}"
        )
    with path.open(newline="") as file:
        rows = csv.DictReader(line for line in file if not line.lstrip().startswith("#"))
        missing = [name for name in COLUMNS if name not in (rows.fieldnames or [])]
        if missing:
            raise InputError(
                f"{path}: the population file lacks the column {', '.join(missing)} (needed: {', '.join(COLUMNS)})"
            )
        table = []
        for number, row in enumerate(rows, start=1):
            try:
                values = [float(row[name]) for name in COLUMNS]
            except (TypeError, ValueError):
                raise InputError(f"{path}, row {number}: not a number in {dict(row)}") from None
            _check_row(path, number, values)
            table.append(values)
    if not table or not any(row[2] > 0 for row in table):
        raise InputError(f"{path}: the population file has no row with a positive weight")
    array = np.array(table)
    return np.stack([array[:, 0] * 1e3, np.radians(array[:, 1]), array[:, 2]], axis=1)


def _check_row(path: Path, number: int, values: list[float]) -> None:
    limits = ((COLUMNS[0], 0.1, 1000.0), (COLUMNS[1], 0.0, 180.0), (COLUMNS[2], 0.0, math.inf))
    for value, (name, low, high) in zip(values, limits):
        if not low <= value <= high or not math.isfinite(value):
            raise InputError(f"{path}, row {number}: {name} = {value:g} must be a number in [{low:g}, {high:g}]")


def _from_file(path: Path):
    table = read_asymptotes(path)

    def states(system: System, start: Start, count: int, rng: np.random.Generator):
        widest = max(m.semi_major_axis + 3.0 * hill_radius(m) for m in system.moons) * 1.1
        rate = table[:, 2] * (widest**2 + 2.0 * system.planet.gm * widest / table[:, 0] ** 2)
        # by number of arrivals, so that every particle weighs the same
        row = rng.choice(len(table), count, p=rate / rate.sum())
        elevation = table[row, 1] * rng.choice([-1.0, 1.0], count)
        longitude = rng.uniform(0.0, 2.0 * math.pi, count)
        incoming = np.stack(
            [np.cos(elevation) * np.cos(longitude), np.cos(elevation) * np.sin(longitude), np.sin(elevation)], axis=1
        )
        position, velocity, _ = _beam(system, incoming, table[row, 0], np.ones(count), rng)
        return position, velocity, np.ones(count)

    return states


def population(name: str, mean_anomaly: float | str | None = None, speed: float = ISOTROPIC_SPEED) -> Population:
    """The population ``name`` (``literal``, ``corrected``, ``isotropic`` or the path of a CSV file).

    ``mean_anomaly``: Jupiter's at the start [rad], ``"random"``, or None for the population's own (literal 60 deg,
    others random); ``speed``: at infinity, for ``isotropic`` [m/s]. Raises ``InputError`` for an unknown name or an
    unreadable file.
    """
    own = LITERAL_MEAN_ANOMALY if name == "literal" else None
    phase = own if mean_anomaly is None else None if mean_anomaly == "random" else float(mean_anomaly)
    if name == "literal":
        return Population(
            name, _literal, phase, 1.4 * YEAR, False, {"cone_deg": 15, "speeds_m_s": LITERAL_SPEEDS.tolist()}
        )
    if name == "printed":
        return Population(
            name, _printed, LITERAL_MEAN_ANOMALY if phase is None else phase, 1.4 * YEAR, False, {"cone_deg": 15}
        )
    if name == "corrected":
        return Population(
            name, _corrected, phase, 3.0 * YEAR, notes={"eccentricity_max": ECCENTRICITY, "inclination_max_deg": 10}
        )
    if name == "isotropic":
        return Population(name, _isotropic(speed), phase, 1.0 * YEAR, notes={"speed_at_infinity_m_s": speed})
    return Population(str(name), _from_file(Path(name)), phase, 1.0 * YEAR, notes={"file": str(name)})
