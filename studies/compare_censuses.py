"""Several censuses in one table: what the choice of the population changes for a basin's projectile, against the
statistical error.

    python studies/compare_censuses.py CENSUS [CENSUS ...] [--target callisto] [--out FILE.md]

``CENSUS`` are folders made by ``impact_census``; the first is the one that the others are compared with.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path

from matter.errors import InputError
from matter.files import archive

ROWS = {
    "v2_retrograde_mean": ("mean speed, retrograde [km/s]", 1e-3, 2),
    "v4_prograde_mean": ("mean speed, prograde [km/s]", 1e-3, 2),
    "mean": ("mean speed, all [km/s]", 1e-3, 2),
    "retrograde_over_prograde": ("retrograde / prograde", 1.0, 2),
    "periapsis_over_none": ("periapsis / no periapsis", 1.0, 2),
    "mean_angle_deg": ("mean angle [deg]", 1.0, 2),
    "Valhalla_mean_angle_deg": ("mean angle at Valhalla's latitude [deg]", 1.0, 2),
    "Valhalla_retrograde_mean_angle_deg": ("the same, retrograde [deg]", 1.0, 2),
    "Asgard_mean_angle_deg": ("mean angle at Asgard's latitude [deg]", 1.0, 2),
    "leading_over_trailing": ("leading / trailing impacts", 1.0, 2),
    "entries_per_particle": ("entries per 1000 particles", 1e3, 3),
}


def read(folder: Path) -> dict:
    """``summary.json`` of a census; raises ``InputError`` when there is none."""
    path = folder / "summary.json"
    if not path.is_file():
        raise InputError(f"no census in {folder}: {path} is missing (impact_census --out {folder} makes it)")
    return json.loads(path.read_text())


def title(summary: dict) -> str:
    """What distinguishes a census."""
    census = summary["census"]
    phase = census["jupiter_mean_anomaly_deg"]
    return (
        f"{census['population']}, phase {phase if isinstance(phase, str) else f'{phase:.0f} deg'}, "
        f"{census['integrator']}"
    )


def table(summaries: list[dict], target: str, command: str) -> str:
    """Markdown table: value +- standard error of each, and in brackets the difference from the first in standard
    errors of both."""
    for summary in summaries:
        if target not in summary["moons"]:
            raise InputError(f"a census holds no impacts on {target} (it has {', '.join(summary['moons'])})")
    lines = [
        f"# Impacts on {target.title()} by population",
        "",
        f"Made by `{command}`. Value +- standard error; in brackets the difference from the first column in standard "
        f"errors of both.",
        "Phase: Jupiter's mean anomaly at the start. Impacts of `literal` weigh one per entry (as published), those "
        "of the others by their chance to hit.",
        "",
        "| quantity | " + " | ".join(title(summary) for summary in summaries) + " |",
        "|---" * (len(summaries) + 1) + "|",
        "| particles; impacts | "
        + " | ".join(f"{s['census']['particles']:,}; {s['moons'][target]['mean']['impacts']:,}" for s in summaries)
        + " |",
    ]
    for key, (label, factor, digits) in ROWS.items():
        numbers = [summary["moons"][target][key] for summary in summaries]
        cells = [_cell(number, numbers[0] if number is not numbers[0] else None, factor, digits) for number in numbers]
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(number: dict, first: dict | None, factor: float, digits: int) -> str:
    text = f"{number['value'] * factor:.{digits}f} +- {number['standard_error'] * factor:.{digits}f}"
    if first is None:
        return text
    spread = math.hypot(number["standard_error"], first["standard_error"])
    return f"{text} ({(number['value'] - first['value']) / spread:+.1f})" if spread > 0.0 else text


def main(arguments: list[str] | None = None) -> int:
    """Command line: see the module's head."""
    parser = argparse.ArgumentParser(prog="python studies/compare_censuses.py")
    parser.add_argument("census", type=Path, nargs="+")
    parser.add_argument("--target", default="callisto")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args(arguments)
    command = "python studies/compare_censuses.py " + " ".join(arguments if arguments is not None else sys.argv[1:])
    text = table([read(folder) for folder in given.census], given.target, command)
    if given.out:
        archive.write_text(given.out, text)
    print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
