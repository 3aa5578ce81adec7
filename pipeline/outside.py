"""A stage's result from elsewhere: checked, and put where the stage itself would have left it."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Mapping
from pathlib import Path

from matter import snapshot
from matter.errors import InputError
from matter.particles import FIELDS
from pipeline.complaints import Complaint

# where the stage would have left its result, and which fields the stages after it use
PLACES = {"nbody": "impact.toml", "sph": "last.vtkhdf", "bed": "bed.vtkhdf", "dem": "last.vtkhdf"}
NEEDED = {
    "sph": ("position", "velocity", "mass", "density", "specific_energy", "pressure", "smoothing_length", "material"),
    "bed": ("position", "velocity", "mass", "radius", "material", "species", "headroom", "density"),
    "dem": ("position", "velocity", "mass", "radius"),
}


def install(stage: str, file: Path, out: Path) -> None:
    """Copy ``file`` into the stage folder ``out``.

    An SPH snapshot also becomes the one numbered snapshot of the series, and a ``target.json`` beside it comes along
    (the bed, the handoff and the datum read it).

    Raises ``InputError`` when the file is no snapshot or lacks fields.
    """
    if stage in NEEDED:
        check(stage, file)
    shutil.copyfile(file, out / PLACES[stage])
    if stage == "sph":
        shutil.copyfile(file, out / f"snap_0000{snapshot.SUFFIX}")
        shutil.copyfile(_target_file(file), out / "target.json")


def taken(stage: str, file: Path) -> tuple[Path, ...]:
    """The files that ``install`` copies."""
    return (file, _target_file(file)) if stage == "sph" else (file,)


def _target_file(file: Path) -> Path:
    target_file = file.with_name("target.json")
    if not target_file.is_file():
        raise InputError(
            f"[sph] snapshot: {target_file} is missing (the body without projectile: interfaces, density, pressure, "
            f"gravity)"
        )
    return target_file


def faults(files: Mapping[str, Path], keys: Mapping[str, str]) -> list[Complaint]:
    """What is wrong with the files that take the place of stages, read as far as that needs: kind, whole, fields,
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
            if stage == "sph":
                _target_file(path)
        except InputError as reason:
            complaints.append(Complaint((stage, keys[stage]), str(reason).removeprefix(f"[{stage}] {keys[stage]}: ")))
    return complaints


def _check_impact(path: Path) -> None:
    try:
        content = tomllib.loads(path.read_text())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as reason:
        raise InputError(f"{path} is not valid TOML: {reason}") from None
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
