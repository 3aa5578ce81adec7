"""A stage's result from elsewhere: checked, and put where the stage itself would have left it."""

from __future__ import annotations

import shutil
from pathlib import Path

from matter import snapshot
from matter.errors import InputError
from matter.particles import FIELDS, Particles

# where the stage would have left its result, and which fields the stages after it use
PLACES = {"nbody": "impact.toml", "sph": "last.vtkhdf", "bed": "bed.vtkhdf", "dem": "last.vtkhdf"}
NEEDED = {
    "sph": ("position", "velocity", "mass", "density", "specific_energy", "pressure", "smoothing_length", "material"),
    "bed": ("position", "velocity", "mass", "radius", "material", "species", "headroom", "density"),
    "dem": ("position", "velocity", "mass", "radius"),
}


def install(stage: str, file: Path, out: Path) -> None:
    """Copy ``file`` into the stage folder ``out``.

    An SPH snapshot also becomes the one numbered snapshot of the series, and a ``target.json`` beside it comes along (the bed, the
    handoff and the datum read it).

    Raises ``InputError`` when the file is no snapshot or lacks fields.
    """
    if stage in NEEDED:
        check(stage, file)
    shutil.copyfile(file, out / PLACES[stage])
    if stage == "sph":
        shutil.copyfile(file, out / f"snap_0000{snapshot.SUFFIX}")
        beside = file.with_name("target.json")
        if not beside.is_file():
            raise InputError(f"[sph] snapshot: {beside} is missing (the body without projectile: interfaces, density, pressure, gravity)")
        shutil.copyfile(beside, out / "target.json")


def check(stage: str, file: Path) -> Particles:
    """The particles of a snapshot that stands in for the result of ``stage``; raises ``InputError`` naming every missing field."""
    try:
        particles = snapshot.read(file)
    except InputError as reason:
        raise InputError(f"[{stage}] snapshot: {reason}") from None
    missing = [name for name in NEEDED[stage] if name not in particles]
    if missing:
        words = "; ".join(f"{name}: {FIELDS[name].meaning} [{FIELDS[name].unit}]" for name in missing)
        raise InputError(f"[{stage}] snapshot: {file} lacks {', '.join(missing)} ({words})")
    return particles
