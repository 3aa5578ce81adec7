"""The options of ``run_case``, an object for each group of them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from pipeline.commands.completion import paths, presets, stage_names

RUNS = Path("runs")


@dataclass(frozen=True)
class Which:
    """Which case, and what of it is changed."""

    case: Annotated[
        str | None,
        typer.Argument(
            metavar="CASE",
            help="A folder with case.toml, or the file; the name of a shipped case; or the folder of a run, to "
            "continue it.",
            autocompletion=paths,
        ),
    ] = None
    preset: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Apply [preset.NAME] of the case.", autocompletion=presets)
    ] = None
    size: Annotated[
        str | None,
        typer.Option(
            metavar="quick|standard|fine",
            help="Aim at 20,000, 300,000 or 1,400,000 particles and grains, instead of the case's own resolution.",
        ),
    ] = None
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Change one value (repeatable).")
    ] = None


@dataclass(frozen=True)
class Run:
    """Where and how far it runs."""

    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Where run folders are made (default: runs).")] = None
    start: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="STAGE", help="Recompute this stage and everything after it.", autocompletion=stage_names
        ),
    ] = None
    until: Annotated[
        str | None, typer.Option("--until", metavar="STAGE", help="Stop after this stage.", autocompletion=stage_names)
    ] = None
    threads: Annotated[int | None, typer.Option(min=1, help="Threads (default: all cores).")] = None
    check: Annotated[
        bool, typer.Option("--check", help="Validate the case and predict time, memory and disk; run nothing.")
    ] = False
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Compute a stretch of every finished stage again, from its last checkpoint, and compare every bit.",
        ),
    ] = False
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Start even if the prediction exceeds available memory or disk.")
    ] = False
    checkpoint_every: Annotated[
        str | None,
        typer.Option(
            "--checkpoint-every",
            metavar="TEXT",
            help="Wall-clock time between checkpoints, '2 min' (default: 15 s, longer where they are large), or a "
            "count, '500 steps'.",
        ),
    ] = None
    fresh: Annotated[bool, typer.Option("--fresh", help="Delete earlier results and checkpoints first.")] = False

    @property
    def folder(self) -> Path:
        """Where run folders are made."""
        return self.out or RUNS


@dataclass(frozen=True)
class Film:
    """The movie that is made after a run."""

    movie: Annotated[
        bool,
        typer.Option(
            "--movie", help="Then make 6_crater/movie.gif and .mp4 (if the run is finished, only the movie is made)."
        ),
    ] = False
    movie_field: Annotated[
        str | None,
        typer.Option(
            "--movie-field",
            metavar="NAME",
            help="Colour the movie by material (default), damage, pressure, origin or speed.",
        ),
    ] = None


@dataclass(frozen=True)
class Reference:
    """What is told of case files."""

    describe: Annotated[
        bool,
        typer.Option(
            "--describe", help="Explain every key of a case file, or those of one table: run_case --describe sph.late."
        ),
    ] = False
    names: Annotated[
        bool,
        typer.Option(
            "--list", help="List cases, materials, observed craters and laws, or one kind: run_case --list materials."
        ),
    ] = False
    schema: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the JSON schema of case files, for editors.")
    ] = None


@dataclass(frozen=True)
class Many:
    """More than one run."""

    sweep: Annotated[
        bool,
        typer.Option(
            "--sweep", help="Run every member of [sweep] of the case, side by side, and end in a table and a page."
        ),
    ] = False
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY.PATH=A,B,C", help="Vary a key (repeatable): a sweep over these values, '...=15,40,65 deg'."
        ),
    ] = None
    ensemble: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Run N draws of particles and grains; their spread becomes the error of the first."
        ),
    ] = None
    errors: Annotated[
        bool,
        typer.Option(
            "--errors",
            help="Measure the errors of the result by some ten further runs: random seeds, resolution, time and alpha "
            "of the handoff (--check: what they cost).",
        ),
    ] = False
    forecast: Annotated[
        bool,
        typer.Option(
            "--forecast",
            help="Run [sweep] kind = 'prior' and write what it forecasts: quantiles, chances, draws, SHA-256, a page.",
        ),
    ] = False
    invert: Annotated[
        bool,
        typer.Option(
            "--invert",
            help="From the crater in [inverse] to what made it, by the members of [sweep] kind = 'prior' that are "
            "done (--check: what the data can tell apart).",
        ),
    ] = False
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Run a sweep on workers of dask.distributed: tcp://host:port, or local for workers on this machine.",
        ),
    ] = None
    status: Annotated[
        bool, typer.Option("--status", help="Say where every member of a sweep stands; run nothing.")
    ] = False
    emit: Annotated[
        str | None,
        typer.Option(
            metavar="slurm-array|snakemake",
            help="Write the job files of a sweep for a cluster into its folder; run nothing.",
        ),
    ] = None


@dataclass(frozen=True)
class Disk:
    """What is copied or deleted, and how much may lie on the disk."""

    copy: Annotated[
        str | None, typer.Option(metavar="NAME", help="Copy a shipped case into the folder CASE, to change it.")
    ] = None
    prune: Annotated[
        bool,
        typer.Option(
            "--prune",
            help="Delete cached stages that no run uses from the store of --out (CASE: the name of one; --check: only "
            "say which).",
        ),
    ] = False
    budget: Annotated[
        str | None,
        typer.Option(
            metavar="SIZE",
            help="Disk that a run may take, '5 GB': snapshots lie further apart where it would take more. With "
            "--prune: only the oldest go, until the store takes at most this.",
        ),
    ] = None
