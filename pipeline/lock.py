"""One run works in a folder at a time.

The lock is the kernel's (``flock``): it goes with the process, so that a killed run leaves nothing behind that has to be cleaned up. The
file names the holder for whoever finds the folder taken.
"""

from __future__ import annotations

import fcntl
import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from matter.errors import InputError


@contextmanager
def held(path: Path, what: str, wait: Callable[[str], None] | None = None) -> Iterator[None]:
    """Hold the lock at ``path`` while the block runs.

    When another process has it: raises ``InputError`` that names it, or, with ``wait``, calls ``wait(message)`` every half second until it
    is free (``wait`` may raise to give up).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "a+") as file:
        while True:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError:
                message = f"{what} is in use by {_holder(path)}"
                if wait is None:
                    raise InputError(f"{message}; wait for it, stop it, or choose another --out") from None
                wait(message)
                time.sleep(0.5)
        file.seek(0)
        file.truncate()
        file.write(json.dumps({"pid": os.getpid(), "host": platform.node(), "since": time.strftime("%Y-%m-%dT%H:%M:%S%z")}))
        file.flush()
        yield


def _holder(path: Path) -> str:
    try:
        holder = json.loads(path.read_text())
        return f"process {holder['pid']} on {holder['host']} since {holder['since']}"
    except (OSError, ValueError, KeyError):
        return "another process"
