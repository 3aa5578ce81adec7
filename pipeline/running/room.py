"""Whether this machine has the memory and the disk that stages will need: said by ``--check``, and refused before
anything is made.

A stage keeps its two newest checkpoints while it is made and writes a third before the oldest goes; a finished stage
keeps none, so that of all stages the largest counts.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

from pipeline.store import provenance

CHECKPOINTS = 3


def needs(rows: Iterable[Mapping[str, float]]) -> tuple[float, float]:
    """Memory and disk [bytes] of stages made one after another."""
    rows = list(rows)
    memory = max((row["memory_bytes"] for row in rows), default=0.0)
    passing = CHECKPOINTS * max((row.get("checkpoint_bytes", 0.0) for row in rows), default=0.0)
    return memory, sum(row["disk_bytes"] for row in rows) + passing


def short_of(memory: float, disk: float, out: Path) -> list[str]:
    """A line for each thing that this machine is short of."""
    shortages = []
    if memory > (have := provenance.memory_bytes()) > 0:
        shortages.append(f"{size(memory)} of memory are needed, this machine has {size(have)}")
    if disk > (free := free_bytes(out)):
        shortages.append(f"{size(disk)} of disk are needed with checkpoints, {_existing(out)} has {size(free)} left")
    return shortages


def free_bytes(out: Path) -> float:
    """What is left on the disk of a folder that may still have to be made; no limit where nothing can be kept at
    all, which is found out by trying."""
    usage = shutil.disk_usage(_existing(out))
    return usage.free if usage.total > 0 else math.inf


def _existing(out: Path) -> Path:
    out = Path(out).resolve()
    return next(path for path in (out, *out.parents) if path.exists())


def size(count: float) -> str:
    """Bytes in words: ``340 MB``, ``1.2 GB``."""
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= scale:
            return f"{count / scale:.3g} {unit}"
    return f"{count:.0f} B"
