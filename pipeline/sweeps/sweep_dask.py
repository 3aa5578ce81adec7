"""A sweep on workers of dask.distributed: a scheduler that runs already (``--scheduler tcp://host:8786``), or one on
this machine (``--scheduler local``).

A worker starts each member as a process and waits for it; all of them see the same file system. When a worker dies,
dask gives its member to another, which waits for what the dead one has left running and then goes on from what lies on
the disk.
"""

from __future__ import annotations

import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from matter.errors import InputError, Stopped
from matter.files import lock
from pipeline.running import run_process
from pipeline.sweeps.sweep import Sweep
from pipeline.sweeps.sweep_run import EVERY_S, side_by_side, state_of

LOCAL = "local"
PATIENCE_S = 30.0
"""How long a scheduler has to answer."""


def run(sweep: Sweep, threads: int, address: str, say: Callable[[str], None]) -> dict[str, int]:
    """Run every member that is not done; exit codes of those that could not be made (-1: lost with its workers).

    Raises ``InputError`` where dask is not installed or no scheduler answers, ``Stopped`` when asked to stop, after
    the members have saved.
    """
    try:
        from distributed import Client, Event, LocalCluster
    except ImportError:
        raise InputError("--scheduler needs dask.distributed: pip install 'bolide[cluster]'") from None
    asked, ours = threading.Event(), threading.current_thread() is threading.main_thread()
    before = (
        {number: signal.signal(number, lambda *_: asked.set()) for number in (signal.SIGTERM, signal.SIGINT)}
        if ours
        else {}
    )
    try:
        cluster: Any = address
        if address == LOCAL:
            cluster = LocalCluster(
                n_workers=side_by_side(sweep, threads), threads_per_worker=1, dashboard_address=None
            )
        with Client(cluster, timeout=PATIENCE_S) as client:
            try:
                return _on(client, Event(f"stop {sweep.folder.name}", client=client), sweep, threads, say, asked)
            finally:
                if address == LOCAL:
                    cluster.close()
    except (OSError, ValueError) as reason:
        if isinstance(reason, InputError):
            raise
        raise InputError(f"--scheduler {address}: no scheduler answers there ({reason})") from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _on(
    client: Any, stop: Any, sweep: Sweep, threads: int, say: Callable[[str], None], asked: threading.Event
) -> dict[str, int]:
    stop.clear()
    logs = sweep.folder / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    futures, failed = {}, {}
    for member in sweep.members:
        if state_of(sweep, member).word != "done":
            command, folder = (
                run_process.command(sweep.arguments(member, threads)),
                sweep.requests[member.name].run_folder,
            )
            given = (
                command,
                str(Path.cwd()),
                str(folder.resolve()),
                str((logs / f"{member.name}.log").resolve()),
                stop.name,
            )
            futures[member.name] = client.submit(
                _member, *given, key=f"{sweep.folder.name}-{member.name}-{time.time():.3f}", pure=False
            )
    while futures:
        if asked.is_set() and not stop.is_set():
            stop.set()
        for name in [name for name, future in futures.items() if future.done()]:
            future = futures.pop(name)
            code = int(future.result()) if future.status == "finished" else -1
            if state_of(sweep, next(one for one in sweep.members if one.name == name)).word == "done":
                say(f"{name}: done")
            elif code == run_process.STOPPED:
                asked.set()
                say(f"{name}: stopped")
            else:
                failed[name] = code
                say(f"{name}: failed, exit code {code} ({logs / f'{name}.log'})")
        time.sleep(EVERY_S)
    if asked.is_set():
        raise Stopped("the sweep was stopped; the same command continues")
    return failed


def _member(command: list[str], here: str, folder: str, log: str, stop: str) -> int:
    """On a worker: run a member and wait for it; its exit code. What a worker that died has left running is waited for
    first."""
    from distributed import Event

    asked = Event(stop)
    while lock.taken(Path(folder) / "run.lock"):
        if asked.is_set():
            return run_process.STOPPED
        time.sleep(EVERY_S)
    if asked.is_set():
        return run_process.STOPPED
    with open(log, "ab") as file:
        child = subprocess.Popen(command, cwd=here, stdout=file, stderr=subprocess.STDOUT, start_new_session=True)
        told = False
        while (code := child.poll()) is None:
            if not told and asked.is_set():
                child.send_signal(signal.SIGTERM)
                told = True
            time.sleep(EVERY_S)
    return code
