"""Momentum that a body takes over from a spacecraft: DART on Dimorphos against cohesion, friction and resolution.

    python studies/dart.py                              # the runs and what stands in their settings
    python studies/dart.py --out runs/dart              # makes them, resumed where they were stopped
    python studies/dart.py --out runs/dart --evaluate   # the table of what is done so far

Shock stage alone: beta from what escapes (``sph.outcome.escaping``), the change of speed that a body of the target's
mass gets, and the mass that leaves, at the end and at half of the time. The parameters were written down in
``cases/dart_dimorphos`` and here before the first of these runs.
"""

from __future__ import annotations

import argparse
import json
import shlex
from pathlib import Path

import numpy as np

from matter.errors import InputError
from matter.files import snapshot
from sph.outcome import escaping
from studies.case_runs import ROOT, run, sets

CASE = ROOT / "cases" / "dart_dimorphos"
COARSE = sets("sph.spacing_at_impact=1 m", "sph.spacing_far=9 m", "sph.growth=0.12", "sph.contact_refinement=1.4")
"""14,000 particles; the projectile is one of them, the shock in it is not resolved."""
LATE = '{at="1 s", sound_speed="20 m/s"}, {at="4 s", sound_speed="12 m/s"}'
ENDS = sets(
    "sph.end_time=5 s", "handoff.time=5 s", "sph.snapshot_interval=0.5 s", "sph.late.at=50 ms",
    "sph.late.sound_speed=80 m/s", f"sph.late.slower=[{LATE}]", "sph.materials.basalt.p_alpha.alpha0=1.4583",
)  # fmt: skip
"""To 5 s, with the late sound speeds and the 2,400 kg/m^3 that the case had when the first of these was made."""
ONE_SPEED = sets("sph.late.slower=[]")
"""Of the coarse table. It makes 0.2 % of the momentum."""
FRICTION = "sph.materials.basalt.drucker_prager.friction_angle={} deg"
COHESION = "sph.materials.basalt.drucker_prager.cohesion={} Pa"
WHOLE = sets("sph.materials.basalt.predamaged=false", "sph.damage=false")
"""Ground that keeps its cohesion however it is strained: what is broken has none."""
ROCK = sets(
    COHESION.format(90e6),
    *(f"sph.materials.basalt.{text}" for text in ("tension.cut=20 MPa", "crush_quadratic.Pe=200 MPa")),
)
"""As strong as granite (its cohesion, and pores that stand 200 MPa), the same density: it does not crumble."""
GROUNDS = {
    "no cohesion": (),
    "5 Pa": WHOLE + sets(COHESION.format(5)),
    "50 Pa": WHOLE + sets(COHESION.format(50)),
    "friction 22 deg": sets(FRICTION.format(22)),
    "friction 35 deg": sets(FRICTION.format(35)),
    # no law says how wide a crater gets that neither weight nor strength holds: as for sand
    "no strength": sets("sph.strength=false", "impact.expected_transient_diameter=78 m"),
    "solid rock": WHOLE + ROCK,
}
RUNS = {
    f"{name}, {size}": ("--preset", "quick", "--until", "sph", *ENDS, *shape, *ground)
    for name, ground in GROUNDS.items()
    for size, shape in (("quick", ()), ("coarse", ONE_SPEED + COARSE))
}
AS_QUICK = sets(
    "sph.spacing_at_impact=75 cm", "sph.spacing_far=7 m", "sph.growth=0.09", "sph.contact_refinement=3",
    "sph.fine_radius=10 m",
)  # fmt: skip
RUNS["no cohesion, body and panels, quick"] = ("--preset", "parts", "--until", "sph", *ENDS, *AS_QUICK)


def measured(folder: Path) -> list[str]:
    """A line for half of the time and one for the end. Raises ``InputError`` for a run without snapshots."""
    report = json.loads((folder / "2_sph" / "stage_report.json").read_text())
    normal = np.array(report["escaping"]["normal"])
    paths = snapshot.series(folder / "2_sph")
    if not paths:
        raise InputError(f"{folder} holds no snapshots")
    first = snapshot.read(paths[0])
    momentum, lines = first.mass @ first.velocity, []
    for path in (paths[len(paths) // 2], paths[-1]):
        cloud = snapshot.read(path)
        found = escaping.escaped_momentum(
            cloud.position, cloud.velocity, cloud.mass, 0.5 * cloud.support_radius, momentum, normal
        )
        left = cloud.mass.sum() - found["mass_kg"]
        change = np.linalg.norm(found["momentum_that_stays_kg_m_s"]) / left
        lines.append(
            f"  {float(cloud.attributes['time']):6.3g} s  {len(cloud):7,} particles  beta {found['beta']:.3f}  leaves "
            f"{found['mass_kg']:.3g} kg  change of speed {1e3 * change:.2f} mm/s"
        )
    return lines


def main() -> int:
    """Make and evaluate the runs; the largest exit code of theirs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="folder of the runs")
    parser.add_argument("--only", default="", help="runs whose name holds this text")
    parser.add_argument("--size", default="", choices=["", "quick", "coarse"], help="runs of this size only")
    parser.add_argument("--evaluate", action="store_true", help="run nothing")
    given = parser.parse_args()
    chosen = {name: arguments for name, arguments in RUNS.items() if given.only in name and name.endswith(given.size)}
    if given.out is None:
        for name, arguments in chosen.items():
            print(f"{name:26} run_case cases/dart_dimorphos {shlex.join(arguments)}")
        return 0
    book = given.out / "book.json"
    folders, worst = json.loads(book.read_text()) if book.is_file() else {}, 0
    for name, arguments in chosen.items():
        print(name)
        if not given.evaluate:
            code, folder = run(CASE, arguments, given.out.resolve())
            worst = max(worst, code)
            if folder is not None:
                given.out.mkdir(parents=True, exist_ok=True)
                book.write_text(json.dumps(folders := folders | {name: str(folder)}, indent=1))
        if name in folders and (Path(folders[name]) / "2_sph" / "stage_report.json").is_file():
            print("\n".join(measured(Path(folders[name]))))
    return worst


if __name__ == "__main__":
    raise SystemExit(main())
