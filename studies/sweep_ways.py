"""One sweep in four ways, timed, and whether they end in the same table.

    python studies/sweep_ways.py --out runs/ways                      # all four of the twelve late stages, quick size
    python studies/sweep_ways.py --out runs/ways killed dask          # two of them
    python studies/sweep_ways.py --out runs/ways --preset tiny --sweep cases/valhalla_980km/late_stages.toml

    separate   every member by itself, in a folder of runs of its own: nothing is shared
    plain      the sweep
    killed     the sweep, all its processes ended by SIGKILL twice: in the shock stage, and when a third is done
    dask       the sweep on two workers of dask.distributed, one of them killed when a third is done

Each way has a folder of runs of its own in --out, so that none takes stages from another. With one thread for each
member the tables are the same to the last digit; where they are not, the largest relative difference is told (exit
code 1). A way whose table is there is not run again; one that was stopped goes on, and its time counts on. Leaves
<way>.csv, ways.json (wall times) and the folders of runs.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from matter.errors import InputError
from matter.files import archive
from pipeline.case import read as cases
from pipeline.running import run_process
from pipeline.store.store import STORE
from pipeline.sweeps import sweep as sweeps
from pipeline.sweeps import sweep_dask, sweep_run, sweep_table

ROOT = Path(__file__).resolve().parents[1]
LOOK_S = 0.2


class SweepState:
    """What a way has made so far, by its store."""

    def __init__(self, sweep: sweeps.Sweep):
        self.store, self.members = sweep.out / STORE, len(sweep.members)

    def shock_is_made(self) -> bool:
        """Whether the shock stage has written a checkpoint."""
        return bool(list(self.store.glob("sph-*/checkpoint_*.h5")))

    def third_is_done(self) -> bool:
        """Whether a third of the members is done, and another is not."""
        done = len(list(self.store.glob("crater-*/done.json")))
        return self.members / 3 <= done < self.members


def separate(sweep: sweeps.Sweep, threads: int, at_once: int) -> list[sweep_table.Row]:
    """Every member by itself, ``at_once`` side by side; the rows of their tables."""
    alone = [
        dataclasses.replace(sweep, out=sweep.out / member.name, members=(member,), name="alone")
        for member in sweep.members
    ]

    def one(of: sweeps.Sweep) -> None:
        of.out.mkdir(parents=True, exist_ok=True)
        with open(of.out / "log.txt", "ab") as log:
            command = run_process.command(of.arguments(of.members[0], threads))
            subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False)

    with ThreadPoolExecutor(at_once) as pool:
        list(pool.map(one, alone))
    return [sweep_table.rows_of(of)[0] for of in alone]


def swept(
    sweep: sweeps.Sweep, arguments: list[str], kills: Sequence[Callable[[], bool]] = ()
) -> list[sweep_table.Row]:
    """The command of the sweep, with all its processes killed when each of ``kills`` comes true; the rows."""
    sweep.out.mkdir(parents=True, exist_ok=True)
    command = run_process.command([*arguments, "--out", str(sweep.out)])
    with open(sweep.out / "log.txt", "ab") as log:
        for due in kills:
            process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
            while process.poll() is None and not due():
                time.sleep(LOOK_S)
            if process.poll() is not None:
                raise InputError(f"the sweep ended before it was to be killed: see {log.name}")
            print(f"  killed: {len(kill(process.pid))} processes", flush=True)
            process.wait()
        subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False)
    return sweep_table.write(sweep)


def kill(pid: int) -> list[int]:
    """End a process and all that it has started, whatever session they are in; their numbers."""
    listed = subprocess.run(["ps", "-e", "-o", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
    parents = {int(one): int(parent) for one, parent in (line.split() for line in listed.splitlines())}
    family = [pid]
    for known in family:
        family += [one for one, parent in parents.items() if parent == known]
    for one in family:
        try:
            os.kill(one, signal.SIGKILL)
        except ProcessLookupError:
            continue
    return family


def on_dask(sweep: sweeps.Sweep, threads: int) -> list[sweep_table.Row]:
    """The sweep on two local workers, one of which is killed; the rows. Raises ``InputError`` without dask."""
    try:
        from distributed import LocalCluster
    except ImportError:
        raise InputError("the way dask needs dask.distributed: pip install 'bolide[cluster]'") from None
    sweep_run.links(sweep)
    state, ended = SweepState(sweep), threading.Event()
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:

        def killer() -> None:
            while not state.third_is_done():
                if ended.wait(LOOK_S):
                    return
            worker = next(iter(cluster.workers.values())).pid
            os.kill(worker, signal.SIGKILL)
            print(f"  killed: worker {worker}", flush=True)

        thread = threading.Thread(target=killer)
        thread.start()
        try:
            sweep_dask.run(sweep, threads, cluster.scheduler_address, lambda words: print(f"  {words}", flush=True))
        finally:
            ended.set()
            thread.join()
    return sweep_table.write(sweep)


def written(rows: Sequence[sweep_table.Row], file: Path) -> None:
    """The rows as CSV, in full precision."""
    columns = sweep_table.columns_of(rows)
    lines = [columns, *(["" if row.get(name) is None else row[name] for name in columns] for row in rows)]
    with archive.replacing(file) as temporary, open(temporary, "w", newline="") as out:
        csv.writer(out, lineterminator="\n").writerows(lines)


def differences(one: Path, other: Path) -> tuple[list[str], float]:
    """Which cells of two tables differ (``member column``), and the largest relative difference among numbers."""
    tables = []
    for file in (one, other):
        with open(file, newline="") as lines:
            tables.append({row["member"]: row for row in csv.DictReader(lines)})
    first, second = tables
    found, largest = [], 0.0
    for member in dict.fromkeys([*first, *second]):
        rows = first.get(member, {}), second.get(member, {})
        for column in dict.fromkeys([*rows[0], *rows[1]]):
            a, b = (row.get(column) or "" for row in rows)
            if a == b:
                continue
            found.append(f"{member} {column}")
            try:
                largest = max(largest, abs(float(a) - float(b)) / max(abs(float(a)), abs(float(b))))
            except ValueError:
                largest = float("inf")
    return found, largest


WAYS = ("separate", "plain", "killed", "dask")


def run(way: str, sweep: sweeps.Sweep, arguments: list[str], threads: int, at_once: int) -> list[sweep_table.Row]:
    """Run one way; its rows."""
    if way == "separate":
        return separate(sweep, threads, at_once)
    if way == "dask":
        return on_dask(sweep, threads)
    state = SweepState(sweep)
    return swept(sweep, arguments, (state.shock_is_made, state.third_is_done) if way == "killed" else ())


def main(words: Sequence[str] | None = None) -> int:
    """Exit code 0, 1 where tables differ or a member failed, 2 for bad input."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ways", nargs="*", metavar="WAY", help=", ".join(WAYS))
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--sweep", type=Path, default=ROOT / "cases" / "valhalla_980km" / "late_stages.toml")
    parser.add_argument("--preset", default="quick")
    parser.add_argument("--threads", type=int, default=1, help="of each member")
    given = parser.parse_args(words)
    try:
        if unknown := [way for way in given.ways if way not in WAYS]:
            raise InputError(f"no way {unknown[0]!r} (there are {', '.join(WAYS)})")
        return _all(given)
    except InputError as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code


def _all(given: argparse.Namespace) -> int:
    read = cases.read(given.sweep, given.preset or None)
    table = sweeps.read_table(read.sweep, [])
    preset = ["--preset", given.preset] if given.preset else []
    arguments = [str(given.sweep), *preset, "--sweep", "--threads", str(given.threads)]
    given.out.mkdir(parents=True, exist_ok=True)
    note = given.out / "ways.json"
    times = archive.read_json(note) if note.is_file() else {}
    for way in given.ways or WAYS:
        if (given.out / f"{way}.csv").is_file():
            continue
        sweep = sweeps.planned_sweep(read, table, given.out / way)
        at_once = sweep_run.side_by_side(sweep, given.threads)
        print(f"== {way}: {len(sweep.members)} members, {given.threads} thread(s) each, {at_once} at once", flush=True)
        began = time.monotonic()
        try:
            rows = run(way, sweep, arguments, given.threads, at_once)
        finally:
            times[way] = times.get(way, 0.0) + time.monotonic() - began
            archive.write_text(note, json.dumps(times, indent=1))
        if all(row["state"] == "done" for row in rows):
            written(rows, given.out / f"{way}.csv")
    return _concluded(given.out, times)


def _concluded(out: Path, times: dict[str, float]) -> int:
    code, reference = 0, ""
    for way in [way for way in WAYS if way in times]:
        file = out / f"{way}.csv"
        words = "not all members are done"
        if file.is_file():
            reference = reference or way
            found, largest = differences(out / f"{reference}.csv", file)
            words = "its table is the reference" if way == reference else f"the same table as {reference}"
            if found:
                words = f"differs from {reference} in {len(found)} cells by up to {largest:.1e} ({found[0]} ...)"
        code = max(code, int(not file.is_file() or "differs" in words))
        print(f"{way:<10}{times[way] / 60.0:>8.1f} min   {words}")
    return code


if __name__ == "__main__":
    sys.exit(main())
