"""How a long calculation reports where it is and learns that it should stop.

A stage makes one ``Progress`` and calls ``update`` in its loop; who listens (a terminal line with an ETA,
``status.json``, a test) registers with ``listen``. ``stop_requested`` becomes true after SIGINT or SIGTERM: the loop
then writes its checkpoint and raises ``Stopped``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from matter.errors import Stopped

_listeners: list[Callable[[Progress], None]] = []
_hearers: list[Callable[[str], None]] = []
_stop = False

_TELLING = 0.003  # fraction of the whole from which on an ETA is given within the first minute


@dataclass
class Progress:
    """Progress of one stage towards ``total`` (simulated seconds, counts, ...).

    ``note`` is a short text beside the bar, ``fraction`` runs from 0 to 1, ``eta_s`` is the estimated wall time left
    [s]; of work that may end earlier than at its total, from ``soonest`` on, ``soonest_eta_s`` until then.
    """

    stage: str
    total: float
    start: float = 0.0
    done: float = 0.0
    note: str = ""
    soonest: float = 0.0
    interval_s: float = 0.5
    _started: float = field(default_factory=time.monotonic)
    _last: float = -1e9

    @property
    def fraction(self) -> float:
        return min(1.0, max(0.0, self.done / self.total)) if self.total > 0 else 0.0

    @property
    def elapsed_s(self) -> float:
        return time.monotonic() - self._started

    @property
    def eta_s(self) -> float:
        return self._until(self.total)

    @property
    def soonest_eta_s(self) -> float:
        return self._until(self.soonest)

    def _until(self, end: float) -> float:
        advanced = self.done - self.start
        if advanced <= 0 or (advanced < _TELLING * self.total and self.elapsed_s < 60.0):
            return float("nan")  # too early to tell: kernels may still have been compiling
        return max(0.0, self.elapsed_s * (end - self.done) / advanced)

    def update(self, done: float, note: str = "", force: bool = False) -> None:
        """Report the position; listeners hear of it at most every ``interval_s`` seconds unless ``force``."""
        self.done, self.note = done, note
        now = time.monotonic()
        if force or now - self._last >= self.interval_s:
            self._last = now
            for listener in _listeners:
                listener(self)


def listen(listener: Callable[[Progress], None]) -> None:
    """Register a function that hears every reported ``Progress``."""
    _listeners.append(listener)


def hear(hearer: Callable[[str], None]) -> None:
    """Register a function that is handed what ``tell`` says."""
    _hearers.append(hearer)


def tell(text: str) -> None:
    """Say something that whoever started the calculation should read, beside its progress."""
    for hearer in _hearers:
        hearer(text)


def silence() -> None:
    """Forget all listeners."""
    _listeners.clear()
    _hearers.clear()


def request_stop() -> None:
    """Ask the running stage to save and stop (signal handlers call this)."""
    global _stop
    _stop = True


def clear_stop() -> None:
    """Forget an earlier request to stop."""
    global _stop
    _stop = False


def stop_requested() -> bool:
    """Whether a stop was asked for."""
    return _stop


def stop_here(stage: str) -> None:
    """Raise ``Stopped`` if a stop was asked for; call it right after the checkpoint is written, or where none is
    kept."""
    if _stop:
        raise Stopped(f"{stage}: stopped on request; the same command resumes")
