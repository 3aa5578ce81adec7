"""Running a sweep on this machine: processes side by side, none of which waits for what another is making; and what
its members' folders say of them.

Each member is ``run_case`` in a process of its own, with its words in ``<sweep>/logs``: one that fails or is killed
loses nothing but what it did since its last checkpoint, and the same command continues. A member is begun when the
first stage that it has to make is not being made by one that runs already.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from matter.errors import Stopped
from matter.files import lock
from pipeline.case import stages
from pipeline.running import plan, prediction, run_process
from pipeline.running.request import settings_of
from pipeline.running.screen import duration
from pipeline.store import folder, provenance
from pipeline.sweeps import sweep_cost
from pipeline.sweeps.sweep import Member, Sweep

EVERY_S = 1.0
_ROOM = 0.8
"""Share of the memory that members may take together."""


@dataclass(frozen=True)
class State:
    """Where a member stands: done, running, stopped, failed or to do; the stage, how much of it, and why it failed."""

    word: str
    stage: str = ""
    fraction: float = 0.0
    reason: str = ""


def state_of(sweep: Sweep, member: Member) -> State:
    """What a member's run folder says, or the table of those that were computed elsewhere."""
    request = sweep.requests[member.name]
    last = request.wanted[-1]
    if member.name in sweep.elsewhere:
        return State("done", last, 1.0)
    if (done := folder.record(stages.folder(request.run_folder, last) / folder.DONE)) and not folder.lacking(done):
        return State("done", last, 1.0)
    told = folder.record(request.run_folder / "status.json")
    word = str(told.get("state", "to do"))
    if word == "running" and not lock.taken(request.run_folder / "run.lock"):
        word = "stopped"
    return State(
        "to do" if word == "done" else word,
        str(told.get("stage", "")),
        float(told.get("fraction", 0.0)),
        " ".join(str(told.get("reason", "")).split()) if word == "failed" else "",
    )


def outcome_of(sweep: Sweep, member: Member, failed: Mapping[str, int]) -> State:
    """What its folder says of a member, and the exit codes of those that ``failed`` just now: one that was refused or
    killed has not written itself why."""
    state, code = state_of(sweep, member), failed.get(member.name)
    if code is None or state.word == "done" or state.reason:
        return state
    log = log_of(sweep, member.name)
    lines = log.read_text(errors="replace").split("\n") if log.is_file() else []
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    return replace(state, word="failed", reason=f"exit code {code}{f': {last}' if last else ''}")


def log_of(sweep: Sweep, name: str) -> Path:
    """What the process of a member has said."""
    return sweep.folder / "logs" / f"{name}.log"


def first_to_make(sweep: Sweep, member: Member) -> str:
    """The name in the store of the first stage that a member has to make; empty where there is none, or where
    another's result decides it."""
    request = sweep.requests[member.name]
    return plan.first_to_make(request, settings_of(request))


def side_by_side(sweep: Sweep, threads: int) -> int:
    """How many members run at once: by cores, and by the memory that the largest stage of one needs."""
    need = max(
        (
            row["memory_bytes"]
            for request in sweep.requests.values()
            for row in prediction.predictions(request, settings_of(request)).values()
        ),
        default=0.0,
    )
    have = provenance.memory_bytes()
    by_memory = int(_ROOM * have / need) if need > 0.0 and have > 0 else len(sweep.members)
    return max(1, min(cores() // threads, by_memory, len(sweep.members)))


def cores() -> int:
    """Cores that this process may use."""
    return provenance.cores()


def checked(sweep: Sweep, threads: int) -> str:
    """What would run: the members, how many at once, which stages they share and what all of it costs."""
    slots = side_by_side(sweep, threads)
    lines = [status(sweep), "", f"{'stage':<12}{'members':>10}{'to compute':>12}{'time':>14}"]
    rows = sweep_cost.rows_of(sweep)
    lines += [f"{stage:<12}{row.members:>10}{row.made:>12}{duration(row.wall_s):>14}" for stage, row in rows.items()]
    total = sum(row.wall_s for row in rows.values())
    lines.append(f"{'total':<12}{'':>22}{duration(total):>14}")
    at_once = f"{slots} at once, {threads} thread{'s' if threads > 1 else ''} each"
    lines.append(
        f"times are for {prediction.threads()} and compiled kernels, and at most this long: members may yet have more "
        f"stages in common; {at_once}"
    )
    return "\n".join(lines)


@dataclass
class Runner:
    """Runs the members of a ``sweep`` that are not done; ``say`` is told what happens."""

    sweep: Sweep
    threads: int
    slots: int
    say: Callable[[str], None]
    running: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)
    failed: dict[str, int] = field(default_factory=dict)
    stopping: bool = False

    def run(self) -> dict[str, int]:
        """Run every member; exit codes of those that could not be made. Raises ``Stopped`` when asked to stop, after
        the members have saved."""
        waiting = [member for member in self.sweep.members if state_of(self.sweep, member).word != "done"]
        ours = threading.current_thread() is threading.main_thread()  # elsewhere signals are somebody else's
        before = (
            {number: signal.signal(number, self._stop) for number in (signal.SIGTERM, signal.SIGINT)} if ours else {}
        )
        try:
            while (waiting or self.running) and not (self.stopping and not self.running):
                self._gather()
                waiting = [member for member in waiting if state_of(self.sweep, member).word != "done"]
                if (
                    not self.stopping
                    and len(self.running) < self.slots
                    and (member := self._next(waiting)) is not None
                ):
                    waiting.remove(member)
                    self._begin(member)
                else:
                    time.sleep(EVERY_S)
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
            for process in self.running.values():
                process.send_signal(signal.SIGTERM)
        if self.stopping:
            raise Stopped("the sweep was stopped; the same command continues")
        return self.failed

    def _next(self, waiting: list[Member]) -> Member | None:
        """The first member that nobody runs, and that has something to make that none of those that run is making."""
        states = {member.name: state_of(self.sweep, member).word for member in waiting}
        others = [
            member
            for member in self.sweep.members
            if member.name in self.running or states.get(member.name) == "running"
        ]
        free = [member for member in waiting if states[member.name] != "running"]
        if not others:
            return free[0] if free else None

        def busy() -> set[str]:
            return {first_to_make(self.sweep, member) for member in others}

        before = busy()
        candidate = next((member for member in free if first_to_make(self.sweep, member) not in before), None)
        # asked again: meanwhile one of the others may have gone on to the stage that this one wants
        return candidate if candidate is not None and first_to_make(self.sweep, candidate) not in busy() else None

    def _begin(self, member: Member) -> None:
        log = log_of(self.sweep, member.name)
        log.parent.mkdir(parents=True, exist_ok=True)
        with open(log, "ab") as file:
            command = run_process.command(self.sweep.arguments(member, self.threads))
            self.running[member.name] = subprocess.Popen(
                command, stdout=file, stderr=subprocess.STDOUT, start_new_session=True
            )
        self.say(f"{member.name}: begins ({_words(self.sweep, member)})")

    def _gather(self) -> None:
        """Take note of the members that have ended."""
        for name, process in list(self.running.items()):
            code = process.poll()
            if code is None:
                continue
            del self.running[name]
            member = next(one for one in self.sweep.members if one.name == name)
            if state_of(self.sweep, member).word == "done":
                self.say(f"{name}: done")
            elif code == run_process.STOPPED:
                self.stopping = True
                self.say(f"{name}: stopped")
            else:
                self.failed[name] = code
                self.say(f"{name}: failed, exit code {code} ({log_of(self.sweep, name)})")

    def _stop(self, number: int, frame: object) -> None:
        if self.stopping:
            for process in self.running.values():
                process.kill()
        self.stopping = True
        print(f"{signal.Signals(number).name}: the members save before exit", file=sys.stderr, flush=True)
        for process in self.running.values():
            process.send_signal(number)


def links(sweep: Sweep) -> None:
    """Let the sweep's folder show its members by their names."""
    sweep.folder.mkdir(parents=True, exist_ok=True)
    for member in sweep.members:
        if member.name in sweep.elsewhere:
            continue
        link, run = sweep.folder / member.name, sweep.requests[member.name].run_folder
        if not link.is_symlink():
            try:
                link.symlink_to(Path("..") / run.name)
            except OSError:
                return  # the table names them


def _words(sweep: Sweep, member: Member) -> str:
    """What a member is: its own case, and what was drawn for it or the values that are its own."""
    own = [sweep.requests[member.name].case.name] if member.where is not None and sweep.several else []
    return ", ".join([*own, *(f"{key} = {value}" for key, value in member.parameters.items())])


def status(sweep: Sweep) -> str:
    """Every member with its values and where it stands, from what lies on the disk."""
    rows = [(member, state_of(sweep, member)) for member in sweep.members]
    counts = ", ".join(
        f"{sum(state.word == word for _, state in rows)} {word}"
        for word in dict.fromkeys(state.word for _, state in rows)
    )
    lines = [f"{sweep.folder}: {len(rows)} members, {counts}"]
    width = max(len(member.name) for member in sweep.members)
    for member, state in rows:
        where = (
            f" {state.stage} {100.0 * state.fraction:.0f} %"
            if state.word in ("running", "stopped", "failed") and state.stage
            else ""
        )
        lines.append(f"  {member.name:<{width}}  {state.word + where:<24} {_words(sweep, member)}")
        if state.reason:
            lines.append(f"  {'':<{width}}  {state.reason}")
    return "\n".join(lines)
