"""Grain steps per second of the contact loop on a settled bed: full four-component law, wall history, list rebuilds
included.

    python benchmarks/dem_bed.py [--json] [--size N] [--threads T] [--peers] [--ranks N]

With ``--peers`` LAMMPS and LIGGGHTS step the same bed in between the same rounds, where installed: the same grains,
walls and step, as many ranks as threads, each with the best of three skins, with every component of the contact that
it has (LIGGGHTS no twist). A peer is timed by its own log, without start and output; it begins 50 steps before the
clock.

A box of grains (radii +-10 %, friction 0.5) is packed without overlap, settled under uniform gravity with damping,
then stepped in rounds; the median round counts.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import time
from pathlib import Path
from typing import Any

ROUNDS, STEPS = 5, 150
SKINS, WARM = (0.05, 0.1, 0.25), 50


def settled_box(count: int, threads: int) -> tuple[Any, list[Any]]:
    """A box of settled grains, base 40 mean diameters wide, walls of the same friction; and its walls."""
    import numpy as np

    from dem.beds.relaxation import Fire
    from dem.contact.gravity import Field
    from dem.contact.settings import OCEAN, Contact
    from dem.contact.walls import PLANE, Wall
    from dem.grains.assembly import Assembly
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
        identity=np.arange(count), position=points, velocity=zero, angular_velocity=zero, mass=mass, radius=radius,
        material=np.zeros(count),
        species=np.zeros(count), stiffness=stiffness,
    )  # fmt: skip
    smooth = Contact(shell=OCEAN.model_copy(update={"restitution": 0.5}))
    loose = Assembly(Particles(fields), smooth, [*walls, lid], threads=threads, overlap_limit=np.inf)
    fire = Fire(loose)
    for _ in range(250):
        fire.step()
    fields = dict(loose.particles({}, tables=False))
    fields["velocity"] = zero
    bed = Assembly(
        Particles(fields), Contact(), walls, Field.constant((0.0, 0.0, -1.0)), threads=threads, overlap_limit=np.inf
    )
    # lighter steps while it falls together: the drag holds the speed at a few radii per unit time
    bed.drag[:] = 0.2 * np.sqrt(1.0 / height)
    steps = int(2.5 * np.sqrt(2 * 0.04 * height) / bed.dt)
    for _ in range(min(steps, 1500)):
        bed.step()
    bed.drag[:] = 0.0
    return bed, walls


def peer_rate(engine: str, bed, walls, skin: float, ranks: int) -> float:
    """Grain steps per second of LAMMPS or LIGGGHTS on this bed, by its own clock."""
    import re
    import tempfile

    import numpy as np

    from dem.collapse import external
    from dem.contact.gravity import Field
    from dem.engines import program
    from dem.engines.scene import Plan, Scene

    grains = bed.particles({}, tables=False)
    # one stiffness: with as many types as radii the peers would be slower for a reason that is not theirs
    grains["stiffness"] = np.full(len(grains), float(grains.stiffness.mean()))
    reach = 1.2 * float(np.abs(grains.position).max()) + 3.0
    scene = Scene(grains, bed.contact, walls, Field.constant((0.0, 0.0, -1.0)), bed.dt, reach, skin=skin)
    with tempfile.TemporaryDirectory() as folder:
        folder_path = Path(folder)
        plan = Plan(WARM + STEPS, STEPS, dumps=False, settle=WARM)
        external.ENGINES[engine].write(scene, plan, folder_path, "in.deck")
        if program.start(engine, "in.deck", ranks, folder_path, "log").wait() != 0:
            raise SystemExit(f"{engine}: {program.complaint(folder_path, 'log')}")
        seconds = re.findall(rb"Loop time of ([0-9.e+-]+)", (folder_path / "log").read_bytes())
    return len(grains) * STEPS / float(seconds[-1])


def installed_peers() -> list[str]:
    """The engines whose programs are there."""
    from dem.engines import program
    from matter.errors import InputError

    found = []
    for engine in program.PROGRAMS:
        try:
            program.find(engine)
            found.append(engine)
        except InputError as reason:
            print(f"left out: {reason}")
    return found


def measure(count: int, threads: int, ranks: int = 0) -> dict:
    """Median grain steps per second, and the bytes that the arrays of a grain and its contacts take; ``ranks`` 0
    leaves the peers out."""
    bed, walls = settled_box(count, threads)
    peers = installed_peers() if ranks else []
    skins = {}
    for engine in peers:
        skins[engine] = max(SKINS, key=lambda skin, engine=engine: peer_rate(engine, bed, walls, skin, ranks))
    for _ in range(STEPS):  # kernels compiled, lists as they will be
        bed.step()
    built = bed.builds
    rates, peer_rates = [], {engine: [] for engine in peers}
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        for _ in range(STEPS):
            bed.step()
        rates.append(count * STEPS / (time.perf_counter() - begin))
        for engine in peers:
            peer_rates[engine].append(peer_rate(engine, bed, walls, skins[engine], ranks))
    mine = statistics.median(rates)
    arrays = (value for value in bed.saved().values() if hasattr(value, "nbytes"))
    size = sum(array.nbytes for array in arrays)
    return {
        "particle_steps_per_s": mine,
        "best_particle_steps_per_s": max(rates),
        "bytes_per_particle": size / count,
        "particles": count,
        "threads": threads,
        "contacts_per_particle": bed.contacts / count,
        "list_entries_per_particle": len(bed.col) / count,
        "list_builds": bed.builds - built,
        "steps": ROUNDS * STEPS,
        "worst_overlap": bed.worst,
        "peers": {
            engine: {
                "particle_steps_per_s": statistics.median(found), "best": max(found),
                "ratio": mine / statistics.median(found), "skin_radii": skins[engine],
                "ranks": ranks,
            }
            for engine, found in peer_rates.items()
        },
    }  # fmt: skip


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object on the last line")
    parser.add_argument("--size", type=int, default=100_000, help="grains")
    parser.add_argument("--threads", type=int, default=0, help="0: all")
    parser.add_argument("--peers", action="store_true", help="LAMMPS and LIGGGHTS on the same bed")
    parser.add_argument("--ranks", type=int, default=0, help="MPI ranks of the peers; 0: as many as threads")
    given = parser.parse_args()
    threads = given.threads or len(os.sched_getaffinity(0))
    result = measure(given.size, threads, (given.ranks or threads) if given.peers else 0)
    for name, value in result.items():
        if name == "peers":
            for engine, row in value.items():
                print(
                    f"{engine:28} {row['particle_steps_per_s']:.6g} (skin {row['skin_radii']:g} r, {row['ranks']} "
                    f"ranks): native over it {row['ratio']:.2f}"
                )
            continue
        print(f"{name:28} {value:.6g}" if isinstance(value, float) else f"{name:28} {value}")
    if given.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
