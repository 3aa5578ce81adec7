"""Deep Impact and momentum transfer beside Benz & Jutzi (2007): tables, pictures, verdicts from finished runs.

    python benchmarks/benz_jutzi.py RUNS [--out docs/results/benz_jutzi]

RUNS is a folder below which run folders of ``cases/deep_impact`` and ``cases/momentum_transfer`` lie, at any depth; what a run is (porosity, crush curve,
spacing) is read from its ``case.used.toml``. Each is measured once: ``measures.json`` in ``--out`` keeps what was measured, and is filled up by the next call.
``reasons.json`` there, written by hand, holds what is known of why a claim is not met, by its id.

Ejected, as in the source, is what rises faster than v_esc (v_z > v_esc), in the air or still in the ground. Left out are particles that began within 5.4 m
(Deep Impact) or 8.4 m of the half-sphere's rim, where the quiet layer and its fixed rim are: three supports of the cases' own outer spacing, the same at
every resolution.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from matter import archive, material, quantity, snapshot  # noqa: E402
from matter.errors import InputError  # noqa: E402
from matter.particles import Particles  # noqa: E402

RIM = {22.0: 5.4, 40.0: 8.4}
"""Particles that began within this distance [m] of the rim are left out; by the half-sphere's radius."""
ESCAPE = (0.1, 1.0, 2.0)
SPEEDS = np.geomspace(0.1, 2e3, 44)
DEPTHS = (5.0, 10.0, 20.0)
CONE = math.cos(math.radians(25.0))
"""Depths are looked at within 25 deg of the axis below the impact."""
ARRIVED = 0.5
"""A shock has arrived where half of the final peak pressure has been reached."""
FLOOR = 0.02
"""A profile of the distention may fall by this much between two rings and still count as monotone: the scatter of a ring."""


LONELY = 4
CURVES = {
    "nominal": ("deep_impact", 1e6, 200e6),
    "soft": ("deep_impact", 0.1e6, 10e6),
    "hard": ("deep_impact", 10e6, 500e6),
    "nominal basalt": ("momentum_transfer", 200e6, 2e9),
    "soft basalt": ("momentum_transfer", 100e6, 1e9),
    "weak basalt": ("momentum_transfer", 1e6, 200e6),
}
"""Crush curves by their ends Pe, Ps [Pa]."""


def pascals(value: str | float) -> float:
    """A pressure of a case (with its unit) or of a material file."""
    return quantity.parse(value, "Pa") if isinstance(value, str) else float(value)


def inside(particles: Particles) -> np.ndarray:
    """Target particles that count."""
    radius = float(particles.attributes["target_depth_m"])
    edge = radius - RIM[round(radius, 6)]
    return (particles.layer >= 0) & (np.linalg.norm(particles.initial_position, axis=1) < edge)


def ejecta(particles: Particles) -> dict[str, Any]:
    """Time, mass [kg] and upward momentum [kg m/s] of what rises faster than each of ``ESCAPE``; the same above the ground; the projectile's with it."""
    counts, ball, up = inside(particles), particles.layer < 0, particles.velocity[:, 2]
    m, row = particles.mass, {"time_s": float(particles.attributes["time"]), "mass_kg": [], "momentum": [], "air_kg": [], "ball_momentum": []}
    for limit in ESCAPE:
        gone = up > limit
        row["mass_kg"].append(float(m[gone & counts].sum()))
        row["momentum"].append(float((m * up)[gone & counts].sum()))
        row["air_kg"].append(float(m[gone & counts & (particles.position[:, 2] > 0.0)].sum()))
        row["ball_momentum"].append(float((m * up)[gone & ball].sum()))
    return row


def rings(particles: Particles, spacing: float) -> dict[str, list[float]]:
    """Distention in rings one ``spacing`` wide about the middle of the crushed zone at ground level, of matter now within the cone below it.

    Middles of the rings, means weighted with mass, scatter. The middle is the mean place of what has lost half of its pores: an oblique impact crushes
    downrange.
    """
    x = particles.position
    below = inside(particles) & (x[:, 2] < 0.0)
    start = float(particles.distention[below].max(initial=1.0))
    crushed = below & (particles.distention < 0.5 * (1.0 + start))
    middle = np.zeros(3)
    if crushed.any():
        middle[:2] = np.average(x[crushed, :2], axis=0, weights=particles.mass[crushed])
    x = x - middle
    r = np.linalg.norm(x, axis=1)
    mine = inside(particles) & (-x[:, 2] > CONE * r)
    ring = (r[mine] / spacing).astype(int)
    number = np.bincount(ring)
    weight = np.bincount(ring, particles.mass[mine])
    with np.errstate(invalid="ignore"):
        mean = np.bincount(ring, particles.mass[mine] * particles.distention[mine]) / weight
        spread = np.sqrt(np.maximum(np.bincount(ring, particles.mass[mine] * particles.distention[mine] ** 2) / weight - mean**2, 0.0))
    kept = np.flatnonzero(number >= 4)
    return {"radius_m": ((kept + 0.5) * spacing).tolist(), "distention": mean[kept].tolist(), "spread": spread[kept].tolist()}


def shells(particles: Particles, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Depths [m] and median peak pressure [Pa] of shells two spacings thick, by where matter began, within the cone."""
    x = particles.initial_position
    r = np.linalg.norm(x, axis=1)
    mine = inside(particles) & (-x[:, 2] > CONE * r)
    depths = np.arange(spacing, r[mine].max() - spacing, spacing)
    peak = [particles.peak_pressure[mine & (abs(r - d) < spacing)] for d in depths]
    return depths, np.array([float(np.median(p)) if len(p) else math.nan for p in peak])


def arrivals(times: list[float], looks: list[np.ndarray], depths: np.ndarray) -> dict[str, list[float]]:
    """Time [s] at which the front passes ``DEPTHS``, linear between snapshots: it is at the outermost shell that has half of its final peak."""
    final = looks[-1]
    front = [0.0]
    for look in looks[1:]:
        reached = np.flatnonzero(look >= ARRIVED * final)
        front.append(max(front[-1], float(depths[reached[-1]]) if len(reached) else 0.0))
    place, when = np.array(front), np.array(times)
    passed = np.concatenate(([True], np.diff(place) > 0.0))
    return {
        "depth_m": list(DEPTHS),
        "arrival_s": [float(np.interp(d, place[passed], when[passed])) if d <= place[-1] else math.nan for d in DEPTHS],
        "peak_Pa": [float(np.interp(d, depths, final)) for d in DEPTHS],
    }


def measure(run: Path) -> dict[str, Any]:
    """All that is read from one run."""
    used = tomllib.loads((run / "case.used.toml").read_text())
    kind = "deep_impact" if run.name.startswith("deep_impact") else "momentum_transfer"
    layer = used["target"]["layers"][0]["material"]
    choice = used["sph"].get("materials", {}).get(layer, {})
    porous = choice.get("porosity") == "p_alpha"
    values = material.load(layer)
    curve = {**values.get("crush_quadratic", {}), **choice.get("crush_quadratic", {})} if porous else {}
    spacing = quantity.parse(used["sph"]["spacing_at_impact"], "m")
    files = sorted((run / "2_sph").glob("snap_*.vtkhdf"))
    series, times, looks = [], [], []
    for file in files:
        particles = snapshot.read(file)
        series.append(ejecta(particles))
        times.append(series[-1]["time_s"])
        depths, look = shells(particles, spacing)
        looks.append(look)
    counts, up = inside(particles), particles.velocity[:, 2]
    report = json.loads((run / "2_sph" / "stage_report.json").read_text())
    return {
        "run": run.name, "case": kind, "alpha0": choice["p_alpha"]["alpha0"] if porous else 1.0,
        "density_kg_m3": float(np.median(snapshot.read(files[0]).density[counts])), "light": "rho0" in str(choice.get("tillotson", {})),
        "intact": choice.get("strength") == "von_mises", "following": used["sph"].get("smoothing") == "density",
        "cut_off": cut_off(snapshot.read(files[min(1, len(files) - 1)])),
        "curve": next((name for name, ends in CURVES.items() if ends == (kind, pascals(curve["Pe"]), pascals(curve["Ps"]))), "other") if curve else "",
        "spacing_m": spacing, "particles": len(particles), "end_s": times[-1], "steps": report["steps"],
        "target_particle_kg": float(particles.mass[counts].min()), "projectile_particle_kg": float(particles.mass[particles.layer < 0].max()),
        "projectile_momentum": report["projectile"]["momentum_kg_m_s"], "projectile_mass_kg": report["projectile"]["mass_kg"],
        "energy_drift": report["drift_over_projectile"]["energy_J"],
        "counted_kg": float(particles.mass[counts].sum()), "target_kg": float(particles.mass[particles.layer >= 0].sum()),
        "series": {key: [row[key] for row in series] for key in series[0]},
        "speed_m_s": SPEEDS.tolist(), "mass_above_kg": [float(particles.mass[counts & (up > v)].sum()) for v in SPEEDS],
        "rings": rings(particles, spacing), "shock": arrivals(times, looks, depths),
        "shells": {"depth_m": depths.tolist(), "peak_Pa": looks[-1].tolist()},
    }  # fmt: skip


def cut_off(particles: Particles) -> dict[str, float]:
    """Heat [J] and number of particles with at most ``LONELY`` neighbours, which feel no pressure (``sph.state``); kinetic energy of the projectile [J]."""
    alone = particles.neighbours <= LONELY
    motion = 0.5 * particles.mass * np.einsum("ij,ij->i", particles.velocity, particles.velocity)
    return {
        "time_s": float(particles.attributes["time"]),
        "heat_J": float((particles.mass * particles.specific_energy)[alone].sum()),
        "number": int(alone.sum()),
        "projectile_kinetic_J": float(motion[particles.layer < 0].sum()),
    }


def found(folder: Path, kept: dict[str, Any]) -> dict[str, Any]:
    """Measures of all finished runs below a folder, by the run folder's name; those in ``kept`` are taken as they are."""
    names = ("deep_impact", "momentum_transfer")
    runs = sorted(path.parents[1] for path in folder.rglob("2_sph/done.json") if path.parents[1].name.rsplit("-", 1)[0] in names)
    for run in runs:
        if run.name not in kept:
            print(f"measuring {run.name}", flush=True)
            kept[run.name] = measure(run)
    return kept


class Runs:
    """Measured runs by what they are."""

    def __init__(self, measured: Iterable[dict[str, Any]]):
        self.rows = sorted(measured, key=lambda row: (row["case"], row["spacing_m"], row["light"], row["alpha0"], row["curve"]))

    def spacings(self, case: str) -> list[float]:
        """Spacings at the impact, the finest first."""
        return sorted({row["spacing_m"] for row in self.rows if row["case"] == case})

    def get(self, case: str, alpha0: float, spacing: float, curve: str = "nominal", light: bool = False) -> dict[str, Any] | None:
        """One run with the case's own strength and supports, if it is there."""
        wanted = (case, alpha0, spacing, curve if alpha0 > 1.0 else "", light, False, False)
        for row in self.rows:
            if wanted == (
                *(row[key] for key in ("case", "alpha0", "spacing_m")),
                row["curve"].split(" ")[0],
                *(row[key] for key in ("light", "intact", "following")),
            ):
                return row
        return None


def mass(row: dict[str, Any], limit: float = 2.0) -> float:
    """Ejected mass [kg] at the end."""
    return row["series"]["mass_kg"][-1][ESCAPE.index(limit)]


def transferred(row: dict[str, Any], limit: float) -> np.ndarray:
    """1 + P_ejecta in units of the projectile's momentum, in time; the projectile's own matter that flies off counts."""
    k = ESCAPE.index(limit)
    both = np.array([a[k] + b[k] for a, b in zip(row["series"]["momentum"], row["series"]["ball_momentum"])])
    return 1.0 + both / row["projectile_momentum"]


def rate(row: dict[str, Any], limit: float) -> float:
    """Relative change of the transferred momentum per millisecond, over the last fifth of the run."""
    t, p = np.array(row["series"]["time_s"]), transferred(row, limit)
    last = t >= 0.8 * t[-1]
    return float(np.polyfit(t[last] * 1e3, p[last], 1)[0] / p[-1])


def slope(row: dict[str, Any], slow: float = 2.0, fast: float = 100.0) -> float:
    """d log M / d log v of M(>v) between two speeds [m/s]."""
    v, m = np.array(row["speed_m_s"]), np.array(row["mass_above_kg"])
    mine = (v >= slow) & (v <= fast) & (m > 0.0)
    return float(np.polyfit(np.log(v[mine]), np.log(m[mine]), 1)[0])


def compacted(row: dict[str, Any]) -> tuple[float, bool]:
    """Thickness [spacings] of the rings with a mean distention below 1.1, and whether the distention never falls outwards (by more than ``FLOOR``)."""
    alpha = np.array(row["rings"]["distention"])
    return float((alpha < 1.1).sum()), bool((np.diff(alpha) > -FLOOR).all())


def label(row: dict[str, Any]) -> str:
    """Words for a run."""
    name = (
        f"alpha0 {row['alpha0']:g}"
        + (", density of 1.5" if row["light"] else "")
        + (", intact" if row["intact"] else "")
        + (", following supports" if row["following"] else "")
    )
    return name + (f", {row['curve'].split(' ')[0]}" if row["curve"] and not row["curve"].startswith("nominal") else "")


def size(row: dict[str, Any]) -> str:
    """Its resolution."""
    return f"{row['particles']:,} particles, {100 * row['spacing_m'] * 2 ** (1 / 6):.0f} cm"


def tables(runs: Runs) -> str:
    """Every run in two tables."""
    head = ["Deep Impact", "resolution", "M(v_z > 2 m/s)", "M / counted", "in the air", "slope of M(>v), 2 to 100 m/s", "rings of alpha < 1.1", "heat cut off"]
    text = [line(head), "|---" * len(head) + "|"]
    for row in runs.rows:
        if row["case"] == "deep_impact":
            thick = f"{compacted(row)[0]:.0f}" if row["alpha0"] > 1.0 else ""
            air = row["series"]["air_kg"][-1][ESCAPE.index(2.0)]
            words = [label(row), size(row), f"{mass(row):.3g} kg", f"{100 * mass(row) / row['counted_kg']:.1f} %", f"{air:.2g} kg", f"{slope(row):.2f}", thick]
            text.append(line([*words, lonely(row)]))
    head = ["momentum transfer", "resolution", "P_trans (0.1 m/s)", "P_trans (1 m/s), change per ms", "peak / final (1 m/s), at", "M(v_z > 1 m/s)"]
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


def lonely(row: dict[str, Any]) -> str:
    """Share of the impact energy that is heat of particles without pressure, soon after the impact."""
    energy = 0.5 * row["projectile_momentum"] ** 2 / row["projectile_mass_kg"]
    return f"{100 * row['cut_off']['heat_J'] / energy:.0f} % in {row['cut_off']['number']} at {1e3 * row['cut_off']['time_s']:.0f} ms"


def line(words: list[str]) -> str:
    """A line of a table."""
    return "| " + " | ".join(words) + " |"


def verdict(key: str, ours: str, met: bool | None, row: dict[str, Any] | None, why: str = "") -> dict[str, str]:
    """One row of ``verdicts.json``; ``met`` is None for what can only be stated."""
    word = "in part" if met is None else "met" if met else "not met"
    return {"id": key, "ours": ours, "verdict": word, **({"resolution": size(row)} if row else {}), **({"why": why} if why else {})}


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
        spread += [f"alpha0 = {row['alpha0']:g}: {label(end).rsplit(', ', 1)[1]} {mass(end):.3g} kg" for end in ends if end]
    met = all(abs(error) <= limit for error, limit in zip(off, limits)) and 4.0 <= first <= 9.0 and 0.8 <= second <= 1.4
    air = ", ".join(f"{row['series']['air_kg'][-1][ESCAPE.index(2.0)]:.2g}" for row in (solid, some, much))
    text = f"{masses[0]:.3g}, {masses[1]:.3g}, {masses[2]:.3g} kg ({', '.join(f'{100 * error:+.0f} %' for error in off)}); ratios {first:.2f} and {second:.2f}"
    why = f"heat that no longer pushes: {lonely(solid)}, {lonely(some)}, {lonely(much)} of the energy; risen above the ground by then {air} kg; " + (
        f"other crush curves: {'; '.join(spread)}" if spread else "other crush curves not run"
    )
    falls = ", ".join(f"{slope(row):.2f}" for row in (solid, some, much))
    thick, monotone = compacted(much)
    words = f"alpha < 1.1 in {thick:.0f} rings of one spacing, least mean of a ring {min(much['rings']['distention']):.2f}"
    return [
        verdict("B04", text, met, solid, why),
        verdict("B05", f"{masses[0]:.3g}, {masses[1]:.3g}, {masses[2]:.3g} kg", masses[0] > 2.0 * masses[1] and masses[1] > masses[2], solid),
        verdict("B06", f"{words}; profile {'' if monotone else 'not '}monotone", thick > 2.0 and monotone, much),
        verdict("B07", f"slope from 2 to 100 m/s: {falls} (alpha0 = 1, 1.5, 3)", None, solid, "published as a picture without numbers; ours: ejected.png"),
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
            parts.append((f"v_esc {limit:g} m/s: {', '.join(f'{value:.2f}' for value in values)}, ratio {values[0] / values[-1]:.2f}", values))
        names = ", ".join(f"{row['alpha0']:g}" for row in (solid, little, some, much) if row)
        met = all(values[0] / values[-1] > 2.0 and all(a >= b for a, b in itertools.pairwise(values)) for _, values in parts)
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
            + ", ".join(f"{1e3 * t:.2f} ms {1e-9 * P:.2g} GPa" for t, P in zip(row["shock"]["arrival_s"], row["shock"]["peak_Pa"]))
            for row in (solid, some, much)
        )
        rows.append(verdict("B12", words, late and weak, solid, "at 5, 10, 20 m below the impact; front between snapshots 1 ms apart"))
    if some and light:
        parts, ok = [], []
        for limit in (0.1, 1.0):
            a, b = transferred(some, limit)[-1] - 1.0, transferred(light, limit)[-1] - 1.0
            ok.append(a < 0.7 * b)
            parts.append(f"v_esc {limit:g} m/s: beta - 1 = {a:.2f} with pores, {b:.2f} without, {100 * (a / b - 1.0):+.0f} %")
        rows.append(verdict("B13", "; ".join(parts), all(ok), some))
    return rows


def lattice(mass_kg: float, radius: float, density: float, count: int) -> tuple[float, float]:
    """Nearest distance [m] and particle mass [kg] of ``count`` particles of a hexagonal lattice in a half-sphere (``mass_kg`` 0) or in a ball of that mass."""
    volume = mass_kg / density if mass_kg else 2.0 / 3.0 * math.pi * radius**3
    return (math.sqrt(2.0) * volume / count) ** (1.0 / 3.0), density * volume / count


def of_setup(runs: Runs) -> list[dict[str, str]]:
    """The set-ups: what was taken over, and the printed resolutions worked out again."""
    rows = []
    for key, again, case, printed, radius, rho, count, ball in (
        ("B01", "B03", "deep_impact", (1.0, 1.5, 3.0), 22.0, 917.0, 700_000, (370.0, 2700.0, 20)),
        ("B08", "B09", "momentum_transfer", (1.0, 1.1, 1.5, 3.0), 40.0, 2700.0, 1_400_000, (400.0, 5500.0, 15)),
    ):
        have = sorted({row["alpha0"] for row in runs.rows if row["case"] == case})
        rows.append(
            {"id": key, "ours": f"R = {radius:g} m; alpha0 = {', '.join(f'{a:g}' for a in have)} run; a quiet layer before the rim", "verdict": "input"}
        )
        apart, _ = lattice(0.0, radius, rho, count)
        near, grain = lattice(ball[0], 0.0, ball[1], int(ball[2]))
        masses = [lattice(0.0, radius, rho / alpha0, count)[1] for alpha0 in (printed[-1], printed[0])]
        ours = f"hexagonal lattice: {100 * apart:.1f} cm, {masses[0]:.3g} to {masses[1]:.3g} kg; projectile {100 * near:.1f} cm, {grain:.3g} kg"
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
            ours = f"{row['projectile_mass_kg']:.1f} kg, particles of {row['projectile_particle_kg']:.1f} kg, the target's {row['target_particle_kg']:.1f}"
            rows.append({"id": "B02", "ours": ours, "verdict": "input"})
    return rows


def pictures(runs: Runs, out: Path) -> None:
    """M(>v) and distention of Deep Impact, momentum and mass in time, shock against depth."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    colour = {1.0: "C0", 1.1: "C3", 1.5: "C1", 3.0: "C2"}
    for case, name in (("deep_impact", "ejected.png"), ("momentum_transfer", "momentum.png")):
        rows = [row for row in runs.rows if row["case"] == case]
        if not rows:
            continue
        fines = runs.spacings(case)
        figure, axes = plt.subplots(1, 2 if case == "deep_impact" else 3, figsize=(11 if case == "deep_impact" else 15, 4.5), layout="constrained")
        for row in rows:
            words = f"{label(row)}, {100 * row['spacing_m'] * 2 ** (1 / 6):.0f} cm"
            pen = {"color": "0.4" if row["light"] else colour[row["alpha0"]], "ls": ("-", "--", ":", "-.")[fines.index(row["spacing_m"]) % 4]}
            if row["curve"].split(" ")[0] in ("soft", "hard", "weak") or row["intact"] or row["following"]:
                pen |= {"lw": 0.7, "alpha": 0.7}
            t = 1e3 * np.array(row["series"]["time_s"])
            if case == "deep_impact":
                axes[0].loglog(row["speed_m_s"], row["mass_above_kg"], label=words, **pen)
                if row["alpha0"] > 1.0:
                    axes[1].plot(row["rings"]["radius_m"], row["rings"]["distention"], label=words, **pen)
            else:
                axes[0].plot(t, transferred(row, 1.0), label=words, **pen)
                axes[1].semilogy(t[1:], np.array(row["series"]["mass_kg"])[1:, ESCAPE.index(1.0)], **pen)
                axes[2].loglog(row["shells"]["depth_m"], 1e-9 * np.array(row["shells"]["peak_Pa"]), **pen)
        if case == "deep_impact":
            for x, y, c in ((2.0, 3.20e6, "C0"), (2.0, 0.52e6, "C1"), (2.0, 0.49e6, "C2")):
                axes[0].plot(x, y, "o", mfc="none", color=c, ms=8)
            axes[0].set(xlabel="v [m/s]", ylabel="M(v_z > v) at 50 ms [kg]; circles: published", ylim=(10, None))
            axes[1].set(xlabel="distance from the impact point [m]", ylabel="distention at 50 ms, below the ground")
        else:
            axes[0].set(xlabel="t [ms]", ylabel="1 + P_ejecta / P_projectile, v_z > 1 m/s")
            axes[1].set(xlabel="t [ms]", ylabel="M(v_z > 1 m/s) [kg]")
            axes[2].set(xlabel="depth below the impact [m]", ylabel="peak pressure [GPa]")
        axes[0].legend(fontsize=7)
        figure.savefig(out / name, dpi=110)
        plt.close(figure)


def slices(folder: Path, runs: Runs, out: Path) -> None:
    """The source's Figures 1 and 2: vertical velocity at the end in slices through the plane of flight, and the distention of alpha0 = 3."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = [row for alpha0 in (1.0, 1.5, 3.0) if (fine := runs.spacings("deep_impact")) and (row := runs.get("deep_impact", alpha0, fine[0]))]
    rows += [row for alpha0 in (1.0, 1.5, 3.0) if (fine := runs.spacings("momentum_transfer")) and (row := runs.get("momentum_transfer", alpha0, fine[0]))]
    if not rows:
        return
    figure, axes = plt.subplots(2, len(rows), figsize=(4.2 * len(rows), 7), squeeze=False, layout="constrained")
    for column, row in enumerate(rows):
        run = next(path for path in folder.rglob(row["run"]) if (path / "2_sph").is_dir())
        particles = snapshot.read(run / "2_sph" / "last.vtkhdf")
        cut = np.abs(particles.position[:, 1]) < 0.5 * particles.smoothing_length
        x, limit, top = particles.position[cut], 2.0 if row["case"] == "deep_impact" else 1.0, row["counted_kg"] and axes[0, column]
        reach = float(particles.attributes["target_depth_m"])
        dots = 1.5 * particles.smoothing_length[cut] / reach * 20.0
        shown = top.scatter(x[:, 0], x[:, 2], c=particles.velocity[cut, 2], s=dots, cmap="coolwarm", vmin=-3 * limit, vmax=3 * limit, lw=0)
        figure.colorbar(shown, ax=top, label="v_z [m/s]", shrink=0.7)
        what = particles.distention[cut] if row["alpha0"] > 1.0 else particles.density[cut]
        shown = axes[1, column].scatter(x[:, 0], x[:, 2], c=what, s=dots, cmap="viridis", lw=0)
        figure.colorbar(shown, ax=axes[1, column], label="distention" if row["alpha0"] > 1.0 else "density [kg/m^3]", shrink=0.7)
        top.set_title(f"{row['case'].replace('_', ' ')}, {label(row)}, {1e3 * row['end_s']:.0f} ms", fontsize=9)
        for panel in axes[:, column]:
            panel.set(xlim=(-reach, reach), ylim=(-reach, 0.6 * reach), aspect="equal")
    figure.savefig(out / "slices.png", dpi=90)
    plt.close(figure)


def main() -> int:
    """Exit code 0, 2 for bad input."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results" / "benz_jutzi")
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
    import benz_jutzi_formulas  # here: it compiles

    rows = of_setup(runs) + benz_jutzi_formulas.verdicts()
    for spacing in runs.spacings("deep_impact"):
        rows += of_deep_impact(runs, spacing)
    for spacing in runs.spacings("momentum_transfer"):
        rows += of_momentum(runs, spacing)
    reasons = json.loads(path.read_text()) if (path := given.out / "reasons.json").exists() else {}
    for row in rows:
        if row["verdict"] == "not met" and row["id"] in reasons:
            row["why"] = "; ".join(text for text in (reasons[row["id"]], row.get("why", "")) if text)
    archive.write_text(given.out / "verdicts.json", json.dumps({"resolution": "", "verdicts": rows}, indent=1) + "\n")
    if not given.no_pictures:
        pictures(runs, given.out)
        slices(given.runs, runs, given.out)
    print((given.out / "tables.md").read_text())
    return 0


if __name__ == "__main__":
    sys.exit(main())
