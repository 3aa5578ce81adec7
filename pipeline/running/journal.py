"""What a run tells while it works: ``status.json`` for whoever watches from outside, ``run.log``, and the screen; and
how it is stopped."""

from __future__ import annotations

import os
import platform
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from matter import progress
from matter.errors import Stopped
from matter.files import archive
from pipeline.store import folder

STATUS_EVERY_S = 1.0


class Screen(Protocol):
    """Who tells the user: a terminal, plain lines, a test."""

    def say(self, text: str) -> None:
        """Print a line."""

    def begins(self, stage: str, text: str) -> None:
        """A stage begins."""

    def moves(self, stage: str, state: progress.Progress) -> None:
        """A stage reports where it is."""

    def ends(self, stage: str, text: str) -> None:
        """A stage is done."""


class Journal:
    """The reports of one run; ``interrupted`` says that the last run with the same ``--from`` did not come to its
    end."""

    def __init__(self, run_folder: Path, start: str | None, screen: Screen):
        self.path, self.start, self.screen = run_folder / "status.json", start, screen
        before = folder.record(self.path)
        self.interrupted = before.get("from") == start and before.get("state") not in (None, "done")
        self.stage, self.state, self._written = "", progress.Progress("", 1.0), 0.0

    def log(self, text: str) -> None:
        """Append to ``run.log``."""
        with open(self.path.with_name("run.log"), "a") as file:
            file.write(f"{time.strftime('%Y-%m-%dT%H:%M:%S%z')} [{os.getpid()}] {text}\n")

    def tell(self, text: str) -> None:
        """Show and log what a stage has to say beside its progress."""
        self.screen.say(f"WARNING: {text}")
        self.log(text)

    def opens(self, stage: str) -> None:
        """A stage takes the floor."""
        self.stage, self.state = stage, progress.Progress(stage, 1.0)
        self.write("running")

    def hear(self, state: progress.Progress) -> None:
        """Listen to a stage's progress."""
        self.state = state
        self.screen.moves(self.stage, state)
        if time.monotonic() - self._written >= STATUS_EVERY_S:
            self.write("running")

    def write(self, word: str, reason: str = "") -> None:
        """Write ``status.json``; ``word`` is running, stopped, failed or done, ``reason`` why it failed."""
        self._written = time.monotonic()
        eta = self.state.eta_s
        content = {
            "state": word,
            "stage": self.stage,
            "fraction": 1.0 if word == "done" else round(self.state.fraction, 5),
            "eta_s": None if word == "done" or not eta < 1e12 else round(eta, 1),
            "note": self.state.note,
            "reason": reason,
            "pid": os.getpid(),
            "host": platform.node(),
            "from": self.start,
            "updated_at": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        }
        archive.write_json(self.path, content)


@contextmanager
def signals(screen: Screen) -> Iterator[None]:
    """SIGINT and SIGTERM ask for a stop; the second one ends the process at once (the last checkpoint stands)."""

    def ask(number: int, frame: Any) -> None:
        if progress.stop_requested():
            os._exit(Stopped.exit_code)
        progress.request_stop()
        screen.say(f"{signal.Signals(number).name}: saving before exit (press again to quit immediately)")

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
