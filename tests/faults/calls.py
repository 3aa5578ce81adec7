"""Calls of the commands in children of this process: exit code, output, time and memory of each, one forked from warm
modules."""

from __future__ import annotations

import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from pipeline.commands import command

SECONDS, BYTES = 10.0, 2**30
"""What no call on bad input may take: CPU time [s], memory [bytes] more than the process that it was forked from."""
_CPU_LIMIT, _PATIENCE = 2 * SECONDS, 60 * SECONDS  # a busy machine stretches the clock, not the time of the processor


class Said(NamedTuple):
    """How a call ended: exit code (negative: the signal that ended it), what it printed, CPU seconds, memory that it
    took [bytes]."""

    code: int
    text: str
    seconds: float
    bytes: int

    def faults(self, codes: tuple[int, ...] = (0, 2)) -> list[str]:
        """What no input may bring about."""
        found = []
        if self.code not in codes:
            found.append(f"exit code {self.code}")
        if "Traceback" in self.text:
            found.append("a traceback")
        if self.seconds > SECONDS:
            found.append(f"{self.seconds:.1f} s")
        if self.bytes > BYTES:
            found.append(f"{self.bytes / 2**20:.0f} MB")
        if self.code == -signal.SIGXCPU:
            found.append("a hang")
        if len(self.text) > command.LONGEST + 200:
            found.append(f"{len(self.text)} characters")
        if self.code == 2 and not self.text.strip():
            found.append("exit code 2 without a word")
        return found


def call(name: str, words: list[str], log: Path, cwd: Path | None = None) -> Said:
    """``name`` (a command of ``pipeline.cli``) with the arguments ``words``; what it prints goes through ``log``."""
    from pipeline import cli

    def work() -> None:
        if cwd is not None:
            os.chdir(cwd)
        resource.setrlimit(resource.RLIMIT_CPU, (int(_CPU_LIMIT), resource.RLIM_INFINITY))
        sys.argv = [name, *words]
        getattr(cli, name)()

    return forked(work, log)


def forked(work: Callable[[], object], log: Path, patience: float = _PATIENCE) -> Said:
    """``work`` in a child of this process, killed after ``patience`` seconds of the clock."""
    sys.stdout.flush()
    sys.stderr.flush()
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(write, str(_resident()).encode())
        os.close(write)
        _child(work, log)
    os.close(write)
    with open(read, "rb") as pipe:
        before = int(pipe.read() or 0)
    until = time.monotonic() + patience
    while True:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            break
        if time.monotonic() > until:
            os.kill(child, 9)
            _, status, usage = os.wait4(child, 0)
            break
        time.sleep(0.002)
    text = log.read_text(errors="replace") if log.is_file() else ""
    return Said(
        os.waitstatus_to_exitcode(status),
        text,
        usage.ru_utime + usage.ru_stime,
        max(0, usage.ru_maxrss * 1024 - before),
    )


def _resident() -> int:
    """Memory [bytes] that this process holds. Asked in the child: a fork does not take the pages of files along."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def _child(work: Callable[[], object], log: Path) -> None:
    code = 70
    try:
        file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, 1)
        os.dup2(file, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
        try:
            work()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else (0 if end.code is None else 1)
        except BaseException:
            traceback.print_exc()
            code = 70
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)
