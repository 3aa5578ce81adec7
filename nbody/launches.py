"""What becomes of a crater's ejecta in the field of the body that they left, its planet, that one's other moons and
the Sun (the command ``fly_ejecta``).

Read is the catalogue that a crater leaves (``ejecta.h5``: position, time and velocity of each launch, mass, layer, in
the frame of its run: the impact point on +z, the projectile flies towards +x). On a moon of Jupiter the impact point
is put at a latitude and a longitude, east of the meridian that faces Jupiter (the leading side is at -90 deg), +x at
an azimuth, clockwise from north. A body of its own, or alone with the Sun, is the centre of its field.

The body has the radius R and GM = g R^2 of the run's target; launches from flat ground are laid round the named body,
arc for distance. It does not turn: speeds are those of the run's frame, and positions of landing are in that frame
too, about the body's centre. No air, no collisions among the ejecta, no attraction by them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError, UnphysicalState
from matter.files import archive
from matter.wording import readable
from nbody.integrators import launched
from nbody.masses import ephemeris
from nbody.masses.ephemeris import Ephemeris, Orbits
from nbody.masses.state_vector import POSITION, VELOCITY
from nbody.masses.system import Body, System, jovian, load, start

NEEDED = {"place": 3, "time": 1, "velocity": 3, "mass": 1, "layer": 1, "number": 1}
"""Arrays that a catalogue has to hold, and how many columns each."""
TOLERANCE = 1e-12
BACK, LEAVES, FLIES = "falls back", "leaves", "still flies"
FAR = 50.0
"""Radii beyond which what is unbound has left a body that stands alone."""


@dataclass(frozen=True)
class Site:
    """Where on the body the impact point lies and where +x points [rad]: ``latitude``, ``longitude`` east of the
    meridian that faces the planet, ``azimuth`` of +x clockwise from north."""

    latitude: float = 0.0
    longitude: float = 0.0
    azimuth: float = 0.5 * math.pi


@dataclass(frozen=True)
class Launches:
    """Launches (n,) on a sphere of ``radius`` [m] with ``gm`` [m^3/s^2], in the frame of the run about its centre."""

    number: np.ndarray
    position: np.ndarray
    time: np.ndarray
    velocity: np.ndarray
    mass: np.ndarray
    layer: np.ndarray
    radius: float
    gm: float


@dataclass(frozen=True)
class Fates:
    """How each flight ended (n,): index into ``names``, when [s] after the first contact, where in the frame of the
    run about the launching body's centre (n, 3) [m] and how fast relative to the body that was hit [m/s] (NaN of what
    hits nothing), and after how many steps."""

    names: tuple[str, ...]
    fate: np.ndarray
    time: np.ndarray
    position: np.ndarray
    speed: np.ndarray
    steps: np.ndarray


def read(path: Path, body: Body | None) -> Launches:
    """The launches of a catalogue; those of flat ground on the ``body``. Raises ``InputError`` for a file that is no
    catalogue, and for flat ground without a body."""
    arrays, facts = archive.read(path)
    for name, columns in NEEDED.items():
        shape = np.shape(arrays[name]) if name in arrays else ()
        if not shape or shape[1:] != ((columns,) if columns > 1 else ()) or len(arrays[name]) != len(arrays["number"]):
            raise InputError(f"{path} is no catalogue of ejecta: it lacks {name} (6_crater/ejecta.h5 of a run is one)")
    if "frame" not in facts:
        raise InputError(f"{path} does not say what ground it is of: run the crater stage again")
    bad = [name for name in NEEDED if not np.isfinite(arrays[name]).all()]
    if bad:
        raise InputError(f"{path}: {', '.join(bad)} not finite")
    axes = np.reshape(facts["axes"], (3, 3))
    position, velocity = (arrays["place"] - facts["centre_m"]) @ axes.T, arrays["velocity"] @ axes.T
    if facts["frame"] == "sphere":
        radius = float(facts["radius_m"])
        gm = float(facts["gravity_m_s2"]) * radius**2
    else:
        if body is None:
            raise InputError(f"{path} is of flat ground: name the body that it lies on with --body")
        radius, gm = body.radius, body.gm
        position, velocity = _round(position, velocity, radius)
    kept = {name: arrays[name] for name in ("number", "time", "mass", "layer")}
    return Launches(position=position, velocity=velocity, radius=radius, gm=gm, **kept)


def _round(position: np.ndarray, velocity: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities of flat ground laid round a sphere that touches it at the origin: the distance becomes the
    arc, the vertical turns with it."""
    away = np.hypot(position[:, 0], position[:, 1])
    out = np.where(away[:, None] > 0.0, position[:, :2] / np.maximum(away, 1e-300)[:, None], [1.0, 0.0])
    along = np.column_stack([out, np.zeros(len(out))])
    up, sine, cosine = np.array([0.0, 0.0, 1.0]), np.sin(away / radius)[:, None], np.cos(away / radius)[:, None]
    here, level = cosine * up + sine * along, cosine * along - sine * up
    side = np.cross(up, along)
    parts = [np.einsum("ij,ij->i", velocity, along), np.einsum("ij,ij->i", velocity, side), velocity[:, 2]]
    return radius * here, parts[0][:, None] * level + parts[1][:, None] * side + parts[2][:, None] * here


@dataclass(frozen=True)
class FlightField:
    """The field of the flights: ``orbits``, the ``names`` and ``radius`` (1 + moons,) of planet and moons, which of
    them is ``home``, where it is (``paths``; None: it rests at the origin), how far ``outer`` [m] is, and the ``axes``
    (3, 3) of the run's frame (rows) in that of the field."""

    orbits: Orbits
    names: tuple[str, ...]
    radius: np.ndarray
    home: int
    paths: Ephemeris | None
    outer: float
    axes: np.ndarray


def field_of_body(launches: Launches) -> FlightField:
    """The body alone."""
    nothing = np.zeros((1, 1, 3, 6))
    nothing[0, 0, 0, 0] = 1e12  # where a Sun without mass stands
    orbits = Orbits(nothing, 1e30, np.array([0.0, launches.gm]), 0.0)
    return FlightField(orbits, ("the body",), np.array([launches.radius]), 0, None, FAR * launches.radius, np.eye(3))


def field_with_companions(launches: Launches, body: Body, site: Site, duration: float, seed: int) -> FlightField:
    """``body`` with the run's radius and mass among its like: a moon of Jupiter with the other moons and the Sun, or
    what goes round the Sun itself; the moons' longitudes and the planet's mean anomaly are drawn by ``seed``."""
    own = replace(body, gm=launches.gm, radius=launches.radius)
    if body.around == "sun":
        system = System(load("sun"), own, ())
    else:
        system = jovian(body.name, ("io", "europa", "ganymede", "callisto"))
        moons = tuple(own if moon.name == body.name else moon for moon in system.moons)
        system = System(system.sun, system.planet, moons)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(7,)))
    anomaly, longitudes = 2.0 * math.pi * rng.random(), 2.0 * math.pi * rng.random(len(system.moons))
    begin = start(system, anomaly, longitudes)
    end = float(launches.time.max(initial=0.0)) + duration
    paths = ephemeris.compute(system, begin, end)
    home = 0 if not system.moons else 1 + system.moon(body.name)
    if home:
        outwards = begin.position[1 + home] - begin.position[1]
        axes = _axes(-outwards / np.linalg.norm(outwards), site)
    else:
        axes = _axes(-begin.sun_direction, site)
    sizes = np.array([system.planet.radius, *(moon.radius for moon in system.moons)])
    names = (system.planet.title, *(moon.title for moon in system.moons))
    return FlightField(paths.orbits, names, sizes, home, paths, system.start_radius, axes)


def _axes(facing: np.ndarray, site: Site) -> np.ndarray:
    """Rows: x, y, z of the run's frame; ``facing`` is the direction to the planet, north is +z of the field."""
    pole = np.array([0.0, 0.0, 1.0])
    level = math.cos(site.longitude) * facing + math.sin(site.longitude) * np.cross(pole, facing)
    up = math.cos(site.latitude) * level + math.sin(site.latitude) * pole
    north = math.cos(site.latitude) * pole - math.sin(site.latitude) * level
    east = np.cross(north, up)
    x = math.cos(site.azimuth) * north + math.sin(site.azimuth) * east
    return np.array([x, np.cross(up, x), up])


def fly(launches: Launches, field: FlightField, duration: float, tolerance: float = TOLERANCE) -> Fates:
    """Follow every launch for ``duration`` [s] after the last of them. Raises ``UnphysicalState`` where a step becomes
    too small."""
    here, moving = _body(field, field.home, launches.time)
    states = np.hstack([launches.position @ field.axes + here, launches.velocity @ field.axes + moving])
    count = len(states)
    ends, finals = np.zeros((count, 3), np.int64), np.zeros((count, 7))
    until = float(launches.time.max(initial=0.0)) + duration
    free = int(field.orbits.gm[0] == 0.0)
    bounds = launched.Bounds(until, field.outer, free, field.radius, tolerance)
    launched.fly(
        np.ascontiguousarray(states), launches.time.astype(float), field.home, field.orbits, bounds, ends, finals
    )
    stuck = ends[:, 0] == launched.STUCK
    if stuck.any():
        raise UnphysicalState(f"n-body: the step of ejecta particle {launches.number[stuck][0]} became too small")
    names = (BACK, *(f"hits {name}" for k, name in enumerate(field.names) if k != field.home), LEAVES, FLIES)
    order = [field.home, *(k for k in range(len(field.names)) if k != field.home)]
    fate = np.full(count, len(names) - 1)
    fate[ends[:, 0] == launched.LEFT] = len(names) - 2
    position, speed, state = np.full((count, 3), np.nan), np.full(count, np.nan), finals[:, 1:]
    for index, body in enumerate(order):
        hits = (ends[:, 0] == launched.HIT) & (ends[:, 1] == body)
        fate[hits] = index
        x, v = _body(field, body, finals[hits, 0])
        speed[hits] = np.linalg.norm(state[hits, VELOCITY] - v, axis=1)
        if body == field.home:
            position[hits] = (state[hits, POSITION] - x) @ field.axes.T
    return Fates(names, fate, finals[:, 0], position, speed, ends[:, 2])


def _body(field: FlightField, body: int, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place and velocity (n, 3) of a body at the times ``t``: the planet is the origin where it has no moons."""
    if field.paths is None or len(field.names) == 1:
        return np.zeros((len(t), 3)), np.zeros((len(t), 3))
    return field.paths.state(body + 1, t)


def masses(launches: Launches, fates: Fates) -> dict[str, Any]:
    """Mass [kg] of target and projectile by fate; ``closure`` is how much their sum misses the catalogue's, over it;
    ``ends``: when, how fast and how far."""
    found: dict[str, Any] = {"particles": len(launches.mass)}
    for body, mine in (("target", launches.layer >= 0), ("projectile", launches.layer < 0)):
        found[f"{body}_kg"] = {
            name: float(launches.mass[mine & (fates.fate == k)].sum()) for k, name in enumerate(fates.names)
        }
    summed = sum(sum(found[f"{body}_kg"].values()) for body in ("target", "projectile"))
    total = float(launches.mass.sum())
    return {**found, "closure": abs(summed - total) / total if total > 0.0 else 0.0, "ends": ends(launches, fates)}


def ends(launches: Launches, fates: Fates) -> dict[str, dict[str, list[float]]]:
    """When [s] after the first contact, how fast [m/s] and, of what falls back, how far from the impact point [m]:
    what a tenth, half and nine tenths of the mass stay below, by each fate that is a hit."""
    found: dict[str, dict[str, list[float]]] = {}
    for k, name in enumerate(fates.names[:-2]):
        mine = fates.fate == k
        if not launches.mass[mine].sum() > 0.0:
            continue
        values = {"time_s": fates.time, "speed_m_s": fates.speed}
        values |= {"distance_m": distances(launches, fates)} if name == BACK else {}
        found[name] = {key: _tenths(value[mine], launches.mass[mine]) for key, value in values.items()}
    return found


def _tenths(value: np.ndarray, mass: np.ndarray) -> list[float]:
    """What a tenth, half and nine tenths of the mass stay below."""
    order = np.argsort(value, kind="stable")
    below = np.cumsum(mass[order])
    return [float(value[order][np.searchsorted(below, fraction * below[-1])]) for fraction in (0.1, 0.5, 0.9)]


def distances(launches: Launches, fates: Fates) -> np.ndarray:
    """Distance (n,) [m] along the ground from the impact point to where each fell back; NaN of what did not."""
    return launches.radius * np.arctan2(np.hypot(fates.position[:, 0], fates.position[:, 1]), fates.position[:, 2])


def write(launches: Launches, fates: Fates, folder: Path, how: Mapping[str, Any]) -> None:
    """``ejecta_fates.h5`` (one row a launch) and ``ejecta_fates.json`` (masses, and ``how`` they were flown)."""
    arrays = {
        "number": (launches.number, "1", "number of the particle in the snapshots of the shock stage"),
        "mass": (launches.mass, "kg", "mass"),
        "layer": (launches.layer, "1", "layer of the target, counted from the centre; -1 is the projectile"),
        "fate": (fates.fate, "1", "index into the file's attribute 'fates'"),
        "time": (fates.time, "s", "when the flight ended, after the first contact"),
        "landing": (fates.position, "m", "where it fell back, about the body's centre, impact point on +z; else NaN"),
        "distance": (
            distances(launches, fates),
            "m",
            "distance of that position from the impact point along the ground",
        ),
        "speed": (fates.speed, "m/s", "speed relative to the body that it hit; NaN where it hit none"),
    }
    archive.write(folder / "ejecta_fates.h5", arrays, {"fates": list(fates.names), **how})
    archive.write_json(folder / "ejecta_fates.json", {**masses(launches, fates), "flown": dict(how)})


def command(path: Path, name: str | None, site: Site, duration: float, seed: int, out: Path) -> int:
    """What ``fly_ejecta`` does: read, fly, write, and say what became of the mass."""
    if not duration > 0.0:
        raise InputError(f"--duration must be positive, not {duration:g} s")
    body = load(name) if name is not None else None
    if body is not None and body.around not in ("jupiter", "sun"):
        raise InputError(f"--body {body.name}: take a moon of Jupiter or what goes round the Sun")
    path = path / "6_crater" / "ejecta.h5" if path.is_dir() else path
    archive.check_folder(out)
    launches = read(path, body)
    field = field_of_body(launches) if body is None else field_with_companions(launches, body, site, duration, seed)
    fates = fly(launches, field, duration)
    out.mkdir(parents=True, exist_ok=True)
    how = {
        "body": field.names[field.home], "radius_m": launches.radius, "gm_m3_s2": launches.gm, "duration_s": duration,
        "latitude_rad": site.latitude, "longitude_rad": site.longitude, "azimuth_rad": site.azimuth, "seed": seed,
    }  # fmt: skip
    write(launches, fates, out, how)
    for line in fate_lines(masses(launches, fates), field.names[field.home], duration):
        print(line)
    print(f"{out / 'ejecta_fates.h5'}: each launch with its fate")
    return 0


def fate_lines(found: Mapping[str, Any], home: str, duration: float) -> list[str]:
    """Masses by fate in words."""
    said = [f"{found['particles']} launches from {home}, followed for {duration / 86400.0:.4g} days"]
    for body in ("target", "projectile"):
        parts = ", ".join(
            f"{name} {readable.amount(mass, 'kg', 3)}" for name, mass in found[f"{body}_kg"].items() if mass > 0.0
        )
        said.append(f"  {body}: {parts or 'none'}")
    return [readable.terminal(line) for line in said]
