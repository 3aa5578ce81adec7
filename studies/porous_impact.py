"""A ball strikes porous ground, by the shock stage and by a grid code: what the flow gets of the ball's energy and
momentum, by the number of particles to its radius.

    python studies/porous_impact.py [--friction] [--out docs/results/porous_impact] [--particles 2 5.26] [--cells 5 10]

Set-up: ``studies/eulerian/porous_ball.py``. Prints the tables, and draws both codes at the last time.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from fixtures.porous_source import GROUNDS
from studies.eulerian import porous_ball

ROOT = Path(__file__).resolve().parents[1]
TIMES = {False: [5e-3, 10e-3, 15e-3, 20e-3], True: [5e-3, 10e-3, 20e-3, 100e-3, 200e-3]}
"""[s], by whether there is friction."""
DRAWN = {
    False: {"kinetic": "kinetic energy left at 20 ms", "outwards": "momentum outwards over the ball's"},
    True: {"outwards": "momentum outwards at 200 ms", "width": "hole's radius, a"},
}


def main() -> int:
    """Both grounds: tables and picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results" / "porous_impact")
    parser.add_argument("--friction", action="store_true", help="30 degrees of it, and until 200 ms")
    parser.add_argument("--particles", type=float, nargs="*", default=[2.0, 2.63, 5.26, 10.5], help="to the radius")
    parser.add_argument("--cells", type=int, nargs="*", help="to the radius")
    given = parser.parse_args()
    cells = given.cells or ([5, 10, 20] if given.friction else [10, 20, 40])
    times, drawn = TIMES[given.friction], DRAWN[given.friction]
    given.out.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(2, 2, figsize=(8.4, 5.6), sharex=True, layout="constrained")
    print("| ground | code | ms | kinetic energy left | momentum outwards | upwards | depth, a | width, a | time |")
    print("|---" * 9 + "|")
    for side, name in enumerate(GROUNDS):
        for words, code, sizes, mark in (
            ("cells", porous_ball.in_cells, cells, "ks-"),
            ("particles", porous_ball.in_particles, given.particles, "o-"),
        ):
            last = []
            for size in sizes:
                begun = time.perf_counter()
                found = code(name, times, size, given.friction)
                took = time.perf_counter() - begun
                for at, one in zip(times, found):
                    numbers = " | ".join(f"{value:.3f}" for value in one)
                    print(f"| {name} | {size:g} {words} | {1e3 * at:g} | {numbers} | {took:.0f} s |", flush=True)
                last.append(found[-1])
            for row, key in enumerate(drawn):
                axes[row, side].plot([1.0 / s for s in sizes], [getattr(one, key) for one in last], mark, label=words)
        axes[0, side].set(title=name)
        axes[1, side].set(xlabel="size over the ball's radius", xlim=(0.0, None))
    for row, label in enumerate(drawn.values()):
        axes[row, 0].set(ylabel=label)
    axes[0, 0].legend(frameon=False)
    figure.savefig(given.out / ("friction.png" if given.friction else "impulse.png"), dpi=80)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
