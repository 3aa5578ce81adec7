"""Grain steps per second of the contact loop on a settled bed: full four-component law, wall history, list rebuilds included.

    python benchmarks/dem_bed.py [--json] [--size N] [--threads T]

A box of grains (radii +-10 %, friction 0.5) is packed without overlap, settled under uniform gravity with damping, then stepped in rounds;
the median round counts.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from pathlib import Path

ROUNDS, STEPS = 5, 150


def settled_box(count: int, threads: int):
    """A box of settled grains: base 40 mean diameters wide, walls of the same friction."""
    import numpy as np

    from dem.assembly import Assembly
    from dem.contact_settings import OCEAN, Contact
    from dem.gravity import Field
    from dem.relaxation import Fire
    from dem.walls import PLANE, Wall
    from matter.particles import Particles

    rng = np.random.default_rng(1)
    radius = rng.uniform(0.9, 1.1, count)
    width = max(20.0, (4.0 / 3.0 * np.pi * np.sum(radius**3) / 0.6) ** (1.0 / 3.0))
    height = 4.0 / 3.0 * np.pi * np.sum(radius**3) / (0.58 * width**2)
    walls = [Wall(PLANE, species=0)]
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        walls.append(Wall(PLANE, point=(width * (x < 0), width * (y < 0), 0.0), direction=(x, y, 0.0), species=0))
    lid = Wall(PLANE, point=(0.0, 0.0, height), direction=(0.0, 0.0, -1.0))
    box = np.array([width, width, height])
    zero = np.zeros((count, 3))
    mass = radius**3
    # static overlap about 0.2 % of a radius at the base
    stiffness = 3.5 * 0.6 * 0.24 * height / 0.002 * radius
    points = rng.uniform(radius[:, None], box - radius[:, None])
    fields = dict(
        identity=np.arange(count), position=points, velocity=zero, angular_velocity=zero, mass=mass, radius=radius, material=np.zeros(count),
        species=np.zeros(count), stiffness=stiffness,
    )  # fmt: skip
    smooth = Contact(shell=OCEAN.model_copy(update={"restitution": 0.5}))
    loose = Assembly(Particles(fields), smooth, [*walls, lid], threads=threads, overlap_limit=np.inf)
    fire = Fire(loose)
    for _ in range(250):
        fire.step()
    fields = dict(loose.particles({}, tables=False))
    fields["velocity"] = zero
    bed = Assembly(Particles(fields), Contact(), walls, Field.constant((0.0, 0.0, -1.0)), threads=threads, overlap_limit=np.inf)
    # lighter steps while it falls together: the drag holds the speed at a few radii per unit time
    bed.drag[:] = 0.2 * np.sqrt(1.0 / height)
    steps = int(2.5 * np.sqrt(2 * 0.04 * height) / bed.dt)
    for _ in range(min(steps, 1500)):
        bed.step()
    bed.drag[:] = 0.0
    return bed


def measure(count: int, threads: int) -> dict:
    """Median grain steps per second, and the bytes that the arrays of a grain and its contacts take."""
    bed = settled_box(count, threads)
    built = bed.builds
    rates = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        for _ in range(STEPS):
            bed.step()
        rates.append(count * STEPS / (time.perf_counter() - begin))
    arrays, _ = bed.state_arrays()
    size = sum(a.nbytes for a in arrays.values()) + bed._spill.nbytes
    return {
        "particle_steps_per_s": statistics.median(rates),
        "best_particle_steps_per_s": max(rates),
        "bytes_per_particle": size / count,
        "particles": count,
        "threads": threads,
        "contacts_per_particle": bed.contacts / count,
        "list_entries_per_particle": len(bed.col) / count,
        "list_builds": bed.builds - built,
        "steps": ROUNDS * STEPS,
        "worst_overlap": bed.worst,
        "peers": {},
    }


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object on the last line")
    parser.add_argument("--size", type=int, default=100_000, help="grains")
    parser.add_argument("--threads", type=int, default=0, help="0: all")
    given = parser.parse_args()
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
    threads = given.threads or len(os.sched_getaffinity(0))
    result = measure(given.size, threads)
    for name, value in result.items():
        print(f"{name:28} {value:.6g}" if isinstance(value, float) else f"{name:28} {value}")
    if given.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
