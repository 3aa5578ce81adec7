"""A ball of porous ground that flies apart inside the same ground, by particles and in shells: what artificial
viscosity takes of a flow that closes pores ahead of it.

    python studies/porous_source.py [--out docs/results/porous_source] [--particles 4 6 8]

Set-up and both codes: ``fixtures/porous_source.py``, ``fixtures/spherical.py``. ``--particles``: to the ball's radius,
until 4.4 ms; 4 of them until 19 ms, with the viscosity of the shock all along and until 4.4 ms. Prints the table and
draws the kinetic energy.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from fixtures import porous_source
from fixtures.porous_source import Course

ROOT = Path(__file__).resolve().parents[1]
EARLY, LATE = [1e-3, 2.2e-3, 4.4e-3], [9e-3, 19e-3]
SHELLS = 100


def row(name: str, how: str, time: float, course: Course) -> str:
    """A line of the table."""
    radii = ", ".join(f"{one:.3f}" for one in course.radii)
    return f"| {name} | {how} | {1e3 * time:.1f} | {course.kinetic:.3f} | {course.closed:.2f} | {radii} |"


def courses(name: str, particles: list[float]) -> dict[str, tuple[list[float], list[Course]]]:
    """Times and courses by how they were made."""
    ground, times = porous_source.ground(name), EARLY + LATE
    made = {"shells": (times, porous_source.in_shells(ground, times, SHELLS))}
    for late, words in ((math.inf, "4 particles"), (EARLY[-1], "4, late viscosity from 4.4 ms on")):
        made[words] = times, porous_source.in_particles(ground, times, 4.0, late=late)
    for number in (number for number in particles if number != 4.0):
        made[f"{number:g} particles"] = EARLY, porous_source.in_particles(ground, EARLY, number, 4.0)
    return made


def main() -> int:
    """Both grounds: table and picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results" / "porous_source")
    parser.add_argument("--particles", type=float, nargs="*", default=[4.0, 6.0, 8.0], help="to the ball's radius")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.4), sharey=True, layout="constrained")
    print(f"| ground | code | ms | kinetic energy left | pores closed | radii of {porous_source.TRACERS} |")
    print("|---" * 6 + "|")
    for ax, name in zip(axes, porous_source.GROUNDS):
        for how, (times, found) in courses(name, given.particles).items():
            for time, course in zip(times, found):
                print(row(name, how, time, course), flush=True)
            line = "k-" if how == "shells" else "o--"
            ax.loglog([1e3 * t for t in times], [c.kinetic for c in found], line, ms=4, label=how)
        ax.set(title=name, xlabel="time, ms")
        ax.set_xticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
        ax.legend(fontsize=8, frameon=False)
        ax.minorticks_off()
    axes[0].set(ylabel="kinetic energy over that at the start")
    axes[0].set_yticks([0.05, 0.1, 0.2, 0.5, 1.0], ["0.05", "0.1", "0.2", "0.5", "1"])
    figure.savefig(given.out / "kinetic_energy.png", dpi=90)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
