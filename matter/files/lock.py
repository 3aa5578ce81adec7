"""One run works in a folder at a time, and one in a stage of the store.

The lock is the kernel's (``flock``): it goes with the process, so that a killed run leaves nothing behind that has to
be cleaned up. The file names the holder for whoever finds the folder taken. On a file system that refuses such locks
an owner file stands for it, whose holder touches it every half minute; one that has been silent for ten minutes is
taken over, and that is said.
"""

from __future__ import annotations

import fcntl
import json
import os
import platform
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from matter import progress
from matter.errors import InputError

BEAT_S, SILENT_S = 30.0, 600.0
"""How often an owner file is touched, and after which silence it is taken over."""
EVERY_S = 0.5


@contextmanager
def held(path: Path, what: str, wait: Callable[[str], None] | None = None) -> Iterator[None]:
    """Hold the lock at ``path`` while the block runs.

    When another process has it: raises ``InputError`` that names it, or, with ``wait``, calls ``wait(message)`` every
    half second until it is free (``wait`` may raise to give up).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "a+") as file:
        while (mine := _flocked(file)) is False:
            _refuse_or_wait(path, path, what, wait)
        if mine is None:
            with _owned(path, what, wait):
                yield
            return
        file.seek(0)
        file.truncate()
        file.write(_me())
        file.flush()
        yield


def _flocked(file: TextIO) -> bool | None:
    """Whether the kernel's lock was had; None where the file system has no such locks."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        return None
    return True


def _refuse_or_wait(path: Path, owner: Path, what: str, wait: Callable[[str], None] | None) -> None:
    message = f"{what} is in use by {holder(owner)}"
    if wait is None:
        raise InputError(f"{message}; wait for it, stop it, or choose another --out") from None
    wait(message)
    time.sleep(EVERY_S)


def _me() -> str:
    return json.dumps({"pid": os.getpid(), "host": platform.node(), "since": time.strftime("%Y-%m-%dT%H:%M:%S%z")})


@contextmanager
def _owned(path: Path, what: str, wait: Callable[[str], None] | None) -> Iterator[None]:
    """Hold an owner file beside ``path`` while the block runs."""
    owner, over = path.with_name(f"{path.name}.owner"), threading.Event()
    while True:
        try:
            handle = os.open(owner, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644)
            break
        except FileExistsError:
            if _silence(path, owner) > SILENT_S:
                _take_over(path, owner, what)
                continue
            _refuse_or_wait(path, owner, what, wait)
    with os.fdopen(handle, "w") as file:
        file.write(_me())

    def beat() -> None:
        while not over.wait(BEAT_S):
            with suppress(OSError):
                os.utime(owner)

    heart = threading.Thread(target=beat, daemon=True)
    heart.start()
    try:
        yield
    finally:
        over.set()
        heart.join()
        owner.unlink(missing_ok=True)


def _take_over(path: Path, owner: Path, what: str) -> None:
    """Set a silent owner's file aside; one that somebody else has just made anew goes back."""
    aside = owner.with_name(f"{owner.name}.{platform.node()}.{os.getpid()}")
    with suppress(FileNotFoundError):
        os.replace(owner, aside)
        if _silence(path, aside) > SILENT_S:
            progress.tell(
                f"{what}: {holder(aside)} has been silent for more than {SILENT_S / 60.0:.0f} minutes and is taken "
                f"to be gone"
            )
            aside.unlink()
        else:
            os.replace(aside, owner)


def _silence(path: Path, owner: Path) -> float:
    """How long an owner file has not been touched [s], by the clock of the file system."""
    try:
        os.utime(path)
        return path.stat().st_mtime - owner.stat().st_mtime
    except FileNotFoundError:
        return 0.0


def taken(path: Path) -> bool:
    """Whether another process holds the lock at ``path``."""
    try:
        with open(path) as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except (BlockingIOError, PermissionError):
        return True
    except OSError:
        return path.with_name(f"{path.name}.owner").exists()
    return False


def holder(path: Path) -> str:
    """Who holds the lock at ``path``, in words."""
    try:
        who = json.loads(path.read_text())
        return f"process {who['pid']} on {who['host']} since {who['since']}"
    except (OSError, ValueError, KeyError):
        return "another process"
