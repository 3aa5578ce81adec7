"""What the user sees while a case runs: a bar with the time left on a terminal, plain lines anywhere else."""

from __future__ import annotations

import math
import sys
import time
from typing import Any

from matter.progress import Progress

LINE_EVERY_S = 15.0


def duration(seconds: float | None) -> str:
    """Wall time in words of a glance: ``4.2 s``, ``3 min 20 s``, ``2 h 05 min``; ``--`` when unknown."""
    if seconds is None or not math.isfinite(seconds):
        return "--"
    if seconds < 60:
        return f"{seconds:.1f} s"
    if seconds < 3600:
        return f"{int(seconds) // 60} min {int(seconds) % 60:02d} s"
    return f"{int(seconds) // 3600} h {int(seconds) % 3600 // 60:02d} min"


def left(state: Progress) -> str:
    """The wall time left; of work that may end earlier, the least and the most."""
    most = f"{duration(state.eta_s)} left"
    if state.soonest <= 0.0 or not math.isfinite(state.eta_s):
        return most
    return f"{duration(state.soonest_eta_s)} to {most}" if state.done < state.soonest else f"at most {most}"


def screen() -> PlainScreen | BarScreen:
    """The screen that fits standard output."""
    return BarScreen() if sys.stdout.isatty() else PlainScreen()


class PlainScreen:
    """Lines for a file or a pipe: one when a stage begins and ends, one every 15 s in between."""

    def __init__(self) -> None:
        self._printed = 0.0

    def say(self, text: str) -> None:
        """Print a line."""
        print(text, flush=True)

    def begins(self, stage: str, text: str) -> None:
        """A stage begins."""
        self._printed = time.monotonic()
        self.say(text)

    def moves(self, stage: str, state: Progress) -> None:
        """A stage reports where it is."""
        if time.monotonic() - self._printed >= LINE_EVERY_S:
            self._printed = time.monotonic()
            self.say(f"  {stage}  {100 * state.fraction:5.1f} %  {left(state)}  {state.note}".rstrip())

    def ends(self, stage: str, text: str) -> None:
        """A stage is done."""
        self.say(text)

    def close(self) -> None:
        """Nothing is left on the screen."""


class SilentScreen:
    """Nothing: for whoever asks for no words."""

    def say(self, text: str) -> None:
        """Nothing."""

    def begins(self, stage: str, text: str) -> None:
        """Nothing."""

    def moves(self, stage: str, state: Progress) -> None:
        """Nothing."""

    def ends(self, stage: str, text: str) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""


class BarScreen:
    """One moving line per stage on a terminal."""

    def __init__(self) -> None:
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bar

        words = [TextColumn("{task.fields[left]}"), TextColumn("{task.fields[note]}")]
        columns = (TextColumn("{task.description}"), BarColumn(24), TextColumn("{task.percentage:5.1f} %"), *words)
        self._bar = Bar(*columns, transient=True, auto_refresh=False)
        self._task: Any = None

    def say(self, text: str) -> None:
        """Print a line above the bar."""
        self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def begins(self, stage: str, text: str) -> None:
        """A stage begins: its bar appears."""
        self._clear()
        self.say(text)
        self._open(stage)

    def moves(self, stage: str, state: Progress) -> None:
        """A stage reports where it is."""
        if self._task is None:
            self._open(stage)
        self._bar.update(self._task, completed=state.fraction, left=left(state), note=state.note, refresh=True)

    def ends(self, stage: str, text: str) -> None:
        """A stage is done: its bar goes."""
        self._clear()
        self.say(text)

    def close(self) -> None:
        """Leave the terminal as it was found."""
        self._clear()

    def _open(self, stage: str) -> None:
        self._task = self._bar.add_task(stage, total=1.0, left="-- left", note="")
        self._bar.start()

    def _clear(self) -> None:
        if self._task is not None:
            self._bar.remove_task(self._task)
            self._task = None
            self._bar.stop()
