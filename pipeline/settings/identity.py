"""What a stage is known by: hashes of all that decides its result.

    inputs   the stage, its settings (``matter.case.identity_fields``), the files from elsewhere by content, and the
             stages that it reads by their keys (or, where it reads one small file of a stage, that file by content)
    key      inputs, the sources of the project that the stage can reach with their data (materials, bodies), and the
             threads where bits depend on them

A run's own stage is up to date while its inputs are the same, whatever has become of the code since (it is said); a
stage of another run is taken only by its key, so that other code never serves as this one's result.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matter.case.body import Model
from matter.case.identity_fields import identity_fields
from pipeline.case import outside, stages
from pipeline.settings import describe
from pipeline.store import folder, provenance

Find = Callable[[str], Path]
"""Where the folder of an earlier stage is, or would be."""


@dataclass(frozen=True)
class Identity:
    """Hashes of a stage; ``sources`` are those of the code and its data (empty for a result from elsewhere),
    ``threads`` is None where bits do not depend on their number."""

    inputs: str
    sources: str
    threads: int | None

    @property
    def key(self) -> str:
        """What a stage is found by in the store."""
        return hashlib.sha256(f"{self.inputs} {self.sources} {self.threads}".encode()).hexdigest()

    def as_record(self) -> dict[str, Any]:
        """What ``begun.json`` and ``done.json`` keep of it."""
        made_by = {"sources_sha256": self.sources, "commit": provenance.commit().get("commit")} if self.sources else {}
        return {"key": self.key, **made_by, **({} if self.threads is None else {"threads": self.threads})}


def stage_identity(stage: str, settings: Model | None, elsewhere: Path | None, find: Find) -> Identity:
    """The identity of a stage whose earlier stages are where ``find`` says; ``elsewhere``: the file that
    replaces it."""
    digest = hashlib.sha256(stage.encode())
    if elsewhere is not None:
        for file in outside.taken(stage, elsewhere):
            digest.update(b"outside" + provenance.file_sha256(file).encode())
        digest.update((outside.ground(stage, elsewhere, settings) or "").encode())
        return Identity(digest.hexdigest(), "", None)
    assert settings is not None
    decided = identity_fields(settings)
    digest.update(json.dumps(decided, sort_keys=True).encode())
    for path in _files_named(decided):
        digest.update(provenance.file_sha256(path).encode())
    for item in stages.READS[stage]:
        digest.update(f"\n{item} {_state_of(item, find)}".encode())
    return Identity(digest.hexdigest(), sources_of(stage, settings), _threads(stage, settings))


def _files_named(value: Any) -> Iterator[Path]:
    """Files that settings name: their content counts."""
    if isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _files_named(item)
    elif (
        isinstance(value, str)
        and ("." in value or os.sep in value)
        and len(value) < 1000
        and "\n" not in value
        and Path(value).is_file()
    ):
        yield Path(value)


def _state_of(item: str, find: Find) -> str:
    """Hash of a boundary file, or the key of a finished stage; a folder filled by hand counts by its files."""
    stage, _, name = item.partition("/")
    stage_folder = find(stage)
    if name:
        return provenance.file_sha256(stage_folder / name) if (stage_folder / name).is_file() else "absent"
    if key := folder.mark(stage_folder / folder.DONE).get("key"):
        return str(key)
    files = sorted(path for path in stage_folder.glob("*") if path.is_file()) if stage_folder.is_dir() else []
    return (
        hashlib.sha256("".join(path.name + provenance.file_sha256(path) for path in files).encode()).hexdigest()
        if files
        else "absent"
    )


def sources_of(stage: str, settings: Model) -> str:
    """Hash of the sources that a stage can reach and of the data that it takes: all files of its room that are no
    code, the templates of the floor where it writes a page, and its materials."""
    digest = hashlib.sha256(provenance.source_key(stages.MODULES[stage]).encode())
    room = provenance.HOUSE / stages.MODULES[stage].partition(".")[0]
    data = [path for path in sorted(room.rglob("*")) if path.is_file() and path.suffix not in (".py", ".pyc")]
    if any(path.parent.name == "templates" for path in data):
        data += sorted((provenance.HOUSE / "matter" / "wording" / "templates").iterdir())
    data += [provenance.HOUSE / "matter" / "materials" / f"{name}.toml" for name in describe.materials([settings])]
    for path in data:
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:20]


def _threads(stage: str, settings: Model) -> int | None:
    """The number of threads, where the bits of the stage's result depend on it (its function ``threads`` says so)."""
    count = getattr(stages.load(stage), "threads", None)
    return None if count is None else int(count(settings))
