"""A whole run of all six stages at its smallest, in children of this process, and what its results come to."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipeline.case import stages
from pipeline.running import verify
from pipeline.store import view
from tests.faults.calls import Said, forked

ROOT = Path(__file__).resolve().parents[2]
SMALLEST = (
    "cases/valhalla_980km --preset tiny --threads 1 --set nbody.encounters=5 --set bed.count=2500 "
    "--set sph.end_time=90_s --set sph.relaxation_time=100_s --set dem.latest_time=200_s --set dem.end_time=150_s"
)
"""The smallest run with grains: it resolves no crater, and ends beyond limits of the ledger (exit code 1)."""
FREQUENT_S = 0.15
"""Seconds between checkpoints."""
_PATIENCE = 1800.0


def words(out: Path) -> list[str]:
    """Arguments of ``run_case``."""
    return [text.replace("_s", " s") if text.endswith("_s") else text for text in SMALLEST.split()] + [
        "--out",
        str(out),
    ]


def run(out: Path, log: Path, before: Callable[[], Any] = lambda: None, more: tuple[str, ...] = ()) -> Said:
    """``run_case`` into ``out`` in a child, with checkpoints every ``FREQUENT_S``; it calls ``before`` first."""
    import sys

    def work() -> None:
        os.chdir(ROOT)
        from matter import cadence
        from pipeline import cli

        cadence.SHARE = 1.0
        cadence.set_pace(cadence.Pace(FREQUENT_S))
        before()
        sys.argv = ["run_case", *words(out), *more]
        cli.run_case()

    return forked(work, log, _PATIENCE)


def folder_of(out: Path) -> Path:
    """The run folder in ``out``."""
    return next(path for path in Path(out).iterdir() if path.name.startswith("valhalla"))


def begun_before(source: Path, out: Path, stage: str) -> None:
    """A copy of the run as it was before ``stage`` was begun."""
    first = stages.ORDER.index(stage)
    if first == 0:
        out.mkdir(parents=True)
        return
    shutil.copytree(source, out, symlinks=True)
    view.forget(folder_of(out), stages.ORDER[first:])
    for later in stages.ORDER[first:]:
        for entry in out.glob(f".store/{later}-*"):
            shutil.rmtree(entry)


def differences(source: Path, out: Path, stage: str) -> list[str]:
    """What of the results up to ``stage`` is not the same in two folders of runs."""
    wanted = stages.ORDER[: stages.ORDER.index(stage) + 1]
    one, other = (contents(folder_of(place), wanted) for place in (source, out))
    differ = sorted(key for key in one.keys() | other.keys() if one.get(key) != other.get(key))
    return [f"{len(differ)} results differ: {', '.join(differ[:3])}"] if differ else []


def contents(run_folder: Path, wanted: tuple[str, ...] = stages.ORDER) -> dict[str, Any]:
    """What the files of these stages say, by name, without what tells of clocks and machines."""
    found = {}
    for stage in wanted:
        place = stages.folder(run_folder, stage)
        for path in verify.results(place):
            found[f"{place.name}/{path.relative_to(place)}"] = verify.content(path)
    return found
