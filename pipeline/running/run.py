"""Running a case: the six stages in order, resumed after any kind of stop, each done once.

A stage that the run shows is skipped when it is done with the same inputs. Else it is taken from the store by its key
(``pipeline.settings.identity``), and made there where the store has it not: continued from its checkpoint when it was
begun, or waited for while another run makes it. ``--from`` recomputes what the store has. SIGINT and SIGTERM ask the
running stage to save and stop.
"""

from __future__ import annotations

import resource
import sys
import time
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from matter import cadence, progress
from matter.case.body import Model
from matter.errors import InputError, Stopped, UnphysicalState, Unsound
from matter.files import archive, lock
from pipeline.case import outside, stages
from pipeline.running import compiling
from pipeline.running.journal import Journal, Screen, signals
from pipeline.running.request import Outcome, Request, after_the_encounters, sensible, settings_of
from pipeline.settings import identity, used
from pipeline.settings.describe import describe
from pipeline.settings.identity import Identity
from pipeline.store import folder, intact, view
from pipeline.store.store import Entry


def run(request: Request, screen: Screen) -> Outcome:
    """Run or resume the wanted stages.

    Raises ``InputError`` (bad input), ``Stopped`` (on request, after saving), ``UnphysicalState``; a stage that ends
    unsound is kept, the stages after it run, and the outcome says so.
    """
    settings = settings_of(request)
    warnings = sensible(request, settings)
    run_folder = request.run_folder
    screen.say(f"run folder: {run_folder}")
    for text in warnings:
        screen.say(f"WARNING: {text}")
    with lock.held(run_folder / "run.lock", str(run_folder)), signals(screen):
        progress.clear_stop()
        archive.remove_unfinished(run_folder, below=False)  # stages are looked after when they are opened
        threads = _threads(request.threads)
        journal = Journal(run_folder, request.start, screen)
        _show_earlier(request, settings, journal)
        _clear_the_way(request, journal.interrupted)
        describe(run_folder, request.case, request.wanted, settings, threads)
        progress.listen(journal.hear)
        progress.listen(_stop_between)
        progress.hear(journal.tell)
        outcome = Outcome(run_folder, _unsound_before(request))
        try:
            for stage in _to_do(request):
                if progress.stop_requested():
                    raise Stopped(f"stopped before {stage}; the same command resumes")
                _one_stage(request, stage, settings, journal, outcome)
                if stage == "nbody":
                    settings = after_the_encounters(request)
                    used.write(run_folder / "case.used.toml", request.case, settings)
            journal.write("done")
        except Stopped:
            journal.write("stopped")
            raise
        except BaseException as error:
            named = isinstance(error, InputError | UnphysicalState)
            journal.write("failed", str(error) if named else f"{type(error).__name__}: {error}")
            journal.log(traceback.format_exc())
            raise
        finally:
            progress.silence()
    return outcome


def _to_do(request: Request) -> list[str]:
    """The wanted stages, after those before them whose result the case takes from elsewhere."""
    before = stages.ORDER[: stages.ORDER.index(request.wanted[0])]
    return [stage for stage in before if stage in request.case.outside] + list(request.wanted)


def _show_earlier(request: Request, settings: dict[str, Model], journal: Journal) -> None:
    """Take from the store the stages before the first wanted one that a new run folder lacks and that are read. What
    would come before a result from elsewhere is not asked for. Raises ``InputError`` where the store lacks them
    too."""
    run_folder, missing, read = request.run_folder, list[str](), set[str]()
    for stage in reversed(stages.ORDER):  # what is read, and what that was made of
        if stage in request.wanted or stage in read:
            read |= {file.partition("/")[0] for file in stages.READS[stage]}
    before = stages.ORDER[: stages.ORDER.index(request.wanted[0])]
    given = [stages.ORDER.index(stage) + 1 for stage in before if stage in request.case.outside]
    for stage in before[max(given, default=0) :]:
        mine = stages.folder(run_folder, stage)
        if stage not in read & set(request.case.stages) or mine.exists():
            continue
        if missing:
            missing.append(mine.name)
            continue
        find = partial(stages.folder, run_folder)
        entry = Entry.for_run(run_folder, stage, identity.stage_identity(stage, settings.get(stage), None, find).key)
        if entry.done:
            view.show(run_folder, stage, entry.path)
            journal.screen.say(f"{mine.name}: taken from the store, {entry.name}")
        else:
            missing.append(mine.name)
    if missing:
        raise InputError(
            f"--from {request.wanted[0]} needs {', '.join(missing)}, which neither {run_folder} nor the store of its "
            f"runs has: leave out --from {request.wanted[0]}, and the run makes what is missing"
        )


def _unsound_before(request: Request) -> dict[str, str]:
    """What stages said that ended unsound and are not to be recomputed: the results after them rest on theirs."""
    run_folder, said = request.run_folder, dict[str, str]()
    for stage in stages.ORDER[: stages.ORDER.index(request.wanted[0])]:
        if stage in request.case.stages and (words := folder.done(stages.folder(run_folder, stage)).get("unsound")):
            said[stage] = str(words).replace(_RUN, str(run_folder))
    return said


_WITHOUT_CHECKPOINTS = ("handoff", "crater")


def _stop_between(state: progress.Progress) -> None:
    """Stages of a minute keep no checkpoints: asked to stop, they end at what they report next, and are made again.
    Raises ``Stopped``."""
    if state.stage in _WITHOUT_CHECKPOINTS and state.fraction < 1.0:
        progress.stop_here(state.stage)


def _one_stage(request: Request, stage: str, settings: dict[str, Model], journal: Journal, outcome: Outcome) -> None:
    """Skip, take from the store, install or make one stage."""
    run_folder, source = request.run_folder, request.case.outside.get(stage)
    who = identity.stage_identity(stage, settings.get(stage), source, partial(stages.folder, run_folder))
    mine, label = stages.folder(run_folder, stage), stages.folder(run_folder, stage).name
    pending = view.pending_recompute(run_folder)
    entry = Entry.for_run(run_folder, stage, who.key)
    if stage not in pending:
        if folder.is_done(mine, who.inputs):
            _there(
                request,
                stage,
                folder.mark(mine / folder.DONE),
                f"up to date{_by_other_sources(mine, who, stage)}",
                journal,
                outcome,
            )
            return
        _check_begun(mine, stage, who, journal)
    view.refuse_foreign(run_folder, stage)
    with entry.held(_waiting(label, journal)):
        done = folder.record(entry.path / folder.DONE) if stage in pending else entry.done
        if done and stage not in pending:
            view.show(run_folder, stage, entry.path)
            _there(request, stage, done, f"taken from the store, {entry.name}", journal, outcome)
            return
        for earlier in dict.fromkeys(file.partition("/")[0] for file in stages.READS[stage] if source is None):
            intact.check_shown(run_folder, earlier)
        stage_folder = entry.remade if done else entry.path
        if stage in pending and not pending[stage]:
            folder.remove(stage_folder)
            view.note_recompute(run_folder, {**pending, stage: True})
        _make(request, stage, who, settings.get(stage), stage_folder, journal, outcome)
        view.show(run_folder, stage, entry.finished(stage_folder))
        view.note_recompute(run_folder, {other: begun for other, begun in pending.items() if other != stage})


def _check_begun(stage_folder: Path, stage: str, who: Identity, journal: Journal) -> None:
    """Whether what this run has begun of a stage can be gone on with. Raises ``InputError`` where another version of
    the code began it: a checkpoint belongs to the program that wrote it."""
    before = folder.mark(stage_folder / folder.BEGUN)
    if before.get("inputs_sha256") != who.inputs:
        return
    if before.get("sources_sha256", "") != who.sources:
        commit = f" (commit {before['commit'][:10]})" if isinstance(before.get("commit"), str) else ""
        raise InputError(
            f"{stage_folder.name} was begun by another version of the code{commit}, and its checkpoints are that "
            f"version's: finish it with that one, "
            f"or restart it with --from {stage}"
        )
    if before.get("threads") != who.threads:
        journal.screen.say(
            f"{stage_folder.name}: begun with --threads {before.get('threads')}, which its bits depend on; with "
            f"{who.threads} it is recomputed"
        )


def _there(request: Request, stage: str, done: dict[str, Any], how: str, journal: Journal, outcome: Outcome) -> None:
    """A stage is done already: look at its files, and say so."""
    stage_folder = stages.folder(request.run_folder, stage)
    intact.check(stage_folder, stage, done.get("files", {}), content=False)
    words = f"{stage_folder.name}: {how.partition(',')[0]} ({done.get('wall_s', 0):.1f} s)"
    words += "".join(how.partition(",")[1:])
    journal.screen.ends(stage, words)
    journal.log(words)
    if done.get("unsound"):
        outcome.unsound[stage] = str(done["unsound"]).replace(_RUN, str(request.run_folder))


_RUN = "<run>"
"""Stands for the run folder in what a stage said and another run may repeat."""


def _waiting(label: str, journal: Journal) -> Callable[[str], None]:
    """What to do while another run makes the stage: say it once, and give up when asked to stop."""
    said: list[str] = []

    def wait(message: str) -> None:
        if not said:
            said.append(message)
            journal.screen.say(f"{label}: waits, {message}")
            journal.log(f"{label} waits: {message}")
        if progress.stop_requested():
            raise Stopped(f"stopped while {label} was made by another run; the same command resumes")

    return wait


def _make(
    request: Request,
    stage: str,
    who: Identity,
    settings: Model | None,
    stage_folder: Path,
    journal: Journal,
    outcome: Outcome,
) -> None:
    """Make a stage, or go on with it, in a folder of the store."""
    run_folder, source = request.run_folder, request.case.outside.get(stage)
    label, made_by = stages.folder(run_folder, stage).name, who.as_record()
    earlier_wall_s, continued = folder.begin(stage_folder, who.inputs, made_by)
    view.show(run_folder, stage, stage_folder)
    journal.opens(stage)
    journal.screen.begins(stage, f"{label}: {'continued' if continued else 'begins'}")
    journal.log(f"{label} {'continued' if continued else 'begins'}, {stage_folder.name}")
    began = time.monotonic()
    cadence.taken()  # what another stage wrote is not this one's
    more: dict[str, Any] = dict(made_by)
    try:
        if source is not None:
            outside.install(stage, source, stage_folder, settings)
            more["from"] = str(source.resolve())
        else:
            with compiling.told(lambda words: journal.screen.say(f"  {stage}  {words}")):
                stages.make(stage, settings, run_folder, stage_folder)
    except Unsound as reason:
        outcome.unsound[stage] = str(reason).replace(str(stage_folder), str(stages.folder(run_folder, stage)))
        more["unsound"] = outcome.unsound[stage].replace(str(run_folder), _RUN)
    except BaseException:
        folder.note_wall_time(stage_folder, who.inputs, earlier_wall_s + time.monotonic() - began, made_by)
        raise
    wall_s = earlier_wall_s + time.monotonic() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    sizes = {
        "process_peak_memory_bytes": peak,
        "disk_bytes": folder.size_bytes(stage_folder),
        "files": intact.files_of(stage_folder),
        **cadence.taken(),
    }
    if missing := folder.lacking({"stage": stage, **sizes}):
        raise InputError(
            f"{label} ended without {', '.join(missing)} in {stage_folder}: something took the folder's files away "
            f"while the stage was made; the same command makes it again"
        )
    folder.finish(stage_folder, stage, who.inputs, wall_s, **more, **sizes)
    note = f"; UNSOUND: {outcome.unsound[stage]}" if "unsound" in more else "; taken from a file" if source else ""
    journal.screen.ends(stage, f"{label}: done in {wall_s:.1f} s{note}")
    journal.log(f"{label} done, {wall_s:.1f} s{note}")


def _by_other_sources(stage_folder: Path, who: Identity, stage: str) -> str:
    """A word of warning when the program has changed since a stage was done: its settings are the same, its physics
    may not be."""
    made_by = folder.record(stage_folder / folder.DONE).get("sources_sha256")
    if made_by in (None, who.sources):
        return ""
    return f", but computed by another version of the code; --from {stage} recomputes it"


def _clear_the_way(request: Request, interrupted: bool) -> None:
    """``--fresh`` and ``--from`` ask for the recomputation of stages that the store has, unless the same command was
    interrupted and now goes on."""
    first = request.wanted[0] if request.fresh else request.start
    if first is None or (interrupted and not request.fresh):
        return
    later = stages.ORDER[stages.ORDER.index(first) :]
    if request.fresh:
        view.forget(request.run_folder, later)
    view.note_recompute(request.run_folder, view.pending_recompute(request.run_folder) | dict.fromkeys(later, False))


def _threads(count: int | None) -> int:
    from matter.compilation import jit

    return jit.set_threads(count)
