"""The commands. Help texts need neither numba nor VTK: what is heavy is imported when a command really starts.

What frames them all (exit codes, errors, versions) is ``pipeline.commands.command``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.commands import run_command
from pipeline.commands.command import guarded, point, quantity, script, watched

run_case = script(run_command.run_case)


@script
def inspect_handoff(
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
        from handoff.pages import handoff_report
        from matter.errors import InputError
        from matter.files import lock
        from pipeline.store import intact, view

        for option, given in (("--only", only), ("--draws", draws), ("--threads", threads)):
            if given and not sensitivity:
                raise InputError(f"{option} goes with --sensitivity")
        run_folder = run.parent if run.name == "4_handoff" else run  # either is understood
        intact.check_shown(run_folder, "handoff")
        busy = run_folder / "run.lock"
        if sensitivity:
            from pipeline.uncertainty import sensitivity as runs

            if lock.taken(busy):  # said before hours of work, not after them
                raise InputError(
                    f"{run_folder} is in use by {lock.holder(busy)}: --sensitivity follows a finished run"
                )
            runs.run(run_folder, only, threads, draws or runs.DRAWS)
            intact.check_shown(run_folder, "handoff")
        code = handoff_report.print_ledger(run_folder)
        if lock.taken(busy):
            print(f"\nthe page stays as it is: {run_folder} is in use by {lock.holder(busy)}")
        else:
            with view.owned(run_folder, "handoff") as out:
                handoff_report.write(run_folder, out, pictures)
            print(f"\nreport: {out / 'report.html'}")
        return code

    guarded(action)


@script
def compare_profiles(
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
        from crater.pages import compare
        from pipeline.store import intact

        for item in items:
            intact.check_shown(Path(item), "crater")
        return compare.compare(items, observed=observed, out=out, stage=stage)

    guarded(action)


@script
def measure_crater(
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
        from pipeline.store import intact

        intact.check_file(snapshot)
        return stage.measure_snapshot(
            snapshot,
            datum=datum,
            datum_radius=None if datum_radius is None else quantity(datum_radius, "m", "--datum-radius"),
            centre=point(centre, "--centre"),
            out=out,
        )

    guarded(action)


@script
def impact_census(
    target: Annotated[str, typer.Option(help="The body that is hit.")] = "callisto",
    population: Annotated[str, typer.Option(help="literal, corrected, isotropic, or a file.")] = "literal",
    integrator: Annotated[str, typer.Option(help="rkck, fast or tube.")] = "fast",
    count: Annotated[int, typer.Option(min=1, help="How many encounters.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Where tables and plots go.")] = None,
) -> None:
    """N-body impact statistics as tables and plots."""

    def action() -> int:
        from nbody.census import census

        return watched("census", lambda: census.census(target, population, integrator, count, seed, out))

    guarded(action)


@script
def fly_ejecta(
    ejecta: Annotated[Path, typer.Argument(metavar="EJECTA", help="6_crater/ejecta.h5 of a run, or the run folder.")],
    body: Annotated[
        str | None,
        typer.Option(help="A moon of Jupiter, or ryugu: what else pulls (default: the run's own body alone)."),
    ] = None,
    latitude: Annotated[str, typer.Option(help="Of the impact point.")] = "0 deg",
    longitude: Annotated[
        str, typer.Option(help="East of the meridian that faces the planet; the leading side is at -90 deg.")
    ] = "0 deg",
    azimuth: Annotated[str, typer.Option(help="Of the projectile's way (+x), clockwise from north.")] = "90 deg",
    duration: Annotated[str, typer.Option(help="How long each is followed.")] = "100 day",
    seed: Annotated[int, typer.Option(min=0, help="Seed of where planet and moons stand.")] = 1,
    out: Annotated[Path, typer.Option(help="Where ejecta_fates.h5 and .json go.")] = Path("ejecta_fates"),
) -> None:
    """Follow a crater's ejecta in the field of body, planet, moons and Sun: falls back, hits another, escapes.

    The page of a run then shows the masses.
    """

    def action() -> int:
        from nbody import launches
        from pipeline.commands import ejecta_fates_page

        angles = zip((latitude, longitude, azimuth), ("--latitude", "--longitude", "--azimuth"))
        site = launches.Site(*(quantity(text, "rad", option) for text, option in angles))
        code = launches.command(ejecta, body, site, quantity(duration, "s", "--duration"), seed, out)
        return ejecta_fates_page.show(ejecta, out) if code == 0 and ejecta.is_dir() else code

    guarded(action)


@script
def import_snapshot(
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
        from matter import formats
        from matter.files import archive

        archive.check_file(out)
        centre, axis = point(origin, "--origin") if origin else None, point(up, "--up") if up else None
        when = quantity(time, "s", "--time") if time else None
        first, *others = formats.convert(file, out, form, columns, materials, centre, axis, when)
        print(f"{out}: {first}")
        for sentence in others:
            print(f"  {sentence}")
        return 0

    guarded(action)


@script
def export_snapshot(
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
        from matter import formats
        from matter.files import archive
        from pipeline.store import intact

        archive.check_file(out)
        intact.check_file(snapshot)
        what = formats.found(snapshot)
        written = formats.export(what.particles, out, form)
        print(f"{out}: {len(what.particles)} particles as {written}")
        for sentence in formats.beside(what):
            print(f"  {sentence}")
        return 0

    guarded(action)
