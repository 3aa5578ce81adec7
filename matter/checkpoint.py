"""Rolling checkpoints: the whole state of a stage, the two newest kept, so that a killed run resumes bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from matter import archive

_KEPT = 2


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
    """Arrays and scalars of the newest readable checkpoint, or None."""
    for path in reversed(_existing(folder)):
        try:
            return archive.read(path)
        except OSError:  # a disk that filled up or a file cut short: the one before it still stands
            continue
    return None


def clear(folder: Path) -> None:
    """Remove the checkpoints of a finished stage."""
    for path in _existing(folder):
        path.unlink(missing_ok=True)
