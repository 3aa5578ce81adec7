"""What a run folder says about its stages: done, begun, or neither, and with which inputs.

``done.json`` is written last, by rename: a stage is done when it exists and the hash of the stage's inputs matches. ``begun.json`` is
written first: checkpoints are only continued under the inputs that they were made with.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matter import archive
from matter.body import Model
from matter.errors import InputError
from pipeline import provenance, stages

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
        stage = path.parent.name.partition("_")[2]
        raise InputError(f"{reason}; the results of {stage} are still there: restore the file, or recompute them with --from {stage}") from None


def settings_text(settings: Model) -> str:
    """Settings as canonical JSON: equal texts are equal settings, to the last bit of every number."""
    return json.dumps(settings.model_dump(mode="json"), sort_keys=True)


def inputs_sha256(run: Path, stage: str, settings: Model | None, outside: Path | None) -> str:
    """Hash of all that decides the result of a stage: its settings, what it reads of earlier stages, or its file from elsewhere."""
    digest = hashlib.sha256(stage.encode())
    if outside is not None:
        digest.update(b"outside" + provenance.file_sha256(outside).encode())
        return digest.hexdigest()
    assert settings is not None
    digest.update(settings_text(settings).encode())
    for item in stages.READS[stage]:
        digest.update(f"\n{item} {_state_of(run, item)}".encode())
    return digest.hexdigest()


def _state_of(run: Path, item: str) -> str:
    """Hash of a boundary file, or of the inputs of a finished stage; a folder filled by hand counts by its files."""
    stage, _, name = item.partition("/")
    place = stages.folder(run, stage)
    if name:
        return provenance.file_sha256(place / name) if (place / name).is_file() else "absent"
    if inputs := mark(place / DONE).get("inputs_sha256"):
        return str(inputs)
    files = sorted(path for path in place.glob("*") if path.is_file()) if place.is_dir() else []
    return hashlib.sha256("".join(path.name + provenance.file_sha256(path) for path in files).encode()).hexdigest() if files else "absent"


def is_done(run: Path, stage: str, inputs: str) -> bool:
    """Whether the stage is done with these inputs."""
    return mark(stages.folder(run, stage) / DONE).get("inputs_sha256") == inputs


def begin(run: Path, stage: str, inputs: str, program: Mapping[str, Any] | None = None) -> tuple[Path, float, bool]:
    """Open a stage's folder: its path, the wall time [s] already spent, and whether it is continued.

    ``program``: hash of the sources that go on (``sources_sha256``), and their commit; a checkpoint belongs to the program that wrote it. What an earlier
    attempt with other inputs left is removed. Raises ``InputError`` when the folder holds files that no run made,
    or checkpoints of another version of the code.
    """
    place = stages.folder(run, stage)
    before = mark(place / BEGUN)
    if not before and not (place / DONE).exists() and place.is_dir() and any(place.iterdir()):
        after = stages.ORDER[stages.ORDER.index(stage) + 1 :]
        use = f"--from {after[0]} uses them" if after else "move them away"
        raise InputError(f"{place} holds files that were not made by a run: {use}, --fresh replaces them")
    continued = before.get("inputs_sha256") == inputs
    if continued and before.get("sources_sha256") not in (None, (program or {}).get("sources_sha256")):
        commit = f" (commit {before['commit'][:10]})" if isinstance(before.get("commit"), str) else ""
        raise InputError(
            f"{place.name} was begun by another version of the code{commit}, and its checkpoints are that version's: finish it with that one, "
            f"or begin it anew with --from {stage}"
        )
    if place.exists() and not continued:
        shutil.rmtree(place)
    place.mkdir(parents=True, exist_ok=True)
    (place / DONE).unlink(missing_ok=True)
    spent = float(before.get("wall_s", 0.0)) if continued else 0.0
    note_spent(place, inputs, spent, program)
    return place, spent, continued


def note_spent(place: Path, inputs: str, wall_s: float, program: Mapping[str, Any] | None = None) -> None:
    """Keep the wall time [s] of an unfinished stage, and the program that makes it."""
    archive.write_text(place / BEGUN, json.dumps({"inputs_sha256": inputs, "wall_s": round(wall_s, 3), **(program or {})}))


def finish(place: Path, stage: str, inputs: str, wall_s: float, **more: Any) -> None:
    """Write ``done.json`` as the last file of a stage."""
    content = {
        "stage": stage,
        "inputs_sha256": inputs,
        "wall_s": round(wall_s, 3),
        "finished_at": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "version": provenance.version(),
        **more,
    }
    archive.write_text(place / DONE, json.dumps(content, indent=1))
    (place / BEGUN).unlink(missing_ok=True)


def forget(run: Path, first: str) -> None:
    """Make ``first`` and every stage after it undone, so that they are made anew (their files stay until then)."""
    for stage in stages.ORDER[stages.ORDER.index(first) :]:
        place = stages.folder(run, stage)
        if (place / DONE).exists() or (place / BEGUN).exists():
            note_spent(place, "stale", 0.0)
            (place / DONE).unlink(missing_ok=True)


def forget_after(run: Path, stage: str) -> None:
    """Make every stage after ``stage`` undone."""
    for later in stages.ORDER[stages.ORDER.index(stage) + 1 :][:1]:
        forget(run, later)


def remove(run: Path, first: str) -> None:
    """Remove the folders of ``first`` and of every stage after it."""
    for stage in stages.ORDER[stages.ORDER.index(first) :]:
        shutil.rmtree(stages.folder(run, stage), ignore_errors=True)


def size_bytes(place: Path) -> int:
    """Size of the files in a folder [bytes]."""
    return sum(path.stat().st_size for path in place.rglob("*") if path.is_file())
