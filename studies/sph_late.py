"""Apparent diameter in time of runs of one impact that differ in the late stage (``sph.stepping.late``): a table and a
picture.

    python studies/sph_late.py --out docs/results/sph_late NAME=RUN_FOLDER [NAME=RUN_FOLDER ...]

The first run is what the others are compared with, at the times that both have. Reads ``2_sph/stage_report.json`` and
``6_crater/time_series.csv``.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path

import numpy as np


def series(run: Path) -> dict[str, np.ndarray]:
    """Times [s], apparent diameters and depths [m] with their errors, of the shock stage's snapshots."""
    with (run / "6_crater" / "time_series.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["stage"] == "sph" and row["diameter_apparent_m"]]
    names = ("time_s", "diameter_apparent_m", "diameter_apparent_m_sigma", "depth_m", "depth_m_sigma")
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in names}


def main() -> None:
    """Compare and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("runs", nargs="+", metavar="NAME=RUN_FOLDER")
    given = parser.parse_args()
    runs = {name: Path(folder) for name, folder in (item.split("=", 1) for item in given.runs)}
    found = {name: series(run) for name, run in runs.items()}
    reference = next(iter(found.values()))
    table = []
    for name, run in runs.items():
        report, own = json.loads((run / "2_sph" / "stage_report.json").read_text()), found[name]
        common = [
            (k, int(np.argmin(np.abs(reference["time_s"] - t))))
            for k, t in enumerate(own["time_s"])
            if np.min(np.abs(reference["time_s"] - t)) < 1e-4
        ]
        off = [own["diameter_apparent_m"][k] / reference["diameter_apparent_m"][j] - 1.0 for k, j in common]
        row = {
            "run": name, "steps": report["steps"], "late": report.get("late") or None,
            "end_s": float(own["time_s"][-1]),
            "diameter_m": float(own["diameter_apparent_m"][-1]),
            "diameter_sigma_m": float(own["diameter_apparent_m_sigma"][-1]),
            "depth_m": float(own["depth_m"][-1]),
            "over_first_last_three": float(np.mean(off[-3:])) if len(off) >= 3 else None,
        }  # fmt: skip
        table.append(row)
        print(json.dumps(row))
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "late.json").write_text(json.dumps(table, indent=1))
    draw_late_stage(found, given.out / "diameter.png")


def draw_late_stage(found: dict[str, dict[str, np.ndarray]], path: Path) -> None:
    """Diameter and depth over time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    for name, own in found.items():
        left.errorbar(
            own["time_s"],
            own["diameter_apparent_m"],
            own["diameter_apparent_m_sigma"],
            fmt="o-",
            ms=3,
            capsize=2,
            label=name,
        )
        right.errorbar(own["time_s"], own["depth_m"], own["depth_m_sigma"], fmt="o-", ms=3, capsize=2)
    for axes, what in ((left, "apparent diameter [m]"), (right, "depth [m]")):
        axes.set(xlabel="time [s]", ylabel=what, ylim=(0.0, None))
    left.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
