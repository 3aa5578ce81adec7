"""Rolling checkpoints: the whole state of a stage, the two newest kept, so that a killed run resumes bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from matter import archive
from matter.errors import InputError

_KEPT = 2


class _Saved(dict[str, Any]):
    """What a checkpoint held; asking for more than that names the file instead of failing without a word."""

    def __init__(self, path: Path, held: Mapping[str, Any]) -> None:
        super().__init__(held)
        self.path = path

    def __missing__(self, name: str) -> Any:
        raise InputError(
            f"{self.path} was written by another version of the program (it has no '{name}'): finish the run with that version, "
            f"or delete the folder {self.path.parent.name} to restart this stage"
        )


def _existing(folder: Path) -> list[Path]:
    return sorted(folder.glob("checkpoint_*.h5"))


def save(folder: Path, step: int, arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any]) -> Path:
    """Write the state at ``step``; older checkpoints beyond the two newest go.

    ``arrays`` hold every array that the stage needs to continue identically (derived state and contact history too),
    ``scalars`` every number and short text.
    """
    path = folder / f"checkpoint_{step:010d}.h5"
    archive.write(path, arrays, {"step": step, **scalars}, compress=False)
    for old in _existing(folder)[:-_KEPT]:
        old.unlink(missing_ok=True)
    return path


def newest(folder: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]] | None:
    """Arrays and scalars of the newest readable checkpoint, or None.

    Whoever asks them for a name that they lack gets an ``InputError``.
    """
    for path in reversed(_existing(folder)):
        try:
            arrays, scalars = archive.read(path)
            return _Saved(path, arrays), _Saved(path, scalars)
        except OSError:  # a disk that filled up or a file cut short: the one before it still stands
            continue
    return None


def clear(folder: Path) -> None:
    """Remove the checkpoints of a finished stage."""
    for path in _existing(folder):
        path.unlink(missing_ok=True)
