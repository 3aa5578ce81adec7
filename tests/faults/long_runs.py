"""One long run that is stopped again and again, watched from outside: steps by the names of its checkpoints, CPU time
and memory by what the system says of the process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")
EVERY_S = 30
"""Seconds between checkpoints, by which steps are counted."""


@dataclass
class Watched:
    """What was seen: ``sessions`` of (wall time [s], step, CPU time [s]) at each new checkpoint, ``memory`` of (wall
    time [s], resident bytes), exit codes of the stops, and the output."""

    sessions: list[list[tuple[float, int, float]]] = field(default_factory=list)
    memory: list[tuple[float, float]] = field(default_factory=list)
    codes: list[int] = field(default_factory=list)
    text: str = ""

    def rates(self, window: float) -> list[tuple[float, float]]:
        """Steps per CPU second over the last ``window`` [s] before each stop, and over the first after it."""
        pairs = []
        for before, after in zip(self.sessions, self.sessions[1:]):
            last = [row for row in before if row[0] >= before[-1][0] - window] if before else []
            first = [row for row in after if row[0] <= after[0][0] + window] if after else []
            if len(last) > 2 and len(first) > 2:
                pairs.append((_rate(last), _rate(first)))
        return pairs

    def memory_of(self, share_from: float, share_to: float) -> float:
        """Median resident memory [bytes] between two shares of the whole time."""
        end = self.memory[-1][0]
        return median(held for at, held in self.memory if share_from * end <= at <= share_to * end)


def _rate(rows: Sequence[tuple[float, int, float]]) -> float:
    return (rows[-1][1] - rows[0][1]) / (rows[-1][2] - rows[0][2])


def watched(words: Sequence[str], place: Path, pattern: str, session: float, stops: int, log: Path) -> Watched:
    """Run ``run_case`` with these arguments in sessions of so many seconds [s], ended by SIGTERM, ``stops`` times, and
    once more. ``pattern``: the checkpoints of the stage, below ``place``."""
    seen, began = Watched(), time.monotonic()
    command = [sys.executable, "-c", "from pipeline.cli import run_case; run_case()", *words]
    command += ["--checkpoint-every", f"{EVERY_S} s"]
    for _ in range(stops + 1):
        with open(log, "a") as out:
            child = subprocess.Popen(command, cwd=ROOT, stdout=out, stderr=subprocess.STDOUT)
        rows: list[tuple[float, int, float]] = []
        known = _newest(place, pattern)
        first = time.monotonic()
        while child.poll() is None:
            now = time.monotonic()
            try:
                cpu, held = _of(child.pid)
            except OSError:
                break
            step = _newest(place, pattern)
            if step != known:
                known = step
                rows.append((now - began, step, cpu))
            if rows:  # compiling and loading are over
                seen.memory.append((now - began, held))
            if now - first > session:
                child.send_signal(signal.SIGTERM)
                break
            time.sleep(1.0)
        seen.codes.append(child.wait())
        seen.sessions.append(rows)
        if seen.codes[-1] != 75:
            break
    seen.text = log.read_text()
    return seen


def _newest(place: Path, pattern: str) -> int:
    steps = [int(path.stem.partition("_")[2]) for path in place.glob(pattern)]
    return max(steps, default=-1)


def _of(pid: int) -> tuple[float, float]:
    """CPU time [s] and resident memory [bytes] of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS, int(fields[21]) * _PAGE
