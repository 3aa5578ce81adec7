"""What the folder of a stage says: done, begun, or neither, and with which inputs.

``done.json`` is written last, by rename: a stage is done when it exists and the hash of the stage's inputs matches.
``begun.json`` is written first: checkpoints are only continued under the inputs that they were made with.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matter.case.body import Model
from matter.case.identity_fields import identity_fields
from matter.errors import InputError
from matter.files import archive
from pipeline.case import stages
from pipeline.store import provenance

DONE, BEGUN = "done.json", "begun.json"


def record(path: Path) -> dict[str, Any]:
    """Content of a small JSON file that only tells something; empty when it is absent or unreadable."""
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def mark(path: Path) -> dict[str, Any]:
    """Content of ``done.json`` or ``begun.json``, which decide whether results are kept; empty when it is absent.

    Raises ``InputError`` when it is damaged: nothing is removed for a file that cannot be read.
    """
    if not path.is_file():
        return {}
    try:
        return dict(archive.read_json(path))
    except InputError as reason:
        stage = path.parent.name.partition("_")[2] or path.parent.name.partition("-")[0]
        raise InputError(
            f"{reason}; the results of {stage} are still there: restore the file, or recompute them with --from "
            f"{stage}"
        ) from None


def settings_text(settings: Model) -> str:
    """What of settings decides a result as canonical JSON: equal texts are equal settings, to the last bit of every
    number."""
    return json.dumps(identity_fields(settings), sort_keys=True)


def lacking(done: Mapping[str, Any]) -> list[str]:
    """Files without which a stage is not done and which its ``done.json`` does not list: the folder was taken away
    while the stage was made. A record without any list (made by an older version) passes."""
    if "files" not in done:
        return []
    return [name for name in stages.LEAVES.get(str(done.get("stage")), ()) if name not in done["files"]]


def done(stage_folder: Path) -> dict[str, Any]:
    """What ``done.json`` says of a finished stage; empty where the stage is not finished, or lacks its files. Raises
    ``InputError`` when the file is damaged."""
    said = mark(stage_folder / DONE)
    return {} if lacking(said) else said


def is_done(stage_folder: Path, inputs: str) -> bool:
    """Whether a stage's folder holds its result with these inputs."""
    return done(stage_folder).get("inputs_sha256") == inputs


def begin(stage_folder: Path, inputs: str, made_by: Mapping[str, Any]) -> tuple[float, bool]:
    """Open the folder of a stage that is not done: the wall time [s] already spent, and whether it is continued.

    ``made_by``: the stage's key, the sources that make it (``sources_sha256``) and their commit. What an earlier
    attempt with other inputs left is removed.
    """
    before = mark(stage_folder / BEGUN)
    continued = before.get("inputs_sha256") == inputs and before.get("key") == made_by.get("key")
    if stage_folder.exists() and not continued:
        shutil.rmtree(stage_folder)
    stage_folder.mkdir(parents=True, exist_ok=True)
    archive.remove_unfinished(stage_folder)
    earlier_wall_s = float(before.get("wall_s", 0.0)) if continued else 0.0
    note_wall_time(stage_folder, inputs, earlier_wall_s, made_by)
    return earlier_wall_s, continued


def note_wall_time(stage_folder: Path, inputs: str, wall_s: float, made_by: Mapping[str, Any]) -> None:
    """Keep the wall time [s] of an unfinished stage, and the program that makes it."""
    archive.write_json(stage_folder / BEGUN, {"inputs_sha256": inputs, "wall_s": round(wall_s, 3), **made_by})


def finish(stage_folder: Path, stage: str, inputs: str, wall_s: float, **more: Any) -> None:
    """Write ``done.json`` as the last file of a stage."""
    content = {
        "stage": stage,
        "inputs_sha256": inputs,
        "wall_s": round(wall_s, 3),
        "finished_at": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "version": provenance.version(),
        **more,
    }
    archive.write_json(stage_folder / DONE, content)
    (stage_folder / BEGUN).unlink(missing_ok=True)


def remove(stage_folder: Path) -> None:
    """Remove what an unfinished stage left."""
    shutil.rmtree(stage_folder, ignore_errors=True)


def size_bytes(stage_folder: Path) -> int:
    """Size of the files in a folder [bytes]."""
    return sum(path.stat().st_size for path in stage_folder.rglob("*") if path.is_file())
