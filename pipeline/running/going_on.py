"""A finished or stopped run goes on: ``run_case RUN``, in the same folder, with the values that it was begun with.

``case.used.toml`` holds all of them, whatever the case file or the defaults have become since; ``provenance.json``
says how they were asked for. With ``--preset`` or ``--set`` the run is the model of another one, in a folder of its
own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.case.read import Case
from pipeline.settings import used
from pipeline.store import folder

USED = "case.used.toml"
PROVENANCE = "provenance.json"


def run_of(where: Path) -> Path | None:
    """The run folder that ``where`` names: the folder itself, or the ``case.used.toml`` in it; None for a case."""
    where = Path(where)
    run_folder = where.parent if where.name == USED else where
    if (
        run_folder.is_dir()
        and not (run_folder / "case.toml").is_file()
        and (run_folder / USED).is_file()
        and (run_folder / PROVENANCE).is_file()
    ):
        return run_folder
    return None


def read(
    where: Path,
    preset: str | None = None,
    overrides: Iterable[str] = (),
    out: Path | None = None,
    size: str | None = None,
) -> Case:
    """A case, or that of a run folder, which then goes on in its own folder. Raises ``InputError``."""
    overrides = tuple(overrides)
    run = run_of(where)
    if run is None:
        return cases.read(where, preset, overrides, size)
    if preset is not None:
        raise InputError(
            f"--preset {preset}: {run} is a run, with values that are fixed; apply a preset to the case itself"
        )
    if size is not None:
        raise InputError(f"--size {size}: {run} is a run, which keeps its size; run the case itself")
    used.check(run / USED)
    case = cases.read(run / USED, None, overrides)
    before = None if case.before is None else _left_open(case.before, run)
    case = replace(case, name=name_of(run), document=_left_open(case.document, run), before=before)
    if overrides:
        return case
    if out is not None and out.resolve() != run.resolve().parent:
        raise InputError(
            f"--out {out}: {run} continues in its own folder; to run it elsewhere, copy its {USED} and run that"
        )
    return replace(case, run=run)


def name_of(run: Path) -> str:
    """The name of the case of a run folder, without the hash."""
    name = run.resolve().name
    head, _, tail = name.rpartition("-")
    return head if head and len(tail) == 8 and all(digit in "0123456789abcdef" for digit in tail) else name


def _left_open(document: dict[str, Any], run: Path) -> dict[str, Any]:
    """The document with ``[impact]`` as it was before the run's encounters had found the rest of it: they decide
    again, and find the same."""
    given = folder.record(run / PROVENANCE).get("case", {}).get("impact_as_given")
    if not given:
        return document
    return {**document, "impact": given}
