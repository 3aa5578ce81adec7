"""What a request would find done and what it would make, before it runs (``run_case --check``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from matter.case.body import Model
from matter.errors import InputError
from pipeline.case import stages
from pipeline.running import prediction, room
from pipeline.running.request import Request, impact_of
from pipeline.settings import identity
from pipeline.settings.compose import compose
from pipeline.store import folder, view
from pipeline.store.store import Entry, store_of

HERE, STORED, MADE, CONTINUED, UNKNOWN = (
    "already done",
    "in the store",
    "will be computed",
    "will be continued",
    "reused if cached, otherwise computed (known once its inputs exist)",
)


_SURE = 0.8
"""Predictions of memory and disk are good to a fifth: where less than that is lacking it is a warning, no refusal."""


def plan(request: Request, settings: Mapping[str, Model]) -> dict[str, str]:
    """Each wanted stage with what would become of it; a stage that reads files of one that is still to be made may yet
    be found."""
    return {stage: word for stage, word, _ in _looked_through(request, settings)}


def refuse_too_large(request: Request, settings: dict[str, Model]) -> None:
    """Raise ``InputError`` where what is still to be made cannot fit into memory or onto the disk: better before hours
    of work than after. What a stopped run has written needs no room again."""
    planned = {stage: (word, name) for stage, word, name in _looked_through(request, settings)}
    rows = [
        row
        for stage, row in prediction.predictions(request, settings).items()
        if not planned.get(stage, ("", ""))[0].startswith((HERE, STORED))
    ]
    memory, disk = room.needs(rows)
    store = store_of(request.run_folder)
    begun = sum(folder.size_bytes(store / name) for word, name in planned.values() if word == CONTINUED)
    if lacks := room.short_of(_SURE * memory, _SURE * disk - begun, request.out):
        raise InputError(
            f"{request.case.file}: {'; '.join(lacks)}. Fewer particles or grains (--size, a preset), a longer "
            "snapshot_interval or another --out need less; --anyway tries it all the same"
        )


def first_to_make(request: Request, settings: Mapping[str, Model]) -> str:
    """The name in the store of the first stage that is to be made or continued; empty where there is none."""
    return next((name for _, word, name in _looked_through(request, settings) if word in (MADE, CONTINUED)), "")


def _looked_through(request: Request, settings: Mapping[str, Model]) -> Iterator[tuple[str, str, str]]:
    """Wanted stage, what would become of it, and its name in the store where that is known."""
    run, folders = request.run_folder, dict[str, Path]()
    first = request.wanted[0] if request.fresh else request.start
    pending = {*view.pending_recompute(run), *(stages.ORDER[stages.ORDER.index(first) :] if first else ())}
    for stage in stages.ORDER:
        mine = stages.folder(run, stage)
        if stage not in request.wanted:
            if mine.exists():
                folders[stage] = mine
            continue
        elsewhere = request.case.outside.get(stage)
        if stage not in settings and elsewhere is None:
            continue
        missing = [
            item
            for item in stages.READS[stage]
            if item.partition("/")[0] in request.case.stages and item.partition("/")[0] not in folders
        ]
        if missing and elsewhere is None:
            yield stage, MADE if stage in pending or any("/" not in item for item in missing) else UNKNOWN, ""
            continue
        who = identity.stage_identity(
            stage, settings.get(stage), elsewhere, lambda earlier: folders.get(earlier, stages.folder(run, earlier))
        )
        entry = Entry.for_run(run, stage, who.key)
        word = CONTINUED if folder.record(entry.path / folder.BEGUN) else MADE
        if stage in pending:
            word = MADE
        elif folder.is_done(mine, who.inputs):
            word, folders[stage] = HERE, mine
        elif entry.done:
            word, folders[stage] = f"{STORED}, {entry.name}", entry.path
        yield stage, word, entry.name
        if stage == "nbody" and stage in folders and impact_of(folders[stage]).is_file():
            settings = compose(request.with_impact_of(folders[stage]), request.wanted)
