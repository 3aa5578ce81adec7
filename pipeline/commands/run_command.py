"""The command ``run_case``: its options, and what it does with them. Heavy imports wait until it really starts."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from pipeline.commands.command import guarded
from pipeline.commands.completion import paths, presets, stage_names

RUNS = Path("runs")


def run_case(
    case: Annotated[
        str | None,
        typer.Argument(
            metavar="CASE",
            help="A folder with case.toml, or the file; the name of a shipped case; or the folder of a run, to "
            "continue it.",
            autocompletion=paths,
        ),
    ] = None,
    preset: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Apply [preset.NAME] of the case.", autocompletion=presets)
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="quick|standard|fine",
            help="Aim at 20,000, 300,000 or 1,400,000 particles and grains, instead of the case's own resolution.",
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Change one value (repeatable).")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where run folders are made (default: runs).")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="STAGE", help="Recompute this stage and everything after it.", autocompletion=stage_names
        ),
    ] = None,
    until: Annotated[
        str | None, typer.Option("--until", metavar="STAGE", help="Stop after this stage.", autocompletion=stage_names)
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads (default: all cores).")] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Validate the case and predict time, memory and disk; run nothing.")
    ] = False,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Compute a stretch of every finished stage again, from its last checkpoint, and compare every bit.",
        ),
    ] = False,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Start even if the prediction exceeds available memory or disk.")
    ] = False,
    checkpoint_every: Annotated[
        str | None,
        typer.Option(
            "--checkpoint-every",
            metavar="TEXT",
            help="Wall-clock time between checkpoints, '2 min' (default: 15 s, longer where they are large), or a "
            "count, '500 steps'.",
        ),
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Delete earlier results and checkpoints first.")] = False,
    movie: Annotated[
        bool,
        typer.Option(
            "--movie", help="Then make 6_crater/movie.gif and .mp4 (if the run is finished, only the movie is made)."
        ),
    ] = False,
    movie_field: Annotated[
        str | None,
        typer.Option(
            "--movie-field",
            metavar="NAME",
            help="Colour the movie by material (default), damage, pressure, origin or speed.",
        ),
    ] = None,
    describe: Annotated[
        bool,
        typer.Option(
            "--describe", help="Explain every key of a case file, or those of one table: run_case --describe sph.late."
        ),
    ] = False,
    names: Annotated[
        bool,
        typer.Option(
            "--list", help="List cases, materials, observed craters and laws, or one kind: run_case --list materials."
        ),
    ] = False,
    schema: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the JSON schema of case files, for editors.")
    ] = None,
    sweep: Annotated[
        bool,
        typer.Option(
            "--sweep", help="Run every member of [sweep] of the case, side by side, and end in a table and a page."
        ),
    ] = False,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY.PATH=A,B,C", help="Vary a key (repeatable): a sweep over these values, '...=15,40,65 deg'."
        ),
    ] = None,
    ensemble: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Run N draws of particles and grains; their spread becomes the error of the first."
        ),
    ] = None,
    errors: Annotated[
        bool,
        typer.Option(
            "--errors",
            help="Measure the errors of the result by some ten further runs: random seeds, resolution, time and alpha "
            "of the handoff (--check: what they cost).",
        ),
    ] = False,
    forecast: Annotated[
        bool,
        typer.Option(
            "--forecast",
            help="Run [sweep] kind = 'prior' and write what it forecasts: quantiles, chances, draws, SHA-256, a page.",
        ),
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Run a sweep on workers of dask.distributed: tcp://host:port, or local for workers on this machine.",
        ),
    ] = None,
    status: Annotated[
        bool, typer.Option("--status", help="Say where every member of a sweep stands; run nothing.")
    ] = False,
    emit: Annotated[
        str | None,
        typer.Option(
            metavar="slurm-array|snakemake",
            help="Write the job files of a sweep for a cluster into its folder; run nothing.",
        ),
    ] = None,
    copy: Annotated[
        str | None, typer.Option(metavar="NAME", help="Copy a shipped case into the folder CASE, to change it.")
    ] = None,
    prune: Annotated[
        bool,
        typer.Option(
            "--prune",
            help="Delete cached stages that no run uses from the store of --out (CASE: the name of one; --check: only "
            "say which).",
        ),
    ] = False,
    budget: Annotated[
        str | None,
        typer.Option(
            metavar="SIZE",
            help="Disk that a run may take, '5 GB': snapshots lie further apart where it would take more. With "
            "--prune: only the oldest go, until the store takes at most this.",
        ),
    ] = None,
) -> None:
    """Run or resume the stages nbody sph bed handoff dem crater of a case.

    The same command continues after any kind of stop.
    """

    def action() -> int:
        if describe or names or schema:
            return _told(case, describe, names, schema)
        if copy:
            return _copied(copy, case)
        if prune:
            return _pruned(case, out or RUNS, budget, check)
        from matter.cadence import Pace, set_pace
        from matter.errors import InputError
        from matter.files import archive
        from matter.wording import drawing
        from pipeline.running import going_on, plan
        from pipeline.running import prune as pruning
        from pipeline.running.request import Request, sensible, settings_of
        from pipeline.running.run import run
        from pipeline.running.screen import screen
        from pipeline.sweeps.sweep import check as check_sweep

        if movie or movie_field:  # said before the run, not after it
            drawing.require("a movie")
        archive.check_folder(out or RUNS)
        if threads is not None and "numba" not in sys.modules:
            os.environ["NUMBA_NUM_THREADS"] = str(threads)
        read = going_on.read(Path(_needed(case)), _single("--preset", preset), overrides or (), out, size)
        if errors:
            from pipeline.commands import error_command

            others = [
                (sweep or vary, "a sweep"),
                (forecast, "--forecast"),
                (ensemble is not None, "--ensemble"),
                (emit, "--emit"),
            ]
            return error_command.with_errors(read, out or RUNS, threads, check, status, [*others, (until, "--until")])
        if sweep or vary or status or emit or forecast or ensemble is not None:
            from pipeline.commands import sweep_command

            instead = [(check, "--check"), (status, "--status"), (emit, "--emit")]
            return sweep_command.swept(
                read, out or RUNS, vary or [], ensemble, until, threads, instead, start or fresh, scheduler, forecast
            )
        check_sweep(read.sweep)
        if checkpoint_every:
            set_pace(Pace.from_text(checkpoint_every))
        if scheduler:
            raise InputError("--scheduler goes with --sweep, --vary, --forecast or --ensemble")
        request = Request(read, out or RUNS, start, until, fresh, threads)
        if budget:
            request = _fitted(request, pruning.size_of(budget), size)
        if check:
            return _checked(request, settings_of(request))
        if verify:
            return _verified(request)
        if not anyway:
            settings = settings_of(request)
            sensible(request, settings)
            plan.refuse_too_large(request, settings)
        display = screen()
        try:
            outcome = run(request, display)
        finally:
            display.close()
        if movie or movie_field:
            _draw_movie(outcome.run, movie_field or "material")
        return _concluded(request.case, outcome)

    guarded(action)


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
