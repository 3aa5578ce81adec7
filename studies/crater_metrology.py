"""Crater metrology on synthetic craters with known answers: accuracy at 5 to 40 particles per radius, and coverage of
the error bars.

``python studies/crater_metrology.py [--json] [--trials N] [--across LOW,HIGH] [--out FOLDER]``; the generator
(fixtures/crater_trials.py) shares no code with crater/. ``--out`` writes ``trials.csv`` (every trial, as it is done:
the same command continues a stopped run), ``coverage.md`` (the tables) and ``coverage.png``.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import resource
import sys
import time
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from crater.drawing.figure import INK, figure, grid, save
from crater.measures.measure import Measures, measure
from fixtures import crater_trials as trials
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.geometry import frame
from matter.particles import Particles

NAMES = ("diameter_rim_m", "diameter_apparent_m", "depth_m", "rim_height_m", "volume_m3")
WORDS = dict(zip(NAMES, ("rim diameter", "apparent diameter", "depth", "rim height", "volume")))
FIRST_SEED = 90_000


def measured(trial: trials.Trial) -> Measures:
    """The trial measured with what is known of its datum."""
    particles = Particles(synthetic.as_fields(trial.position, trial.spacing))
    if trial.body is None:
        return measure(particles, "plane" if trial.datum == "free" else frame.Plane())
    if trial.datum == "given":
        return measure(particles, frame.Sphere(trial.body))
    centre = (0.0, 0.0, 0.0) if trial.datum == "centre" else None
    return measure(particles, "sphere", centre=centre, datum_radius=trial.body if trial.datum == "radius" else None)


def row_of(trial: trials.Trial) -> dict[str, object]:
    """What was drawn, and value, sigma and truth of every measure; empty where none was stated."""
    began = time.process_time()
    row: dict[str, object] = dict(trial.facts)
    try:
        found = measured(trial)
    except InputError as reason:
        return {**row, "seconds": time.process_time() - began, "reason": str(reason)}
    row["seconds"] = time.process_time() - began
    for name, true in trial.truth.items():
        quantity = found[name]
        row[f"{name}_true"] = true
        row[name] = quantity.value if quantity.value is not None else ""
        row[f"{name}_sigma"] = quantity.sigma if quantity.value is not None else ""
        for part in ("azimuth", "resolution", "datum", "method"):
            row[f"{name}_{part}"] = quantity.parts.get(part, 0.0)
    return row


def column(rows: list[dict], key: str) -> np.ndarray:
    """A column as numbers, NaN where empty."""
    return np.array([float(row[key]) if row.get(key, "") != "" else np.nan for row in rows])


def statistics(rows: list[dict], name: str) -> dict[str, float]:
    """Share stated, coverage of one and 1.96 sigma, relative rms error, median relative sigma and their ratio, bias,
    median |error|."""
    value, sigma, true = (column(rows, key) for key in (name, f"{name}_sigma", f"{name}_true"))
    stated = np.isfinite(value)
    error, relative = (value - true)[stated], ((value - true) / true)[stated]
    off = np.abs(error) / sigma[stated]
    rms, median = float(np.sqrt(np.mean(relative**2))), float(np.median((sigma / true)[stated]))
    return {
        "stated": float(stated.mean()),
        "within_1_sigma": float(np.mean(off < 1.0)),
        "within_2_sigma": float(np.mean(off < 1.96)),
        "rms": rms,
        "median_sigma": median,
        "sigma_over_rms": median / rms,
        "bias": float(np.median(relative)),
        "median_error": float(np.median(np.abs(relative))),
    }


def table(rows: list[dict], title: str) -> str:
    """Markdown table of all measures over some rows."""
    head = [
        "measure",
        "stated",
        "within 1 sigma",
        "within 1.96 sigma",
        "rms error",
        "median sigma",
        "sigma / rms",
        "median error, signed",
    ]
    lines = [f"**{title}** ({len(rows)} craters)", "", "| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for name in NAMES:
        s = statistics(rows, name)
        cells = [
            f"{s['stated']:.0%}",
            f"{s['within_1_sigma']:.1%}",
            f"{s['within_2_sigma']:.1%}",
            f"{s['rms']:.2%}",
            f"{s['median_sigma']:.2%}",
        ]
        lines.append(f"| {name} | " + " | ".join(cells + [f"{s['sigma_over_rms']:.2f}", f"{s['bias']:+.2%}"]) + " |")
    return "\n".join(lines)


BANDS = ((5, 8), (8, 12), (12, 20), (20, 40.1))
"""Particles per rim radius."""


def by_resolution(rows: list[dict]) -> list[tuple[str, list[dict]]]:
    """The trials of each of ``BANDS``, with its words."""
    return [
        (f"{low:g} to {high:.0f}", [r for r in rows if low <= float(r["per_radius"]) < high]) for low, high in BANDS
    ]


def draw_coverage(rows: list[dict], path: Path) -> None:
    """How many truths lie within two sigma of each measure, by resolution, with the binomial error of the count."""
    fig = figure(7.4, 3.6)
    axis = fig.add_subplot()
    axis.axhspan(92.0, 98.0, color=INK[4], alpha=0.15, label="what is asked")
    for k, name in enumerate(NAMES):
        at, found, error = [], [], []
        for j, (_, chosen) in enumerate(by_resolution(rows)):
            if chosen:
                fraction = statistics(chosen, name)["within_2_sigma"]
                at.append(j + 0.12 * (k - 2))
                found.append(100.0 * fraction)
                error.append(100.0 * np.sqrt(max(fraction * (1.0 - fraction), 0.01) / len(chosen)))
        axis.errorbar(at, found, error, fmt="o", markersize=5, color=INK[k], label=WORDS[name])
    axis.set_xticks(range(len(BANDS)), [f"{words}\n({len(chosen)})" for words, chosen in by_resolution(rows)])
    axis.set_xlabel("particles per rim radius (craters)")
    axis.set_ylabel("truths within two sigma [%]")
    axis.set_ylim(40.0, 103.0)
    grid(axis)
    fig.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    save(fig, path)


def tables(rows: list[dict]) -> str:
    """All rows, and the strata: resolution, sampling, body, what is known of the datum, family."""
    parts = [table(rows, "all")]
    groups = [(f"{words} particles per radius", chosen) for words, chosen in by_resolution(rows)]
    for key, word in (
        ("kind", "sampling"),
        ("datum", "known of the datum"),
        ("family", "profile"),
        ("body_km", "body radius [km], 0 a plane"),
    ):
        groups += [
            (f"{word}: {value}", [r for r in rows if str(r[key]) == value])
            for value in sorted({str(r[key]) for r in rows})
        ]
    return "\n\n".join(parts + [table(chosen, title) for title, chosen in groups if len(chosen) >= 8])


def _done(file: Path | None) -> list[dict]:
    if file is None or not file.is_file():
        return []
    with file.open() as stream:
        return list(csv.DictReader(stream))


def _write(file: Path, rows: list[dict]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    keys = list(dict.fromkeys(key for row in rows for key in row))
    partial = file.with_suffix(".part")
    with partial.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, keys, restval="")
        writer.writeheader()
        writer.writerows(rows)
    partial.replace(file)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", "--size", type=int, default=30)
    parser.add_argument("--across", default="5,40", help="bounds of the particles per radius")
    parser.add_argument("--seed", type=int, default=FIRST_SEED)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--threads", type=int, default=1, help="accepted for uniformity: the measure runs on one")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    low, high = (float(part) for part in asked.across.split(","))
    file = asked.out / "trials.csv" if asked.out else None
    rows = _done(file)
    known = {int(row["seed"]) for row in rows}
    for seed in range(asked.seed, asked.seed + asked.trials):
        if seed in known:
            continue
        rows.append(
            {
                key: f"{value:.6g}" if isinstance(value, float) else value
                for key, value in row_of(trials.random_trial(seed, (low, high))).items()
            }
        )
        if file is not None:
            _write(file, rows)
        print(
            f"{len(rows)}/{asked.trials} {rows[-1]['particles']} particles {rows[-1]['seconds']} s",
            file=sys.stderr,
            flush=True,
        )
    text = tables(rows)
    print(text)
    if asked.out:
        (asked.out / "coverage.md").write_text(text + "\n")
        draw_coverage(rows, asked.out / "coverage.png")
    if asked.json:
        content = {name: statistics(rows, name) for name in NAMES}
        content["peak_bytes"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        print(json.dumps(content))


if __name__ == "__main__":
    main()
