"""Reference forecasts of what Hera finds, for skill: a forecast is worth something where it beats them.

    published     what others expect, as a mixture of equal parts; a spread that nobody gave is an estimate, said below
    prior         the samples of ``studies.hera_forecast`` without the observed push: what our factors say alone
    scaling_law   a crater in dry sand by three laws (``crater.scaling``), 10 % beside their spread; no change of shape
    no_change     Dimorphos as it was before DART: density 2,400 +- 300, volume and axes with the errors of before

Frozen with ``hera_v0`` (``forecasts/SHA256SUMS``); the same random numbers (PCG64) give the same bytes.

``trial`` scores the forecast on what is known already: each observable is left out in turn, the samples are weighted
by all the others, and references know none of them. Command: ``python -m studies.hera_references [--trial]`` writes
``hera_references.toml`` and its draws into ``--out`` (``forecasts``), or prints the table of the trial.
"""

from __future__ import annotations

import argparse
import datetime
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import bolide
from crater.scaling import crater_size
from matter.constants import G
from pipeline.uncertainty import forecast_files
from studies import hera_forecast as forecast
from studies import hera_forecast_files as files

NAME, FROZEN, SEED, COUNT = "hera_references", datetime.date(2026, 11, 28), 20261128, 512
LAWS = ("holsapple_sand", "housen_holsapple_2011_sand", "schmidt_housen_sand")
OBSERVABLE = files.Row(
    "dv_observable", "m/s", "drop of the speed along the track as the period gives it", files.ORBIT, "runs", ""
)
WORDS = {
    "published": "equal parts: density Makadia et al. 2026 (1,540 +- 220) and Cheng et al. 2023 (2,400; +- 300 est); "
    "beta 3.61 at 2,400, in proportion to the density (Cheng); a/b 1.3, a/c 1.6 (Naidu et al. 2024; +- 0.1 est); mass "
    "that left: Ferrari et al. 2025 (1.1-5.5e7 kg), Kim & Jewitt 2023 (1.7-2.2e7), Raducan et al. 2024 (0.5-1 %); "
    "hollow 50 m (Jewitt et al. 2023; 30 % est); plane up to 1 deg (Farnham et al. 2025); class: reshaped by two "
    "(Raducan & Jutzi 2022, Raducan et al. 2024), crater by one (Jewitt), by Jeffreys; rotation 0.75 est (Nakano et "
    "al. 2024, Richardson et al. 2024, Farnham)",
    "prior": "factors of hera_v0_inputs.toml, density as in its column makadia, without the observed change of speed",
    "scaling_law": f"{', '.join(LAWS)} with the density of the column prior, 10 %; depth 0.15 to 0.25 of the width; "
    "mass above the escape speed by Housen & Holsapple 2011, sand",
    "no_change": "before DART: 2,400 +- 300 kg/m3, axes with their errors; beta 1, nothing left, no hollow",
}


def numbers(count: int) -> list[np.ndarray]:
    """``count`` independent columns (COUNT,) of numbers in (0, 1), the same ones always."""
    return list(forecast.uniforms(SEED, count * COUNT).reshape(count, COUNT))


def published() -> forecast.Samples:
    """What others expect."""
    u = numbers(12)
    makadia = forecast.valued("normal", [1540.0, 220.0], u[1], [900.0, 3300.0])
    density = np.where(u[0] < 0.5, makadia, forecast.valued("normal", [2400.0, 300.0], u[1]))
    volume = forecast.valued("normal", [1.79e6, 0.107e6], u[2], [1.4e6, 2.2e6])
    ferrari = forecast.valued("lognormal", [math.sqrt(1.1e7 * 5.5e7), 0.57], u[4])
    jewitt, raducan = 1e7 * (1.7 + 0.5 * u[4]), density * volume * (0.005 + 0.005 * u[4])
    left = np.where(u[3] < 1 / 3, ferrari, np.where(u[3] < 2 / 3, jewitt, raducan))
    a_b = np.maximum(forecast.valued("normal", [1.3, 0.1], u[5]), 1.0)
    return {
        "density": density, "mass": density * volume - left, "volume": volume - left / density, "mass_left": left,
        "beta_ejecta": 3.61 * density / 2400.0 * forecast.valued("lognormal", [1.0, 0.06], u[6]),
        "a_over_b": a_b, "a_over_c": np.maximum(forecast.valued("normal", [1.6, 0.1], u[7]), a_b),
        "hollow": forecast.valued("lognormal", [50.0, 0.3], u[8]), "plane_turned": u[9],
        "class": np.searchsorted([1.5 / 4.5, 4.0 / 4.5], u[10]).astype(float), "excited": (u[11] < 0.75).astype(float),
    }  # fmt: skip


def prior(given: Mapping[str, Any], column: str) -> forecast.Samples:
    """The samples without the observed push; in the density prior of a ``column`` of ``hera_v0``."""
    made = forecast.samples(given)
    found = forecast.resampled(made, forecast.weights(made, given, column, without="dv_track"), COUNT, 0.5)
    return {name: values.astype(float) for name, values in found.items()}


def scaling_law(given: Mapping[str, Any], density: np.ndarray, volume: np.ndarray) -> forecast.Samples:
    """A crater in dry sand on a body of this density and volume."""
    u, body, impact = numbers(15)[12:], given["body"], given["impact"]
    radius = (3.0 * volume / (4.0 * math.pi)) ** (1.0 / 3.0)
    size = body["projectile_radius_m"]
    own = impact["mass_kg"] / (4.0 / 3.0 * math.pi * size**3)
    wide, left = np.empty(COUNT), np.empty(COUNT)
    for k in range(COUNT):
        weight = G * density[k] * volume[k] / radius[k] ** 2
        event = crater_size.ImpactEvent(size, impact["speed_m_s"], math.radians(17.0), weight, own, density[k])
        wide[k] = crater_size.LAWS[LAWS[int(u[0][k] * len(LAWS))]](event)
        k_sand, c1, mu = crater_size.EJECTA["sand"]
        left[k] = crater_size.ejected_mass(event, math.sqrt(2.0 * weight * radius[k]), k_sand, c1, mu)
    wide *= forecast.valued("lognormal", [1.0, 0.1], u[1])
    sure = {"edge": np.zeros(COUNT), "neither": np.zeros(COUNT)}
    return {
        "hollow": wide, "deepest": wide * (0.15 + 0.1 * u[2]), "mass_left": left,
        "class": forecast.classed(wide, volume, sure, body),
    }  # fmt: skip


def no_change() -> forecast.Samples:
    """The body as it was."""
    u, zero = numbers(19)[15:], np.zeros(COUNT)
    density = forecast.valued("normal", [2400.0, 300.0], u[0])
    volume = forecast.valued("normal", [1.79e6, 0.107e6], u[1], [1.4e6, 2.2e6])
    a_b = np.maximum(forecast.valued("normal", [1.04, 0.02], u[2]), 1.0)
    return {
        "density": density, "volume": volume, "mass": density * volume, "a_over_b": a_b,
        "a_over_c": np.maximum(forecast.valued("normal", [1.526, 0.04], u[3]), a_b), "beta_normal": zero + 1.0,
        "beta_track": zero + 1.0, "beta_ejecta": zero + 1.0, "mass_left": zero, "hollow": zero, "deepest": zero,
        "resurfaced": zero, "plane_turned": zero, "dv_observable": zero, "class": zero + 2.0, "excited": zero,
    }  # fmt: skip


def references(given: Mapping[str, Any], column: str = "makadia") -> dict[str, forecast.Samples]:
    """The draws of every reference, the prior's density as in a ``column`` of ``hera_v0``."""
    ours = prior(given, column)
    law = scaling_law(given, ours["density"], ours["volume"])
    return {"published": published(), "prior": ours, "scaling_law": law, "no_change": no_change()}


def text(made: Mapping[str, forecast.Samples], about: Mapping[str, Any], columns: Mapping[str, str]) -> str:
    """A forecast with these columns as TOML."""
    out = ["# Made by python -m studies.hera_references.", "", *forecast_files.pairs(about)]
    out += ["", "[columns]", *forecast_files.pairs(columns)]
    for row in (*files.ROWS[:-1], OBSERVABLE):  # dv_track is a condition everywhere
        having = {column: draws[row.name] for column, draws in made.items() if row.name in draws}
        words = {"name": row.name, "unit": row.unit, "definition": row.words, "condition_in": []}
        out += forecast_files.quantity(words, having) if having else []
    out += ["", "[class]"]
    for column, draws in made.items():
        if "class" in draws:
            found = {name: float(np.mean(draws["class"] == k)) for k, name in enumerate(forecast.CLASSES)}
            out.append(f"p_{column} = {forecast_files.table_of(found)}")
    out += ["", "[rotation]"]
    out += [
        f"p_{name} = {forecast_files.number(float(np.mean(one['excited'])))}"
        for name, one in made.items()
        if "excited" in one
    ]
    return "\n".join(out) + "\n"


def write(
    folder: Path, name: str, made: Mapping[str, forecast.Samples], columns: Mapping[str, str], frozen: bool
) -> None:
    """Write a forecast with these columns."""
    about = {"name": name, "frozen": FROZEN, "draws": COUNT, "seed": SEED, "headline": next(iter(columns))}
    known = {row.name: row for row in (*files.ROWS, OBSERVABLE)}
    arrays = {
        f"{column}/{quantity}": (values.astype(np.float32), known[quantity].unit, known[quantity].words)
        for column, draws in made.items()
        for quantity, values in draws.items()
        if quantity in known
    }
    forecast_files.write(folder, name, text(made, about, columns), arrays, {"name": name, "seed": SEED}, frozen)


# -- the trial


def known(given: Mapping[str, Any]) -> dict[str, tuple[str, tuple[float, float], float, str]]:
    """What is known already: its words, value and error, the factor of the table and its unit."""
    seen = given["observed"]
    left, dv = seen["mass_left"], seen["dv_track"]
    middle = math.sqrt(left["low_kg"] * left["high_kg"])
    return {
        "dv_observable": ("change of speed", (1e-3 * dv["value_mm_s"], 1e-3 * dv["sigma_mm_s"]), 1e3, "mm/s"),
        "density": ("density (Makadia et al. 2026)", tuple(seen["makadia"]["density_kg_m3"]), 1.0, "kg/m3"),
        "a_over_b": ("a/b (Naidu et al. 2024)", tuple(seen["shape"]["a_over_b"]), 1.0, ""),
        "a_over_c": ("a/c (Naidu et al. 2024)", tuple(seen["shape"]["a_over_c"]), 1.0, ""),
        "mass_left": ("mass that left (Ferrari et al. 2025)", (middle, left["sigma_ln"] * middle), 1e-7, "1e7 kg"),
    }


def left_out(given: Mapping[str, Any], name: str) -> forecast.Samples:
    """The samples, weighted by all that is known but one."""
    made, seen = forecast.samples(given), given["observed"]
    weight = forecast.weights(made, given, "flat", without=name.replace("dv_observable", "dv_track"))
    left = seen["mass_left"]
    conditions = {
        "density": (made["density"], seen["makadia"]["density_kg_m3"]),
        "a_over_b": (made["a_over_b"], seen["shape"]["a_over_b"]),
        "a_over_c": (made["a_over_c"], seen["shape"]["a_over_c"]),
        "mass_left": (np.log(made["mass_left"]), (0.5 * math.log(left["low_kg"] * left["high_kg"]), left["sigma_ln"])),
    }  # fmt: skip
    for other, (x, (value, sigma)) in conditions.items():
        weight = weight if other == name else weight * forecast.bell(x, value, sigma)
    return {name: forecast.resampled(made, weight, COUNT, 0.5)[name].astype(float)}


def trial(given: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A row for each known observable: forecast from all the others, observed, scores, skill (``bolide.score``)."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        made = references(given, "flat")
        del made["published"]  # made of what is observed here
        write(Path(folder), "others", made, {name: WORDS[name] for name in made}, frozen=False)
        columns = {f"without_{name}": left_out(given, name) for name in known(given)}
        write(Path(folder), "trial", columns, dict.fromkeys(columns, "by all the others"), frozen=False)
        for name, (words, seen, factor, unit) in known(given).items():
            scored = bolide.score(
                Path(folder) / "trial.toml", {name: seen}, f"without_{name}", against=Path(folder) / "others.toml"
            )
            draws = columns[f"without_{name}"][name]
            rows.append(
                {"what": words, "shown_in": unit, "factor": factor, "seen": seen,
                 "forecast": np.quantile(draws, forecast_files.LEVELS), **scored.loc[name]}
            )  # fmt: skip
    return rows


def trial_table(rows: list[dict[str, Any]]) -> str:
    """The trial as the page of the forecast shows it."""
    names = ("prior", "scaling_law", "no_change")
    head = "| left out | from all the others | observed | PIT | CRPS | skill against prior | scaling law | no change |"
    out = [head, "|---|---|---|---|---|---|---|---|"]
    for row in rows:

        def shown(value: float, factor: float = row["factor"]) -> str:
            return f"{factor * value:.3g}" if factor * value < 1000 else f"{10 * round(0.1 * factor * value):,d}"

        value, sigma = row["seen"]
        skills = [f"{row[f'skill_{name}']:+.2f}" if math.isfinite(row[f"skill_{name}"]) else "–" for name in names]
        what = ", ".join(filter(None, (row["what"], row["shown_in"])))
        cells = [
            what, forecast_files.range_words(row["forecast"], shown),
            f"{shown(value)} +- {shown(sigma)}", f"{row['pit']:.2f}", shown(row["crps"]), *skills,
        ]  # fmt: skip
        out.append(f"| {' | '.join(cells)} |")
    return "\n".join(out)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.hera_references", description="Make the reference forecasts, or score the known."
    )
    parser.add_argument("--out", type=Path, default=forecast.FOLDER)
    parser.add_argument("--trial", action="store_true", help="print what each known observable scores when left out")
    options = parser.parse_args()
    given = forecast.inputs()
    if options.trial:
        print(trial_table(trial(given)))
    else:
        write(options.out, NAME, references(given), WORDS, frozen=True)


if __name__ == "__main__":
    main()
