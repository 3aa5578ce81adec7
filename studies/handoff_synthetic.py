"""The handoff on flows and cavities with known answers: conservation, fields, shapes, and their convergence with
grains per cavity radius.

``python studies/handoff_synthetic.py [--flows] [--shapes] [--sphere] [--at 5,7,10] [--draws 3] [--json] [--out
FOLDER]`` (all three parts without a choice; ``--at``: grains per cavity radius); flows and shapes come from
``fixtures/flows.py`` and ``shapes.py``. ``--out`` writes ``flows.csv``, ``orders.csv``, ``shapes.csv``,
``sphere.csv``, the scatter over the draws, and ``tables.md``. Some 20 minutes of one core; ``--flows --at 5,7,10``
one.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import time
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from fixtures import clouds, flows, shapes

FLOWS_AT = (5.0, 7.0, 10.0, 14.0, 20.0)
SHAPES_AT = (7.0, 10.0, 14.0, 20.0)
SPHERE_AT = (7.0, 10.0, 14.0, 20.0)
SPHERE = (450e3, 180e3, 40e3)  # radius, depth, rim [m]
LIMITS = {"p_raw": 1e-2, "L_raw": 2e-2, "field_L2": 0.05, "p_after": 1e-10, "L_after": 1e-10}


def run_flows(counts: tuple[float, ...]) -> list[dict]:
    """Every flow at every resolution."""
    rows = []
    for count in counts:
        grains = flows.bed(count)
        for name in flows.FIELDS:
            rows.append({"flow": name, **flows.measured(name, count, grains)})
            print(json.dumps(rows[-1]), flush=True)
    return rows


def run_shapes(counts: tuple[float, ...], draws: int) -> list[dict]:
    """Every shape in every kind of cloud at the finest resolution, in shaken lattices at the others too; each in
    ``draws`` clouds and beds."""
    rows = []
    for count in counts:
        for draw in range(draws):
            grains = shapes.bed(count, seed=2 + draw)
            for shape in shapes.SHAPES:
                for kind in shapes.KINDS:
                    if count == counts[-1] or kind == "shaken":
                        rows.append(
                            {
                                "shape": shape,
                                "cloud": kind,
                                "draw": draw,
                                **shapes.measured(shape, kind, count, grains, seed=1 + draw),
                            }
                        )
                        print(json.dumps(rows[-1]), flush=True)
    return rows


def run_sphere(counts: tuple[float, ...], draws: int) -> list[dict]:
    """The bowl with rim and curtain on a sphere, in ``draws`` clouds and beds."""
    rows = []
    for count in counts:
        grain = SPHERE[0] / count
        for draw in range(draws):
            points, grains = (
                clouds.sphere_cloud(fine=shapes.FINE * grain, seed=3 + draw),
                clouds.sphere_bed(grain=grain, seed=4 + draw),
            )
            rows.append({"shape": "rim and curtain", "cloud": "graded glass on a sphere", "draw": draw,
                         **shapes.on_a_sphere(points, grains, *SPHERE, curtain=300)})  # fmt: skip
            print(json.dumps(rows[-1]), flush=True)
    return rows


def scatter(rows: list[dict]) -> list[dict]:
    """Means, rms and worst over the draws of each shape, cloud and resolution."""
    found = []
    for key in dict.fromkeys((row["shape"], row["cloud"], round(row["grains_per_radius"])) for row in rows):
        mine = [row for row in rows if (row["shape"], row["cloud"], round(row["grains_per_radius"])) == key]
        line = dict(zip(("shape", "cloud", "grains_per_radius"), key)) | {"draws": len(mine)}
        for name in ("source_volume_rel", "bed_volume_rel"):
            values = [row[name] for row in mine]
            line |= {
                f"{name}_mean": sum(values) / len(values),
                f"{name}_rms": (sum(v * v for v in values) / len(values)) ** 0.5,
            }
            line |= {f"{name}_worst": max(values, key=abs)}
        line["hausdorff_over_r_worst"] = max(row["hausdorff_over_r"] for row in mine)
        found.append(line)
    return found


def table(rows: list[dict], columns: list[str]) -> str:
    """Rows as a table in Markdown."""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return "\n".join(lines + ["| " + " | ".join(_shown(row[name]) for name in columns) + " |" for row in rows])


def _shown(value) -> str:
    return (
        f"{value:.2g}"
        if isinstance(value, float) and abs(value) < 1e-2
        else f"{value:.3g}"
        if isinstance(value, float)
        else str(value)
    )


def orders(rows: list[dict]) -> list[dict]:
    """Orders of convergence of each flow."""
    found = []
    for name in flows.FIELDS:
        mine = [row for row in rows if row["flow"] == name]
        counts = [row["grains_per_radius"] for row in mine]
        found.append(
            {
                "flow": name,
                **{
                    key: flows.order(counts, [row[key] for row in mine])
                    for key in ("truth", "field_L2", "p_raw", "L_raw", "mass_raw")
                },
            }
        )
    return found


def main() -> None:
    """Run what was asked for and print tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flows", action="store_true")
    parser.add_argument("--shapes", action="store_true")
    parser.add_argument("--sphere", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--at", type=lambda text: tuple(float(part) for part in text.split(",")), default=None)
    parser.add_argument("--draws", type=int, default=3, help="clouds and beds per shape and resolution")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    everything = not (options.flows or options.shapes or options.sphere)
    began, results, texts = time.perf_counter(), {}, []
    for part, make, usual in (
        ("flows", run_flows, FLOWS_AT),
        ("shapes", run_shapes, SHAPES_AT),
        ("sphere", run_sphere, SPHERE_AT),
    ):
        if not (everything or getattr(options, part)):
            continue
        rows = results[part] = (
            make(options.at or usual) if part == "flows" else make(options.at or usual, options.draws)
        )
        if part == "flows":
            texts.append(
                "### Flows\n\n"
                + table(rows, list(rows[0]))
                + "\n\n### Order of convergence against grains per cavity radius\n\n"
            )
            results["orders"] = orders(rows)
            texts[-1] += table(results["orders"], list(results["orders"][0]))
        else:
            results[f"{part}_scatter"] = scatter(rows)
            title = "Shapes in a half space" if part == "shapes" else "On a sphere"
            texts.append(f"### {title}\n\n" + table(results[f"{part}_scatter"], list(results[f"{part}_scatter"][0])))
    text = "\n\n".join(texts) + f"\n\n{time.perf_counter() - began:.0f} s\n"
    print(text)
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        for part, rows in results.items():
            with open(options.out / f"{part}.csv", "w", newline="") as file:
                writer = csv.DictWriter(file, list(rows[0]))
                writer.writeheader()
                writer.writerows(rows)
        (options.out / "tables.md").write_text(text)
    if options.json:
        worst = (
            {
                key: max((row[key] for row in results["flows"] if row["grains_per_radius"] == 10.0), default=None)
                for key in LIMITS
            }
            if "flows" in results
            else {}
        )
        print(json.dumps({"seconds": time.perf_counter() - began, "worst_at_10": worst, "limits": LIMITS}))


if __name__ == "__main__":
    main()
