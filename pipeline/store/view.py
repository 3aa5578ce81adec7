"""A run folder as a view of stages: links to where they lie in the store, and beside them what belongs to the run
alone.

    2_sph -> ../.store/sph-5d0b2e52766e
        relative, so that a folder of runs may be moved; copies where a file system has no links

What is written after a stage is done (rows of the ledger that a sensitivity fills, pages, movies) belongs to the run:
``owned`` turns the link into a folder of the run, with links to the large files and copies of the others.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from matter.errors import InputError
from matter.files import archive, lock
from pipeline.case import stages
from pipeline.store import folder, intact

RECOMPUTE = "anew.json"
_LINKED = (".vtkhdf", ".h5", ".ply", ".bin")
"""Endings of files that nothing rewrites: ``own`` links them."""


def show(run: Path, stage: str, target: Path) -> Path:
    """Let ``run`` show ``target`` as its ``stage``, instead of what it showed; where it can then be written to: the
    link, or ``target`` itself where there are no links (it is copied when it is done)."""
    link = stages.folder(run, stage)
    target, run = target.resolve(), run.resolve()
    if link.resolve() == target and link.is_symlink():
        return link
    part = link.with_name(f".{link.name}.part")
    _remove(part)
    try:
        os.symlink(os.path.relpath(target, run), part, target_is_directory=True)
    except OSError:
        if not folder.record(target / folder.DONE):
            return target
        shutil.copytree(target, part, copy_function=shutil.copyfile)
    if (link.is_dir() and not link.is_symlink()) or (part.is_dir() and not part.is_symlink()):
        _remove(link)
    os.replace(part, link)
    return link


@contextmanager
def owned(run: Path, stage: str) -> Iterator[Path]:
    """The folder of a finished stage as one that belongs to the run and may be written to, while no run works in the
    run folder. Raises ``InputError`` where the stage is not finished, or a run is at work."""
    intact.require_done(run, stage)
    with lock.held(run / "run.lock", str(run)):
        intact.require_done(run, stage)
        yield own(run, stage)


def own(run: Path, stage: str) -> Path:
    """The stage's folder as one that belongs to the run; the caller holds the lock of the run. Raises ``InputError``
    where the stage is not finished: whoever makes it would lose it."""
    intact.require_done(run, stage)
    link = stages.folder(run, stage)
    if not link.is_symlink() or not link.is_dir():
        for path in link.glob("*"):  # a copy of a run: files of the store are read-only
            if path.is_file() and not path.is_symlink() and not path.stat().st_mode & 0o200:
                path.chmod(path.stat().st_mode | 0o200)
        return link
    target, part = link.resolve(), link.with_name(f".{link.name}.part")
    _remove(part)
    part.mkdir()
    for path in sorted(target.rglob("*")):
        mine = part / path.relative_to(target)
        if path.is_dir():
            mine.mkdir()
        elif path.suffix in _LINKED:
            mine.symlink_to(os.path.relpath(path, link.parent.resolve() / link.name / mine.relative_to(part).parent))
        else:
            shutil.copyfile(path, mine)
    link.unlink()
    part.rename(link)
    return link


def forget(run: Path, some: Iterable[str]) -> None:
    """The run no longer shows these stages, whether links, copies or folders of its own; the store keeps what it
    has."""
    for stage in some:
        _remove(stages.folder(run, stage))


def _remove(path: Path) -> None:
    if path.is_symlink() or path.is_file():
        path.unlink()
    elif path.exists():
        shutil.rmtree(path)


def pending_recompute(run: Path) -> dict[str, bool]:
    """The stages that are to be recomputed although they are in the store, and whether that was begun."""
    named = folder.record(run / RECOMPUTE)
    return {stage: bool(named[stage]) for stage in stages.ORDER if stage in named}


def note_recompute(run: Path, some: Mapping[str, bool]) -> None:
    """Note which stages are to be recomputed."""
    if some:
        archive.write_json(run / RECOMPUTE, dict(some))
    else:
        (run / RECOMPUTE).unlink(missing_ok=True)


def refuse_foreign(run: Path, stage: str) -> None:
    """Raise ``InputError`` when the stage's folder holds files that no run made: they would be lost."""
    stage_folder = stages.folder(run, stage)
    marked = any((stage_folder / name).exists() for name in (folder.DONE, folder.BEGUN))
    if not stage_folder.is_symlink() and stage_folder.is_dir() and any(stage_folder.iterdir()) and not marked:
        after = stages.ORDER[stages.ORDER.index(stage) + 1 :]
        use = f"--from {after[0]} uses them" if after else "move them away"
        raise InputError(f"{stage_folder} holds files that were not made by a run: {use}, --fresh replaces them")
