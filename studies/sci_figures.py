"""The two figures of the source on the Ryugu shot (abstract on the SPH-SSDEM framework), drawn from runs of
``cases/sci_ryugu``.

    python studies/sci_figures.py handoff RUN --out figure_1.png
        # velocity of the particles handed over, and of the grains that begin
    python studies/sci_figures.py craters RUN [RUN ...] --out figure_2.png
        # settled craters in section, with their diameters and depth
    python studies/sci_figures.py late RUN_ALL_IN_SPH RUN --out late.png
        # profiles of a late stage that is all in SPH beside that of grains, some 28, 108 and 500 s after the impact

Sections are slabs of one grain diameter on both sides of the plane y = 0.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm

from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from studies.sci import measured

HALF, BELOW, ABOVE = 13.0, 6.0, 5.0
"""Half width, depth and height of a section [m]."""
SLOW, FAST = 1e-3, 1.0
"""Ends of the colours of speed [m/s]."""
MARK = "gold"
LATE = (28.0, 108.0, 500.0)
"""Times [s] of the two late stages that are compared."""


def slab(particles: Particles, radius: np.ndarray, half: float) -> tuple[Particles, np.ndarray]:
    """Those of the particles within ``half`` [m] of the plane y = 0 and inside the frame, and their radii [m]."""
    x, y, z = particles.position.T
    here = (np.abs(y) < half) & (np.abs(x) < HALF) & (z > -BELOW) & (z < ABOVE)
    return particles.select(here), radius[here]


def circles(ax: Any, particles: Particles, radius: np.ndarray, colour: np.ndarray | str, **how: Any) -> Any:
    """The particles as circles of their size, the nearest to the plane on top."""
    order = np.argsort(-np.abs(particles.position[:, 1]))
    positions = particles.position[order][:, [0, 2]]
    discs = EllipseCollection(
        2 * radius[order],
        2 * radius[order],
        np.zeros(len(order)),
        offsets=positions,
        units="xy",
        offset_transform=ax.transData,
        **how,
    )
    if isinstance(colour, str):
        discs.set_facecolor(colour)
    else:
        discs.set_array(colour[order])
    ax.add_collection(discs)
    ax.set(xlim=(-HALF, HALF), ylim=(-BELOW, ABOVE), aspect="equal", xlabel="x [m]")
    ax.axhline(0.0, color="k", lw=0.8, ls="--")
    return discs


def of_particles(particles: Particles) -> np.ndarray:
    """Radius of the sphere of a particle's volume [m]."""
    return np.cbrt(particles.mass / particles.density * 0.75 / np.pi)


def handoff(runs: list[Path], path: Path) -> None:
    """Figure 1: speed of the particles handed over (left) and of the grains that begin (right); numbers and radii on
    top."""
    run = runs[0]
    moment = float(json.loads((run / "4_handoff" / "handoff.json").read_text())["time_s"])
    series = [*snapshot.series(run / "2_sph"), run / "2_sph" / f"last{snapshot.SUFFIX}"]
    before = snapshot.read(min(series, key=lambda one: abs(float(snapshot.attributes(one)["time"]) - moment)))
    after = snapshot.read(run / "4_handoff" / "start.vtkhdf")
    sizes = of_particles(before), after.radius
    half = float(np.median(after.radius))
    fig, axes = plt.subplots(1, 2, figsize=(11, 3.2), layout="constrained", sharey=True)
    for ax, particles, radius, name in zip(
        axes, (before, after), sizes, ("shock stage, as handed over", "grains, as they begin")
    ):
        part, size = slab(particles, radius, half)
        speed = np.linalg.norm(part.velocity, axis=1)
        discs = circles(ax, part, size, speed, norm=LogNorm(SLOW, FAST), cmap="viridis")
        typical = np.linalg.norm(particles.position, axis=1) < 8.0
        if particles is after:  # ejecta are as small as the particles they were
            typical &= particles.identity < particles.attributes["bed_grains"]
        ax.set_title(f"{name}: N = {len(particles):,}, r = {np.median(radius[typical]):.2f} m", fontsize=10)
    axes[0].set_ylabel("z [m]")
    fig.colorbar(discs, ax=axes, label="speed [m/s]", extend="both")
    fig.savefig(path, dpi=110)
    plt.close(fig)


def craters(runs: list[Path], path: Path) -> None:
    """Figure 2: a panel for each run; rim diameter, crater diameter and depth marked, packing, r and N in the left
    corner."""
    columns = min(3, len(runs))
    rows = -(-len(runs) // columns)
    fig, axes = plt.subplots(
        rows,
        columns,
        figsize=(4.6 * columns, 2.4 * rows),
        layout="constrained",
        sharex=True,
        sharey=True,
        squeeze=False,
    )
    for ax in axes.flat[len(runs) :]:
        ax.remove()
    for ax, run in zip(axes.flat, runs):
        last = snapshot.read(run / "5_dem" / "last.vtkhdf")
        final = json.loads((run / "6_crater" / "measures.json").read_text())["final"]
        usual = float(np.median(last.radius))
        part, size = slab(last, last.radius, usual)
        circles(ax, part, size, "tan", edgecolor="saddlebrown", linewidth=0.3)
        rim, wide, deep = (final[name]["value"] for name in ("diameter_rim_m", "diameter_apparent_m", "depth_m"))
        for level, length in ((2.6, rim), (1.1, wide)):
            ax.annotate(
                "", (-0.5 * length, level), (0.5 * length, level), arrowprops={"arrowstyle": "<->", "color": MARK}
            )
            ax.text(0.0, level + 0.15, f"{length:.1f} m", ha="center", color="darkgoldenrod")
        ax.annotate("", (0.0, 0.0), (0.0, -deep), arrowprops={"arrowstyle": "<->", "color": MARK})
        ax.text(0.3, -0.6 * deep, f"{deep:.2f} m", color="darkgoldenrod")
        ax.axvline(0.0, color="k", lw=0.6, ls="--")
        packing = str(last.attributes.get("packing", "rcp")).upper().replace("_", ", ")
        words = f"{packing}, r = {usual:.2f} m, N = {int(last.attributes.get('bed_grains', len(last))):,}"
        if not final.get("settled"):
            words += f" (still moving at {final['time_s']['value']:.0f} s)"
        ax.text(-HALF + 0.4, -BELOW + 0.4, words, fontsize=9, bbox={"facecolor": "w", "lw": 0, "alpha": 0.8, "pad": 1})
    for ax in axes[:, 0]:
        ax.set_ylabel("z [m]")
    fig.savefig(path, dpi=110)
    plt.close(fig)


def late(runs: list[Path], path: Path) -> None:
    """Profiles of the run that is all in SPH (first) and of the grains of the other (second) at ``LATE``, each at the
    snapshot nearest in time."""
    fig, ax = plt.subplots(figsize=(8, 4), layout="constrained")
    for run, stage, name, style in zip(runs, ("2_sph", "5_dem"), ("SPH", "grains"), ("--", "-")):
        paths = snapshot.series(run / stage)
        times = np.array([float(snapshot.attributes(one)["time"]) for one in paths])
        for moment, colour in zip(LATE, ("tab:blue", "tab:orange", "tab:red")):
            nearest = int(np.argmin(np.abs(times - moment)))
            found = measured(paths[nearest])
            sizes = [found[key].value for key in ("diameter_apparent_m", "depth_m")]
            said = f"{name}, {times[nearest]:.0f} s: " + ", ".join(
                f"{letter} " + ("none" if size is None else f"{size:.2f} m") for letter, size in zip("Dd", sizes)
            )
            print(said)
            ax.plot(found.profile.radius, found.profile.height, style, color=colour, label=said)
    ax.axhline(0.0, color="k", lw=0.8, ls=":")
    ax.set(xlim=(0.0, HALF), xlabel="distance from the axis [m]", ylabel="height [m]")
    ax.legend(fontsize=8)
    fig.savefig(path, dpi=110)
    plt.close(fig)


def main() -> int:
    """Draw one figure."""
    figures: dict[str, Callable[[list[Path], Path], None]] = {"handoff": handoff, "craters": craters, "late": late}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", choices=list(figures))
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    try:
        figures[given.figure](given.runs, given.out)
    except (InputError, OSError) as reason:
        print(reason)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
