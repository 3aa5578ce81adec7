"""The shipped cases whose results were first kept with the former numerics, with the default set: one command a row.

    python studies/sph_cases.py                                # the rows and their commands
    python studies/sph_cases.py --out runs/cases --only V10    # makes them, resumed where they were stopped
    python studies/sph_cases.py --out runs/cases --evaluate    # diameters, depths, energies of what is done

Impacts straight down are computed as a quarter (``[sph] symmetry``), oblique ones as a half, but for bodies that
break. Material, friction and times are the cases' own. What else is read from a run is read by the study of its paper
(``benz_jutzi.py``, ``nakamura_fujiwara.py``), which takes the same folder.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from studies.case_runs import ROOT, run, sets

DEFAULT = sets('sph.numerics="reconstructed"')
QUARTER, HALF = sets('sph.symmetry="quarter"'), sets('sph.symmetry="half"')
ONE_EACH = sets("sph.projectile_particles=1")
SIZES = {
    "deep_impact": {"64 cm": sets("sph.spacing_at_impact=0.571m", "sph.spacing_far=1.62m"), "36 cm": ()},
    "momentum_transfer": {"92 cm": sets("sph.spacing_at_impact=0.824m", "sph.spacing_far=2.52m"), "51 cm": ()},
}
"""Of the kept results; the projectile in the coarse ones is one particle in each part."""


def _porous(case: str, claim: str, presets: dict[str, str], part: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    return {
        f"{claim}, {size}, {words}": (
            case, *(("--preset", preset) if preset else ()), *DEFAULT, *part, *shape, *(ONE_EACH if shape else ())
        )
        for size, shape in SIZES[case].items()
        for preset, words in presets.items()
    }  # fmt: skip


ROWS: dict[str, tuple[str, ...]] = {
    "V05, 100,000": ("nakamura_fujiwara", *DEFAULT),
    "V06, 2.6 km/s": ("pumice_jutzi_2009", *DEFAULT),
    "V06, 4.2 km/s": ("pumice_jutzi_2009", "--preset", "fast", *DEFAULT),
    "V08, 40 spacings": (
        "pierazzo_2008", *DEFAULT, *QUARTER, *sets("sph.spacing_at_impact=12.5m", "sph.spacing_far=125m")
    ),
    "V09, 0.6 mm": ("pierazzo_2008_water", "--preset", "coarse", *DEFAULT, *QUARTER),
    "V10, 2.3 mm": ("housen_holsapple_2003", "--preset", "coarse", *DEFAULT, *QUARTER),
    "V10, 1.6 mm": ("housen_holsapple_2003", *DEFAULT, *QUARTER),
    **_porous("deep_impact", "B04", {"": "alpha0 1", "porous15": "alpha0 1.5", "porous30": "alpha0 3"}, HALF),
    **_porous(
        "momentum_transfer",
        "B10",
        {
            "": "alpha0 1",
            "porous11": "alpha0 1.1",
            "porous15": "alpha0 1.5",
            "porous30": "alpha0 3",
            "light15": "density of 1.5, no pores",
        },
        QUARTER,
    ),
}  # fmt: skip
"""Claim of ../docs/validation.md and size -> case and arguments of ``run_case``."""


SHOWN = ("diameter_apparent_m", "depth_m")


def read(folder: Path) -> str:
    """One line of what a finished run says."""
    report = json.loads((folder / "2_sph" / "stage_report.json").read_text())
    words = [
        f"{report['steps']:,} steps, energy {report['drift_over_projectile']['energy_J']:+.1e} of the projectile's"
    ]
    measures = folder / "6_crater" / "measures.json"
    if measures.is_file():
        for kind, found in json.loads(measures.read_text()).items():
            sizes: list[Any] = [found.get(name) for name in SHOWN] if isinstance(found, dict) else [None]
            if all(isinstance(size, dict) and size["value"] is not None for size in sizes):
                words.append(
                    f"{kind}: D, depth " + ", ".join(f"{s['value']:.4g} +- {s['sigma']:.2g} m" for s in sizes)
                )
    return "; ".join(words)


def main() -> int:
    """Make and read the rows; the largest exit code of theirs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="folder of the runs")
    parser.add_argument("--only", default="", help="rows whose name holds this text")
    parser.add_argument("--evaluate", action="store_true", help="run nothing")
    given = parser.parse_args()
    chosen = {name: arguments for name, arguments in ROWS.items() if given.only in name}
    if given.out is None:
        for name, (case, *arguments) in chosen.items():
            print(f"{name:36} run_case cases/{case} " + " ".join(f"'{a}'" if '"' in a else a for a in arguments))
        return 0
    book = given.out / "book.json"
    folders, worst = json.loads(book.read_text()) if book.is_file() else {}, 0
    for name, (case, *arguments) in chosen.items():
        print(name)
        if not given.evaluate:
            code, folder = run(ROOT / "cases" / case, arguments, given.out.resolve())
            worst = max(worst, code)
            if folder is not None:
                given.out.mkdir(parents=True, exist_ok=True)
                book.write_text(json.dumps(folders := folders | {name: str(folder)}, indent=1))
        if name in folders and (Path(folders[name]) / "2_sph" / "stage_report.json").is_file():
            print("   ", read(Path(folders[name])))
    return worst


if __name__ == "__main__":
    raise SystemExit(main())
