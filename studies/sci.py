"""The runs behind the claims on the Ryugu shot, one command for each row, and what they found beside its limits.

    python studies/sci.py                                # the rows and their runs
    python studies/sci.py S1 --out runs/sci
        # makes the runs of a row, resumed where they were stopped; what rows share is made once
    python studies/sci.py S1 --out runs/sci --check      # validates them and predicts their cost
    python studies/sci.py S1 --out runs/sci --evaluate   # the table of what is done so far

Rows S and G are of the shock stage: apparent diameter and depth of snapshots, and the ballistic crater. Rows D and E
are of the grains: ``measures.json`` of every run. The rows stand in ``studies/sci_rows.py``.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from crater.ejecta import ballistic
from crater.measures.measure import Measures
from crater.results import measurement_config
from matter.errors import InputError
from matter.files import snapshot
from studies.case_runs import run
from studies.sci_rows import ROWS, Row

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "cases" / "sci_ryugu"
GRAVITY, REACH = 1.2e-4, 14.5


def measured(path: Path) -> Measures:
    """The crater in a snapshot, on the choices of the run that it comes from. Raises ``InputError`` where none is
    found."""
    particles = snapshot.read(path)
    known = measurement_config.of_snapshot(path, particles.attributes)
    if known is None:
        raise InputError(f"{path} does not say what it is measured against")
    return known.measured(particles, known.ground_before(), str(path))


def of_shock(folder: Path, times: Sequence[float]) -> list[str]:
    """A line for each time: diameter and depth as measured, and the ballistic crater."""
    lines, paths = [], snapshot.series(folder / "2_sph")
    layer = json.loads((folder / "2_sph" / "target.json").read_text())["layers"][-1]
    density = layer["mass_kg_m2"] / (layer["top_m"] - layer["bottom_m"])
    stamps = np.array([float(snapshot.attributes(path).get("time", 0.0)) for path in paths])
    for time in times:
        if len(paths) == 0 or np.min(np.abs(stamps - time)) > 0.1 * time:
            lines.append(f"{time:8.3g} s  no snapshot")
            continue
        path = paths[int(np.argmin(np.abs(stamps - time)))]
        try:
            found = measured(path)
            size = "  ".join(
                f"{name} {found[key].value:.3g} m"
                for name, key in (("D", "diameter_apparent_m"), ("d", "depth_m"))
                if found[key].value is not None
            )
        except InputError as reason:
            size = str(reason)
        in_flight = ballistic.measure_profile(ballistic.profile_of(snapshot.read(path), GRAVITY, density, REACH)[0])
        free = "  ".join(
            f"{name} {in_flight[key].value:.4g}"
            for name, key in (("D", "diameter_apparent_m"), ("V", "volume_m3"))
            if key in in_flight
        )
        lines.append(f"{time:8.3g} s  {size}   ballistic: {free}")
    return lines


def inside(folder: Path, times: Sequence[float], radius: float) -> list[str]:
    """A line for each time: vertical momentum and kinetic energy of the matter within ``radius`` [m] of the point of
    impact."""
    lines = []
    for time in times:
        path = min(
            snapshot.series(folder / "2_sph"), key=lambda one: abs(float(snapshot.attributes(one)["time"]) - time)
        )
        particles = snapshot.read(path)
        near = particles.select(np.linalg.norm(particles.position, axis=1) < radius)
        energy = 0.5 * near.mass @ np.sum(near.velocity**2, axis=1)
        lines.append(
            f"{float(particles.attributes['time']):8.3g} s  p_z {near.mass @ near.velocity[:, 2]:.6g} kg m/s  energy "
            f"{energy:.6g} J"
        )
    return lines


def of_grains(folder: Path) -> list[str]:
    """Final and ballistic measures, and the rows of the ledger that fail."""
    path = folder / "6_crater" / "measures.json"
    if not path.is_file():
        return ["not done"]
    measures = json.loads(path.read_text())
    lines = []
    for part in ("final", "ballistic"):
        rows = {
            key: value
            for key, value in measures.get(part, {}).items()
            if key.endswith(("_m", "_m3")) and isinstance(value, dict) and value.get("value")
        }
        lines.append(
            f"  {part}: "
            + ", ".join(
                f"{key} {value['value']:.4g} +- {value.get('sigma') or float('nan'):.2g}"
                for key, value in rows.items()
            )
        )
    ledger = folder / "4_handoff" / "ledger.json"
    failing = (
        [row["name"] for row in json.loads(ledger.read_text()) if row["verdict"] == "fail"] if ledger.is_file() else []
    )
    return [*lines, f"  ledger: {', '.join(failing) if failing else 'no row fails'}"]


def books(folder: Path, after: float) -> list[str]:
    """Vertical momentum and energies of all grains at the start of the collapse and ``after`` [s], from its history
    (the row nearest to it), and the kinetic energy of bed and ejecta in the first snapshots."""
    with (folder / "5_dem" / "history.csv").open() as lines:
        rows = [{key: float(value or "nan") for key, value in row.items()} for row in csv.DictReader(lines)]
    begin = rows[0]
    then = min(rows, key=lambda row: abs(row["time_s"] - begin["time_s"] - after))
    parts = []
    bed_grains = snapshot.read(folder / "4_handoff" / "start.vtkhdf").attributes["bed_grains"]
    for path in snapshot.series(folder / "5_dem")[:3]:
        grains = snapshot.read(path)
        energy = 0.5 * grains.mass * np.sum(grains.velocity**2, axis=1)
        bed = grains.identity < bed_grains
        parts.append(
            f"{grains.attributes['time']:8.4g} s  kinetic, bed {energy[bed].sum():.4g} J  ejecta "
            f"{energy[~bed].sum():.6g} J"
        )
    return [
        f"{row['time_s']:8.4g} s  p_z {row['momentum_z']:.6g} kg m/s  kinetic {row['kinetic_J']:.6g} J  rotational "
        f"{row['rotational_J']:.4g} J  lost in contacts {row['dissipated_contacts_J']:.5g} J"
        for row in (begin, then)
    ] + parts


def evaluated(row: Row, folder: Path) -> list[str]:
    """What a run of this row has to say."""
    if row.within:
        return inside(folder, row.times, row.within)
    if row.times:
        return of_shock(folder, row.times)
    return [*of_grains(folder), *(books(folder, row.after) if row.after else [])]


def main() -> int:
    """Run, check or evaluate a row; the largest exit code of its runs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("row", nargs="?", choices=list(ROWS))
    parser.add_argument(
        "--out", type=Path, default=Path("runs/sci"), help="folder of the runs and of the book of what was run"
    )
    parser.add_argument("--check", action="store_true", help="validate and predict only")
    parser.add_argument("--evaluate", action="store_true", help="run nothing")
    given = parser.parse_args()
    if given.row is None:
        for name, row in ROWS.items():
            print(f"{name}  {row.shows}")
            for label, arguments in row.runs.items():
                print(
                    f"      {label:18} run_case cases/sci_ryugu "
                    + " ".join(f'"{part}"' if " " in part else part for part in arguments)
                )
        return 0
    row, worst = ROWS[given.row], 0
    print(f"{given.row}: {row.shows}")
    book = given.out / "book.json"
    folders = json.loads(book.read_text()) if book.is_file() else {}
    for label, arguments in row.runs.items():
        print(label)
        key = " ".join(arguments)
        if not given.evaluate:
            code, folder = run(CASE, arguments, given.out.resolve(), given.check)
            worst = max(worst, code)
            if folder is not None and not given.check:
                given.out.mkdir(parents=True, exist_ok=True)
                book.write_text(json.dumps(folders := folders | {key: str(folder)}, indent=1))
        if not given.check and key in folders:
            print("\n".join(evaluated(row, Path(folders[key]))))
    return worst


if __name__ == "__main__":
    raise SystemExit(main())
