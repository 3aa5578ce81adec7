"""The command ``run_case``: its options, and what it does with them. Heavy imports wait until it really starts."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from pipeline.commands.command import guarded
from pipeline.commands.run_options import Disk, Film, Many, Reference, Run, Which


def run_case(which: Which, run: Run, film: Film, reference: Reference, many: Many, disk: Disk) -> None:
    """Run or resume the stages nbody sph bed handoff dem crater of a case.

    The same command continues after any kind of stop.
    """
    guarded(lambda: _done(which, run, film, reference, many, disk))


def _done(which: Which, run: Run, film: Film, reference: Reference, many: Many, disk: Disk) -> int:
    """Do what the options ask for; the exit code."""
    if reference.describe or reference.names or reference.schema:
        return _told(which.case, reference)
    if disk.copy:
        return _copied(disk.copy, which.case)
    if disk.prune:
        return _pruned(which.case, run.folder, disk.budget, run.check)
    from matter.files import archive
    from matter.wording import drawing
    from pipeline.running import going_on

    if film.movie or film.movie_field:  # said before the run, not after it
        drawing.require("a movie")
    archive.check_folder(run.folder)
    if run.threads is not None and "numba" not in sys.modules:
        os.environ["NUMBA_NUM_THREADS"] = str(run.threads)
    preset = _single("--preset", which.preset)
    read = going_on.read(Path(_needed(which.case)), preset, which.overrides or (), run.out, which.size)
    if many.invert:
        return _inverted(read, run, many)
    if many.errors:
        return _with_errors(read, run, many)
    if many.sweep or many.vary or many.status or many.emit or many.forecast or many.ensemble is not None:
        return _swept(read, run, many)
    if many.scheduler:
        from matter.errors import InputError

        raise InputError("--scheduler goes with --sweep, --vary, --forecast or --ensemble")
    return _one_run(read, run, film, disk.budget, which.size)


def _inverted(read: Any, run: Run, many: Many) -> int:
    """From an observed crater to what made it."""
    from pipeline.commands import invert_command

    others = [
        (many.sweep or many.vary or many.status, "options of a sweep"),
        (many.forecast, "--forecast"),
        (many.errors, "--errors"),
        (many.ensemble is not None, "--ensemble"),
        (many.emit, "--emit"),
        (run.start or run.fresh, "--from and --fresh"),
    ]
    return invert_command.inverted(read, run.folder, others, run.check)


def _with_errors(read: Any, run: Run, many: Many) -> int:
    """Measure the errors of a case by further runs."""
    from pipeline.commands import error_command

    others = [
        (many.sweep or many.vary, "a sweep"),
        (many.forecast, "--forecast"),
        (many.ensemble is not None, "--ensemble"),
        (many.emit, "--emit"),
        (run.until, "--until"),
    ]
    return error_command.with_errors(read, run.folder, run.threads, run.check, many.status, others)


def _swept(read: Any, run: Run, many: Many) -> int:
    """Run, show or write down the members of a sweep."""
    from pipeline.commands import sweep_command

    instead = [(run.check, "--check"), (many.status, "--status"), (many.emit, "--emit")]
    return sweep_command.swept(
        read, run.folder, many.vary or [], many.ensemble, run.until, run.threads, instead,
        run.start or run.fresh, many.scheduler, many.forecast,
    )  # fmt: skip


def _one_run(read: Any, given: Run, film: Film, budget: str | None, size: str | None) -> int:
    """Check, verify, or run and resume one case."""
    from matter.cadence import Pace, set_pace
    from pipeline.running import plan
    from pipeline.running import prune as pruning
    from pipeline.running.request import Request, sensible, settings_of
    from pipeline.running.run import run
    from pipeline.running.screen import screen
    from pipeline.sweeps.sweep import check as check_sweep

    check_sweep(read.sweep)
    if given.checkpoint_every:
        set_pace(Pace.from_text(given.checkpoint_every))
    request = Request(read, given.folder, given.start, given.until, given.fresh, given.threads)
    if budget:
        request = _fitted(request, pruning.size_of(budget), size)
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
    if film.movie or film.movie_field:
        _draw_movie(outcome.run, film.movie_field or "material")
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


def _told(topic: str | None, reference: Reference) -> int:
    """What is known about case files: their keys, the names that they may take, their schema."""
    if reference.describe:
        from pipeline.commands import key_reference

        print(key_reference.describe(topic))
    if reference.names:
        from pipeline.commands import listing

        print(listing.listing(topic))
    if file := reference.schema:
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
