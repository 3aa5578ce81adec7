"""The runs behind the claims on the Ryugu shot, one command for each row, and what they found beside its limits.

    python studies/sci.py                                # the rows and their runs
    python studies/sci.py S1 --out runs/sci
        # makes the runs of a row, resumed where they were stopped; what rows share is made once
    python studies/sci.py S1 --out runs/sci --check      # validates them and predicts their cost
    python studies/sci.py S1 --out runs/sci --evaluate   # the table of what is done so far

Rows S are of the shock stage: apparent diameter and depth of snapshots, and the ballistic crater. Rows D are of the
grains: ``measures.json`` of every run.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crater import ballistic, choices
from crater.measure import Measures
from dem.engines import deviations
from matter import snapshot
from matter.errors import InputError
from studies.case_runs import run, sets

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "cases" / "sci_ryugu"
GRAVITY, DENSITY, REACH = 1.2e-4, 1227.0, 14.5


class Row(NamedTuple):
    """What must be shown, the runs by name (arguments of ``run_case``), and the times [s] at which shock stages are
    measured."""

    shows: str
    runs: dict[str, tuple[str, ...]]
    times: tuple[float, ...] = ()
    within: float = 0.0
    """Radius [m] inside which momentum and energy are summed instead of a crater measured."""
    after: float = 0.0
    """Time [s] from the start of the collapse at which the books of the grains are read."""


SPH, COARSE, QUICK = ("--until", "sph"), ("--preset", "coarse29"), ("--preset", "quick")
# the case computes a quarter (a vertical shot is its own mirror image in two planes) with reconstructed jumps; S2, S3
# and S5 have the former numerics beside them
QUARTER = (*SPH, *sets("sph.numerics=monaghan"))
WHOLE = (*QUARTER, *sets("sph.symmetry=none"))
FINE = sets(
    "sph.spacing_at_impact=6.5 cm",
    "sph.growth=0.04",
    "sph.spacing_far=1 m",
    "sph.end_time=1.2 s",
    "handoff.time=1.2 s",
)
EARLY = sets("sph.end_time=15.5 ms", "handoff.time=last", "sph.snapshot_interval=1 ms", "sph.history_interval=0.5 ms")
WIDE = sets('target.layers=[{name="soil",material="basalt",thickness="30 m"}]')
# one bed in the springs of the collapse for all engines, so that no contact carries an offset; D and depth at 200 s
SAME = (
    *QUICK,
    *sets("bed.largest_speed=0.025 m/s", "dem.springs_for=bed", "dem.end_time=200 s", "dem.latest_time=200 s"),
)
ACCEPT = "dem.accept=[" + ",".join(f'"{name}"' for name in deviations.SENTENCES) + "]"
NO_TWIST = sets("dem.contact.shell.twisting=0")
LATER = sets("sph.late.at=30 ms", "sph.late.viscosity_at=15 ms")
ROWS = {
    "S1": Row(
        "switch at 15 and 30 ms, alpha halved and doubled: D 5 %, depth 10 % at 1 and 4 s",
        {
            "15 ms": SPH,
            "30 ms": (*SPH, *LATER),
            "coarse": (*SPH, *COARSE),
            "coarse 30 ms": (*SPH, *COARSE, *LATER),
            "coarse alpha / 2": (*SPH, *COARSE, *sets("sph.late.alpha=0.05")),
            "coarse alpha x 2": (*SPH, *COARSE, *sets("sph.late.alpha=0.2")),
        },
        (1.0, 4.0),
    ),
    "S2": Row(
        "Morris & Monaghan's switch from the start, and reconstructed jumps: ballistic D and V stated",
        {
            "none": (*QUARTER, *COARSE),
            "morris_monaghan": (*QUARTER, *COARSE, *sets("sph.viscosity_switch=morris_monaghan")),
            "reconstructed": (*SPH, *COARSE),
        },
        (1.0, 4.0, 6.0),
    ),
    "S3": Row(
        "three numbers of particles: ballistic D 5 %, V 10 % between the last two",
        {
            **{
                f"{words}{number}": (*kind, *size)
                for words, kind in (("", SPH), ("monaghan ", QUARTER))
                for number, size in (("29,532", COARSE), ("104,556", ()), ("227,512", FINE))
            },
        },
        (1.0,),
    ),
    "S4": Row(
        "ground of 22 and 30 m: vertical momentum and energy inside 5 m at 15 ms 10 %",
        {"22 m": (*SPH, *COARSE, *EARLY), "30 m": (*SPH, *COARSE, *EARLY, *WIDE)},
        (0.015,),
        5.0,
    ),
    "S5": Row(
        "a quarter against the whole, each with a draw of its own: D and depth within the scatter",
        {
            "whole": WHOLE,
            "quarter": QUARTER,
            "coarse whole": (*WHOLE, *COARSE),
            "coarse quarter": (*QUARTER, *COARSE),
        },
        (1.0, 4.0),
    ),
    "S6": Row(
        "a quarter whose projectile has 4 (one in each quarter), 16 and 56 particles: D and depth stated",
        {f"{count}": (*SPH, *QUICK, *sets(f"sph.projectile_particles={count}")) for count in (1, 16, 50)},
        (1.0, 4.0, 8.0),
    ),
    "D1": Row(
        "random packing, one handoff: 50,000 to 100,000 grains D 5 %, depth 10 % and r / 2",
        {f"{count:,}": sets(f"bed.count={count}") for count in (20_000, 50_000, 100_000)},
    ),
    "D2": Row(
        "hexagonal packing: D below 0.95, depth below 0.9 of the random one, its change with the number larger",
        {
            **{f"hcp {count:,}": ("--preset", "hcp", *sets(f"bed.count={count}")) for count in (50_000, 100_000)},
            "tilted 50,000": sets("bed.packing=hcp_tilted", "bed.count=50000"),
        },
    ),
    "D3": Row("against the observation: D 14.5-16.7, depth 2.07-2.99, rim 16.2-19.8 m", {"case": ()}),
    "D5": Row(
        "springs four times as stiff D 3 %, depth 5 %; half and twice the time of the handoff, limits of 0.5 "
        "and 2 m/s D 5 %, depth 10 %; "
        "three beds: the scatter is the error (inspect_handoff RUN --sensitivity does the rest)",
        {
            "quick": QUICK,
            "springs x 4": (*QUICK, *sets("dem.springs_for=0.05 m/s")),
            "bed 2": (*QUICK, *sets("bed.seed=2")),
            "bed 3": (*QUICK, *sets("bed.seed=3")),
            "4 s": (*QUICK, *sets("handoff.time=4 s")),
            "limit 0.5 m/s": (*QUICK, *sets("handoff.speed_limit=0.5 m/s")),
            "limit 2 m/s": (*QUICK, *sets("handoff.speed_limit=2 m/s")),
            "16 s": (*QUICK, *sets("handoff.time=16 s", "sph.end_time=16 s")),
        },
    ),
    "D6": Row(
        "bowls of 12 to 22 m, one size of grains: 18 to 22 m D 3 %, depth 5 %",
        {
            f"{radius} m": (*QUICK, *sets(f"bed.arc_radius={radius} m", f"bed.count={count}"))
            for radius, count in ((12, 9_216), (15, 18_000), (18, 31_104), (22, 56_789))
        },
    ),
    "D7": Row(
        "1 Pa of cohesion: smaller",
        {"none": QUICK, "1 Pa": (*QUICK, *sets("dem.contact.cohesion=zhang", "dem.contact.shell.cohesion=1 Pa"))},
    ),
    "D9": Row(
        "the same all in SPH, to 100 s",
        {
            "sph": (
                *SPH,
                *COARSE,
                *sets("sph.end_time=100 s", "sph.snapshot_interval=2 s", "sph.history_interval=0.2 s"),
            )
        },
        (4.0, 20.0, 100.0),
    ),
    "E": Row(
        "other engines from one bed: momentum and energy lost by 10 s 2 %, D and depth within twice the scatter of "
        "three beds",
        {
            "native": SAME,
            "lammps": (*SAME, *sets("dem.engine=lammps", ACCEPT)),
            "native, no twist": (*SAME, *NO_TWIST),
            "liggghts, no twist": (*SAME, *NO_TWIST, *sets("dem.engine=liggghts", ACCEPT)),
        },
        after=10.0,
    ),
}


def measured(path: Path) -> Measures:
    """The crater in a snapshot, on the choices of the run that it comes from. Raises ``InputError`` where none is
    found."""
    particles = snapshot.read(path)
    known = choices.of_snapshot(path, particles.attributes)
    if known is None:
        raise InputError(f"{path} does not say what it is measured against")
    return known.measured(particles, known.ground_before(), str(path))


def of_shock(folder: Path, times: Sequence[float]) -> list[str]:
    """A line for each time: diameter and depth as measured, and the ballistic crater."""
    lines, paths = [], snapshot.series(folder / "2_sph")
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
        flown = ballistic.measure_profile(ballistic.profile_of(snapshot.read(path), GRAVITY, DENSITY, REACH)[0])
        free = "  ".join(
            f"{name} {flown[key].value:.4g}"
            for name, key in (("D", "diameter_apparent_m"), ("V", "volume_m3"))
            if key in flown
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
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines)]
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
