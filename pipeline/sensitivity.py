"""How much the final crater depends on how it was handed over: variants of a finished run, each from the handoff on,
and two control runs.

``RUN/sensitivity/`` holds the run folders of the variants; the stages before the handoff are those of the run, so that
only the handoff (for another bed, the bed too), the collapse and the measuring are made. What is done is not made
again: the same command continues after any stop. Results: ``RUN/4_handoff/sensitivity.json``, the rows of the ledger
that need further runs, and a table in the report.

Times are those of the run x0.5 and x2, speed limits x0.5 and x2, alpha x0.67 and x1.5; every variant changes one of
them and keeps the run's own values of the others, the time included. Each is made with ``draws`` beds and compared
with the run handed over onto the same bed: the mean of the changes and its error tell an effect from the luck of one
bed. Controls: the carved bed without motion, the bed carved at the datum (``handoff.control``).
"""

from __future__ import annotations

import csv
import json
import math
import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from matter import archive
from matter.crater_measures import BY_NAME, RATIOS, UNITS
from matter.errors import InputError, Stopped
from pipeline import case as cases
from pipeline import folder, going_on, identity, run_process, stages, view
from pipeline.compose import compose
from pipeline.run import Request, settings_of

FOLDER, FILE = "sensitivity", "sensitivity.json"
DEEP, STILL = 5.0, 0.1
"""The carved bed at rest: grains deeper than ``DEEP`` radii below the carved surface shall move less than ``STILL``
radii."""
_MINE = ("handoff", "dem", "crater")
_ROWS = {  # ledger row -> measure, variants
    "final_D_change_on_t_handoff_x2": ("D", ("time_x0.5", "time_x2")),
    "final_d_change_on_t_handoff_x2": ("d", ("time_x0.5", "time_x2")),
    "final_D_change_on_vcut_x2": ("D", ("speed_limit_x0.5", "speed_limit_x2")),
    "final_D_change_on_alpha_x1.5": ("D", ("alpha_x0.67", "alpha_x1.5")),
}
_DEEPEST = "dem_depth_most_m"
_COLUMNS = {**{name: f"{BY_NAME[name].symbol} [m]" for name in RATIOS if UNITS[name] == "m"}, _DEEPEST: "deepest [m]"}
CONTROLS = ("control_at_rest", "control_uncarved")
DRAWS = 2
"""Beds on which each variant is made."""
_BED = "@bed"


@dataclass(frozen=True)
class Variant:
    """One change of the handoff of a run: ``overrides`` are texts of ``--set``; ``shares`` are the stages that the run
    has done for it."""

    name: str
    overrides: tuple[str, ...]
    shares: tuple[str, ...] = ("nbody", "sph", "bed")

    @property
    def of(self) -> str:
        """The variant that this is a draw of: itself on the run's own bed."""
        return "base" if self.name.startswith("another_bed") else self.name.partition(_BED)[0]

    def request(self, run: Path) -> Request:
        """The request that makes it. Raises ``InputError``."""
        return Request(going_on.read(run / "case.used.toml", None, self.overrides), run / FOLDER, start=None)


def variants(run: Path, draws: int = 1) -> list[Variant]:
    """The variants and controls of a finished run, each on ``draws`` beds, the run's own first. Raises ``InputError``
    when the run has no handoff or no ``case.used.toml``."""
    record = folder.record(stages.folder(run, "handoff") / "handoff.json")
    if not record or not (run / "case.used.toml").is_file():
        raise InputError(f"{run} is not a finished run: no handoff.json or no case.used.toml")
    seed = cases.read(run / "case.used.toml").document.get("bed", {}).get("seed", 1)
    time, limit, alpha = record["time_s"], record["speed_limit_m_s"], record["alpha_spacings"]

    def fixed(**changed: float) -> tuple[str, ...]:
        values = {"time": time, "speed_limit": limit, "alpha": alpha} | changed
        return (
            f'handoff.time="{values["time"]!r} s"',
            f'handoff.speed_limit="{values["speed_limit"]!r} m/s"',
            f"handoff.alpha={values['alpha']!r}",
        )

    found = [Variant("base", fixed())]
    found += [Variant(f"time_x{factor:g}", fixed(time=factor * time)) for factor in (0.5, 2.0)]
    found += [Variant(f"speed_limit_x{factor:g}", fixed(speed_limit=factor * limit)) for factor in (0.5, 2.0)]
    found += [Variant(f"alpha_x{factor:g}", fixed(alpha=factor * alpha)) for factor in (0.67, 1.5)]
    others = []
    for k in range(2, max(draws, 2) + 1):
        for one in found if k <= draws else found[:1]:
            name = ("another_bed" if k == 2 else f"another_bed_{k}") if one.name == "base" else f"{one.name}{_BED}{k}"
            others.append(Variant(name, (*one.overrides, f"bed.seed={seed + k - 1}"), shares=("nbody", "sph")))
    found += others
    return found + [
        Variant(f"control_{kind}", (*fixed(), f'handoff.control="{kind}"')) for kind in ("at_rest", "uncarved")
    ]


def make(
    run: Path, only: Iterable[str] | None = None, threads: int | None = None, say=print, draws: int = 1
) -> list[str]:
    """Run the variants (those named in ``only``, with their draws), one after another; the names of those that could
    not be made.

    A variant that ends unsound is kept and compared; one that cannot be handed over (a time before there is a crater
    ...) is named, and the others go on. Raises ``InputError`` for an unknown name, ``Stopped`` when one was stopped on
    request.
    """
    run, failed = Path(run).resolve(), []
    every = variants(run, draws)
    unknown = set(only or ()) - {variant.name for variant in every}
    if unknown:
        raise InputError(
            f"no variant {', '.join(sorted(unknown))} (known: {', '.join(variant.name for variant in every)})"
        )
    for variant in every:
        if only and not {variant.name, variant.name.partition(_BED)[0]} & set(only):
            continue
        if is_done(variant, run):
            say(f"{variant.name}: done before")
            continue
        place = share(run, variant.request(run), variant.shares)
        say(f"{variant.name}: {', '.join(variant.overrides)} ({place.name})")
        # the crater is not measured where there is none to measure
        until = ["--until", "dem"] if variant.name in CONTROLS else []
        arguments = [str(run / "case.used.toml"), "--out", str(run / FOLDER), *until]
        arguments += [part for text in variant.overrides for part in ("--set", text)] + (
            ["--threads", str(threads)] if threads else []
        )
        code = run_process.as_process(arguments)
        if code == run_process.STOPPED:
            raise Stopped(f"stopped in {variant.name}; the same command continues")
        if not is_done(variant, run):
            failed.append(variant.name)
            say(f"{variant.name}: could not be made (exit code {code})")
    return failed


def share(run: Path, request: Request, shared: Iterable[str]) -> Path:
    """Make the run folder of a request show the stages that another run has done for it, whatever has become of the
    code since. Raises ``InputError`` when they are of other settings than the request's."""
    place = request.run_folder
    place.mkdir(parents=True, exist_ok=True)
    settings = settings_of(request)
    for stage in shared:
        if stages.folder(run, stage).exists():
            view.show(place, stage, stages.folder(run, stage))
        who = identity.of(stage, settings.get(stage), request.case.outside.get(stage), partial(stages.folder, place))
        if not folder.is_done(stages.folder(place, stage), who.inputs):
            raise InputError(
                f"the stage {stage} of {run} is not done with the settings of its case.used.toml: run the case again, "
                f"then its sensitivity"
            )
    return place


def place_of(variant: Variant, run: Path) -> Path:
    """The folder of a variant: its own, and for the base the run's where its last stages were made by the sources of
    today."""
    return run if variant.name == "base" and _by_today(run) else variant.request(run).run_folder


def _by_today(run: Path) -> bool:
    settings = compose(going_on.read(run))
    done = {stage: folder.record(stages.folder(run, stage) / folder.DONE).get("sources_sha256") for stage in _MINE}
    return all(
        stage in settings and made_by == identity.sources_of(stage, settings[stage]) for stage, made_by in done.items()
    )


def is_done(variant: Variant, run: Path) -> bool:
    """Whether a variant's last stage is done."""
    last = "dem" if variant.name in CONTROLS else "crater"
    return (stages.folder(place_of(variant, run), last) / folder.DONE).is_file()


def compare(run: Path, draws: int = 1) -> dict[str, Any]:
    """What the variants that are done came to: final diameter and depth with their change against the base (mean over
    the beds on which both are done, and its standard error where there are two or more), difference of the profiles,
    the deepest crater of the grains, the control runs. Without the base there is nothing to compare the variants with,
    and no row of theirs."""
    run = Path(run).resolve()
    every = {variant.name: variant for variant in variants(run, draws)}
    done = {name for name, variant in every.items() if is_done(variant, run)}
    found = (
        {name: _measured(place_of(every[name], run)) for name in every if name in done and name not in CONTROLS}
        if "base" in done
        else {}
    )
    rows: dict[str, dict[str, Any]] = {}
    for name, row in found.items():
        if _BED in name:
            continue
        pairs = [(row, found["base"])] + [
            (found[other], found[_base_of(other)]) for other in _draws_of(name, found) if _base_of(other) in found
        ]
        for key in (*RATIOS, _DEEPEST):
            changes = [change for one, base in pairs if (change := _change(one.get(key), base.get(key))) is not None]
            row[f"{key}_change"] = (
                sum(changes) / len(changes)
                if changes and _change(row.get(key), found["base"].get(key)) is not None
                else None
            )
            row[f"{key}_change_error"] = (
                statistics.stdev(changes) / math.sqrt(len(changes)) if len(changes) > 1 else None
            )
        row["beds"] = len(pairs)
        row["profile_rms_m"] = (
            0.0 if name == "base" else _profile_rms(place_of(every["base"], run), place_of(every[name], run))
        )
        rows[name] = row
    on_other_beds = {name: row for name, row in found.items() if _BED in name}
    controls = {name: _control(every[name].request(run).run_folder) for name in CONTROLS if name in done}
    missing = [name for name in every if name not in done]
    return {
        "rows": rows,
        "other_beds": on_other_beds,
        "controls": controls,
        "missing": missing,
        "allowed_rms_m": _allowed(run),
    }


def _draws_of(name: str, found: dict[str, Any]) -> list[str]:
    """The same variant on other beds."""
    return [other for other in found if other.startswith(f"{name}{_BED}")]


def _base_of(name: str) -> str:
    """The base on the bed of a draw."""
    number = name.partition(_BED)[2]
    return "another_bed" if number == "2" else f"another_bed_{number}"


def _measured(place: Path) -> dict[str, Any]:
    measures = archive.read_json(stages.folder(place, "crater") / "measures.json")
    record = folder.record(stages.folder(place, "handoff") / "handoff.json")
    final = measures.get("final") or {}
    row: dict[str, Any] = {key: (final.get(key) or {}).get("value") for key in RATIOS}
    row |= {f"{key}_sigma": (final.get(key) or {}).get("sigma") for key in RATIOS}
    row |= {
        "time_s": record.get("time_s"),
        "speed_limit_m_s": record.get("speed_limit_m_s"),
        "alpha_spacings": record.get("alpha_spacings"),
    }
    row[_DEEPEST] = _deepest(stages.folder(place, "crater") / "time_series.csv")
    return row


def _deepest(path: Path) -> float | None:
    """Greatest depth [m] among the snapshots of the grains."""
    if not path.is_file():
        return None
    with open(path, newline="") as file:
        depths = [float(row["depth_m"]) for row in csv.DictReader(file) if row["stage"] == "dem" and row["depth_m"]]
    return max(depths, default=None)


def _change(value: float | None, base: float | None) -> float | None:
    return value / base - 1.0 if value is not None and base else None


def _profile_rms(one: Path, other: Path) -> float | None:
    from crater import difference, radial_profile

    try:
        first, second = (
            radial_profile.read_csv(stages.folder(place, "crater") / "profile.csv") for place in (one, other)
        )
        return float(difference.profile_difference(first, second)["rms_m"])
    except InputError:
        return None


def _allowed(run: Path) -> float:
    """The larger of 5 % of the transient depth and half a grain radius [m]: what profiles may differ by where no rim
    is left."""
    from matter import snapshot

    measures = folder.record(stages.folder(run, "crater") / "measures.json")
    depth = ((measures.get("transient") or {}).get("depth_m") or {}).get("value")
    start = snapshot.read(stages.folder(run, "handoff") / f"start{snapshot.SUFFIX}")
    return max(0.05 * (depth or 0.0), 0.5 * float(start.radius.mean()))


def _control(place: Path) -> dict[str, Any]:
    """Drift of the grains of a control run in mean radii, and its mechanical energy against the start."""
    import numpy as np

    from handoff import control
    from matter import snapshot

    start = snapshot.read(stages.folder(place, "handoff") / f"start{snapshot.SUFFIX}")
    last = snapshot.read(stages.folder(place, "dem") / f"last{snapshot.SUFFIX}")
    radius = float(start.radius.mean())
    way = control.moved(start, last) / radius
    deep = control.depth_below_surface(start) > DEEP * radius
    with open(stages.folder(place, "dem") / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    energy = np.array(
        [[float(row[name]) for name in ("kinetic_J", "rotational_J", "gravitational_J", "elastic_J")] for row in rows]
    ).sum(axis=1)
    moving = max(float(row["kinetic_J"]) for row in rows)
    return {
        "grains": len(start),
        "drift_most_over_r": float(np.nanmax(way)),
        "drift_mean_over_r": float(np.nanmean(way)),
        "deep_grains": int(deep.sum()),
        "deep_drift_most_over_r": float(np.nanmax(way[deep])) if deep.any() else None,
        "deep_beyond": int(np.count_nonzero(way[deep] >= STILL)),
        "lost": int(np.isnan(way).sum()),
        "energy_rise_J": float(energy.max() - energy[0]),
        "energy_rise_rel": float((energy.max() - energy[0]) / abs(energy[0])),
        "kinetic_most_J": moving,
        "from_s": float(rows[0]["time_s"]),
        "to_s": float(rows[-1]["time_s"]),
    }


def enter(found: dict[str, Any], book) -> None:
    """Fill the rows of a ledger that need further runs; a change counts as the larger of the two that its variants
    show."""
    rows = found["rows"]
    for name, (measure, wanted) in _ROWS.items():
        there = [rows[variant] for variant in wanted if variant in rows]
        if not there:
            continue
        missing = [variant for variant in wanted if variant not in rows]
        key = (
            "depth_m"
            if measure == "d"
            else next((k for k in RATIOS[:2] if all(row[f"{k}_change"] is not None for row in there)), None)
        )
        changes = [row[f"{key}_change"] for row in there] if key else []
        said = ", ".join(f"{variant} {_with_error(rows[variant], key)}" for variant in wanted if variant in rows)
        cut = f"; not made: {', '.join(missing)}" if missing else ""
        if key and all(change is not None for change in changes):
            book.amend(name, max(abs(change) for change in changes), f"{key}: {said}{cut}")
        elif all(row["profile_rms_m"] is not None for row in there):
            worst = max(row["profile_rms_m"] for row in there)
            book.amend(
                name,
                worst,
                f"no crater left to measure: RMS difference of the profiles{cut}",
                limit=found["allowed_rms_m"],
                unit="m",
            )
        else:
            book.amend(name, None, f"no final crater could be measured in {' or '.join(wanted)}")
    if (still := found["controls"].get("control_uncarved")) is not None:
        note = (
            f"bed carved at the datum, {still['from_s']:.4g} to {still['to_s']:.4g} s: {still['grains']} grains, mean "
            f"{still['drift_mean_over_r']:.2g} r"
        )
        book.amend("control_no_impact_run_drift_over_r", still["drift_most_over_r"], note)


def _percent(change: float | None) -> str:
    return "--" if change is None or not math.isfinite(change) else f"{100.0 * change:+.1f} %"


def _with_error(row: dict[str, Any], key: str | None) -> str:
    """A change with its error over the beds, where there are several."""
    error = row.get(f"{key}_change_error")
    return _percent(row.get(f"{key}_change")) + (
        f" (+- {100.0 * error:.1f} % over {row['beds']} beds)" if error is not None else ""
    )


def text(found: dict[str, Any]) -> str:
    """The comparison as a table for a terminal."""
    head = (
        f"{'variant':<18}{'t [s]':>9}{'v limit':>9}{'alpha':>7}"
        + "".join(f"{title:>16}{'change':>9}{'+-':>7}" for title in _COLUMNS.values())
        + f"{'RMS [m]':>10}"
    )
    lines = [head]
    for name, row in found["rows"].items():
        cells = "".join(
            f"{_shown(row[key]):>16}{_percent(row[f'{key}_change']):>9}{_error(row, key):>7}" for key in _COLUMNS
        )
        given = f"{row['time_s']:>9.4g}{row['speed_limit_m_s']:>9.4g}{row['alpha_spacings']:>7.3g}"
        lines.append(f"{name:<18}{given}{cells}{_shown(row['profile_rms_m']):>10}")
    for name, row in found["controls"].items():
        lines.append(
            f"{name}: {row['grains']} grains, {row['from_s']:.4g} to {row['to_s']:.4g} s: largest displacement "
            f"{row['drift_most_over_r']:.3g} r (mean "
            f"{row['drift_mean_over_r']:.2g} r); {row['deep_grains']} deeper than {DEEP:g} r: "
            f"{_shown(row['deep_drift_most_over_r'])} r, {row['deep_beyond']} "
            f"beyond {STILL:g} r; energy rose by {row['energy_rise_rel']:.1e} of its size (history.csv resolves 1e-10)"
        )
    if found["missing"]:
        lines.append(f"not made: {', '.join(found['missing'])}")
    return "\n".join(lines)


def _error(row: dict[str, Any], key: str) -> str:
    error = row.get(f"{key}_change_error")
    return "" if error is None else f"{100.0 * error:.1f}"


def _shown(value: float | None) -> str:
    return "--" if value is None else f"{value:.4g}"


def run(
    folder_of_run: Path, only: Iterable[str] | None = None, threads: int | None = None, draws: int = DRAWS
) -> None:
    """Make the variants, compare, write ``sensitivity.json`` and the ledger's rows, print the table. Raises as
    ``make``."""
    from handoff import ledger as ledgers

    make(folder_of_run, only, threads, say=lambda words: print(words, flush=True), draws=draws)
    found = compare(folder_of_run, draws)
    out = view.own(Path(folder_of_run), "handoff")
    archive.write_text(out / FILE, json.dumps(found, indent=1))
    book = ledgers.read(out / "ledger.json")
    enter(found, book)
    book.write(out / "ledger.json")
    print("\n" + text(found) + "\n")
