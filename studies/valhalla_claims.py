"""Run the variants of the Valhalla cases that the thesis' claims W50-W69 ask for, and table what is met.

    python studies/valhalla_claims.py --out runs/claims   # everything, at the quick size: an hour or more on two cores
    python studies/valhalla_claims.py --out runs/claims --runs 350_base 350_one
    python studies/valhalla_claims.py --out runs/claims --table              # the table alone, of what there is

Started again, it goes on where it was. Leaves run folders, measured/<run>/ (time_series.csv, measures.json, pictures),
claims.md, claims.json and figures_22_25.png (the thesis' Figures 22 to 25 with these runs beside).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from matter.errors import InputError, Stopped
from matter.files import archive
from pipeline.running.run_process import STOPPED
from studies.winter_2017 import variants as sweep

ROOT = Path(__file__).resolve().parents[1]
ICE = "target.layers.1.material=ice"
WEAK = "sph.materials.ice.strength=collins"  # 10 MPa and friction of broken ice instead of 1 GPa without
FLAWS = ("sph.materials.ice.weibull.k=1e46 m^-3", "sph.materials.ice.weibull.m=9.1")  # miluphcuda's ice
LITERAL = "target.start=literal"
SPEEDS = {"v1": "19.99 km/s", "v3": "14.1 km/s", "v4": "9.59 km/s"}
RADII = {"350": {"v1": 24.69, "v3": 31.16, "v4": 40.29}, "980": {"v1": 50.71, "v3": 63.98, "v4": 82.72}}


def matrix(size: str, more: tuple[str, ...] = ()) -> list[sweep.Variant]:
    """All runs at a size (a preset of the cases), each with ``more`` settings."""
    rows: list[tuple[str, str, tuple[str, ...]]] = []
    many = ("sph.projectile_particles=81",)
    rows += [
        ("350", "base", many),
        ("350", "literal", (LITERAL, *many)),
        ("350", "one", ("sph.projectile_particles=1",)),
    ]
    rows += [
        ("350", "literal_one", (LITERAL, "sph.projectile_particles=1")),
        ("350", "ice", (ICE, *many)),
        ("350", "literal_ice", (LITERAL, ICE, *many)),
    ]
    rows += [
        ("600", "base", ()),
        ("600", "literal", (LITERAL,)),
        ("980", "base", ()),
        ("980", "literal", (LITERAL,)),
        ("980", "ice", (ICE,)),
    ]
    rows += [
        ("350", "weak", (WEAK, *many)),
        ("980", "weak", (WEAK,)),
        ("350", "flaws", (*FLAWS, *many)),
        ("350", "literal_flaws", (LITERAL, *FLAWS, *many)),
    ]
    for case, own in (("350", many), ("980", ())):
        rows += [(case, f"angle{angle}", (f"impact.angle_from_vertical={angle} deg", *own)) for angle in (15, 65)]
    for case, radii in RADII.items():
        for name, radius in radii.items():
            # at the quick size of 980 km projectile particles weigh what they do at v2: their number goes with the
            # volume
            own = (
                many
                if case == "350"
                else (f"sph.projectile_particles={round(37 * (radius / 53.9) ** 3)}",)
                if size == "quick"
                else ()
            )
            rows.append((case, name, (f"impact.projectile.radius={radius} km", f"impact.speed={SPEEDS[name]}", *own)))
    rows += [("980", "courant", ("sph.courant=0.15",)), ("980", "gravity", ("sph.gravity_shift=0",))]
    return [
        sweep.Variant(f"{case}_{name}", ROOT / "cases" / f"valhalla_{case}km", size, (*own, *more))
        for case, name, own in rows
    ]


def table(variants: list[sweep.Variant], out: Path, command: str) -> None:
    """Measure what is finished and write ``claims.md`` and ``claims.json``."""
    from studies.winter_2017 import evidence, figures, valhalla

    found = {}
    for variant in variants:
        folder_path = sweep.measure(variant, out)
        print(f"{variant.name:<18} {'measured' if folder_path else 'not run'}", flush=True)
        if folder_path:
            found[variant.name] = evidence.read_run(variant.name, variant.run_folder(out), folder_path)
    scores = evidence.score(valhalla.CLAIMS, found)
    folders = ", ".join(f"{name} = {run.facts['run']}" for name, run in found.items())
    settings = f"Runs: {folders or 'none'}."
    archive.write_text(
        out / "claims.md", evidence.as_markdown(scores, "Published claims W50-W69 against the runs", command, settings)
    )
    archive.write_text(out / "claims.json", evidence.as_json(scores, command))
    figures.draw_figures(found, out / "figures_22_25.png")
    print((out / "claims.md").read_text())


def main() -> int:
    """Exit code 0, 2 for bad input, 75 when stopped, 1 when a run failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs/valhalla_claims"))
    parser.add_argument("--runs", nargs="+", metavar="NAME", help="a part of the matrix")
    parser.add_argument("--size", choices=("quick", "thesis"), default="quick")
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
    variants, failed = matrix(given.size, tuple(given.set)), []
    try:
        for variant in [] if given.table else sweep.chosen(variants, given.runs):
            print(f"== {variant.name}", flush=True)
            if code := sweep.run(variant, given.out, given.threads):
                if code == STOPPED:
                    return code
                failed.append(f"{variant.name} ended with {code}")
            else:
                sweep.measure(variant, given.out)
        given.out.mkdir(parents=True, exist_ok=True)
        table(variants, given.out, " ".join(["python", *sys.argv]))
    except (InputError, Stopped) as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    print("\n".join(failed), file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
