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
import math
import statistics
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from matter.errors import InputError, Stopped
from matter.files import archive
from matter.wording.crater_measures import RATIOS
from pipeline.case import stages
from pipeline.running import going_on, run_process
from pipeline.running.request import Request, settings_of
from pipeline.settings import identity
from pipeline.settings.compose import compose
from pipeline.store import folder, intact, view
from pipeline.uncertainty import sensitivity_table
from pipeline.uncertainty.sensitivity_table import DEEP, DEEPEST, STILL
from pipeline.uncertainty.variants import BED, CONTROLS, FOLDER, Variant, variants

FILE = "sensitivity.json"
_MINE = ("handoff", "dem", "crater")
DRAWS = 2
"""Beds on which each variant is made."""


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
        if only and not {variant.name, variant.name.partition(BED)[0]} & set(only):
            continue
        if is_done(variant, run):
            say(f"{variant.name}: done before")
            continue
        variant_folder = share_stages(run, variant.request(run), variant.shared_stages)
        say(f"{variant.name}: {', '.join(variant.overrides)} ({variant_folder.name})")
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


def share_stages(run: Path, request: Request, shared: Iterable[str]) -> Path:
    """Make the run folder of a request show the stages that another run has done for it, whatever has become of the
    code since. Raises ``InputError`` when they are of other settings than the request's."""
    variant_folder = request.run_folder
    variant_folder.mkdir(parents=True, exist_ok=True)
    settings = settings_of(request)
    for stage in shared:
        if stage not in request.case.stages:
            continue
        if stages.folder(run, stage).exists():
            view.show(variant_folder, stage, stages.folder(run, stage))
        who = identity.stage_identity(
            stage, settings.get(stage), request.case.outside.get(stage), partial(stages.folder, variant_folder)
        )
        if not folder.is_done(stages.folder(variant_folder, stage), who.inputs):
            raise InputError(
                f"the stage {stage} of {run} is not done with the settings of its case.used.toml: run the case again, "
                f"then its sensitivity"
            )
    return variant_folder


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
    by_variant = (
        {name: _measured(place_of(every[name], run)) for name in every if name in done and name not in CONTROLS}
        if "base" in done
        else {}
    )
    rows: dict[str, dict[str, Any]] = {}
    for name, row in by_variant.items():
        if BED in name:
            continue
        pairs = [(row, by_variant["base"])] + [
            (by_variant[other], by_variant[_base_of(other)])
            for other in _draws_of(name, by_variant)
            if _base_of(other) in by_variant
        ]
        for key in (*RATIOS, DEEPEST):
            changes = [change for one, base in pairs if (change := _change(one.get(key), base.get(key))) is not None]
            row[f"{key}_change"] = (
                sum(changes) / len(changes)
                if changes and _change(row.get(key), by_variant["base"].get(key)) is not None
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
    on_other_beds = {name: row for name, row in by_variant.items() if BED in name}
    controls = {name: _control(every[name].request(run).run_folder) for name in CONTROLS if name in done}
    missing = [name for name in every if name not in done]
    return {
        "rows": rows,
        "other_beds": on_other_beds,
        "controls": controls,
        "missing": missing,
        "allowed_rms_m": _allowed(run),
    }


def _draws_of(name: str, rows: dict[str, Any]) -> list[str]:
    """The same variant on other beds."""
    return [other for other in rows if other.startswith(f"{name}{BED}")]


def _base_of(name: str) -> str:
    """The base on the bed of a draw."""
    number = name.partition(BED)[2]
    return "another_bed" if number == "2" else f"another_bed_{number}"


def _measured(variant_folder: Path) -> dict[str, Any]:
    measures = archive.read_json(stages.folder(variant_folder, "crater") / "measures.json")
    record = folder.record(stages.folder(variant_folder, "handoff") / "handoff.json")
    final = measures.get("final") or {}
    row: dict[str, Any] = {key: (final.get(key) or {}).get("value") for key in RATIOS}
    row |= {f"{key}_sigma": (final.get(key) or {}).get("sigma") for key in RATIOS}
    row |= {
        "time_s": record.get("time_s"),
        "speed_limit_m_s": record.get("speed_limit_m_s"),
        "alpha_spacings": record.get("alpha_spacings"),
    }
    row[DEEPEST] = _deepest(stages.folder(variant_folder, "crater") / "time_series.csv")
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
    from crater.comparison import difference
    from crater.ground import radial_profile

    try:
        first, second = (
            radial_profile.read_csv(stages.folder(variant_folder, "crater") / "profile.csv")
            for variant_folder in (one, other)
        )
        return float(difference.profile_difference(first, second)["rms_m"])
    except InputError:
        return None


def _allowed(run: Path) -> float:
    """The larger of 5 % of the transient depth and half a grain radius [m]: what profiles may differ by where no rim
    is left."""
    from matter.files import snapshot

    measures = folder.record(stages.folder(run, "crater") / "measures.json")
    depth = ((measures.get("transient") or {}).get("depth_m") or {}).get("value")
    start = snapshot.read(stages.folder(run, "handoff") / f"start{snapshot.SUFFIX}")
    return max(0.05 * (depth or 0.0), 0.5 * float(start.radius.mean()))


def _control(variant_folder: Path) -> dict[str, Any]:
    """Drift of the grains of a control run in mean radii, and its mechanical energy against the start."""
    import numpy as np

    from handoff.transfer import control
    from matter.files import snapshot

    start = snapshot.read(stages.folder(variant_folder, "handoff") / f"start{snapshot.SUFFIX}")
    last = snapshot.read(stages.folder(variant_folder, "dem") / f"last{snapshot.SUFFIX}")
    radius = float(start.radius.mean())
    way = control.moved(start, last) / radius
    deep = control.depth_below_surface(start) > DEEP * radius
    with open(stages.folder(variant_folder, "dem") / "history.csv", newline="") as file:
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


def run(
    folder_of_run: Path, only: Iterable[str] | None = None, threads: int | None = None, draws: int = DRAWS
) -> None:
    """Make the variants, compare, write ``sensitivity.json`` and the ledger's rows, print the table. Raises as
    ``make``."""
    from handoff import ledger as ledgers

    make(folder_of_run, only, threads, say=lambda words: print(words, flush=True), draws=draws)
    comparison = compare(folder_of_run, draws)
    with view.owned(Path(folder_of_run), "handoff") as out:
        archive.write_json(out / FILE, comparison)
        book = ledgers.read(out / "ledger.json")
        sensitivity_table.enter(comparison, book)
        book.write(out / "ledger.json")
        intact.renew(out, "ledger.json")
    print("\n" + sensitivity_table.text(comparison) + "\n")
