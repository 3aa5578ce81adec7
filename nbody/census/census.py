"""A census of encounters: draw particles, fly them, collect events until there are enough.

Resumable; the same bits for any number of threads.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numba
import numpy as np

from matter.cadence import Cadence
from matter.errors import InputError
from matter.files import archive, checkpoint, lock
from matter.progress import Progress, stop_here
from nbody.census import moon_hits
from nbody.integrators import fast, rkck, tube
from nbody.masses.system import System, jovian
from nbody.population import conditions, encounters
from nbody.population.conditions import CHUNK, Population
from nbody.population.encounters import ENTRY

INTEGRATORS = ("rkck", "fast", "tube")
MAX_PARTICLES = 400_000_000


@dataclass(frozen=True)
class Request:
    """What to count: ``count`` entries into the Hill sphere of ``target`` (effective ones for ``tube``)."""

    target: str
    population: Population
    integrator: str
    count: int
    seed: int

    def __post_init__(self) -> None:
        if self.integrator not in INTEGRATORS:
            raise InputError(f"unknown integrator {self.integrator!r} (known: {', '.join(INTEGRATORS)})")
        if self.count < 1:
            raise InputError(f"count = {self.count} must be at least 1")
        if self.seed < 0:
            raise InputError(f"seed = {self.seed} must not be negative")


@dataclass
class Tally:
    """What a census found so far; ``ends`` counts flights by how they ended, the errors are the largest relative ones
    seen.

    ``integrated`` of the ``particles`` were integrated: ``rkck`` flies only those that come near a moon. ``enough``:
    effective entries, summed over the blocks in their order.
    """

    table: dict[str, np.ndarray]
    block: int = 0
    particles: int = 0
    integrated: int = 0
    steps: int = 0
    enough: float = 0.0
    ends: np.ndarray = field(default_factory=lambda: np.zeros(5, np.int64))
    energy_error: float = 0.0
    angular_momentum_error: float = 0.0
    wall_s: float = 0.0


@dataclass(frozen=True)
class Block:
    """Result of one unit of work, in the order in which units are numbered."""

    table: dict[str, np.ndarray]
    particles: int
    integrated: int
    steps: int
    ends: np.ndarray
    energy_error: float
    angular_momentum_error: float


def _fast(system: System, request: Request, number: int) -> Block:
    batch = conditions.batch(system, request.population, request.seed, number)
    return _collided(fast.run(system, batch, request.population.duration), system, request, number)


def _tube(system: System, request: Request, number: int) -> Block:
    batch = conditions.batch(system, request.population, request.seed, number)
    return _collided(tube.run(system, batch, request.population.duration, request.seed), system, request, number)


def _collided(flights: fast.Flights | tube.Flights, system: System, request: Request, number: int) -> Block:
    """A block of the ``flights``, with the collisions that follow from their entries."""
    hits = moon_hits.collide(flights.table, system, request.seed, number, request.population.focused)
    return Block(
        encounters.join([flights.table, hits]),
        CHUNK,
        CHUNK,
        int(flights.ends[:, 1].sum()),
        np.bincount(flights.ends[:, 0], minlength=5),
        flights.ephemeris.energy_error,
        flights.ephemeris.angular_momentum_error,
    )


def _rkck(system: System, request: Request, number: int) -> Block:
    batch = conditions.batch(system, request.population, request.seed, number)
    flights = rkck.run(system, batch, request.population.duration, request.seed, to_the_end=True)
    taken = flights.ends[:, 1]
    ends = np.bincount(flights.ends[:, 0], minlength=5)
    return Block(flights.table, CHUNK, int((taken > 0).sum()), int(taken.sum()), ends, 0.0, 0.0)


WORKERS: dict[str, Callable[[System, Request, int], Block]] = {"fast": _fast, "tube": _tube, "rkck": _rkck}


def effective_entries(request: Request, system: System, table: dict[str, np.ndarray]) -> float:
    """Entries at the target so far: their number, or (sum w)^2 / sum w^2 where they carry weights."""
    weight = table["weight"][(table["event"] == ENTRY) & (table["moon"] == system.moon(request.target))]
    return float(weight.sum() ** 2 / (weight**2).sum()) if len(weight) else 0.0


def collect(request: Request, out: Path) -> Tally:
    """Run a census, with checkpoints in ``out``; continues where an interrupted one stopped. Raises ``Stopped`` on
    request."""
    system = jovian(request.target)
    tally = _resumed(request, out)
    progress = Progress("nbody", float(request.count), start=tally.enough)
    tables, cadence, began = [tally.table], Cadence(), time.monotonic() - tally.wall_s
    for block in _blocks(system, request, tally.block) if tally.enough < request.count else ():
        tables.append(block.table)
        tally.block += 1
        tally.particles += block.particles
        tally.integrated += block.integrated
        tally.steps += block.steps
        tally.ends += block.ends
        tally.energy_error = max(tally.energy_error, block.energy_error)
        tally.angular_momentum_error = max(tally.angular_momentum_error, block.angular_momentum_error)
        tally.wall_s = time.monotonic() - began
        if len(tables) > 64:
            tables = [encounters.join(tables)]
        tally.enough += effective_entries(request, system, block.table)
        progress.update(tally.enough, f"{tally.particles} particles")
        if cadence.due():
            tables = [encounters.join(tables)]
            tally.table = tables[0]
            with cadence.writing():
                _save(request, out, tally)
            stop_here("nbody")
        if tally.enough >= request.count:
            break
        if tally.particles >= MAX_PARTICLES:
            raise InputError(
                f"{tally.particles} particles gave only {tally.enough:.0f} of {request.count} entries at "
                f"{request.target}"
            )
    tally.table = encounters.join(tables)
    progress.update(tally.enough, f"{tally.particles} particles", force=True)
    return tally


def _blocks(system: System, request: Request, first: int) -> Iterator[Block]:
    """Units of work in order; threads work ahead, but what is taken depends on the order alone."""
    work = WORKERS[request.integrator]
    threads = numba.get_num_threads()
    with ThreadPoolExecutor(threads) as pool:
        number = first + threads + 1
        waiting = deque(pool.submit(work, system, request, n) for n in range(first, number))
        try:
            while True:
                yield waiting.popleft().result()
                waiting.append(pool.submit(work, system, request, number))
                number += 1
        finally:
            for future in waiting:
                future.cancel()


def _identity(request: Request) -> str:
    population = request.population
    return (
        f"{request.target} {population.name} {population.mean_anomaly} {population.notes} {request.integrator} "
        f"{request.seed}"
    )


_NUMBERS = ("block", "particles", "integrated", "steps", "enough", "energy_error", "angular_momentum_error", "wall_s")


def _save(request: Request, out: Path, tally: Tally) -> None:
    arrays = {f"events/{name}": column for name, column in tally.table.items()} | {"ends": tally.ends}
    scalars = {name: getattr(tally, name) for name in _NUMBERS}
    checkpoint.save(out, tally.block, arrays, {**scalars, "request": _identity(request)})


def _resumed(request: Request, out: Path) -> Tally:
    kept = checkpoint.newest(out)
    if kept is None or kept[1]["request"] != _identity(request):
        return Tally(encounters.empty())
    arrays, scalars = kept
    table = {name: arrays[f"events/{name}"] for name in encounters.TABLE}
    return Tally(table, ends=arrays["ends"], **{name: scalars[name] for name in _NUMBERS})


def run(request: Request, out: Path) -> tuple[dict[str, np.ndarray], dict]:
    """A census into ``out``: collects, or reads ``encounters.h5`` if the same one already stands there. Returns table
    and attributes."""
    path = out / "encounters.h5"
    if path.is_file():
        table, attributes = encounters.read(path)
        if attributes.get("request") == _identity(request) and attributes.get("count") == request.count:
            return table, attributes
    tally = collect(request, out)
    attributes = {
        "request": _identity(request),
        "moons": ", ".join(moon.name for moon in jovian(request.target).moons),
        "target": request.target,
        "population": request.population.name,
        "jupiter_mean_anomaly_deg": "random"
        if request.population.mean_anomaly is None
        else float(np.degrees(request.population.mean_anomaly)),
        "integrator": request.integrator,
        "count": request.count,
        "seed": request.seed,
        "particles": tally.particles,
        "steps": tally.steps,
        "steps_per_flight": tally.steps / max(tally.integrated, 1),
        "flights_timed_out": int(tally.ends[encounters.TIMED_OUT]),
        "flights_left": int(tally.ends[encounters.LEFT]),
        "flights_hit_jupiter": int(tally.ends[encounters.HIT_PLANET]),
        "flights_hit_moon": int(tally.ends[encounters.HIT_MOON]),
        "energy_error": tally.energy_error,
        "angular_momentum_error": tally.angular_momentum_error,
        "wall_s": tally.wall_s,
        "threads": numba.get_num_threads(),
    }
    encounters.write(path, tally.table, attributes)
    checkpoint.clear(out)
    return tally.table, attributes


def census(
    target: str = "callisto",
    population: str = "literal",
    integrator: str = "fast",
    count: int = 1000,
    seed: int = 1,
    out: Path | str | None = None,
    mean_anomaly: float | str | None = None,
    speed: float = conditions.ISOTROPIC_SPEED,
) -> int:
    """What the command ``impact_census`` does: impact statistics of one population at one moon as tables and pictures.

    ``target``: io, europa, ganymede or callisto. ``population``: literal, corrected, isotropic, or a CSV file (see
    ``nbody.population.conditions``). ``integrator``: rkck, fast or tube. ``count``: entries into the target's Hill
    sphere (effective ones for tube). ``out``: folder, default
    ``census-<target>-<population>-<integrator>-<count>-<seed>``; the same command resumes what was interrupted there,
    or only redraws. ``mean_anomaly``: Jupiter's at the start [rad] or "random" (default: the population's own);
    ``speed``: at infinity, ``isotropic`` [m/s].

    Returns the exit code 0. Raises ``InputError`` (2) for bad input and ``Stopped`` (75) on request. Prints folder
    first, result last.
    """
    from nbody.results import products

    request = Request(target, conditions.population(population, mean_anomaly, speed), integrator, count, seed)
    jovian(target)
    name = Path(population).stem
    folder = archive.check_folder(
        Path(out) if out is not None else Path(f"census-{target}-{name}-{integrator}-{count}-{seed}")
    )
    folder.mkdir(parents=True, exist_ok=True)
    print(folder)
    with lock.held(folder / "run.lock", str(folder)):
        table, attributes = run(request, folder)
        print(products.write(table, attributes, folder))
    return 0


main = census
