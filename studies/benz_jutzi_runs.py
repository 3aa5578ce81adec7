"""What is read from one finished run of Deep Impact or momentum transfer, and the runs by what they are
(``benz_jutzi.py``)."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from matter.case import material, quantity
from matter.files import snapshot
from matter.particles import Particles
from sph.stepping.numerics import SETS

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
"""A profile of the distention may fall by this much between two rings and still count as monotone: the scatter of a
ring."""


LONELY = 4
DEFAULT_SET = "reconstructed"
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
    """Time, mass [kg] and upward momentum [kg m/s] of what rises faster than each of ``ESCAPE``; the same above the
    ground; the projectile's with it."""
    counts, ball, up = inside(particles), particles.layer < 0, particles.velocity[:, 2]
    m = particles.mass
    row: dict[str, Any] = {
        "time_s": float(particles.attributes["time"]),
        "mass_kg": [],
        "momentum": [],
        "air_kg": [],
        "ball_momentum": [],
    }
    for limit in ESCAPE:
        ejected = up > limit
        row["mass_kg"].append(float(m[ejected & counts].sum()))
        row["momentum"].append(float((m * up)[ejected & counts].sum()))
        row["air_kg"].append(float(m[ejected & counts & (particles.position[:, 2] > 0.0)].sum()))
        row["ball_momentum"].append(float((m * up)[ejected & ball].sum()))
    return row


def rings(particles: Particles, spacing: float) -> dict[str, list[float]]:
    """Distention in rings one ``spacing`` wide about the middle of the crushed zone at ground level, of matter now
    within the cone below it.

    Middles of the rings, means weighted with mass, scatter. The middle is the mean place of what has lost half of its
    pores: an oblique impact crushes downrange.
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
        spread = np.sqrt(
            np.maximum(
                np.bincount(ring, particles.mass[mine] * particles.distention[mine] ** 2) / weight - mean**2, 0.0
            )
        )
    kept = np.flatnonzero(number >= 4)
    return {
        "radius_m": ((kept + 0.5) * spacing).tolist(),
        "distention": mean[kept].tolist(),
        "spread": spread[kept].tolist(),
    }


def shells(particles: Particles, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Depths [m] and median peak pressure [Pa] of shells two spacings thick, by where matter began, within the
    cone."""
    x = particles.initial_position
    r = np.linalg.norm(x, axis=1)
    mine = inside(particles) & (-x[:, 2] > CONE * r)
    depths = np.arange(spacing, r[mine].max() - spacing, spacing)
    peak = [particles.peak_pressure[mine & (abs(r - d) < spacing)] for d in depths]
    return depths, np.array([float(np.median(p)) if len(p) else math.nan for p in peak])


def arrivals(times: list[float], looks: list[np.ndarray], depths: np.ndarray) -> dict[str, list[float]]:
    """Time [s] at which the front passes ``DEPTHS``, linear between snapshots: it is at the outermost shell that has
    half of its final peak."""
    final = looks[-1]
    front = [0.0]
    for look in looks[1:]:
        reached = np.flatnonzero(look >= ARRIVED * final)
        front.append(max(front[-1], float(depths[reached[-1]]) if len(reached) else 0.0))
    position, when = np.array(front), np.array(times)
    passed = np.concatenate(([True], np.diff(position) > 0.0))
    return {
        "depth_m": list(DEPTHS),
        "arrival_s": [
            float(np.interp(d, position[passed], when[passed])) if d <= position[-1] else math.nan for d in DEPTHS
        ],
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
        "density_kg_m3": float(np.median(snapshot.read(files[0]).density[counts])),
        "light": "rho0" in str(choice.get("tillotson", {})),
        "set": used["sph"]["numerics"], "part": used["sph"].get("symmetry", "none"),
        "odd": [f"{key} = {used['sph'][key]}" for key, usual in SETS[used["sph"]["numerics"]].items()
                if used["sph"].get(key, usual) != usual],
        "intact": choice.get("strength") == "von_mises",
        "cut_off": cut_off(snapshot.read(files[min(1, len(files) - 1)])),
        "curve": next((name for name, ends in CURVES.items() if ends == (kind, pascals(curve["Pe"]),
        pascals(curve["Ps"]))), "other") if curve else "",
        "spacing_m": spacing, "particles": len(particles), "end_s": times[-1], "steps": report["steps"],
        "target_particle_kg": float(particles.mass[counts].min()),
        "projectile_particle_kg": float(particles.mass[particles.layer < 0].max()),
        "projectile_momentum": report["projectile"]["momentum_kg_m_s"],
        "projectile_mass_kg": report["projectile"]["mass_kg"],
        "energy_drift": report["drift_over_projectile"]["energy_J"],
        "counted_kg": float(particles.mass[counts].sum()),
        "target_kg": float(particles.mass[particles.layer >= 0].sum()),
        "series": {key: [row[key] for row in series] for key in series[0]},
        "speed_m_s": SPEEDS.tolist(),
        "mass_above_kg": [float(particles.mass[counts & (up > v)].sum()) for v in SPEEDS],
        "rings": rings(particles, spacing), "shock": arrivals(times, looks, depths),
        "shells": {"depth_m": depths.tolist(), "peak_Pa": looks[-1].tolist()},
    }  # fmt: skip


def cut_off(particles: Particles) -> dict[str, float]:
    """Heat [J] and number of particles with at most ``LONELY`` neighbours, which feel no pressure
    (``sph.stepping.state``); kinetic energy of the projectile [J]."""
    alone = particles.neighbours <= LONELY
    motion = 0.5 * particles.mass * np.einsum("ij,ij->i", particles.velocity, particles.velocity)
    return {
        "time_s": float(particles.attributes["time"]),
        "heat_J": float((particles.mass * particles.specific_energy)[alone].sum()),
        "number": int(alone.sum()),
        "projectile_kinetic_J": float(motion[particles.layer < 0].sum()),
    }


def found(folder: Path, kept: dict[str, Any]) -> dict[str, Any]:
    """Measures of all finished runs below a folder, by the run folder's name; those in ``kept`` are taken as they
    are."""
    names = ("deep_impact", "momentum_transfer")
    runs = sorted(
        path.parents[1] for path in folder.rglob("2_sph/done.json") if path.parents[1].name.rsplit("-", 1)[0] in names
    )
    for run in runs:
        if run.name not in kept:
            print(f"measuring {run.name}", flush=True)
            kept[run.name] = measure(run)
    return kept


class Runs:
    """Measured runs by what they are."""

    def __init__(self, measured: Iterable[dict[str, Any]]):
        self.rows = sorted(
            measured, key=lambda row: (row["case"], row["spacing_m"], row["light"], row["alpha0"], row["curve"])
        )

    def spacings(self, case: str) -> list[float]:
        """Spacings at the impact, the finest first."""
        return sorted({row["spacing_m"] for row in self.rows if row["case"] == case})

    def get(
        self, case: str, alpha0: float, spacing: float, curve: str = "nominal", light: bool = False
    ) -> dict[str, Any] | None:
        """One run with the case's own strength and the default numerics, if it is there."""
        wanted = (case, alpha0, spacing, curve if alpha0 > 1.0 else "", light, False, DEFAULT_SET)
        for row in self.rows:
            if not row["odd"] and wanted == (
                *(row[key] for key in ("case", "alpha0", "spacing_m")),
                row["curve"].split(" ")[0],
                *(row[key] for key in ("light", "intact", "set")),
            ):
                return row
        return None


def mass(row: dict[str, Any], limit: float = 2.0) -> float:
    """Ejected mass [kg] at the end."""
    return row["series"]["mass_kg"][-1][ESCAPE.index(limit)]


def transferred(row: dict[str, Any], limit: float) -> np.ndarray:
    """1 + P_ejecta in units of the projectile's momentum, in time; the projectile's own matter that flies off
    counts."""
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
    """Thickness [spacings] of the rings with a mean distention below 1.1, and whether the distention never falls
    outwards (by more than ``FLOOR``)."""
    alpha = np.array(row["rings"]["distention"])
    return float((alpha < 1.1).sum()), bool((np.diff(alpha) > -FLOOR).all())


def label(row: dict[str, Any]) -> str:
    """Words for a run."""
    name = (
        f"alpha0 {row['alpha0']:g}"
        + (", density of 1.5" if row["light"] else "")
        + (", intact" if row["intact"] else "")
        + (f", {row['set']}" if row["set"] != DEFAULT_SET else "")
        + "".join(f", {words}" for words in row["odd"])
    )
    return name + (
        f", {row['curve'].split(' ')[0]}" if row["curve"] and not row["curve"].startswith("nominal") else ""
    )


def size(row: dict[str, Any]) -> str:
    """Its resolution, and what of the body was computed."""
    part = f", a {row['part']} of them" if row["part"] != "none" else ""
    return f"{row['particles']:,} particles{part}, {100 * row['spacing_m'] * 2 ** (1 / 6):.0f} cm"


def lonely(row: dict[str, Any]) -> str:
    """Share of the impact energy that is heat of particles without pressure, soon after the impact."""
    energy = 0.5 * row["projectile_momentum"] ** 2 / row["projectile_mass_kg"]
    return (
        f"{100 * row['cut_off']['heat_J'] / energy:.0f} % in {row['cut_off']['number']} at "
        f"{1e3 * row['cut_off']['time_s']:.0f} ms"
    )


def lattice(mass_kg: float, radius: float, density: float, count: int) -> tuple[float, float]:
    """Nearest distance [m] and particle mass [kg] of ``count`` particles of a hexagonal lattice in a half-sphere
    (``mass_kg`` 0) or in a ball of that mass."""
    volume = mass_kg / density if mass_kg else 2.0 / 3.0 * math.pi * radius**3
    return (math.sqrt(2.0) * volume / count) ** (1.0 / 3.0), density * volume / count
