"""A stage's result from elsewhere: checked, and put where the stage itself would have left it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path

from matter import formats
from matter.case.body import Model
from matter.errors import InputError
from matter.files import archive, snapshot, toml_input
from matter.particles import FIELDS
from pipeline.case import stages
from pipeline.case.complaints import Complaint

_TARGET = "target.json"
# where the stage would have left its result, and which fields the stages after it use
FILES = {"nbody": "impact.toml", "sph": "last.vtkhdf", "bed": "bed.vtkhdf", "dem": "last.vtkhdf"}
NEEDED = {
    "sph": formats.NEEDED["handoff"],
    "bed": ("position", "velocity", "mass", "radius", "material", "species", "headroom", "density"),
    "dem": ("position", "velocity", "mass", "radius"),
}


def install(stage: str, file: Path, out: Path, settings: Model | None = None) -> None:
    """Copy ``file`` into the stage folder ``out``.

    An SPH snapshot also becomes the one numbered snapshot of the series, and a ``target.json`` beside it comes along
    (the bed, the handoff and the datum read it); where there is none, it is made of the stage's ``settings``.

    Raises ``InputError`` when the file is no snapshot or lacks fields.
    """
    if stage in NEEDED:
        check(stage, file)
    shutil.copyfile(file, out / FILES[stage])
    if stage == "sph":
        shutil.copyfile(file, out / f"snap_0000{snapshot.SUFFIX}")
        if (text := ground(stage, file, settings)) is None:
            shutil.copyfile(_beside(file), out / _TARGET)
        else:
            archive.write_text(out / _TARGET, text)


def taken(stage: str, file: Path) -> tuple[Path, ...]:
    """The files that ``install`` copies."""
    return (file, _beside(file)) if stage == "sph" and _beside(file).is_file() else (file,)


def ground(stage: str, file: Path, settings: Model | None) -> str | None:
    """The ``target.json`` of an SPH snapshot that has none beside it: the ground that the case itself describes, in
    balance. None where there is one, or the stage needs none.

    Raises ``InputError`` where the case describes no ground either.
    """
    if stage != "sph" or _beside(file).is_file():
        return None
    facts = getattr(stages.load("sph"), "target_facts", None)
    if facts is None or settings is None:
        raise InputError(
            f"[sph] snapshot: {_beside(file)} is missing (the body without projectile: interfaces, density, pressure, "
            f"gravity), and the case does not describe it: [target] with its layers, and [impact]"
        )
    return json.dumps(facts(settings), indent=1)


def _beside(file: Path) -> Path:
    return file.with_name(_TARGET)


def faults(files: Mapping[str, Path], keys: Mapping[str, str]) -> list[Complaint]:
    """What is wrong with the files that replace stages, read as far as that needs: kind, whole, fields,
    companions."""
    complaints = []
    for stage, path in files.items():
        try:
            if not path.is_file():
                continue  # complained about where it was looked for
            if stage == "nbody":
                _check_impact(path)
            else:
                check(stage, path)
        except InputError as reason:
            complaints.append(Complaint((stage, keys[stage]), str(reason).removeprefix(f"[{stage}] {keys[stage]}: ")))
    return complaints


def no_ground(files: Mapping[str, Path], settings: Mapping[str, Model]) -> list[Complaint]:
    """A snapshot of the shock stage whose ground is described nowhere."""
    path = files.get("sph")
    try:
        if path is not None and path.is_file():
            ground("sph", path, settings.get("sph"))
    except InputError as reason:
        return [Complaint(("sph", stages.OUTSIDE["sph"]), str(reason).removeprefix("[sph] snapshot: "))]
    return []


def _check_impact(path: Path) -> None:
    _, content = toml_input.read(path)
    missing = [key for key in ("speed", "angle_from_vertical") if key not in content]
    if missing:
        raise InputError(f"{path} lacks {', '.join(missing)}: it does not say how the projectile hits")


def check(stage: str, file: Path) -> None:
    """Whether a snapshot can stand in for the result of ``stage``; raises ``InputError`` naming every missing
    field."""
    try:
        held = snapshot.names(file)
        made_by = str(snapshot.attributes(file).get("stage", ""))
    except InputError as reason:
        raise InputError(f"[{stage}] snapshot: {reason}") from None
    missing = [name for name in NEEDED[stage] if name not in held]
    if missing:
        words = "; ".join(f"{name}: {FIELDS[name].meaning} [{FIELDS[name].unit}]" for name in missing)
        kind = f", which the stage {made_by} has made," if made_by in NEEDED and made_by != stage else ""
        raise InputError(f"[{stage}] snapshot: {file}{kind} lacks {', '.join(missing)} ({words})")
