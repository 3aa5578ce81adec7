"""``run_case RUN --verify``: a stretch of each finished stage is computed again, and has to come out to the same bits.

Each stage is copied to a scratch folder, goes on there from the checkpoint that it kept (one without checkpoints is
made again as a whole), and what it writes on the way is compared with what the run holds: every array of its
snapshots, every row of its tables, every number of its reports but those that tell of clocks and machines. It shows
what a checksum cannot: a machine that computes something else today than on the day of the run.
"""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from matter.errors import InputError, Unsound
from matter.files import archive, checkpoint, lock
from pipeline.case import stages
from pipeline.running.run import Request, settings_of
from pipeline.settings import identity
from pipeline.store import folder, intact

CLOCKS = re.compile(r"wall|seconds|per_second|_rate|memory|finished|commit|version|sha256|threads|program")
"""Names of numbers in reports that are not of the result."""
_TABLES = (".vtkhdf", ".h5", ".csv", ".json")


class Verdict(NamedTuple):
    """What came of one stage: files computed again, those of them that ``differ``, and a word where there is nothing
    to compare."""

    stage: str
    files: int
    differ: tuple[str, ...]
    note: str = ""


def verify(request: Request, say: Callable[[str], None]) -> list[Verdict]:
    """Compute a stretch of every wanted stage of a finished run again; ``say`` is told of each.

    Raises ``InputError`` where a stage is not done, is damaged, or was made by another version of the code, and where
    a run works in the folder.
    """
    verdicts, settings = list[Verdict](), settings_of(request)
    run = request.run_folder
    with lock.held(run / "run.lock", str(run)) if run.is_dir() else nullcontext():
        for stage in request.wanted:
            verdict = _one(request, stage, settings)
            verdicts.append(verdict)
            say(words(verdict))
    return verdicts


def words(verdict: Verdict) -> str:
    """One line on one stage."""
    if verdict.note:
        return f"{verdict.stage}: {verdict.note}"
    if verdict.differ:
        more = f" and {len(verdict.differ) - 3} more" if len(verdict.differ) > 3 else ""
        return f"{verdict.stage}: DIFFERS in {', '.join(verdict.differ[:3])}{more} ({verdict.files} files made again)"
    return f"{verdict.stage}: the same bits ({verdict.files} files made again)"


def _one(request: Request, stage: str, settings: Any) -> Verdict:
    run = request.run_folder
    stage_folder = stages.folder(run, stage)
    done = folder.mark(stage_folder / folder.DONE)
    if not done:
        raise InputError(
            f"{stage_folder} is not finished: there is nothing to verify; the same command without --verify runs it"
        )
    if stage in request.case.outside or done.get("from"):
        return Verdict(stage, 0, (), "taken from a file, not computed here")
    if (engine := getattr(settings[stage], "engine", "native")) != "native":
        return Verdict(stage, 0, (), f"computed by {engine}, not here")
    who = identity.stage_identity(stage, settings.get(stage), None, partial(stages.folder, run))
    if done.get("sources_sha256") != who.sources or done.get("threads") != who.threads:
        raise InputError(
            f"{stage_folder.name} was made by another version of the code or with another number of threads: its bits "
            "can only be compared with what made them"
        )
    intact.check(stage_folder, stage, done.get("files", {}), content=True)
    scratch = Path(tempfile.mkdtemp(prefix=f".verify-{stage}-", dir=run))
    try:
        _copy(stage_folder, scratch)
        before = {path: path.stat().st_ino for path in results(scratch)}
        try:
            stages.make(stage, settings[stage], run, scratch)
        except Unsound:
            pass  # said in the run's own log, and no less true of the stretch
        again = [path for path in results(scratch) if before.get(path) != path.stat().st_ino]
        differ = [
            str(path.relative_to(scratch))
            for path in again
            if not (stage_folder / path.relative_to(scratch)).is_file()
            or content(path) != content(stage_folder / path.relative_to(scratch))
        ]
        return Verdict(stage, len(again), tuple(differ))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _copy(stage_folder: Path, scratch: Path) -> None:
    """The stage as it was at its last checkpoint; an empty folder where it keeps none."""
    if not checkpoint.existing(stage_folder):
        return
    for path in stage_folder.rglob("*"):
        if path.is_file() and path.name not in (folder.DONE, folder.BEGUN):
            copy = scratch / path.relative_to(stage_folder)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)


def results(stage_folder: Path) -> Iterator[Path]:
    """The files of a stage whose content is its result."""
    yield from sorted(
        path
        for path in stage_folder.rglob("*")
        if path.suffix in _TABLES and not path.name.startswith(("checkpoint_", ".", "done", "begun"))
    )


def content(path: Path) -> Any:
    """What a file says, to be compared by ``==``: arrays by their bytes, tables and reports without clocks."""
    if path.suffix in (".vtkhdf", ".h5"):
        arrays, attributes = archive.read(path)
        kept = {key: value for key, value in attributes.items() if not CLOCKS.search(key)}
        return {key: (array.dtype.str, array.shape, _bits(array)) for key, array in arrays.items()}, repr(kept)
    if path.suffix == ".json":
        return json.dumps(_without_clocks(json.loads(path.read_text())), sort_keys=True)
    return path.read_bytes()


def _bits(array: np.ndarray) -> Any:
    return array.tolist() if array.dtype.hasobject else array.tobytes()  # the bytes of texts are addresses


def _without_clocks(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_clocks(entry) for key, entry in value.items() if not CLOCKS.search(key)}
    return [_without_clocks(entry) for entry in value] if isinstance(value, list) else value
