"""Our loops beside those of other programs at their own best: CPU time of one thread, in turns.

    python benchmarks/peers.py [--suite NAME ...] [--turns N] [--record] [--json]

Each suite does one job with every program that is installed: ours, peer, peer, ours, ... ``--turns`` times (5 at
least), so that what else the machine does falls on all alike. What counts is the median over the turns of the ratio of
CPU times within a turn (user and system; children by ``getrusage``), above 1 where ours is faster. ``--record`` writes
``benchmarks/history/<version>.json``, from which ``docs/site`` makes the page of speeds. Suites are classes in the
form of airspeed velocity (``setup``, ``track_*``): ``asv run -E existing:PYTHON`` runs them too, PYTHON being one that
has bolide, ``asv_runner`` and the peers installed (``asv.conf.json``).

``Bed``   a settled bed of grains of one stiffness, contact forces with history, walls, list rebuilds: LAMMPS and
          LIGGGHTS through the decks that runs use, and LIGGGHTS by a deck of its own (rolling ``epsd2``, its own bins,
          grains sorted in space), each with the best of three skins. None of LIGGGHTS' has a twisting resistance. A
          peer is started twice, for few and for many steps; the difference has neither start nor output.
``Tree``  gravity of a ball of particles by an octree with one opening angle: REBOUND's tree. Errors against the direct
          sum stand beside it: the trees are not equally exact.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

HISTORY = Path(__file__).resolve().parent / "history"
TURNS = 5
SKINS = (0.05, 0.1, 0.2)


def children() -> float:
    """CPU time of the processes that this one waited for [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Suite:
    """A job and the programs that do it: ``sides`` by name, each a call that does ``work`` units and returns its CPU
    time [s]; ours is called ``bolide``."""

    about, unit, timeout = "", "", 3600.0
    work = 1.0

    def setup(self) -> None:
        """Prepare ``sides``; programs that are not installed are left out."""
        self.sides: dict[str, Callable[[], float]] = {}
        self.notes: dict[str, str] = {}

    def turns(self, count: int) -> dict[str, Any]:
        """Median units per second of CPU time of each side, and the ratios of ours to the others."""
        times: dict[str, list[float]] = {name: [] for name in self.sides}
        for _ in range(max(count, TURNS)):
            for name, call in self.sides.items():
                times[name].append(call())
        mine = times["bolide"]
        rows = {}
        for name, found in times.items():
            ratios = sorted(theirs / ours for ours, theirs in zip(mine, found))
            rows[name] = {
                "per_cpu_s": self.work / statistics.median(found),
                "ratio": statistics.median(ratios),
                "ratio_from": ratios[0],
                "ratio_to": ratios[-1],
                "note": self.notes.get(name, ""),
            }
        return {"about": self.about, "unit": self.unit, "turns": len(mine), "sides": rows}


class Bed(Suite):
    """Contacts of a settled bed."""

    about = "a settled bed of 20,000 grains, friction, rolling and twisting with history, five walls"
    unit = "grain steps"
    COUNT, SHORT, LONG = 20_000, 50, 450
    work = float(COUNT * (LONG - SHORT))

    def setup(self) -> None:
        """The bed, warm, and the best skin of each peer."""
        sys.path[:0] = [str(Path(__file__).resolve().parent)]
        import dem_bed
        import numpy as np

        from matter.particles import Particles

        super().setup()
        self.bed, self.walls = dem_bed.settled_box(self.COUNT, 1)
        grains = self.bed.particles({}, tables=False)
        even = dict(grains) | {"stiffness": np.full(len(grains), float(grains.stiffness.mean()))}
        cell = np.floor(np.asarray(grains.position) / 3.0)
        order = np.lexsort(cell.T)
        self.grains = Particles({name: np.asarray(array)[order] for name, array in even.items()})
        self.sides["bolide"] = self.ours
        self.ours()
        self.notes["bolide"] = "friction, rolling, twisting"
        for name, engine, own in (
            ("LAMMPS", "lammps", False),
            ("LIGGGHTS, our deck", "liggghts", False),
            ("LIGGGHTS, its own deck", "liggghts", True),
        ):
            if engine not in dem_bed.installed_peers():
                continue
            # the least of two: what else the machine does only ever adds
            tried = {skin: min(self.theirs(engine, own, skin) for _ in range(2)) for skin in SKINS}
            best = min(tried, key=lambda skin: tried[skin])
            self.sides[name] = lambda engine=engine, own=own, best=best: self.theirs(engine, own, best)
            self.notes[name] = f"skin {best:g} r" + ("" if engine == "lammps" else ", no twisting")

    def ours(self) -> float:
        """CPU time of our steps."""
        begin = time.process_time()
        for _ in range(self.LONG - self.SHORT):
            self.bed.step()
        return time.process_time() - begin

    def theirs(self, engine: str, own: bool, skin: float) -> float:
        """CPU time of a peer's steps: a long run less a short one."""
        return self.wall_time(engine, own, skin, self.LONG) - self.wall_time(engine, own, skin, self.SHORT)

    def wall_time(self, engine: str, own: bool, skin: float, steps: int) -> float:
        """CPU time of a peer's whole run [s]."""
        import numpy as np

        from dem.collapse import external
        from dem.contact.gravity import Field
        from dem.engines import program
        from dem.engines.scene import Plan, Scene

        reach = 1.2 * float(np.abs(np.asarray(self.grains.position)).max()) + 3.0
        field = Field.constant((0.0, 0.0, -1.0))
        scene = Scene(self.grains, self.bed.contact, self.walls, field, self.bed.dt, reach, skin=skin)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder)
            external.ENGINES[engine].write(scene, Plan(steps, steps, dumps=False), path, "in.deck")
            if own:
                deck = path / "in.deck"
                deck.write_text(own_deck(deck.read_text()))
            before = children()
            if program.start(engine, "in.deck", 1, path, "log").wait() != 0:
                raise SystemExit(f"{engine}: {program.complaint(path, 'log')}")
            return children() - before

    def track_ratio_to_lammps(self) -> float:
        """CPU time of LAMMPS over ours."""
        return self.turns(TURNS)["sides"]["LAMMPS"]["ratio"]


def own_deck(deck: str) -> str:
    """LIGGGHTS as its users run it: rolling ``epsd2``, which keeps no damping, and the program's own bins."""
    kept = [line for line in deck.splitlines() if "neigh_modify binsize" not in line]
    return "\n".join(kept).replace("epsd3", "epsd2") + "\n"


class Tree(Suite):
    """Gravity by a tree."""

    about = "gravity of a ball of 50,000 particles by an octree, opening angle 0.5"
    unit = "particles"
    COUNT, THETA = 50_000, 0.5
    work = float(COUNT)

    def setup(self) -> None:
        """A ball of equal density, both trees, and their errors."""
        import numpy as np

        from matter.geometry import tree

        super().setup()
        rng = np.random.default_rng(1)
        n = self.COUNT
        x = rng.normal(size=(n, 3))
        x *= (rng.random(n) ** (1 / 3) / np.linalg.norm(x, axis=1))[:, None]
        m, eps = np.full(n, 1.0 / n), np.full(n, 0.01)
        picked = rng.integers(0, n, 300)
        exact = np.array([(d := x - x[i]).T @ (m / ((d**2).sum(axis=1) + 1e-4) ** 1.5) for i in picked])

        def error(g: Any) -> str:
            off = np.sqrt(((g[picked] - exact) ** 2).sum(axis=1).mean() / (exact**2).sum(axis=1).mean())
            return f"rms error {off:.1e}"

        def ours() -> float:
            begin = time.process_time()
            tree.gravity(x, m, eps, self.THETA)
            return time.process_time() - begin

        ours()
        self.sides["bolide"] = ours
        self.notes["bolide"] = error(tree.gravity(x, m, eps, self.THETA) / tree.G)
        try:
            import rebound
        except ImportError:
            return
        sim = rebound.Simulation()
        sim.root_size = 10.0
        sim.integrator, sim.gravity, sim.boundary = "leapfrog", "tree", "open"
        sim.G, sim.softening, sim.dt, sim.opening_angle2 = 1.0, 0.01, 1e-9, self.THETA**2
        for position in x:
            sim.add(m=1.0 / n, x=position[0], y=position[1], z=position[2])

        def theirs() -> float:
            begin = time.process_time()
            sim.steps(1)  # one evaluation of the forces, and the tree for it
            return time.process_time() - begin

        theirs()
        pull = np.array([(p.ax, p.ay, p.az) for p in sim.particles])
        self.sides["REBOUND"] = theirs
        self.notes["REBOUND"] = f"{rebound.__version__}, {error(pull)}"

    def track_ratio_to_rebound(self) -> float:
        """CPU time of REBOUND over ours."""
        return self.turns(TURNS)["sides"]["REBOUND"]["ratio"]


SUITES: dict[str, type[Suite]] = {"bed": Bed, "tree": Tree}


def main() -> None:
    """Measure, print, record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--suite", action="append", choices=SUITES)
    parser.add_argument("--turns", type=int, default=TURNS)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    os.environ["NUMBA_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    from importlib.metadata import version

    from matter.compilation.jit import set_threads

    set_threads(1)
    path = HISTORY / f"{version('bolide')}.json"
    kept = json.loads(path.read_text()) if path.is_file() else {"suites": {}}
    kept |= {"version": version("bolide"), "date": time.strftime("%Y-%m-%d"), "machine": machine()}
    for name in given.suite or SUITES:
        suite = SUITES[name]()
        suite.setup()
        kept["suites"][name] = suite.turns(given.turns)
        for side, row in kept["suites"][name]["sides"].items():
            print(
                f"{name:6} {side:24} {row['per_cpu_s']:.4g} {suite.unit} per s of CPU time, over ours "
                f"{row['ratio']:.2f} ({row['ratio_from']:.2f} to {row['ratio_to']:.2f})  {row['note']}",
                flush=True,
            )
    if given.record:
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(kept, indent=1) + "\n")
    if given.json:
        print(json.dumps(kept))


def machine() -> str:
    """The processor, and how many processes wanted it (load over cores) when this was begun."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    load = os.getloadavg()[0]
    return f"{name or platform.machine()}, {os.cpu_count()} cores, load {load:.1f}"


if __name__ == "__main__":
    main()
