"""Deep Impact and momentum transfer beside Benz & Jutzi (2007): tables, pictures, verdicts from finished runs.

    python studies/benz_jutzi.py RUNS [--out docs/results/benz_jutzi]

RUNS is a folder below which run folders of ``cases/deep_impact`` and ``cases/momentum_transfer`` lie, at any depth;
what a run is (porosity, crush curve, spacing) is read from its ``case.used.toml``. Each is measured once:
``measures.json`` in ``--out`` keeps what was measured, and is filled up by the next call. ``reasons.json`` there,
written by hand, holds what is known of why a claim is not met, by its id; ``former.json`` verdicts of runs with the
former numerics, which are not kept.

Ejected, as in the source, is what rises faster than v_esc (v_z > v_esc), in the air or still in the ground. Left out
are particles that began within 5.4 m (Deep Impact) or 8.4 m of the half-sphere's rim, where the quiet layer and its
fixed rim are: three supports of the cases' own outer spacing, the same at every resolution.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import archive
from studies import benz_jutzi_pictures
from studies.benz_jutzi_runs import (
    ESCAPE,
    Runs,
    compacted,
    found,
    label,
    lattice,
    lonely,
    mass,
    rate,
    size,
    slope,
    transferred,
)


def tables(runs: Runs) -> str:
    """Every run in two tables."""
    head = [
        "Deep Impact",
        "resolution",
        "M(v_z > 2 m/s)",
        "M / counted",
        "in the air",
        "slope of M(>v), 2 to 100 m/s",
        "rings of alpha < 1.1",
        "heat cut off",
    ]
    text = [line(head), "|---" * len(head) + "|"]
    for row in runs.rows:
        if row["case"] == "deep_impact":
            thick = f"{compacted(row)[0]:.0f}" if row["alpha0"] > 1.0 else ""
            air = row["series"]["air_kg"][-1][ESCAPE.index(2.0)]
            words = [
                label(row),
                size(row),
                f"{mass(row):.3g} kg",
                f"{100 * mass(row) / row['counted_kg']:.1f} %",
                f"{air:.2g} kg",
                f"{slope(row):.2f}",
                thick,
            ]
            text.append(line([*words, lonely(row)]))
    head = [
        "momentum transfer",
        "resolution",
        "P_trans (0.1 m/s)",
        "P_trans (1 m/s), change per ms",
        "peak / final (1 m/s), at",
        "M(v_z > 1 m/s)",
    ]
    head += ["arrival at 5, 10, 20 m [ms]", "peak P there [GPa]", "heat cut off"]
    text += ["", line(head), "|---" * len(head) + "|"]
    for row in runs.rows:
        if row["case"] == "momentum_transfer":
            slow, quick = transferred(row, 0.1), transferred(row, 1.0)
            at = row["series"]["time_s"][int(np.argmax(quick))]
            words = [
                label(row),
                size(row),
                f"{slow[-1]:.2f}",
                f"{quick[-1]:.2f}, {100 * rate(row, 1.0):+.2f} %",
                f"{quick.max() / quick[-1]:.2f}, {1e3 * at:.0f} ms",
            ]
            words += [f"{mass(row, 1.0):.3g} kg", ", ".join(f"{1e3 * t:.2f}" for t in row["shock"]["arrival_s"])]
            text.append(line([*words, ", ".join(f"{1e-9 * P:.3g}" for P in row["shock"]["peak_Pa"]), lonely(row)]))
    return "\n".join(text) + "\n"


def line(words: list[str]) -> str:
    """A line of a table."""
    return "| " + " | ".join(words) + " |"


def verdict(key: str, ours: str, met: bool | None, row: dict[str, Any] | None, why: str = "") -> dict[str, str]:
    """One row of ``verdicts.json``; ``met`` is None for what can only be stated."""
    word = "in part" if met is None else "met" if met else "not met"
    return {
        "id": key,
        "ours": ours,
        "verdict": word,
        **({"resolution": size(row)} if row else {}),
        **({"why": why} if why else {}),
    }


def of_deep_impact(runs: Runs, spacing: float) -> list[dict[str, str]]:
    """Verdicts B04 to B07 at one spacing, of what is there."""
    solid, some, much = (runs.get("deep_impact", alpha0, spacing) for alpha0 in (1.0, 1.5, 3.0))
    if not (solid and some and much):
        return []
    masses = [mass(row) for row in (solid, some, much)]
    wanted, limits = (3.20e6, 0.52e6, 0.49e6), (0.3, 0.5, 0.5)
    off = [got / right - 1.0 for got, right in zip(masses, wanted)]
    first, second = masses[0] / masses[1], masses[1] / masses[2]
    spread = []
    for row in (some, much):
        ends = [runs.get("deep_impact", row["alpha0"], spacing, curve) for curve in ("soft", "hard")]
        spread += [
            f"alpha0 = {row['alpha0']:g}: {label(end).rsplit(', ', 1)[1]} {mass(end):.3g} kg" for end in ends if end
        ]
    met = (
        all(abs(error) <= limit for error, limit in zip(off, limits)) and 4.0 <= first <= 9.0 and 0.8 <= second <= 1.4
    )
    air = ", ".join(f"{row['series']['air_kg'][-1][ESCAPE.index(2.0)]:.2g}" for row in (solid, some, much))
    text = (
        f"{masses[0]:.3g}, {masses[1]:.3g}, {masses[2]:.3g} kg "
        f"({', '.join(f'{100 * error:+.0f} %' for error in off)}); ratios {first:.2f} and {second:.2f}"
    )
    why = (
        f"heat that no longer pushes: {lonely(solid)}, {lonely(some)}, {lonely(much)} of the energy; risen above the "
        f"ground by then {air} kg; "
        + (f"other crush curves: {'; '.join(spread)}" if spread else "other crush curves not run")
    )
    falls = ", ".join(f"{slope(row):.2f}" for row in (solid, some, much))
    thick, monotone = compacted(much)
    words = (
        f"alpha < 1.1 in {thick:.0f} rings of one spacing, least mean of a ring {min(much['rings']['distention']):.2f}"
    )
    return [
        verdict("B04", text, met, solid, why),
        verdict("B05", f"{masses[0]:.3g}, {masses[1]:.3g}, {masses[2]:.3g} "
                       f"kg", masses[0] > 2.0 * masses[1] and masses[1] > masses[2], solid),
        verdict("B06", f"{words}; profile {'' if monotone else 'not '}monotone", thick > 2.0 and monotone, much),
        verdict("B07", f"slope from 2 to 100 m/s: {falls} (alpha0 = 1, 1.5, 3)", None, solid,
        "published as a picture without numbers; ours: ejected.png"),
    ]  # fmt: skip


def of_momentum(runs: Runs, spacing: float) -> list[dict[str, str]]:
    """Verdicts B10 to B13 at one spacing, of what is there."""
    case, rows = "momentum_transfer", []
    solid, some, much = (runs.get(case, alpha0, spacing) for alpha0 in (1.0, 1.5, 3.0))
    light = runs.get(case, 1.0, spacing, light=True)
    if solid and much:
        little = runs.get(case, 1.1, spacing)
        parts = []
        for limit in (0.1, 1.0):
            values = [transferred(row, limit)[-1] for row in (solid, little, some, much) if row]
            parts.append(
                (
                    f"v_esc {limit:g} m/s: {', '.join(f'{value:.2f}' for value in values)}, ratio "
                    f"{values[0] / values[-1]:.2f}",
                    values,
                )
            )
        names = ", ".join(f"{row['alpha0']:g}" for row in (solid, little, some, much) if row)
        met = all(
            values[0] / values[-1] > 2.0 and all(a >= b for a, b in itertools.pairwise(values)) for _, values in parts
        )
        change = ", ".join(f"{100 * rate(row, 1.0):+.2f}" for row in (solid, some, much) if row)
        why = f"change per ms at {1e3 * solid['end_s']:.0f} ms (1 m/s; alpha0 = 1, 1.5, 3 as run): {change} %"
        rows.append(verdict("B10", f"alpha0 = {names}: " + "; ".join(text for text, _ in parts), met, solid, why))
    if solid and some and much:
        tops, ok = [], []
        for limit in (0.1, 1.0):
            over = [float(transferred(row, limit).max() / transferred(row, limit)[-1]) for row in (solid, some, much)]
            ok.append(over[0] > 1.1 and max(over[1:]) < 1.02)
            tops.append(f"v_esc {limit:g} m/s: {', '.join(f'{value:.2f}' for value in over)}")
        rows.append(
            verdict(
                "B11",
                "peak over final, alpha0 = 1, 1.5, 3: " + "; ".join(tops),
                any(ok),
                solid,
                "met if one of the two v_esc shows it: the source does not state its own",
            )
        )
        late = all(a < b < c for a, b, c in zip(*(row["shock"]["arrival_s"] for row in (solid, some, much))))
        weak = all(a > b > c for a, b, c in zip(*(row["shock"]["peak_Pa"] for row in (solid, some, much))))
        words = "; ".join(
            f"alpha0 = {row['alpha0']:g}: "
            + ", ".join(
                f"{1e3 * t:.2f} ms {1e-9 * P:.2g} GPa"
                for t, P in zip(row["shock"]["arrival_s"], row["shock"]["peak_Pa"])
            )
            for row in (solid, some, much)
        )
        rows.append(
            verdict(
                "B12",
                words,
                late and weak,
                solid,
                "at 5, 10, 20 m below the impact; front between snapshots 1 ms apart",
            )
        )
    if some and light:
        parts, ok = [], []
        for limit in (0.1, 1.0):
            a, b = transferred(some, limit)[-1] - 1.0, transferred(light, limit)[-1] - 1.0
            ok.append(a < 0.7 * b)
            parts.append(
                f"v_esc {limit:g} m/s: beta - 1 = {a:.2f} with pores, {b:.2f} without, {100 * (a / b - 1.0):+.0f} %"
            )
        rows.append(verdict("B13", "; ".join(parts), all(ok), some))
    return rows


def of_setup(runs: Runs) -> list[dict[str, str]]:
    """The set-ups: what was taken over, and the printed resolutions worked out again."""
    rows = []
    for key, again, case, printed, radius, rho, count, ball in (
        ("B01", "B03", "deep_impact", (1.0, 1.5, 3.0), 22.0, 917.0, 700_000, (370.0, 2700.0, 20)),
        ("B08", "B09", "momentum_transfer", (1.0, 1.1, 1.5, 3.0), 40.0, 2700.0, 1_400_000, (400.0, 5500.0, 15)),
    ):
        have = sorted({row["alpha0"] for row in runs.rows if row["case"] == case})
        rows.append(
            {
                "id": key,
                "ours": f"R = {radius:g} m; alpha0 = {', '.join(f'{a:g}' for a in have)} run; a quiet layer before "
                f"the rim",
                "verdict": "input",
            }
        )
        differing, _ = lattice(0.0, radius, rho, count)
        near, grain = lattice(ball[0], 0.0, ball[1], int(ball[2]))
        masses = [lattice(0.0, radius, rho / alpha0, count)[1] for alpha0 in (printed[-1], printed[0])]
        ours = (
            f"hexagonal lattice: {100 * differing:.1f} cm, {masses[0]:.3g} to {masses[1]:.3g} kg; projectile "
            f"{100 * near:.1f} cm, {grain:.3g} kg"
        )
        rows.append(
            {
                "id": again,
                "ours": ours,
                "verdict": "arithmetic",
                "why": "printed values are rounded; so the lattice is hexagonal and spacings are nearest distances",
            }
        )
    if finest := runs.spacings("deep_impact"):
        row = runs.get("deep_impact", 1.0, finest[0])
        if row:
            ours = (
                f"{row['projectile_mass_kg']:.1f} kg, particles of {row['projectile_particle_kg']:.1f} kg, the "
                f"target's {row['target_particle_kg']:.1f}"
            )
            rows.append({"id": "B02", "ours": ours, "verdict": "input"})
    return rows


def main() -> int:
    """Exit code 0, 2 for bad input."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path)
    parser.add_argument(
        "--out", type=Path, default=Path(__file__).resolve().parents[1] / "docs" / "results" / "benz_jutzi"
    )
    parser.add_argument("--no-pictures", action="store_true")
    given = parser.parse_args()
    try:
        if not given.runs.is_dir():
            raise InputError(f"{given.runs} is no folder")
        given.out.mkdir(parents=True, exist_ok=True)
        path = given.out / "measures.json"
        kept = found(given.runs, json.loads(path.read_text()) if path.exists() else {})
        archive.write_text(path, json.dumps(kept, separators=(",", ":")))
    except InputError as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    runs = Runs(kept.values())
    archive.write_text(given.out / "tables.md", tables(runs))
    from studies import benz_jutzi_formulas  # here: it compiles

    rows = of_setup(runs) + benz_jutzi_formulas.verdicts()
    for spacing in runs.spacings("deep_impact"):
        rows += of_deep_impact(runs, spacing)
    for spacing in runs.spacings("momentum_transfer"):
        rows += of_momentum(runs, spacing)
    reasons = json.loads(path.read_text()) if (path := given.out / "reasons.json").exists() else {}
    for row in rows:
        if row["verdict"] == "not met" and row["id"] in reasons:
            row["why"] = "; ".join(text for text in (reasons[row["id"]], row.get("why", "")) if text)
    rows += json.loads(path.read_text()) if (path := given.out / "former.json").exists() else []
    archive.write_text(given.out / "verdicts.json", json.dumps({"resolution": "", "verdicts": rows}, indent=1) + "\n")
    if not given.no_pictures:
        benz_jutzi_pictures.pictures(runs, given.out)
        benz_jutzi_pictures.slices(given.runs, runs, given.out)
    print((given.out / "tables.md").read_text())
    return 0


if __name__ == "__main__":
    sys.exit(main())
