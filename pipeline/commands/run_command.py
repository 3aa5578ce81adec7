"""The command ``run_case``: its options, and what it does with them. Heavy imports wait until it really starts."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any, NamedTuple

from pipeline.commands import run_options as options
from pipeline.commands.command import guarded

RUNS = Path("runs")


class Given(NamedTuple):
    """What a user gave of the options."""

    case: str | None
    preset: list[str] | None
    size: str | None
    overrides: list[str] | None
    out: Path | None
    start: str | None
    until: str | None
    threads: int | None
    check: bool
    verify: bool
    anyway: bool
    checkpoint_every: str | None
    fresh: bool
    movie: bool
    movie_field: str | None
    describe: bool
    names: bool
    schema: Path | None
    sweep: bool
    vary: list[str] | None
    ensemble: int | None
    errors: bool
    forecast: bool
    invert: bool
    scheduler: str | None
    status: bool
    emit: str | None
    copy: str | None
    prune: bool
    budget: str | None

    @property
    def folder(self) -> Path:
        """Where run folders are made."""
        return self.out or RUNS


def run_case(
    case: options.Case = None,
    preset: options.Preset = None,
    size: options.Size = None,
    overrides: options.Overrides = None,
    out: options.Out = None,
    start: options.Start = None,
    until: options.Until = None,
    threads: options.Threads = None,
    check: options.Check = False,
    verify: options.Verify = False,
    anyway: options.Anyway = False,
    checkpoint_every: options.CheckpointEvery = None,
    fresh: options.Fresh = False,
    movie: options.Movie = False,
    movie_field: options.MovieField = None,
    describe: options.Describe = False,
    names: options.Names = False,
    schema: options.Schema = None,
    sweep: options.Sweep = False,
    vary: options.Vary = None,
    ensemble: options.Ensemble = None,
    errors: options.Errors = False,
    forecast: options.Forecast = False,
    invert: options.Invert = False,
    scheduler: options.Scheduler = None,
    status: options.Status = False,
    emit: options.Emit = None,
    copy: options.Copy = None,
    prune: options.Prune = False,
    budget: options.Budget = None,
) -> None:
    """Run or resume the stages nbody sph bed handoff dem crater of a case.

    The same command continues after any kind of stop.
    """
    given = Given(**locals())
    guarded(lambda: _done(given))


def _done(given: Given) -> int:
    """Do what the options ask for; the exit code."""
    if given.describe or given.names or given.schema:
        return _told(given.case, given.describe, given.names, given.schema)
    if given.copy:
        return _copied(given.copy, given.case)
    if given.prune:
        return _pruned(given.case, given.folder, given.budget, given.check)
    from matter.files import archive
    from matter.wording import drawing
    from pipeline.running import going_on

    if given.movie or given.movie_field:  # said before the run, not after it
        drawing.require("a movie")
    archive.check_folder(given.folder)
    if given.threads is not None and "numba" not in sys.modules:
        os.environ["NUMBA_NUM_THREADS"] = str(given.threads)
    preset = _single("--preset", given.preset)
    read = going_on.read(Path(_needed(given.case)), preset, given.overrides or (), given.out, given.size)
    if given.invert:
        return _inverted(read, given)
    if given.errors:
        return _with_errors(read, given)
    if given.sweep or given.vary or given.status or given.emit or given.forecast or given.ensemble is not None:
        return _swept(read, given)
    return _one_run(read, given)


def _inverted(read: Any, given: Given) -> int:
    """From an observed crater to what made it."""
    from pipeline.commands import invert_command

    others = [
        (given.sweep or given.vary or given.status, "options of a sweep"),
        (given.forecast, "--forecast"),
        (given.errors, "--errors"),
        (given.ensemble is not None, "--ensemble"),
        (given.emit, "--emit"),
        (given.start or given.fresh, "--from and --fresh"),
    ]
    return invert_command.inverted(read, given.folder, others, given.check)


def _with_errors(read: Any, given: Given) -> int:
    """Measure the errors of a case by further runs."""
    from pipeline.commands import error_command

    others = [
        (given.sweep or given.vary, "a sweep"),
        (given.forecast, "--forecast"),
        (given.ensemble is not None, "--ensemble"),
        (given.emit, "--emit"),
        (given.until, "--until"),
    ]
    return error_command.with_errors(read, given.folder, given.threads, given.check, given.status, others)


def _swept(read: Any, given: Given) -> int:
    """Run, show or write down the members of a sweep."""
    from pipeline.commands import sweep_command

    instead = [(given.check, "--check"), (given.status, "--status"), (given.emit, "--emit")]
    return sweep_command.swept(
        read, given.folder, given.vary or [], given.ensemble, given.until, given.threads, instead,
        given.start or given.fresh, given.scheduler, given.forecast,
    )  # fmt: skip


def _one_run(read: Any, given: Given) -> int:
    """Check, verify, or run and resume one case."""
    from matter.cadence import Pace, set_pace
    from matter.errors import InputError
    from pipeline.running import plan
    from pipeline.running import prune as pruning
    from pipeline.running.request import Request, sensible, settings_of
    from pipeline.running.run import run
    from pipeline.running.screen import screen
    from pipeline.sweeps.sweep import check as check_sweep

    check_sweep(read.sweep)
    if given.checkpoint_every:
        set_pace(Pace.from_text(given.checkpoint_every))
    if given.scheduler:
        raise InputError("--scheduler goes with --sweep, --vary, --forecast or --ensemble")
    request = Request(read, given.folder, given.start, given.until, given.fresh, given.threads)
    if given.budget:
        request = _fitted(request, pruning.size_of(given.budget), given.size)
    if given.check:
        return _checked(request, settings_of(request))
    if given.verify:
        return _verified(request)
    if not given.anyway:
        settings = settings_of(request)
        sensible(request, settings)
        plan.refuse_too_large(request, settings)
    display = screen()
    try:
        outcome = run(request, display)
    finally:
        display.close()
    if given.movie or given.movie_field:
        _draw_movie(outcome.run, given.movie_field or "material")
    return _concluded(request.case, outcome)


def _needed(case: str | None) -> str:
    from matter.errors import InputError

    if case is None:
        raise InputError(
            "a case is missing: run_case CASE, with the folder of a case or of a run (run_case --list names cases, "
            "--help explains)"
        )
    return case


def _single(option: str, given: list[str] | None) -> str | None:
    from matter.errors import InputError

    if given and len(given) > 1:
        raise InputError(f"{option} was given {len(given)} times ({', '.join(given)}): a case takes one")
    return given[0] if given else None


def _told(topic: str | None, describe: bool, names: bool, file: Path | None) -> int:
    """What is known about case files: their keys, the names that they may take, their schema."""
    if describe:
        from pipeline.commands import key_reference

        print(key_reference.describe(topic))
    if names:
        from pipeline.commands import listing

        print(listing.listing(topic))
    if file:
        from pipeline.commands import schema

        schema.write(file)
        print(f"schema of case files: {file} (first line of a case for taplo: #:schema {file})")
    return 0


def _copied(name: str, to: str | None) -> int:
    from matter.errors import InputError
    from pipeline.case import shipped

    if to is None:
        raise InputError(f"a folder is missing: run_case --copy {name} FOLDER")
    print(f"{shipped.copy(name, Path(to))}: run_case {to} runs it")
    return 0


def _fitted(request: Any, budget: float, size: str | None) -> Any:
    """The request with snapshots so far apart that it fits into the ``budget`` [bytes]."""
    from dataclasses import replace

    from pipeline.running import disk_budget, going_on

    case = request.case

    def read(more: tuple[str, ...]) -> Any:
        if not more:
            return case
        return going_on.read(case.file, case.preset, (*case.overrides, *more), None, size)

    fitting, words = disk_budget.fitted(read, lambda other: replace(request, case=other), budget)
    if words:
        print(f"--budget: {words}")
    return replace(request, case=fitting)


def _pruned(name: str | None, out: Path, budget: str | None, only_say: bool) -> int:
    from pipeline.running import prune as pruning

    entries = pruning.held(out)
    going = pruning.chosen(entries, [name] if name else [], pruning.size_of(budget) if budget else None)
    print(pruning.table(entries, going), flush=True)
    if not only_say:
        for one in pruning.remove(out, going):
            print(f"{one} is in use by a run: it stays")
    return 0


def _draw_movie(run: Path, field: str) -> None:
    from crater.drawing import movie
    from matter.wording import drawing
    from pipeline.store import view

    name = "movie" if field == "material" else f"movie_{field}"
    paths = [run / "6_crater" / f"{name}{ending}" for ending in movie.movie_formats()]
    note = "" if len(paths) > 1 else f" (for an .mp4: {drawing.INSTALL})"
    with view.owned(run, "crater"):
        print(f"{movie.write(run, paths, colour=field)} frames: {', '.join(map(str, paths))}{note}")


def _checked(request: Any, settings: Any) -> int:
    from pipeline.running import plan, prediction
    from pipeline.running.request import sensible
    from pipeline.settings import other_presets

    warnings = sensible(request, settings)
    case = request.case
    named = f", preset {case.preset}" if case.preset else f", size {case.size}" if case.size else ""
    print(f"{case.file}: {case.title}{named}\nrun folder: {request.run_folder}")
    if not request.case.pinned:
        print("speed and angle will come from the encounters; the predictions use placeholders")
    if words := prediction.words(request, settings):
        print(words)
    print(prediction.table(request, prediction.predictions(request, settings), plan.plan(request, settings)))
    for text in [*warnings, *other_presets.faults(request.case)]:
        print(f"WARNING: {text}")
    return 0


def _verified(request: Any) -> int:
    from pipeline.running import verify

    verdicts = verify.verify(request, lambda text: print(text, flush=True))
    return 1 if any(one.differ for one in verdicts) else 0


def _concluded(case: Any, outcome: Any) -> int:
    from pipeline.running import result
    from pipeline.settings import expected

    for stage, reason in outcome.unsound.items():
        print(f"UNSOUND {stage}: {reason.removeprefix(f'{stage}: ')}")
    table = "\n".join(part for part in (result.table(outcome.run), expected.text(case, outcome.run)) if part)
    print(f"\n{table}\n\nresult: {outcome.run}" if table else f"result: {outcome.run}", flush=True)
    return 1 if outcome.unsound else 0
