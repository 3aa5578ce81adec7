"""Running a case: the six stages in order, resumed after any kind of stop, each done once.

A stage is skipped when it is done with the same inputs, continued from its checkpoint when it was begun with the same inputs, and made
anew otherwise; whatever is made anew makes the stages after it undone. SIGINT and SIGTERM ask the running stage to save and stop.
"""

from __future__ import annotations

import resource
import sys
import time
import traceback
from dataclasses import dataclass
from dataclasses import field as item
from pathlib import Path
from typing import Any

from matter import progress
from matter.body import Model
from matter.errors import InputError, Stopped, Unsound
from pipeline import folder, intact, lock, outside, provenance, sense, stages, used
from pipeline.case import Case, with_impact
from pipeline.checking import listed
from pipeline.compose import compose
from pipeline.describe import describe
from pipeline.journal import Journal, Screen, signals
from pipeline.left_open import FROM_ENCOUNTERS


@dataclass(frozen=True)
class Request:
    """What the user asked for: a case, where, from and until which stage, anew or not, on how many threads."""

    case: Case
    out: Path = Path("runs")
    start: str | None = None
    until: str | None = None
    fresh: bool = False
    threads: int | None = None

    @property
    def run_folder(self) -> Path:
        return self.case.run or self.out / f"{self.case.name}-{self.case.hash8}"

    @property
    def wanted(self) -> tuple[str, ...]:
        """The stages to run; raises ``InputError`` for an unknown name or an empty range."""
        first = stages.ORDER.index(stages.known(self.start)) if self.start else 0
        last = stages.ORDER.index(stages.known(self.until)) if self.until else len(stages.ORDER) - 1
        if first > last:
            raise InputError(f"--from {self.start} comes after --until {self.until} (the order is {' '.join(stages.ORDER)})")
        wanted = tuple(stage for stage in stages.ORDER[first : last + 1] if stage in self.case.stages)
        if not wanted:
            raise InputError(f"{self.case.file} has none of these stages: it has {' '.join(self.case.stages)}")
        return wanted


@dataclass
class Outcome:
    """A finished request: the run folder and what each unsound stage said."""

    run: Path
    unsound: dict[str, str] = item(default_factory=dict)


def settings_of(request: Request) -> dict[str, Model]:
    """The settings of the stages: from the case, and from the impact that an earlier run of the encounters has chosen.

    Raises ``InputError`` with every complaint about the case.
    """
    if "nbody" in request.wanted:
        return compose(request.case, request.wanted)
    if not request.case.pinned and not _impact_file(request).is_file():
        raise InputError(
            f"{request.case.file} takes speed and angle from the encounters, and {_impact_file(request)} does not exist: run the stage nbody first"
        )
    return _after_the_encounters(request)


def sensible(request: Request, settings: dict[str, Model]) -> list[str]:
    """Warnings about what the settings say together (``pipeline.sense``). Raises ``InputError`` with everything that cannot be."""
    errors, warnings = sense.judged(settings, request.case.outside, request.wanted)
    if errors:
        raise InputError(listed(request.case, errors, ()))
    return warnings


def _impact_file(request: Request) -> Path:
    return stages.folder(request.run_folder, "nbody") / outside.PLACES["nbody"]


def _after_the_encounters(request: Request) -> dict[str, Model]:
    found, case = _impact_file(request), request.case
    if found.is_file():
        case = with_impact(case, found)
        if not case.pinned:
            raise InputError(f"{found} lacks {' or '.join(FROM_ENCOUNTERS)}: it does not say how the projectile hits")
    return compose(case, request.wanted)


def run(request: Request, screen: Screen) -> Outcome:
    """Run or resume the wanted stages.

    Raises ``InputError`` (bad input), ``Stopped`` (on request, after saving), ``UnphysicalState``; a stage that ends unsound is kept, the
    stages after it run, and the outcome says so.
    """
    settings = settings_of(request)
    warnings = sensible(request, settings)
    run_folder = request.run_folder
    screen.say(f"run folder: {run_folder}")
    for text in warnings:
        screen.say(f"WARNING: {text}")
    with lock.held(run_folder / "run.lock", str(run_folder)), signals(screen):
        progress.clear_stop()
        threads = _threads(request.threads)
        journal = Journal(run_folder, request.start, screen)
        _clear_the_way(request, journal.interrupted)
        describe(run_folder, request.case, request.wanted, settings, threads)
        progress.listen(journal.hear)
        progress.hear(journal.tell)
        outcome = Outcome(run_folder)
        try:
            for stage in _to_do(request):
                if progress.stop_requested():
                    raise Stopped(f"stopped before {stage}; the same command resumes")
                _one_stage(request, stage, settings, journal, outcome)
                if stage == "nbody":
                    settings = _after_the_encounters(request)
                    used.write(run_folder / "case.used.toml", request.case, settings)
            journal.write("done")
        except Stopped:
            journal.write("stopped")
            raise
        except BaseException:
            journal.write("failed")
            journal.log(traceback.format_exc())
            raise
        finally:
            progress.silence()
    return outcome


def _to_do(request: Request) -> list[str]:
    """The wanted stages, after those before them whose result the case takes from elsewhere."""
    before = stages.ORDER[: stages.ORDER.index(request.wanted[0])]
    return [stage for stage in before if stage in request.case.outside] + list(request.wanted)


def _one_stage(request: Request, stage: str, settings: dict[str, Model], journal: Journal, outcome: Outcome) -> None:
    """Skip, install or run one stage and mark it done."""
    run_folder, source = request.run_folder, request.case.outside.get(stage)
    inputs = folder.inputs_sha256(run_folder, stage, settings.get(stage), source)
    label = stages.folder(run_folder, stage).name
    if folder.is_done(run_folder, stage, inputs):
        done = folder.record(stages.folder(run_folder, stage) / folder.DONE)
        intact.check(stages.folder(run_folder, stage), stage, done.get("files", {}), content=False)
        journal.screen.ends(stage, f"{label}: up to date ({done.get('wall_s', 0):.1f} s){_by_other_sources(stage, done)}")
        if done.get("unsound"):
            outcome.unsound[stage] = done["unsound"]
        return
    for earlier in dict.fromkeys(file.partition("/")[0] for file in stages.READS[stage]):
        there = stages.folder(run_folder, earlier)
        intact.check(there, earlier, folder.record(there / folder.DONE).get("files", {}), content=True)
    program = {"sources_sha256": provenance.source_key(stages.MODULES[stage]), "commit": provenance.commit().get("commit")} if source is None else {}
    place, spent, continued = folder.begin(run_folder, stage, inputs, program)
    folder.forget_after(run_folder, stage)
    journal.opens(stage)
    journal.screen.begins(stage, f"{label}: {'continued' if continued else 'begins'}")
    journal.log(f"{label} {'continued' if continued else 'begins'}, inputs {inputs}")
    began = time.monotonic()
    more: dict[str, Any] = {}
    try:
        if source is not None:
            outside.install(stage, source, place)
            more["from"] = str(source.resolve())
        else:
            more["sources_sha256"] = program["sources_sha256"]
            module = stages.load(stage)
            with _one_blas_thread():
                module.run(settings[stage], run_folder, place)
    except Unsound as reason:
        more["unsound"] = outcome.unsound[stage] = str(reason)
    except BaseException:
        folder.note_spent(place, inputs, spent + time.monotonic() - began, program)
        raise
    wall_s = spent + time.monotonic() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    sizes = {"process_peak_memory_bytes": peak, "disk_bytes": folder.size_bytes(place), "files": intact.files_of(place)}
    folder.finish(place, stage, inputs, wall_s, **more, **sizes)
    note = f"; UNSOUND: {more['unsound']}" if "unsound" in more else "; taken from a file" if source else ""
    journal.screen.ends(stage, f"{label}: done in {wall_s:.1f} s{note}")
    journal.log(f"{label} done, {wall_s:.1f} s{note}")


def _by_other_sources(stage: str, done: dict[str, Any]) -> str:
    """A word of warning when the program has changed since a stage was done: its settings are the same, its physics may not be."""
    made_by = done.get("sources_sha256")
    if made_by in (None, provenance.source_key(stages.MODULES[stage])):
        return ""
    return f", but computed by another version of the code; --from {stage} recomputes it"


def _clear_the_way(request: Request, interrupted: bool) -> None:
    """``--fresh`` removes the wanted stages; ``--from`` makes them undone, unless the same command was interrupted and now goes on."""
    if request.fresh:
        folder.remove(request.run_folder, request.wanted[0])
    elif request.start and not interrupted:
        folder.forget(request.run_folder, request.start)


def _one_blas_thread():
    from matter import jit

    return jit.one_blas_thread()


def _threads(count: int | None) -> int:
    from matter import jit

    return jit.set_threads(count)
