"""Commands in children of the test process: they end, print and are told apart like processes of their own, and find
loaded what takes a new process a second or two (Python, numba, scipy). What is about the start of a process, or about
signals to one, starts one."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from functools import cache
from pathlib import Path

LATE = (
    "matplotlib.pyplot",
    "jinja2",
    "pipeline.cli",
    "pipeline.commands.run_command",
    "pipeline.running.run",
    "pipeline.sweeps.sweep_run",
    "pipeline.running.result",
    "crater.ejecta.excavation",
    "crater.stage",
    "handoff.stage",
)
"""What the commands load when they first need it."""


@cache
def load() -> None:
    """Load all that, and the units, in this process."""
    from matter.case import quantity

    for name in LATE:
        importlib.import_module(name)
    quantity.parse("1 km", "m")


def run(
    work: Callable[[], object], environment: dict[str, str], cwd: Path | None = None, timeout: float = 120.0
) -> subprocess.CompletedProcess[str]:
    """``work`` in a child with this ``environment`` in the folder ``cwd``: its exit code and what it printed.

    Raises ``subprocess.TimeoutExpired`` when it takes longer than ``timeout`` [s]; it is killed then."""
    load()
    sys.stdout.flush()
    sys.stderr.flush()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = os.fork()
        if child == 0:
            _child(work, environment, cwd, out.fileno(), err.fileno())
        until = time.monotonic() + timeout
        while not (ended := os.waitpid(child, os.WNOHANG))[0]:
            if time.monotonic() > until:
                os.kill(child, 9)
                os.waitpid(child, 0)
                raise subprocess.TimeoutExpired("a child of the test", timeout)
            time.sleep(0.002)
        out.seek(0)
        err.seek(0)
        code = os.waitstatus_to_exitcode(ended[1])
        return subprocess.CompletedProcess([], code, out.read().decode(), err.read().decode())


def _child(work: Callable[[], object], environment: dict[str, str], cwd: Path | None, out: int, err: int) -> None:
    code = 1
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(err, 2)
        sys.stdin = os.fdopen(0, closefd=False)
        sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
        os.environ.update(environment)
        if cwd is not None:
            os.chdir(cwd)
        try:
            work()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
            if code and not isinstance(end.code, int):
                print(end.code, file=sys.stderr)
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)
