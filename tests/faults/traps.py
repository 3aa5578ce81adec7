"""Failures injected where the program touches its disk: recorded once, then one place after another fails or kills.

A *place* is the kind of operation (open to write, open to read, make, replace, remove, link, mode, sync) and the two
innermost lines of the project that ask for it. Operations are heard by an audit hook (PEP 578) and around
``os.fsync``; what HDF5 itself writes fails through a limit on the size of files, set when the file is opened.
"""

from __future__ import annotations

import errno
import json
import os
import resource
import signal
import sys
from pathlib import Path

from pipeline.case import stages

ROOT = Path(__file__).resolve().parents[2]
KINDS = {
    "os.rename": "replace", "os.remove": "remove", "os.mkdir": "make", "os.rmdir": "remove", "os.symlink": "link",
    "os.link": "link", "os.chmod": "mode", "os.truncate": "truncate", "shutil.rmtree": "remove",
    "tempfile.mkstemp": "make", "os.fsync": "sync",
}  # fmt: skip
FAILURES = {"full": errno.ENOSPC, "input/output": errno.EIO, "read-only": errno.EROFS, "quota": errno.EDQUOT}
LIMIT = 512
"""Bytes after which a file that ``short`` has opened takes no more."""


class Trap:
    """Hears every operation under ``folder`` and acts at the first one at ``place`` (None: only counts).

    ``how``: a name of ``FAILURES`` raises that error, ``short`` lets the file be opened and take ``LIMIT`` bytes,
    ``kill`` ends the process without a word.
    """

    def __init__(self, folder: Path, place: str | None = None, how: str = "kill") -> None:
        self.folder, self.place, self.how = str(Path(folder).resolve()), place, how
        self.places: dict[str, str] = {}
        """The places heard, and the stage that was made when each was first."""
        self.busy = self.sprung = False

    def set(self) -> Trap:
        """Listen from now on, for the rest of this process."""
        sync = os.fsync

        def fsync(file):
            self._heard("os.fsync", (os.readlink(f"/proc/self/fd/{int(getattr(file, 'fileno', lambda: file)())}"),))
            return sync(file)

        os.fsync = fsync
        sys.addaudithook(self._heard)
        return self

    def written_to(self, path: Path) -> Trap:
        """Leave the places in a JSON file when the process ends by ``os._exit`` (as children do that were forked)."""
        leave = os._exit

        def last(code: int) -> None:
            self.busy = True
            Path(path).write_text(json.dumps(self.places, indent=1))
            leave(code)

        os._exit = last  # type: ignore[assignment]
        return self

    def _stage(self) -> str:
        """The first stage that is not done."""
        done = {path.parent.name.partition("-")[0] for path in Path(self.folder).glob(".store/*/done.json")}
        return next((stage for stage in stages.ORDER if stage not in done), "")

    def _heard(self, event: str, arguments: tuple) -> None:
        if self.busy or (event != "open" and event not in KINDS):
            return
        self.busy = True
        try:
            self._look(event, arguments)
        finally:
            self.busy = False

    def _look(self, event: str, arguments: tuple) -> None:
        paths = [os.fsdecode(path) for path in arguments if isinstance(path, str | bytes | os.PathLike)]
        if not any(os.path.abspath(path).startswith(self.folder) for path in paths):
            return
        if event == "open":
            flags = arguments[2] if isinstance(arguments[2], int) else 0
            kind = "write" if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) else "read"
        else:
            kind = KINDS[event]
        place = f"{kind} {_lines()}"
        self.places.setdefault(place, self._stage())
        if place != self.place or self.sprung:
            return
        self.sprung = True
        if self.how == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.how == "short":
            resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, resource.RLIM_INFINITY))
            return
        raise OSError(FAILURES[self.how], os.strerror(FAILURES[self.how]), paths[0])


def _lines() -> str:
    """The two innermost lines of the project's own code on the stack."""
    found, frame = [], sys._getframe(1)
    while frame is not None and len(found) < 2:
        file = frame.f_code.co_filename
        if file.startswith(str(ROOT)) and "/tests/" not in file and "/.venv/" not in file and "/.ci/" not in file:
            found.append(f"{os.path.relpath(file, ROOT)}:{frame.f_lineno} {frame.f_code.co_name}")
        frame = frame.f_back
    return " < ".join(found)
