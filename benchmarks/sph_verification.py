"""Shocks of the production kernels against exact solutions, as one table.

    python benchmarks/sph_verification.py [--json] [--out FOLDER] [--layers N]

Pistons over the Rankine-Hugoniot tables, compaction waves of porous material, Sod's tube, and what a quiet end returns; one set of viscosity, step and
kernel for all (printed first). The set-ups are those of the tests (``tests/sph/columns.py``). ``--out`` writes ``shocks.md`` and ``shocks.json``.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "sph")]

import columns  # noqa: E402
import shock_tube  # noqa: E402
import test_boundaries  # noqa: E402
import test_shocks  # noqa: E402

from matter import archive  # noqa: E402
from sph.materials import collect  # noqa: E402
from sph.porosity import compaction_wave  # noqa: E402

SOLIDS = [("basalt", "basalt"), ("ice", "ice"), ("water_thesis", "water"), ("aluminum", "aluminum"), ("iron", "iron")]


def compared(name: str, piston: float, got: columns.Shock, wanted: tuple[float, float, float, float], limits: tuple[float, ...], begun: float) -> dict:
    """One row: relative errors of P, rho, u and the speed, and whether each is within its limit."""
    errors = [value / exact - 1.0 for value, exact in zip((got.P, got.rho, got.u, got.speed), wanted)]
    met = all(abs(error) <= limit for error, limit in zip(errors, limits) if limit > 0.0)
    keys = ("P", "rho", "u", "speed")
    return {
        "case": name,
        "piston_m_s": piston,
        **{f"{key}_exact": exact for key, exact in zip(keys, wanted)},
        **{f"{key}_error": error for key, error in zip(keys, errors)},
        "plateau_scatter_P": got.scatter,
        "front_width_h": got.width,
        "distention": got.distention,
        "particles": got.particles,
        "steps": got.steps,
        "wall_s": time.perf_counter() - begun,
        "met": met,
    }


def pistons(layers: int) -> list[dict]:
    """Solid materials: P and rho within 1 %, u 2 %, shock speed 1 %."""
    rows = []
    for name, file in SOLIDS:
        for speed in test_shocks.SPEEDS:
            begun, row = time.perf_counter(), test_shocks.published(file, speed)
            wanted = tuple(float(row[key]) for key in ("P_Pa", "rho_kg_m3", "E_J_kg", "us_m_s"))
            got = columns.shocked(collect((name,)), speed, wanted[3], layers=layers)
            rows.append(compared(name, speed, got, wanted, (0.01, 0.01, 0.02, 0.01), begun))
            print(line(rows[-1]), flush=True)
    return rows


def compaction(layers: int) -> list[dict]:
    """Porous materials: P, rho and the front's speed within 2 %."""
    rows = []
    for name, alpha0, curve, speed in test_shocks.POROUS:
        begun, materials = time.perf_counter(), test_shocks.porous(name, alpha0, curve)
        waves = compaction_wave.driven(materials.rows, 0, speed)
        front = waves.front
        got = columns.shocked(materials, speed, front.shock_speed, layers=layers)
        label = f"{name}, alpha0 = {materials.rows.alpha0[0]:g}"
        row = compared(label, speed, got, (front.P, front.rho, front.u, front.shock_speed), (0.02, 0.02, 0.0, 0.02), begun)
        rows.append(row | {"distention_exact": waves.distention})
        print(line(rows[-1]), flush=True)
    return rows


TITLES = ("material", "piston m/s", "P", "error", "rho", "error", "u", "error", "shock m/s", "error", "alpha behind", "met")
HEAD = f"| {' | '.join(TITLES)} |\n|{'---|' * len(TITLES)}"


def line(row: dict) -> str:
    """A row of the table."""
    cells = [row["case"], f"{row['piston_m_s']:g}"]
    for key, form in (("P", "{:.4g}"), ("rho", "{:.5g}"), ("u", "{:.4g}"), ("speed", "{:.5g}")):
        cells += [form.format(row[f"{key}_exact"]), f"{100 * row[f'{key}_error']:+.2f} %"]
    return "| " + " | ".join([*cells, f"{row['distention']:.4f}", "yes" if row["met"] else "**no**"]) + " |"


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--out", type=Path, default=None)
    parser.add_argument("--layers", type=int, default=100, help="height of the pistons' columns; porous ones are 1.4 times as high")
    options = parser.parse_args()
    numerics = {**columns.NUMERICS, "support_over_spacing": columns.SUPPORT, "kernel": "cubic_spline", "layers": options.layers}
    print(numerics)
    content = {"numerics": numerics, "pistons": pistons(options.layers), "compaction": compaction(round(1.4 * options.layers))}
    content["sod"] = [dict(zip(("layers", "L1_density", "shock_speed"), (n, *shock_tube.sod(n)))) for n in (50, 100, 200)]
    content["quiet"] = [{"sigma_spacings": s, "returned": test_boundaries.returned("quiet", s)} for s in (4.0, 8.0)]
    met = sum(row["met"] for key in ("pistons", "compaction") for row in content[key])
    total = len(content["pistons"]) + len(content["compaction"])
    text = [f"Numerics of every row: {', '.join(f'{key} {value}' for key, value in numerics.items())}.", ""]
    for title, key in (("Pistons into solids", "pistons"), ("Compaction waves", "compaction")):
        text += [f"## {title}", "", HEAD, *map(line, content[key]), ""]
    text += ["## Sod's tube", "", "| layers per unit | L1 of the density | shock speed (1.7522) |", "|---|---|---|"]
    text += [f"| {row['layers']} | {100 * row['L1_density']:.2f} % | {row['shock_speed']:.4f} |" for row in content["sod"]]
    text += ["", "## Quiet end", "", "| half width of the pulse, spacings | momentum returned |", "|---|---|"]
    text += [f"| {row['sigma_spacings']:g} | {100 * row['returned']:.2f} % |" for row in content["quiet"]]
    print("\n".join(text[-12:]))
    print(f"{met} of {total} rows within their limits")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        archive.write_text(options.out / "shocks.md", "\n".join(text) + "\n")
        archive.write_text(options.out / "shocks.json", json.dumps(content, indent=1))
    if options.json:
        print(json.dumps(content))


if __name__ == "__main__":
    main()
