"""``run_case`` as a process of its own, for what makes many runs of cases one after the other."""

from __future__ import annotations

import signal
import subprocess
import sys

STOPPED = 75
"""Exit code of a run that was stopped on request and can be resumed."""
_COMMAND = "from pipeline.cli import run_case; run_case()"


def command(arguments: list[str]) -> list[str]:
    """The words that start ``run_case`` with these arguments as a process."""
    return [sys.executable, "-c", _COMMAND, *arguments]


def as_process(arguments: list[str]) -> int:
    """``run_case`` with these arguments as its own process; its exit code. SIGTERM and SIGINT are handed on."""
    child = subprocess.Popen(command(arguments))
    before = {
        number: signal.signal(number, lambda n, _: child.send_signal(n)) for number in (signal.SIGTERM, signal.SIGINT)
    }
    try:
        return child.wait()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
