"""The isobaric core and the decay of peak pressure by a grid code of the project's own: what V08 is held against.

    python studies/isobaric_core.py [--results docs/results/isobaric_core] [--core 20 40 80 160] [--decay 20 40]

An aluminium ball of 500 m strikes aluminium straight down at 5 and 20 km/s, without strength and gravity, in cells
about the axis (``eulerian/``). Peak pressures are those of markers, read as ``examples/peak_pressures.py`` reads
those of particles: medians by mass in shells of 0.2 radii within 30 deg of the vertical. Numbers are cells to the
ball's radius:
``--core`` until the shock is 0.5 radii deep, ``--decay`` until it is 4 deep. What stands in ``measured.json`` is not
made again. Extrapolated to no cell size by m = m_0 + a h^p of the last three sizes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from sph.materials.rows import Materials, collect
from sph.shock_states import impedance
from studies.eulerian import ball, contact_edge
from studies.melt_of_dunite import extrapolated

ROOT = Path(__file__).resolve().parents[1]
RADIUS, MATERIAL = 500.0, "aluminum"
SPEEDS = {"5 km/s": 5e3, "20 km/s": 20e3}
KINDS = {"core": (0.5, 0.6), "decay": (4.0, 2.1)}
"""How deep the shock comes and how high the cells reach, over the ball's radius."""
OVER = 1.05
"""Above this fraction of the planar limit matter counts as overshooting."""


def measured(materials: Materials, speed: float, cells: int, kind: str) -> dict[str, Any]:
    """Pressures over the planar limit of one run, and what it took."""
    begun, limit = time.perf_counter(), impedance.planar(materials, MATERIAL, MATERIAL, speed).pressure
    reach, above = KINDS[kind]
    markers, flow = ball.struck(materials, speed, RADIUS, cells, reach, above)
    table = ball.shells(markers, reach)
    whole = 4.0 / 3.0 * np.pi * RADIUS**3 * float(materials.rows.rho0[0])
    found = {
        "core": float(table[:, 1].max() / limit),
        "overshoot": ball.overshoot(markers, OVER * limit, whole),
        "largest": float(markers.peak.max() / limit),
        "steps": flow.steps,
        "wall_s": round(time.perf_counter() - begun, 1),
        "shells": np.round(np.column_stack([table[:, 0], table[:, 1] / limit]), 4).tolist(),
    }
    return found | ({"exponent": ball.exponent(table)} if kind == "decay" else {})


def result_rows(found: dict[str, Any], materials: Materials) -> list[str]:
    """The table of all runs, and what they come to without cells."""
    rows = ["| speed | cells | core | above 1.05 of planar | largest | n | steps | wall s |", "|---" * 8 + "|"]
    for speed, v in SPEEDS.items():
        cores = []
        for kind in KINDS:
            for cells, run in sorted(found.get(f"{kind}, {speed}", {}).items(), key=lambda item: int(item[0])):
                n = f"{run['exponent']:.2f}" if "exponent" in run else ""
                rows.append(
                    f"| {speed} | {cells} | {run['core']:.4f} | {100.0 * run['overshoot']:.2f} % | "
                    f"{run['largest']:.2f} | {n} | {run['steps']:,} | {run['wall_s']:.0f} |"
                )
                if kind == "core":
                    cores.append((1.0 / int(cells), run["core"]))
        end = extrapolated(*np.array(cores).T) if len(cores) >= 3 else None
        limit = impedance.planar(materials, MATERIAL, MATERIAL, v).pressure
        edge = contact_edge.last_attached(materials, v)
        rows.append(
            f"| {speed} | none | {f'{end[0]:.4f} (order {end[1]:.1f})' if end else 'not even'} | | edge of the "
            f"contact, exact: {edge.pressure / limit:.2f} at {edge.distance:.2f} radii | | | |"
        )
    return rows


def picture(found: dict[str, Any], path: Path) -> None:
    """Shell medians against depth, each speed at its finest decay run and finest core run."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.6), layout="constrained")
    for color, speed in zip(("C0", "C3"), SPEEDS):
        decay, core = (found.get(f"{kind}, {speed}", {}) for kind in ("decay", "core"))
        for style, (cells, run) in zip((":", "--", "-"), sorted(decay.items(), key=lambda item: int(item[0]))):
            axes[0].loglog(*np.array(run["shells"]).T, color=color, ls=style, label=f"{speed}, {cells} cells")
        sizes = sorted(int(cells) for cells in core)
        axes[1].plot([1.0 / n for n in sizes], [core[str(n)]["core"] for n in sizes], "o-", color=color, label=speed)
    axes[0].set(xlabel="depth over the ball's radius", ylabel="peak pressure over the planar limit")
    axes[0].set_xticks([0.3, 0.5, 1.0, 2.0, 4.0], ["0.3", "0.5", "1", "2", "4"])
    axes[0].set_yticks([0.1, 0.2, 0.5, 0.8], ["0.1", "0.2", "0.5", "0.8"])
    axes[0].minorticks_off()
    axes[1].set(xlabel="cell over the ball's radius", ylabel="core over the planar limit", xlim=(0.0, None))
    for ax in axes:
        ax.legend(fontsize=8, frameon=False)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> int:
    """Make what is missing, print and keep what all of it says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, default=ROOT / "docs" / "results" / "isobaric_core")
    parser.add_argument("--core", type=int, nargs="*", default=[20, 40, 80, 160], help="cells to the ball's radius")
    parser.add_argument("--decay", type=int, nargs="*", default=[20, 40], help="cells to the ball's radius")
    given = parser.parse_args()
    given.results.mkdir(parents=True, exist_ok=True)
    book = given.results / "measured.json"
    found: dict[str, Any] = json.loads(book.read_text()) if book.is_file() else {}
    materials = collect((MATERIAL,))
    sizes = {"core": given.core, "decay": given.decay}
    wanted = [(cells, kind, speed) for kind in KINDS for cells in sizes[kind] for speed in SPEEDS]
    for cells, kind, speed in sorted(wanted, key=lambda run: run[0]):
        rows = found.setdefault(f"{kind}, {speed}", {})
        if str(cells) not in rows:
            rows[str(cells)] = measured(materials, SPEEDS[speed], cells, kind)
            print(kind, speed, cells, {k: v for k, v in rows[str(cells)].items() if k != "shells"}, flush=True)
            book.write_text(json.dumps(found) + "\n")
    print("\n".join(result_rows(found, materials)))
    picture(found, given.results / "peaks.png")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
