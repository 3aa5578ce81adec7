"""The commands. Help texts need neither numba nor VTK: what is heavy is imported when a command really starts.

What frames them all (exit codes, errors, versions) is ``pipeline.command``.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from pipeline import command
from pipeline.command import guarded, point, quantity, watched
from pipeline.completion import paths, presets, stage_names

RUNS = Path("runs")


def _run_case(
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
            help="Aim at 20,000, 300,000 or 1,400,000 particles and grains, in place of the case's own resolution.",
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
            help="Remove stages that no run shows from the store of --out (CASE: the name of one; --check: only say "
            "which).",
        ),
    ] = False,
    budget: Annotated[
        str | None,
        typer.Option(
            metavar="SIZE", help="With --prune: only the oldest, until the store takes at most this, '20 GB'."
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
        if prune or budget:
            return _pruned(case, out or RUNS, prune, budget, check)
        from matter import archive
        from matter.errors import InputError
        from pipeline import going_on
        from pipeline.run import Request, run, settings_of
        from pipeline.screen import screen

        archive.check_folder(out or RUNS)
        if threads is not None and "numba" not in sys.modules:
            os.environ["NUMBA_NUM_THREADS"] = str(threads)
        read = going_on.read(Path(_needed(case)), _single("--preset", preset), overrides or (), out, size)
        if sweep or vary or status or emit or ensemble is not None:
            from pipeline import sweep_command

            instead = [(check, "--check"), (status, "--status"), (emit, "--emit")]
            return sweep_command.swept(
                read, out or RUNS, vary or [], ensemble, until, threads, instead, start or fresh, scheduler
            )
        if scheduler:
            raise InputError("--scheduler goes with --sweep, --vary or --ensemble")
        request = Request(read, out or RUNS, start, until, fresh, threads)
        if check:
            return _checked(request, settings_of(request))
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
        from pipeline import key_reference

        print(key_reference.describe(topic))
    if names:
        from pipeline import listing

        print(listing.listing(topic))
    if file:
        from pipeline import schema

        schema.write(file)
        print(f"schema of case files: {file} (first line of a case for taplo: #:schema {file})")
    return 0


def _copied(name: str, to: str | None) -> int:
    from matter.errors import InputError
    from pipeline import shipped

    if to is None:
        raise InputError(f"a folder is missing: run_case --copy {name} FOLDER")
    print(f"{shipped.copy(name, Path(to))}: run_case {to} runs it")
    return 0


def _pruned(name: str | None, out: Path, prune: bool, budget: str | None, only_say: bool) -> int:
    from matter.errors import InputError
    from pipeline import prune as pruning

    if not prune:
        raise InputError("--budget goes with --prune")
    found = pruning.held(out)
    going = pruning.chosen(found, [name] if name else [], pruning.size_of(budget) if budget else None)
    print(pruning.table(found, going), flush=True)
    if not only_say:
        for one in pruning.remove(out, going):
            print(f"{one} is being made: it stays")
    return 0


def _draw_movie(run: Path, field: str) -> None:
    from crater import movie
    from pipeline import view

    name = "movie" if field == "material" else f"movie_{field}"
    paths = [run / "6_crater" / f"{name}{ending}" for ending in movie.endings()]
    view.own(run, "crater").mkdir(exist_ok=True)
    note = "" if len(paths) > 1 else " (for an .mp4: pip install imageio-ffmpeg)"
    print(f"{movie.write(run, paths, colour=field)} frames: {', '.join(map(str, paths))}{note}")


def _checked(request: Any, settings: Any) -> int:
    from pipeline import other_presets, plan, prediction
    from pipeline.run import sensible

    warnings = sensible(request, settings)
    named = (
        f", preset {request.case.preset}"
        if request.case.preset
        else f", size {request.case.size}"
        if request.case.size
        else ""
    )
    print(f"{request.case.file}: {request.case.title}{named}\nrun folder: {request.run_folder}")
    if not request.case.pinned:
        print("speed and angle will come from the encounters; the predictions use placeholders")
    if words := prediction.words(request, settings):
        print(words)
    print(prediction.table(request, prediction.predictions(request, settings), plan.plan(request, settings)))
    for text in [*warnings, *other_presets.faults(request.case)]:
        print(f"WARNING: {text}")
    return 0


def _concluded(case: Any, outcome: Any) -> int:
    from pipeline import expected, result

    for stage, reason in outcome.unsound.items():
        print(f"UNSOUND {stage}: {reason.removeprefix(f'{stage}: ')}")
    table = "\n".join(part for part in (result.table(outcome.run), expected.text(case, outcome.run)) if part)
    print(f"\n{table}\n\nresult: {outcome.run}" if table else f"result: {outcome.run}", flush=True)
    return 1 if outcome.unsound else 0


def _inspect_handoff(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="Draw the pictures of the report.")
    ] = True,
    sensitivity: Annotated[
        bool,
        typer.Option(
            "--sensitivity",
            help="Run variants of the handoff (time, speed limit, alpha, bed) and control runs; resumable.",
        ),
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="NAME", help="With --sensitivity: only this variant (repeatable)."),
    ] = None,
    draws: Annotated[
        int | None, typer.Option(min=1, help="With --sensitivity: beds on which each variant is made (default: 2).")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="With --sensitivity: threads of each run.")] = None,
) -> None:
    """Print the ledger of a handoff: what went in, what came out, each limit and its verdict."""

    def action() -> int:
        from handoff import report
        from matter.errors import InputError
        from pipeline import view

        for option, given in (("--only", only), ("--draws", draws), ("--threads", threads)):
            if given and not sensitivity:
                raise InputError(f"{option} goes with --sensitivity")
        place = run.parent if run.name == "4_handoff" else run  # either is understood
        if sensitivity:
            from pipeline import sensitivity as runs

            runs.run(place, only, threads, draws or runs.DRAWS)
        view.own(place, "handoff")
        return report.print_ledger(place, pictures)

    guarded(action)


def _compare_profiles(
    items: Annotated[
        list[str], typer.Argument(metavar="A B [C ...]", help="Run folders, profile.csv files, observed names.")
    ],
    observed: Annotated[str | None, typer.Option(help="An observed crater to compare with.")] = None,
    out: Annotated[Path | None, typer.Option(help="Where the picture goes.")] = None,
    stage: Annotated[
        str | None,
        typer.Option(
            metavar="transient|final",
            help="Which crater of every run (default: that of the kind that it is compared with).",
        ),
    ] = None,
) -> None:
    """Compare craters, like with like: diameters, depths, RMS difference, one picture."""

    def action() -> int:
        from crater import compare

        return compare.compare(items, observed=observed, out=out, stage=stage)

    guarded(action)


def _measure_crater(
    snapshot: Annotated[Path, typer.Argument(metavar="SNAPSHOT", help="A snapshot of SPH particles or grains.")],
    datum: Annotated[str | None, typer.Option(help="plane or sphere (default: what the snapshot says).")] = None,
    datum_radius: Annotated[
        str | None, typer.Option(help="Radius of the datum sphere, '2142 km' for example.")
    ] = None,
    centre: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Centre of the datum sphere [m].")] = None,
    out: Annotated[Path | None, typer.Option(help="Where profile and pictures go.")] = None,
) -> None:
    """Measure the crater in one snapshot."""

    def action() -> int:
        from crater import stage

        return stage.measure_snapshot(
            snapshot,
            datum=datum,
            datum_radius=None if datum_radius is None else quantity(datum_radius, "m", "--datum-radius"),
            centre=point(centre, "--centre"),
            out=out,
        )

    guarded(action)


def _impact_census(
    target: Annotated[str, typer.Option(help="The body that is hit.")] = "callisto",
    population: Annotated[str, typer.Option(help="literal, corrected, isotropic, or a file.")] = "literal",
    integrator: Annotated[str, typer.Option(help="rkck, fast or tube.")] = "fast",
    count: Annotated[int, typer.Option(min=1, help="How many encounters.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Where tables and plots go.")] = None,
) -> None:
    """N-body impact statistics as tables and plots."""

    def action() -> int:
        from nbody import census

        return watched("census", lambda: census.census(target, population, integrator, count, seed, out))

    guarded(action)


def _import_snapshot(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Another code's output.")],
    out: Annotated[Path, typer.Option(help="The snapshot to write (.vtkhdf).")],
    form: Annotated[
        str | None, typer.Option("--format", metavar="NAME", help="Default: from the file's name.")
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            help="Text: 'x,y,z,vx,vy,vz,m,rho'. HDF5: 'position=A/B [km],m=A/C'. miluphcuda's text: "
            "'INTEGRATE_ENERGY,SOLID'."
        ),
    ] = None,
    materials: Annotated[
        str | None,
        typer.Option(
            help="Names of the materials by number, 'ice,water,basalt'; one name where the file has no numbers."
        ),
    ] = None,
    origin: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Where the target's centre (or a point of flat ground) is [m].")
    ] = None,
    up: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Direction from there to the impact point.")] = None,
    time: Annotated[
        str | None, typer.Option(help="Time after the impact, '120 s', where the file does not say it.")
    ] = None,
) -> None:
    """Write another code's output as a snapshot of this project."""

    def action() -> int:
        from matter import archive, formats
        from matter.formats import placing

        archive.check_file(out)
        particles = formats.read(file, form, columns=columns, materials=materials)
        if origin or up:
            centre, axis = point(origin, "--origin") or (0.0, 0.0, 0.0), point(up, "--up") or (0.0, 0.0, 1.0)
            particles = placing.placed(particles, centre, axis)
        if time:
            particles.attributes["time"] = quantity(time, "s", "--time")
        formats.save(particles, out)
        print(f"{out}: {len(particles)} particles, {', '.join(particles)}")
        for stage, missing in formats.lacking(particles).items():
            print(f"  cannot be used by {stage}: missing {', '.join(missing)}")
        for sentence in formats.plausible.strangers(particles):
            print(f"  {sentence}")
        return 0

    guarded(action)


def _export_snapshot(
    snapshot: Annotated[
        Path, typer.Argument(metavar="SNAPSHOT", help="A snapshot, or any file that import_snapshot reads.")
    ],
    out: Annotated[Path, typer.Option(help="The file to write: .data or .lmp (LAMMPS), .liggghts, .vtk, .ply, .csv.")],
    form: Annotated[
        str | None,
        typer.Option(
            "--format", metavar="NAME", help="lammps, liggghts, vtk, ply or csv; default: from the file's name."
        ),
    ] = None,
) -> None:
    """Write a snapshot for another program."""

    def action() -> int:
        from matter import archive, formats

        archive.check_file(out)
        particles = formats.read(snapshot)
        written = formats.export(particles, out, form)
        print(f"{out}: {len(particles)} particles as {written}")
        return 0

    guarded(action)


def run_case() -> None:
    """Console script."""
    command.start(_run_case)


def inspect_handoff() -> None:
    """Console script."""
    command.start(_inspect_handoff)


def compare_profiles() -> None:
    """Console script."""
    command.start(_compare_profiles)


def measure_crater() -> None:
    """Console script."""
    command.start(_measure_crater)


def impact_census() -> None:
    """Console script."""
    command.start(_impact_census)


def import_snapshot() -> None:
    """Console script."""
    command.start(_import_snapshot)


def export_snapshot() -> None:
    """Console script."""
    command.start(_export_snapshot)
