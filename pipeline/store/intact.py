"""Sizes and hashes of the files that a finished stage left: a result that is missing, cut short or altered is never
read as good.

``done.json`` holds them (``files``: path in the stage's folder -> [bytes, SHA-256]). Sizes are looked at whenever a
stage is passed over as done, hashes before a stage that reads it is made. What may change after a stage is done (pages
of a sensitivity, pictures, logs) is not among them; rows that it adds to the ledger are noted with ``renew``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matter.errors import InputError
from matter.files import archive
from pipeline.case import stages
from pipeline.store import folder, provenance, store

_SUFFIXES = (".vtkhdf", ".h5", ".csv", ".json", ".toml", ".ply")
_LATER = ("sensitivity.json", "done.json", "begun.json", "status.json")
_NAMED = 3


def files_of(stage_folder: Path) -> dict[str, list[Any]]:
    """Size [bytes] and SHA-256 of every result in a stage's folder, by its path there."""
    files = sorted(
        path
        for path in stage_folder.rglob("*")
        if path.is_file() and path.suffix in _SUFFIXES and path.name not in _LATER and path.name[0] != "."
    )
    return {str(path.relative_to(stage_folder)): [path.stat().st_size, provenance.file_sha256(path)] for path in files}


def renew(stage_folder: Path, name: str) -> None:
    """Note a file that was changed on purpose, in the ``done.json`` of a folder that belongs to a run."""
    done = folder.mark(stage_folder / folder.DONE)
    if name in done.get("files", {}):
        done["files"][name] = [(stage_folder / name).stat().st_size, provenance.file_sha256(stage_folder / name)]
        archive.write_json(stage_folder / folder.DONE, done)


def check(stage_folder: Path, stage: str, recorded: Mapping[str, Any], content: bool) -> None:
    """Hold a stage's folder against what ``done.json`` recorded; ``content``: hashes too, else existence and sizes.

    Raises ``InputError`` that names the first files that differ, or ``done.json`` where its record is none. A stage
    that recorded nothing (made by an older version) passes.
    """
    if not isinstance(recorded, Mapping) or not all(_is_entry(entry) for entry in recorded.values()):
        raise InputError(
            f"{stage_folder / folder.DONE} is damaged: it should hold size and hash of each file; restore it, or "
            f"recompute the stage with --from {stage}"
        )
    wrong = [
        f"{name} {what}" for name, entry in recorded.items() if (what := _fault(stage_folder / name, entry, content))
    ]
    if wrong:
        more = f" and {len(wrong) - _NAMED} more" if len(wrong) > _NAMED else ""
        raise InputError(
            f"{stage_folder} is not as the stage left it: {'; '.join(wrong[:_NAMED])}{more}. Restore what it was, or "
            f"recompute it with --from {stage}"
        )


def check_shown(run: Path, stage: str) -> None:
    """Hold what a run shows of a finished stage against its record, contents too; raises as ``check``, and where the
    stage was begun and is not finished."""
    stage_folder = stages.folder(run, stage)
    if done := folder.mark(stage_folder / folder.DONE):
        _refuse_empty(run, stage_folder, done)
        check(stage_folder, stage, done.get("files", {}), content=True)
    elif (stage_folder / folder.BEGUN).is_file():
        _refuse_unfinished(run, stage_folder)


def check_file(path: Path) -> None:
    """Hold one file of a finished stage against its record, content too; a file that no stage recorded passes. Raises
    as ``check``."""
    path = path.absolute()
    stage_folder = next((above for above in path.parents[:3] if (above / folder.DONE).is_file()), None)
    if stage_folder is None:
        return
    done, name = folder.mark(stage_folder / folder.DONE), str(path.relative_to(stage_folder))
    if entry := done.get("files", {}).get(name):
        check(stage_folder, str(done.get("stage")), {name: entry}, content=True)


def require_done(run: Path, stage: str) -> None:
    """Raise ``InputError`` where a run has not finished a stage; it names who makes it, or how it is finished."""
    stage_folder = stages.folder(run, stage)
    if done := folder.mark(stage_folder / folder.DONE):
        _refuse_empty(run, stage_folder, done)
    elif (stage_folder / folder.BEGUN).is_file():
        _refuse_unfinished(run, stage_folder)
    elif stage_folder.is_symlink() or not stage_folder.is_dir():  # a folder without marks was filled by hand
        raise InputError(f"{run} has no finished {stage_folder.name} yet: run_case {run} makes it")


def _refuse_empty(run: Path, stage_folder: Path, done: Mapping[str, Any]) -> None:
    if missing := folder.lacking(done):
        raise InputError(
            f"{stage_folder} is called done and lacks {', '.join(missing)}: run_case {run} makes it again"
        )


def _refuse_unfinished(run: Path, stage_folder: Path) -> None:
    if maker := store.maker(stage_folder):
        raise InputError(f"{stage_folder} is being made by {maker}: wait until it is done")
    raise InputError(f"{stage_folder} was begun and is not finished: run_case {run} goes on with it")


def _is_entry(entry: Any) -> bool:
    return isinstance(entry, list) and len(entry) == 2 and isinstance(entry[0], int) and isinstance(entry[1], str)


def _fault(path: Path, entry: Any, content: bool) -> str:
    """What is wrong with one file; empty when nothing is."""
    size, digest = entry
    if not path.is_file():
        return "is missing"
    if path.stat().st_size != size:
        return f"has {path.stat().st_size} bytes instead of {size}"
    return "has other content" if content and provenance.file_sha256(path) != digest else ""
