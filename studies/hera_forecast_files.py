"""The files of a forecast of ``studies.hera_forecast``: its table (TOML), its draws (HDF5), its picture and the table
of its page. The same inputs give the same bytes; a file that is there and differs is never written over."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr

from pipeline.uncertainty import forecast_files
from pipeline.uncertainty.forecast_files import LEVELS, number, table_of
from studies import hera_forecast as forecast
from studies import hera_forecast_picture

SHOWN = {
    "mass": ("mass, 1e9 kg", 1e-9, 2), "density": ("bulk density, kg/m3", 0.1, 0),
    "volume": ("volume, 1e6 m3", 1e-6, 2), "beta_normal": ("beta along the normal", 1.0, 2),
    "beta_track": ("beta along the track", 1.0, 2), "beta_ejecta": ("beta of Cheng et al.", 1.0, 2),
    "mass_left": ("mass that left, 1e7 kg", 1e-7, 1), "a_over_b": ("a/b", 1.0, 2), "a_over_c": ("a/c", 1.0, 2),
    "hollow": ("width of the hollow, m", 1.0, 0), "deepest": ("deepest change, m", 1.0, 0),
    "resurfaced": ("resurfaced fraction", 1.0, 2), "plane_turned": ("orbit's plane turned, deg", 1.0, 1),
}  # fmt: skip
"""Of the page: words, factor, digits (of the density the last is left out)."""


class Row(NamedTuple):
    """A quantity of the forecast; ``known``: what ``all_known`` was conditioned on, so that it forecasts nothing."""

    name: str
    unit: str
    words: str
    frame: str
    basis: str
    why: str
    known: bool = False


OWN_SEED = "the case's own, one draw a run"
BODY, SITE, ORBIT = "body", "surface of before, normal of the ellipsoid", "mutual orbit"
ROWS = (
    Row("mass", "kg", "mass of Dimorphos when Hera arrives", BODY, "scaled from runs",
        "mass = density x volume; weighted by M dv . t = p c_t (1 + kappa (beta_n - 1)), solved for the observed dv"),
    Row("density", "kg/m^3", "bulk density: mass over volume, voids included", BODY, "scaled from runs",
        "prior of the column x likelihood of the observed change of speed"),
    Row("volume", "m^3", "volume inside the surface when Hera arrives", BODY, "estimate",
        "volume of before less what left at bulk density; no dilation or compaction of the body counted"),
    Row("beta_normal", "1", "dP . n / p . n: momentum that stays over what came, along the outward normal n", SITE,
        "scaled from runs", "quick run at 2,400 kg/m^3 x porosity, friction, cohesion, spacecraft, blocks, numerics"),
    Row("beta_track", "1", "dP . t / p . t along the track t of Dimorphos before the impact", ORBIT,
        "scaled from runs", "1 + kappa (beta_n - 1), kappa 1.105 +- 0.05 of the runs"),
    Row("beta_ejecta", "1", "beta of Cheng et al. (2023), eq. 1, along the momentum of the ejecta: what teams quote",
        ORBIT, "scaled from runs",
        "from beta_track by his (E . U)(E . t) = 0.928, of his pair 3.61 at 2,400 kg/m^3, 2.70 mm/s, 1.81e6 m^3"),
    Row("mass_left", "kg", "mass beyond Dimorphos' Hill sphere after two hours; what came back later is not taken off",
        BODY, "scaled from runs",
        "3.40e7 kg (density/2400)^-1.18 x second hour, handoff, friction, spacecraft, cohesion", True),
    Row("a_over_b", "1", "longest over middle axis of the even ellipsoid of equal inertia", BODY, "scaled from runs",
        "before + 0.086 (width of the hollow/109.6 m)^3.62", True),
    Row("a_over_c", "1", "longest over shortest axis of the even ellipsoid of equal inertia", BODY, "scaled from runs",
        "before -0.015 +- 0.04", True),
    Row("hollow", "m", "width of the hollow at the site: of the circle of the area that lies below the surface of "
        "before", SITE, "scaled from runs", "109.6 m (density/2400)^-0.463 x friction, spacecraft, cohesion, 12 %"),
    Row("deepest", "m", "deepest change of height along the normal", SITE, "estimate",
        "30.3 m at 107 m width (2,400 kg/m^3 alone); grows with the width to a power between 0 and 1"),
    Row("resurfaced", "1", "fraction of the surface that moved, was removed or buried", SITE, "scaled from runs",
        "0.18 (density/2400)^-1.22 x (width over that of the density)^2 x 1.15, 35 %"),
    Row("plane_turned", "deg", "angle between the planes of the mutual orbit before and after", ORBIT, "estimate",
        "arctan(p_out / (M 0.177 m/s)); p_out with chance 0.75 (0.6 to 3.6) p x (0.5 to 1), else below 0.18 p"),
    Row("dv_track", "m/s", "drop of the speed along the track by the impact alone, without change of shape", ORBIT,
        "condition", "observed: 2.65 +- 0.07 mm/s less what the change of shape gives; no forecast"),
)  # fmt: skip
CLASS_WORDS = {
    "crater": "a closed edge all round the hollow at the site, which takes at most 14.6 % of the surface "
    "(some 118 m wide on this body), and a change of height not spread over more than that",
    "reshaped": "a hollow that takes more of the surface, or has no edge all round, or a change of height spread over "
    "more than 14.6 % of it; or no hollow, but an axis changed beyond its error or more than 5 % resurfaced",
    "neither": "the project's classes 'not resolved' and 'no hollow' together: no hollow deeper than the noise of the "
    "ground, no change of axes beyond its error",
}


def conditioned(row: Row) -> list[str]:
    """The columns in which a quantity is a condition and no forecast."""
    return list(forecast.COLUMNS) if row.basis == "condition" else ["all_known"] if row.known else []


def trials(given: Mapping[str, Any]) -> list[tuple[str, str, float, float, float, float, float]]:
    """What is known already, each left out: what, the column without it, 2.5, 50, 97.5 %, observed, and where that
    lies in the forecast convolved with its error (PIT: 0.5 is the middle)."""
    made, seen = forecast.samples(given), given["observed"]
    left = seen["mass_left"]
    ferrari = 0.5 * np.log(left["low_kg"] * left["high_kg"]), left["sigma_ln"]
    delta_v = 1e3 * made["dv_observable"]
    asked = (
        ("change of speed along the track, mm/s", "makadia without it", delta_v, "makadia", "dv_track",
         (seen["dv_track"]["value_mm_s"], seen["dv_track"]["sigma_mm_s"]), np.asarray),
        ("density by Makadia et al. 2026, kg/m^3", "flat", made["density"], "flat", "",
         seen["makadia"]["density_kg_m3"], np.asarray),
        ("a/b by Naidu et al. 2024", "makadia", made["a_over_b"], "makadia", "",
         seen["shape"]["a_over_b"], np.asarray),
        ("a/c by Naidu et al. 2024", "makadia", made["a_over_c"], "makadia", "",
         seen["shape"]["a_over_c"], np.asarray),
        ("mass that left by Ferrari et al. 2025, kg", "makadia", np.log(made["mass_left"]), "makadia", "", ferrari,
         np.exp),
    )  # fmt: skip
    found = []
    for words, column, x, name, without, (value, sigma), shown in asked:
        weight = forecast.weights(made, given, name, without)
        chosen = forecast.resampled({"x": x}, weight, given["draws"], 0.5)["x"]
        low, middle, high = shown(np.quantile(chosen.astype(float), (0.025, 0.5, 0.975)))
        pit = float(weight @ ndtr((value - x) / sigma) / weight.sum())
        found.append((words, column, low, middle, high, float(shown(value)), pit))
    return found


def text(given: Mapping[str, Any], made: Mapping[str, forecast.Samples], worth: Mapping[str, float]) -> str:
    """The forecast as TOML."""
    inputs = forecast.FOLDER / f"{given['name']}_inputs.toml"
    out = [
        "# What ESA's Hera should find at Dimorphos after DART, written down before it looked. Never edited: a later",
        f"# version is a new file. Made by python -m studies.hera_forecast from {inputs.name}.",
        "",
        f'name = "{given["name"]}"',
        f"frozen = {given['frozen']}",
        f'model = "{given["model"]}"',
        f'runs_commit = "{given["runs_commit"]}"',
        f"runs_seed = {json.dumps(given.get('runs_seed', OWN_SEED))}",
        f'inputs_sha256 = "{hashlib.sha256(inputs.read_bytes()).hexdigest()}"',
        f"seed = {given['seed']}",
        f"prior_samples = {given['prior_samples']}",
        f"draws = {given['draws']}",
        f"levels = [{', '.join(map(str, LEVELS))}]",
        'headline = "makadia"',
        "",
        "[definitions]",
        'units = "SI; angles in degrees where said"',
        'epoch = "Dimorphos as Hera finds it on arrival (end of 2026); before: just before 2022-09-26T23:14:24 UTC"',
        'body = "Dimorphos. a >= b >= c: full axes of the even ellipsoid with its mass and moments of inertia"',
        "surface = \"heights along the outward normal against the ellipsoid of before, 177 x 174 x 116 m; if Hera's "
        'team has a better shape of before, against that. The body is stood against it by the half that moved least"',
        'site = "latitude -8.84, east longitude 264.3 deg; n the outward normal of the ellipsoid there"',
        'orbit = "track t: along the velocity of Dimorphos about Didymos just before the impact"',
        'momentum = "p = m |U| = 3.560e6 kg m/s; dP what stays in Dimorphos, the projectile\'s own included"',
        'classes = "crater/bodies/classes.py: if Hera\'s team words it otherwise, both readings are scored"',
        'scoring = "CRPS, interval score and PIT of each quantity against the draws, convolved with the error of what '
        'is observed; Brier and log score of classes; energy score of mass, a/b, a/c, width"',
        "",
        "[columns]",
        'makadia = "HEADLINE. Density prior 0.7 N(1540, 220) of Makadia et al. 2026 + 0.3 N(2400, 300), the older '
        "assumption; weighted by the observed change of speed. It is the headline because it uses all that is "
        "published about the mass and nothing of what Hera sees of the shape; Makadia's mass comes from the Sun's "
        'orbit and shares only the change of speed (4 %) with ours"',
        'flat = "Density prior flat from 900 to 3300; weighted by the observed change of speed: what our beta alone '
        'says, a test of it"',
        'all_known = "makadia, weighted by the shape (Naidu et al. 2024) and the ejected mass (Ferrari et al. 2025) '
        'as well: mass_left, a_over_b and a_over_c are conditions there and no forecast"',
        "",
        "[conditions]",
        'makadia = ["density (Makadia et al. 2026)", "change of speed along the track, 2.65 +- 0.07 mm/s"]',
        'flat = ["change of speed along the track, 2.65 +- 0.07 mm/s"]',
        'all_known = ["density (Makadia et al. 2026)", "change of speed along the track, 2.65 +- 0.07 mm/s", '
        '"a/b 1.3 +- 0.1", "a/c 1.6 +- 0.1", "mass that left, ln-normal 2.46e7 kg, 0.57"]',
        'never_forecast = ["change of speed along the track", "period of the mutual orbit"]',
        "",
        "[independent_samples]",
        *(f"{column} = {round(worth[column])}" for column in forecast.COLUMNS),
        "",
        *(_ensemble(given) if "members" in given else _few_runs(given)),
    ]
    why = given.get("derivation", {})
    for row in ROWS:
        about: dict[str, Any] = {
            "name": row.name, "unit": row.unit, "definition": row.words, "frame": row.frame, "basis": row.basis,
            "derivation": why.get(row.name, row.why), "condition_in": conditioned(row),
        }  # fmt: skip
        out += forecast_files.quantity(about, {column: made[column][row.name] for column in forecast.COLUMNS})
    out += ["", "[class]", 'basis = "scaled from runs, with estimates: factors edge and neither"']
    out += [f'{name} = "{words}"' for name, words in CLASS_WORDS.items()]
    for column in forecast.COLUMNS:
        found = [float((made[column]["class"] == k).mean()) for k in range(len(forecast.CLASSES))]
        out.append(f"p_{column} = {table_of(dict(zip(forecast.CLASSES, found)))}")
    out += ["", "[rotation]", 'excited = "tumbling, or libration in longitude of more than 10 deg, on arrival"',
            'basis = "estimate: factor excited"']  # fmt: skip
    out += [f"p_{column} = {number(float(made[column]['excited'].mean()))}" for column in forecast.COLUMNS]
    out += ["", "[odds]"]
    for column in forecast.COLUMNS:
        one = made[column]
        odds = {
            "density_below_2000": (one["density"] < 2000).mean(),
            "density_below_1500": (one["density"] < 1500).mean(),
            "a_over_b_above_1_2": (one["a_over_b"] > 1.2).mean(),
            "plane_above_0_2_deg": (one["plane_turned"] > 0.2).mean(),
        }  # fmt: skip
        out.append(f"{column} = {table_of({name: float(value) for name, value in odds.items()})}")
    for words, column, low, middle, high, value, pit in trials(given):
        out += ["", "[[left_out]]", f'what = "{words}"', f'column = "{column}"',
                f"forecast = [{number(low)}, {number(middle)}, {number(high)}]", f"observed = {number(value)}",
                f"pit = {number(pit)}"]  # fmt: skip
    return "\n".join(out) + "\n"


def _few_runs(given: Mapping[str, Any]) -> list[str]:
    """The runs of a forecast that stands on few, and what was fitted to them."""
    out = [
        "# powers and constants fitted to the runs of hera_v0_inputs.toml",
        "[fits]",
        *(f"{name} = {number(value)}" for name, value in forecast.fits(given).items()),
        "",
        "# the runs, as they stand in hera_v0_inputs.toml with their commands; value, error of counting",
    ]
    for run in given["run"] + given["run_2400"]:
        out += ["", "[[run]]", *(f"{name} = {json.dumps(value)}" for name, value in run.items())]
    return out


def _ensemble(given: Mapping[str, Any]) -> list[str]:
    """The members of a forecast that stands on an ensemble, and how well their processes predict one left out."""
    from studies import hera_ensemble

    file = forecast.FOLDER / given["members"]
    found, by = hera_ensemble.fitted(file)
    counts = {word: found.classes.count(word) for word in sorted(set(found.classes)) if word}
    out = [
        "# members of the ensemble that are done, and the classes of those that ran the whole chain",
        "[ensemble]",
        f"members_sha256 = {json.dumps(hashlib.sha256(file.read_bytes()).hexdigest())}",
        f"done = {len(found.x)}",
        f"whole_chain = {sum(map(bool, found.classes))}",
        f"failed = {found.failed}",
        f"classes = {table_of(counts)}",
        "",
        "# a Gaussian process each: rms of ln y of a member that the others predict, and how many lie in their 95 %",
    ]
    for name, process in by.items():
        for stage, left in zip(("shock", "chain") if len(process.parts) > 1 else ("chain",), process.left_out):
            inside = float(np.mean(np.abs(left.z) < 1.96))
            out += ["", "[[process]]", f'measure = "{name}"', f'part = "{stage}"', f"members = {len(left.truth)}",
                    f"left_out_rms = {number(left.rms)}", f"left_out_inside_95 = {number(inside)}"]  # fmt: skip
    return out


def arrays(made: Mapping[str, forecast.Samples]) -> dict[str, Any]:
    """The draws by the paths of the file; ``class`` and ``excited`` as small integers."""
    found: dict[str, Any] = {}
    for column in forecast.COLUMNS:
        for row in ROWS:
            found[f"{column}/{row.name}"] = (made[column][row.name], row.unit, row.words)
        found[f"{column}/class"] = (made[column]["class"].astype(np.uint8), "1", ", ".join(forecast.CLASSES))
        excited = made[column]["excited"].astype(np.uint8)
        found[f"{column}/excited"] = (excited, "1", "1: tumbling, or libration of more than 10 deg")
    return found


def write(given: Mapping[str, Any], out: Path) -> None:
    """Write table, draws and picture into ``out``. Raises ``InputError`` where a file is there and differs."""
    made, worth = forecast.draws(given)
    name = given["name"]
    attributes = {"name": name, "frozen": str(given["frozen"]), "seed": given["seed"], "headline": "makadia"}
    forecast_files.write(out, name, text(given, made, worth), arrays(made), attributes, frozen=True)
    hera_forecast_picture.picture(made, out / f"{name}.png")


def shown(name: str, value: float) -> str:
    """A value as the page shows it."""
    _, factor, digits = SHOWN[name]
    return f"{10 * round(value * factor):,d}" if name == "density" else f"{value * factor:.{digits}f}"


def table(content: Mapping[str, Any]) -> str:
    """The table of the page, from the frozen file: median (68 %; 95 %)."""
    rows = ["| | **headline** | our beta alone (flat) | all that is known | |", "|---|---|---|---|---|"]
    for found in content["quantity"]:
        if found["basis"] == "condition":
            continue
        cells = []
        for column in forecast.COLUMNS:
            cell = forecast_files.range_words(found[column], lambda value, name=found["name"]: shown(name, value))
            if column == "makadia":
                cell = f"**{cell.replace(' (', '** (', 1)}"
            cells.append("a condition" if column in found["condition_in"] else cell)
        basis = found["basis"].removeprefix("scaled from ")
        rows.append(f"| {SHOWN[found['name']][0]} | {' | '.join(cells)} | {basis} |")
    for kind in forecast.CLASSES:
        odds = [f"{content['class'][f'p_{column}'][kind]:.2f}" for column in forecast.COLUMNS]
        rows.append(f"| P({kind}) | **{odds[0]}** | {odds[1]} | {odds[2]} | runs, estimate |")
    odds = [f"{content['rotation'][f'p_{column}']:.2f}" for column in forecast.COLUMNS]
    rows.append(f"| P(tumbling, or libration above 10 deg) | **{odds[0]}** | {odds[1]} | {odds[2]} | estimate |")
    return "\n".join(rows)
