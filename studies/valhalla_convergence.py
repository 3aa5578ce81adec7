"""Transient crater of the 980 km case against the particle spacing, extrapolated to none.

    python studies/valhalla_convergence.py --out runs/convergence
        # graded: 74, 52, 37 and 26 km (about half an hour on two cores)
    python studies/valhalla_convergence.py --out runs/convergence --uniform runs/valhalla_980km-1234abcd

All zones are refined together (far spacing, contact spacing and the projectile's particles go with the spacing at the
impact), so that runs differ in resolution alone. ``--uniform``: run folder of the 300,000 particles of one size, shown
beside. Started again, it goes on where it was. Leaves convergence.png, .md, .json.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

from matter.errors import InputError, Stopped
from matter.files import archive
from pipeline.running.run_process import STOPPED
from studies.winter_2017 import variants as sweep

CASE = Path(__file__).resolve().parents[1] / "cases" / "valhalla_980km"
SPACINGS = (74, 52, 37, 26)
QUANTITIES = ("diameter_apparent_m", "depth_m")
CHOICES = ("depth", "volume")


def variants(more: tuple[str, ...] = ()) -> list[sweep.Variant]:
    """The graded runs, coarse to fine."""
    rows = []
    for s in SPACINGS:
        far, count = 200.0 * s / 52.0, round(37 * (52 / s) ** 3)
        own = (f"sph.spacing_at_impact={s} km", f"sph.spacing_far={far:.0f} km", f"sph.projectile_particles={count}")
        rows.append(sweep.Variant(f"{s}km", CASE, "quick", (*own, *more)))
    return rows


def row_of(name: str, run: Path, measures: dict[str, Any]) -> dict[str, Any]:
    """Spacing, particle number, peak pressure and the transient crater of one run."""
    from matter.files import snapshot

    report = json.loads((run / "2_sph" / "stage_report.json").read_text())
    first = snapshot.attributes(snapshot.series(run / "2_sph")[0])
    row: dict[str, Any] = {
        "name": name,
        "run": run.name,
        "spacing_m": float(first["spacing_at_impact_m"]),
        "particles": report["particles"],
    }
    row["peak_pressure_Pa"] = report["peak_pressure_Pa"]
    for choice in CHOICES:
        crater = measures["transient"].get(f"at_maximum_{choice}", {})
        for quantity in (*QUANTITIES, "time_s"):
            entry = crater.get(quantity, {})
            row[f"{quantity}_at_{choice}"] = math.nan if entry.get("value") is None else entry["value"]
            row[f"{quantity}_at_{choice}_sigma"] = math.nan if entry.get("sigma") is None else entry["sigma"]
    return row


def as_markdown(rows: list[dict[str, Any]], fits: dict[str, Any], command: str) -> str:
    """The table."""
    lines = ["# Transient crater against particle spacing, 980 km case", "", f"Made by `{command}`.", ""]
    lines += [
        "| run | spacing [km] | particles | peak pressure [GPa] | at maximum of | t [min] | D [km] | depth [km] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        for choice in CHOICES:
            cells = [
                f"{row[f'{q}_at_{choice}'] / 1e3:.0f} +- {row[f'{q}_at_{choice}_sigma'] / 1e3:.0f}" for q in QUANTITIES
            ]
            start = (
                f"| {row['name']} ({row['run']}) | {row['spacing_m'] / 1e3:.1f} | {row['particles']:,} | "
                f"{row['peak_pressure_Pa'] / 1e9:.1f} |"
            )
            lines.append(f"{start} {choice} | {row[f'time_s_at_{choice}'] / 60:.1f} | {cells[0]} | {cells[1]} |")
    lines += [
        "",
        "Extrapolated to spacing zero (the graded runs; q0 + a s, error: the fit's and the difference to a free "
        "order):",
        "",
    ]
    lines += [
        "| quantity | extrapolated [km] | slope [km per km] | scatter about the line [km] | free order | with it [km] "
        "|",
        "|---|---|---|---|---|---|",
    ]
    for name, fit in fits.items():
        free = (f"{fit.free_order:.2f}", f"{fit.free_value / 1e3:.0f}") if fit.free_order is not None else ("-", "-")
        lines.append(
            f"| {name} | {fit.value / 1e3:.0f} +- {fit.sigma / 1e3:.0f} | {fit.slope:.2f} | {fit.scatter / 1e3:.1f} | "
            f"{free[0]} | {free[1]} |"
        )
    return "\n".join(lines) + "\n"


def table(chosen: list[sweep.Variant], out: Path, uniform: Path | None, command: str) -> None:
    """Measure what is finished, extrapolate, write table and picture."""
    from studies.winter_2017 import convergence

    rows = []
    for variant in chosen:
        folder_path = sweep.measure(variant, out)
        print(f"{variant.name:<6} {'measured' if folder_path else 'not run'}", flush=True)
        if folder_path:
            rows.append(
                row_of(variant.name, variant.run_folder(out), json.loads((folder_path / "measures.json").read_text()))
            )
    fits = {}
    for key in (f"{quantity}_at_{choice}" for choice in CHOICES for quantity in QUANTITIES):
        try:
            fits[key] = convergence.extrapolated(
                *([row[column] for row in rows] for column in ("spacing_m", key, f"{key}_sigma"))
            )
        except InputError as reason:
            print(f"{key}: {reason}")
    beside = None
    if uniform is not None:
        if not (uniform / "6_crater" / "measures.json").is_file():
            raise InputError(f"{uniform} is not a finished run: 6_crater/measures.json is missing")
        beside = row_of("uniform", uniform, json.loads((uniform / "6_crater" / "measures.json").read_text()))
    text = as_markdown([*rows, *([beside] if beside else [])], fits, command)
    archive.write_text(out / "convergence.md", text)
    content = {
        "command": command,
        "rows": rows,
        "uniform": beside,
        "extrapolated": {key: vars(fit) for key, fit in fits.items()},
    }
    archive.write_json(out / "convergence.json", content)
    if rows:
        convergence.draw_convergence(rows, fits, out / "convergence.png", beside)
    print(text)


def main() -> int:
    """Exit code 0, 2 for bad input, 75 when stopped, 1 when a run failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs/valhalla_convergence"))
    parser.add_argument("--runs", nargs="+", metavar="NAME", help=f"a part of {' '.join(f'{s}km' for s in SPACINGS)}")
    parser.add_argument("--uniform", type=Path, help="run folder of the case at its thesis size")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="laid over every run: --set 'sph.end_time=3 min' to try the script",
    )
    parser.add_argument("--table", action="store_true", help="run nothing, table what there is")
    parser.add_argument("--threads", type=int)
    given = parser.parse_args()
    runs, failed = variants(tuple(given.set)), []
    try:
        for variant in [] if given.table else sweep.chosen(runs, given.runs):
            print(f"== {variant.name}", flush=True)
            if code := sweep.run(variant, given.out, given.threads):
                if code == STOPPED:
                    return code
                failed.append(f"{variant.name} ended with {code}")
        given.out.mkdir(parents=True, exist_ok=True)
        table(runs, given.out, given.uniform, " ".join(["python", *sys.argv]))
    except (InputError, Stopped) as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    print("\n".join(failed), file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
