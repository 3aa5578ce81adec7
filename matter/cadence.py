"""When a stage writes its next checkpoint: by the clock and by a count of steps, and never so often that writing takes
more than a stated fraction of the time.

One ``Pace`` holds for all stages of a process (``run_case --checkpoint-every``); it decides nothing about a result.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from matter.case import quantity
from matter.errors import InputError
from matter.progress import stop_requested


@dataclass(frozen=True)
class Pace:
    """A checkpoint is due ``seconds`` [s, wall time] or, where it is above 0, ``steps`` of the stage (steps of time,
    blocks of a census) after the last one."""

    seconds: float = 15.0
    steps: int = 0

    @classmethod
    def from_text(cls, text: str) -> Pace:
        """From ``"2 min"`` or ``"500 steps"``. Raises ``InputError`` for anything else."""
        counted = re.fullmatch(r"\s*([1-9]\d{0,8})\s+steps?\s*", text)
        if counted:
            return cls(steps=int(counted[1]), seconds=math.inf)
        try:
            seconds = quantity.parse(text, "s")
        except ValueError:
            seconds = -1.0
        if not 0.0 < seconds < 1e7:
            raise InputError(f"--checkpoint-every {text!r}: a time of the clock ('2 min') or a count ('500 steps')")
        return cls(seconds)


SHARE = 0.02
"""Checkpoints by the clock take no more than about this fraction of the time: a large state is written less often."""

pace = Pace()
"""The pace of this process."""


def set_pace(wanted: Pace) -> None:
    """Let all stages of this process keep another pace."""
    global pace
    pace = wanted


class Cadence:
    """The checkpoints of one stage: ``count`` of them in this process took ``spent_s`` [s]."""

    def __init__(self) -> None:
        self.count, self.spent_s = 0, 0.0
        self._ended, self._cost, self._steps = time.monotonic(), 0.0, 0
        _all.append(self)

    def due(self) -> bool:
        """Whether a checkpoint is to be written after this step; asked once a step. After a request to stop it is."""
        self._steps += 1
        return (
            stop_requested()
            or 0 < pace.steps <= self._steps
            or time.monotonic() - self._ended > max(pace.seconds, self._cost / SHARE)
        )

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Around the writing of one."""
        began = time.monotonic()
        yield
        self._ended, self._steps = time.monotonic(), 0
        self._cost = self._ended - began
        self.count, self.spent_s = self.count + 1, self.spent_s + self._cost


_all: list[Cadence] = []


def taken() -> dict[str, float]:
    """Count and wall time [s] of the checkpoints written in this process since it was last asked."""
    found = {
        "checkpoints": sum(each.count for each in _all),
        "checkpoints_wall_s": round(sum(each.spent_s for each in _all), 3),
    }
    _all.clear()
    return found
