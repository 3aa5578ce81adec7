"""The production kernels against exact solutions, as one table.

    python studies/sph_verification.py [--json] [--out FOLDER] [--layers N] [--only TEXT]

Pistons over the Rankine-Hugoniot tables, compaction waves of porous material, Sod's tube, what a quiet end returns,
elastic waves, a slope, a blast, a collapse, a spinning ball, rings, a rod; the default numerics for all. The set-ups
are those of the tests (``fixtures/columns.py``, ``solutions.py``). ``--out`` writes ``shocks.md`` and ``shocks.json``,
row by row: the same command continues a stopped run.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np

from fixtures import blast, columns, quiet_end, shock_tube, shocks, slopes, solutions
from matter.files import archive
from sph.materials.rows import collect
from sph.shock_states import compaction_wave

SHELLS = [(5_000, sums, switch) for switch in (None, "morris_monaghan") for sums in ("plain", "corrected")]
SHELLS += [
    *((n, "plain", None) for n in (10_000, 20_000)),
    (10_000, "plain", "morris_monaghan"),
    *((n, "corrected", "morris_monaghan") for n in (10_000, 20_000, 60_000)),
]
SOLIDS = [("basalt", "basalt"), ("ice", "ice"), ("water_thesis", "water"), ("aluminum", "aluminum"), ("iron", "iron")]

Four = tuple[float, float, float, float]


def compared(
    name: str, piston: float, got: columns.Shock, wanted: Four, limits: tuple[float, ...], begun: float
) -> dict:
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


def piston(name: str, file: str, speed: float, layers: int) -> dict:
    """Solid material: P and rho within 1 %, u 2 %, shock speed 1 %."""
    begun, row = time.perf_counter(), shocks.published(file, speed)
    wanted = (float(row["P_Pa"]), float(row["rho_kg_m3"]), float(row["E_J_kg"]), float(row["us_m_s"]))
    got = columns.shocked(collect((name,)), speed, wanted[3], layers=layers)
    return compared(name, speed, got, wanted, (0.01, 0.01, 0.02, 0.01), begun)


def compaction(name: str, alpha0: float | None, curve: dict | None, speed: float, layers: int) -> dict:
    """Porous material: P, rho and the front's speed within 2 %."""
    begun, materials = time.perf_counter(), shocks.porous(name, alpha0, curve)
    waves = compaction_wave.driven(materials.rows, 0, speed)
    front = waves.front
    got = columns.shocked(materials, speed, front.shock_speed, layers=layers, fastest=waves.fastest)
    label = f"{name}, alpha0 = {materials.rows.alpha0[0]:g}"
    return compared(
        label, speed, got, (front.P, front.rho, front.u, front.shock_speed), (0.02, 0.02, 0.0, 0.02), begun
    ) | {"distention_exact": waves.distention}


def solved(what: str, measure: Callable[[], float], wanted: float, limit: float, relative: bool = True) -> dict:
    """One row: what was measured, what the exact solution says, and whether it is within ``limit`` of it."""
    value = float(measure())
    off = abs(value - wanted) / (abs(wanted) if relative else 1.0)
    return {"what": what, "value": value, "wanted": wanted, "limit": limit, "relative": relative, "met": off <= limit}


def spun(gradients: str) -> list[dict]:
    """Rows of the spinning ball, with ``corrected`` gradients in force, density and heat or with ``plain`` ones."""
    momentum, removed, pressure, shear = solutions.spin(gradients=gradients)
    rows = (
        (f"spinning ball, one turn, gradients {gradients}: change of L", momentum, 1e-3),
        ("... taken out by the correction of the torque, over L", removed, 1e-3),
        ("... change of the core's pressure", pressure, 0.01),
        ("... change of sqrt(J2)", shear, 0.01),
    )
    return [solved(what, lambda value=value: value, 0.0, limit, False) for what, value, limit in rows]


def stopped(particles: int, **options) -> list[dict]:
    """Rows of Verney's shell."""
    stop, viscous, energy = solutions.shell(particles, **options)
    how = f"gradients {options.get('gradients', 'plain')}, viscosity {options.get('viscosity_switch', 'everywhere')}"
    return [
        solved(
            f"Verney's shell of {particles:,} particles, {how}: inner radius at its stop over exact",
            lambda: stop,
            1.0,
            0.03,
        ),
        {"what": "... share of the kinetic energy that viscosity took", "value": viscous},
        solved("... change of the total energy over the kinetic", lambda: energy, 0.0, 1e-3, False),
    ]


def pulled() -> list[dict]:
    """The rod's exponent."""
    rates = np.array([3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
    strength = [solutions.rod(rate) for rate in rates]
    what = "tensile strength of a rod: power of the rate, 3 to 1000 /s"
    return [solved(what, lambda: np.polyfit(np.log(rates), np.log(strength), 1)[0], 0.25, 0.05, False)]


def blown(across: int, gamma: float) -> list[dict]:
    """Rows of the blast."""
    got = blast.blast(across, gamma)
    label = f"blast, gamma {gamma:.3g}, in a ball of {across} spacings"
    return [
        solved(f"{label}: radius of the densest shell over Sedov's", lambda: got.radius, 1.0, 0.02),
        solved("... radius of the half level outside it", lambda: got.half_level, 1.0, 0.02),
        solved("... radius of the front that smears to such a shell", lambda: got.front, 1.0, 0.02),
        solved("... largest density over that behind the front", lambda: got.density, 1.0, 0.4),
        {
            "what": f"... kinetic share of the energy (exact {blast.kinetic_share(gamma):.3g})",
            "value": got.kinetic,
        },
        solved("... change of the total energy", lambda: got.energy, 0.0, 1e-3, False),
    ]


def rest() -> dict[str, Callable[[], list[dict]]]:
    """What has no table of its own."""
    found: dict[str, Callable[[], list[dict]]] = {}
    for name in ("basalt", "ice", "aluminum"):
        for transverse in (False, True):
            label = f"{'shear' if transverse else 'pressure'} wave in {name}, speed over exact"
            found[label] = lambda label=label, name=name, across=transverse: [
                solved(label, lambda: solutions.elastic_speed(name, across), 1.0, 0.015)
            ]
    for sums in ("plain", "corrected"):
        for name in ("basalt", "ice", "aluminum"):
            label = (
                f"wave along a bar of {name}{', corrected gradients' if sums == 'corrected' else ''}, speed over exact"
            )
            found[label] = lambda label=label, name=name, sums=sums: [
                solved(label, lambda: solutions.bar_speed(name, gradients=sums), 1.0, 0.015)
            ]
    angle, more = slopes.angle_of_slope(math.radians(30.0)), math.radians(2.0)
    free = math.sin(more) / (math.cos(angle) * math.sin(angle + more))
    found["slope"] = lambda: [
        solved(
            "dry slope 2 deg below its angle: speed over free sliding",
            lambda: slopes.slope(angle - more),
            0.0,
            0.01,
            False,
        ),
        solved("... 2 deg above it", lambda: slopes.slope(angle + more), free, 0.3),
    ]
    found["rod"] = pulled
    for sums in ("plain", "corrected"):
        found[f"spin, {sums}"] = partial(spun, sums)
    for particles, sums, switch in SHELLS:
        options = {"gradients": sums} | ({"viscosity_switch": switch} if switch else {})
        found[f"shell {particles} {sums} {switch or 'none'}"] = partial(stopped, particles, **options)
    for gamma in (1.4, 5.0 / 3.0):
        for across in (24, 36):
            found[f"blast {gamma:.3g} {across}"] = partial(blown, across, gamma)
    found["blast 1.67 62"] = partial(blown, 62, 5.0 / 3.0)
    found["collapse"] = lambda: [
        solved(
            "pressureless collapse at 0.8 of free fall: radius over exact",
            lambda: solutions.collapse(40, 0.8),
            1.0,
            0.01,
        )
    ]
    return found


def tube(count: int) -> dict:
    """Sod's shock tube."""
    return dict(zip(("layers", "L1_density", "shock_speed"), (count, *shock_tube.sod(count))))


def returned(sigma: float) -> dict:
    """What a quiet end sends back of a pulse."""
    return {"sigma_spacings": sigma, "returned": quiet_end.returned("quiet", sigma)}


def jobs(layers: int) -> dict[str, Callable[[], dict]]:
    """Everything to be measured, by name."""
    found: dict[str, Callable[[], dict]] = {}
    for name, file in SOLIDS:
        for speed in shocks.SPEEDS:
            found[f"pistons/{name} {speed:g}"] = partial(piston, name, file, speed, layers)
    for row in shocks.POROUS:
        found[f"compaction/{row[0]} {row[1]} {row[3]:g}"] = partial(compaction, *row, layers)
    for count in (50, 100, 200, 400):
        found[f"sod/{count}"] = partial(tube, count)
    for sigma in (4.0, 8.0):
        found[f"quiet/{sigma:g}"] = partial(returned, sigma)
    for name, job in rest().items():
        found[f"solutions/{name}"] = lambda job=job: {"rows": job()}
    return found


TITLES = (
    "material",
    "piston m/s",
    "P",
    "error",
    "rho",
    "error",
    "u",
    "error",
    "shock m/s",
    "error",
    "alpha behind",
    "met",
)
HEAD = f"| {' | '.join(TITLES)} |\n|{'---|' * len(TITLES)}"


def line(row: dict) -> str:
    """A row of the table."""
    cells = [row["case"], f"{row['piston_m_s']:g}"]
    for key, form in (("P", "{:.4g}"), ("rho", "{:.5g}"), ("u", "{:.4g}"), ("speed", "{:.5g}")):
        cells += [form.format(row[f"{key}_exact"]), f"{100 * row[f'{key}_error']:+.2f} %"]
    return "| " + " | ".join([*cells, f"{row['distention']:.4f}", "yes" if row["met"] else "**no**"]) + " |"


def other(row: dict) -> str:
    """A row of the last table."""
    if "wanted" not in row:
        return f"| {row['what']} | {row['value']:.4g} | | | |"
    limit = f"{100 * row['limit']:g} %" if row["relative"] else f"{row['limit']:g}"
    return (
        f"| {row['what']} | {row['value']:.4g} | {row['wanted']:.4g} | {limit} | {'yes' if row['met'] else '**no**'} |"
    )


def page(layers: int, done: dict[str, dict]) -> str:
    """The tables of what was measured."""
    text = [f"Default numerics, columns of {layers} layers.", ""]
    kinds = {
        kind: [row for name, row in done.items() if name.startswith(f"{kind}/")]
        for kind in ("pistons", "compaction", "sod", "quiet")
    }
    for title, kind in (("Pistons into solids", "pistons"), ("Compaction waves", "compaction")):
        text += [f"## {title}", "", HEAD, *map(line, kinds[kind]), ""]
    text += ["## Sod's tube", "", "| layers per unit | L1 of the density | shock speed (1.7522) |", "|---|---|---|"]
    text += [
        f"| {row['layers']} | {100 * row['L1_density']:.2f} % | {row['shock_speed']:.4f} |" for row in kinds["sod"]
    ]
    text += ["", "## Quiet end", "", "| half width of the pulse, spacings | momentum returned |", "|---|---|"]
    text += [f"| {row['sigma_spacings']:g} | {100 * row['returned']:.2f} % |" for row in kinds["quiet"]]
    text += ["", "## Other solutions", "", "| | measured | exact | limit | met |", "|---|---|---|---|---|"]
    for name, entry in done.items():
        if name.startswith("solutions/"):
            text += [other(row) for row in entry["rows"]]
    rows = kinds["pistons"] + kinds["compaction"]
    return "\n".join([*text, "", f"{sum(row['met'] for row in rows)} of {len(rows)} shocks within their limits.", ""])


def main() -> None:
    """Measure, print and write; with ``--out`` what was measured before is kept and the rest done."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--out", type=Path, default=None)
    parser.add_argument(
        "--layers",
        type=int,
        default=150,
        help="how far fronts may run; a column is higher where a precursor runs ahead of the front",
    )
    parser.add_argument("--only", default="", help="measure only what has this text in its name")
    options = parser.parse_args()
    kept = options.out / "shocks.json" if options.out else None
    content = json.loads(kept.read_text()) if kept and kept.is_file() else {"layers": options.layers, "done": {}}
    if content.get("layers") != options.layers:
        raise SystemExit(f"{kept} holds results of other columns or numerics")
    wanted = jobs(options.layers)
    for name, job in wanted.items():
        if name in content["done"] or options.only not in name:
            continue
        content["done"][name] = job()
        print(
            line(content["done"][name]) if "case" in content["done"][name] else f"{name}: {content['done'][name]}",
            flush=True,
        )
        if options.out and kept:
            options.out.mkdir(parents=True, exist_ok=True)
            content["done"] = {key: content["done"][key] for key in wanted if key in content["done"]}
            archive.write_text(kept, json.dumps(content, indent=1))
            archive.write_text(options.out / "shocks.md", page(options.layers, content["done"]))
    print(page(options.layers, content["done"]).splitlines()[-1])
    if options.json:
        print(json.dumps(content))


if __name__ == "__main__":
    main()
