"""Melt of dunite struck by dunite at 25 km/s, by peak pressure and by entropy, against the spacing.

    python studies/melt_of_dunite.py --out runs/melt [--results docs/results/melt_of_dunite] [--sizes 10 14 20]

Runs ``cases/pierazzo_1997``; what is done is not made again. In masses of the ball, of target and ball together; both
ways use the pressure or entropy at which matter is as hot as its melting point at 1 bar (``crater.shock.release``).
The published laws are those of the run's own page (``crater.scaling.melt``). Extrapolated to no spacing by m = m_0 + a
h^p of the last three sizes.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from crater.scaling import melt
from studies import case_runs

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "cases" / "pierazzo_1997"
RADIUS = 1000.0
SIZES = (10, 14)
WAYS = {
    "melting_begins": "as hot as its melting point, by entropy",
    "shock_melting_begins": "the same, by peak pressure",
    "boiling_begins": "begins to boil, by entropy",
    "shock_boiling_begins": "the same, by peak pressure",
}


def measured(run: Path) -> dict[str, Any]:
    """Masses over that of the ball, of target and ball together, and those of the ball alone, by way, with errors."""
    measures = json.loads((run / "6_crater" / "measures.json").read_text())
    parts = measures["release"]
    critical = parts[0]["critical"]
    found: dict[str, Any] = {
        "pressure": critical["shock_melting_begins_Pa"],
        "published": measures["melt_scaling"]["over_projectile_mass"],
    }
    for way in WAYS:
        each = {part["body"]: part["over_projectile_mass"].get(way, 0.0) for part in parts}
        error = np.hypot(*(part["counting_error"].get(way, 0.0) for part in parts))
        found[way] = {"sum": sum(each.values()), "ball": each["projectile"], "error": float(error)}
    report = json.loads((run / "2_sph" / "stage_report.json").read_text())
    found["energy"] = report["drift_over_projectile"]["energy_J"]
    return found


def extrapolated(spacing: np.ndarray, mass: np.ndarray) -> tuple[float, float] | None:
    """(mass at no spacing, order) through three sizes, the finest last; None where they do not come together."""
    (h0, h1, h2), (m0, m1, m2) = spacing[-3:], mass[-3:]
    ratio = (m0 - m1) / (m1 - m2)

    def off(order: float) -> float:
        return float((h0**order - h1**order) / (h1**order - h2**order) - ratio)

    if not off(0.2) * off(6.0) < 0.0:
        return None
    order = float(brentq(off, 0.2, 6.0))
    slope = (m1 - m2) / (h1**order - h2**order)
    return float(m2 - slope * h2**order), order


def table(found: dict[int, dict[str, Any]]) -> str:
    """All sizes, and what they come to without spacing."""
    lines = ["| spacings to the radius | " + " | ".join(WAYS.values()) + " |", "|---" * (1 + len(WAYS)) + "|"]
    for size, run in found.items():
        cells = (f"{run[way]['sum']:.2f} +- {run[way]['error']:.2f}" for way in WAYS)
        lines.append(f"| {size} | " + " | ".join(cells) + " |")
    if len(found) >= 3:
        spacing = 1.0 / np.array(list(found), dtype=float)
        ends = (extrapolated(spacing, np.array([run[way]["sum"] for run in found.values()])) for way in WAYS)
        cells = ("not even" if end is None else f"{end[0]:.2f} (order {end[1]:.1f})" for end in ends)
        lines.append("| no spacing | " + " | ".join(cells) + " |")
    laws = next(iter(found.values()))["published"]
    said = ", ".join(f"{melt.WORDS[key]}: {value:.2f}" for key, value in laws.items())
    return "\n".join(lines) + f"\n\nPublished: {said}\n"


def picture(found: dict[int, dict[str, Any]], path: Path) -> None:
    """Both ways against the spacing."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(5.6, 3.8), layout="constrained")
    spacing = 1.0 / np.array(list(found), dtype=float)
    for color, (way, words) in zip(("C3", "C0", "C1", "C9"), WAYS.items()):
        sums = [run[way]["sum"] for run in found.values()]
        ax.errorbar(
            spacing, sums, [run[way]["error"] for run in found.values()], color=color, marker="o", ms=4, label=words
        )
    for style, (key, value) in zip((":", "--"), next(iter(found.values()))["published"].items()):
        ax.axhline(value, color="k", lw=0.8, ls=style, label=melt.WORDS[key])
    ax.set(xlim=(0.0, None), ylim=(0.0, None), xlabel="spacing over the ball's radius", ylabel="mass over the ball's")
    ax.legend(fontsize=7)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> int:
    """Make what is missing, print and keep what all of it says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "melt", help="folder of the runs")
    parser.add_argument("--results", type=Path, default=ROOT / "docs" / "results" / "melt_of_dunite")
    parser.add_argument("--sizes", type=int, nargs="+", default=list(SIZES), help="spacings to the ball's radius")
    given = parser.parse_args()
    found: dict[int, dict[str, Any]] = {}
    for size in sorted(given.sizes):
        spacing = case_runs.sets(f"sph.spacing_at_impact={RADIUS / size:.3g} m")
        code, folder = case_runs.run(CASE, (*spacing, "--threads", "1"), given.out.resolve())
        if code or folder is None:
            return code or 1
        found[size] = measured(folder)
    given.results.mkdir(parents=True, exist_ok=True)
    text = table(found)
    print(text)
    picture(found, given.results / "melt.png")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
