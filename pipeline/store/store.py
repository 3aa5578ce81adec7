"""The store of stages: ``<out>/.store/<stage>-<key>/``, where a stage lies that every run with the same key takes its
result from.

The key (``pipeline.settings.identity``) follows from what decides the result, so that a stage is made when its key is
not there. It is made in its final folder, under a lock: who wants the same stage waits, and continues it when its
maker has gone. After ``done.json`` nothing in it changes; what is to be recomputed although it is there (``--from``)
is made in ``<stage>-<key>.anew`` and replaces it when it is done. Run folders show stages as links
(``pipeline.store.view``).
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matter.files import lock
from pipeline.store import folder

STORE, LOCKS = ".store", ".locks"
DIGITS = 12
"""Digits of a key that name a stage."""
_REMADE, _OLD = ".anew", ".old"
_OUTER = ("case.used.toml", "provenance.json")


def store_of(run: Path) -> Path:
    """The store of a run folder: in the folder that holds it; a run inside another run (``RUN/sensitivity/...``)
    shares the other's."""
    run = Path(os.path.realpath(run))  # a sweep shows its members as links
    outer = next((above for above in list(run.parents)[:2] if all((above / name).is_file() for name in _OUTER)), run)
    return outer.parent / STORE


@dataclass(frozen=True)
class Entry:
    """The folder of one stage in a ``store``, by its ``name``."""

    store: Path
    name: str

    @classmethod
    def for_run(cls, run: Path, stage: str, key: str) -> Entry:
        """The folder of a stage with this key, for a run."""
        return cls(store_of(run), f"{stage}-{key[:DIGITS]}")

    @property
    def path(self) -> Path:
        """Its folder."""
        return self.store / self.name

    @property
    def remade(self) -> Path:
        """The folder in which it is made although it is there."""
        return self.store / f"{self.name}{_REMADE}"

    @property
    def done(self) -> dict[str, Any]:
        """What ``done.json`` says; empty where the stage is not finished or lacks its files. Raises ``InputError``
        when the file is damaged."""
        return folder.done(self.path)

    @contextmanager
    def held(self, wait: Callable[[str], None] | None = None) -> Iterator[None]:
        """Hold the stage's lock; ``wait`` as for ``lock.held``."""
        with lock.held(self.store / LOCKS / self.name, self.name, wait):
            if not self.path.exists():  # a maker was killed while it put a recomputed stage in its folder
                for left in (self.remade, self.store / f"{self.name}{_OLD}"):
                    if folder.record(left / folder.DONE):
                        os.replace(left, self.path)
                        break
            yield

    def finished(self, made_in: Path) -> Path:
        """A stage was finished in ``made_in``: nothing in it changes from here on, and it replaces the earlier one,
        whose path is returned."""
        for path in made_in.rglob("*"):
            if path.is_file() and not path.is_symlink():
                path.chmod(path.stat().st_mode & 0o555)
        if made_in != self.path:
            old = self.store / f"{self.name}{_OLD}"
            shutil.rmtree(old, ignore_errors=True)
            if self.path.exists():
                os.replace(self.path, old)
            os.replace(made_in, self.path)
            shutil.rmtree(old, ignore_errors=True)
        return self.path


def maker(stage_folder: Path) -> str:
    """The process that makes the stage in a folder of the store, in words; empty where none does."""
    stage_folder = stage_folder.resolve()
    path = stage_folder.parent / LOCKS / stage_folder.name.removesuffix(_REMADE)
    return lock.holder(path) if lock.taken(path) else ""
