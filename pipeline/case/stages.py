"""The six stages in their order: where each leaves its files, which module runs it, and what it reads.

The modules are named as texts and imported when they are needed: they bring numba, and a command that only prints its
help does not need it.
"""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from matter.errors import InputError

ORDER = ("nbody", "sph", "bed", "handoff", "dem", "crater")

MODULES = {
    "nbody": "nbody.stage",
    "sph": "sph.stage",
    "bed": "dem.beds.stage",
    "handoff": "handoff.stage",
    "dem": "dem.stage",
    "crater": "crater.stage",
}

# What a stage reads of the earlier ones: a whole stage ("sph"), or one small boundary file ("sph/target.json"), whose
# content alone then decides whether the stage is up to date: the bed depends on the body, not on what hit it. The
# impact that the encounters find reaches the other stages through the settings.
READS = {
    "nbody": (),
    "sph": (),
    "bed": ("sph/target.json",),
    "handoff": ("sph", "bed"),
    "dem": ("handoff", "sph/target.json"),
    "crater": ("sph", "handoff", "dem"),
}

# Without these files a stage is not done, whatever its ``done.json`` says.
LEAVES = {
    "nbody": ("impact.toml",),
    "sph": ("target.json", "last.vtkhdf"),
    "bed": ("bed.vtkhdf",),
    "handoff": ("start.vtkhdf", "ledger.json"),
    "dem": ("last.vtkhdf",),
    "crater": ("measures.json",),
}

SHARED_TABLES = ("target", "impact")

# the key of a file from elsewhere instead of what a stage would have made
OUTSIDE = {"nbody": "impact", "sph": "snapshot", "bed": "snapshot", "dem": "snapshot"}


def folder(run: Path, stage: str) -> Path:
    """The folder of ``stage`` in a run folder, ``2_sph`` for example."""
    return run / f"{ORDER.index(stage) + 1}_{stage}"


def known(stage: str) -> str:
    """``stage`` itself if it is one of the six; raises ``InputError`` with the nearest name otherwise."""
    if stage not in ORDER:
        raise InputError(f"no stage {stage!r}{nearest(stage, ORDER)} (the stages are {' '.join(ORDER)})")
    return stage


def load(stage: str) -> ModuleType:
    """The module of ``stage``; raises ``InputError`` when this installation has none."""
    name = MODULES[stage]
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as reason:
        if reason.name is not None and (name == reason.name or name.startswith(reason.name + ".")):
            raise InputError(f"stage {stage!r} is not part of this installation (no module {name})") from None
        raise


def takes(stage: str, key: str) -> bool:
    """Whether the settings of ``stage``, where this installation has it, hold ``key``."""
    try:
        return key in load(stage).Settings.model_fields
    except InputError:
        return False


def make(stage: str, settings: Any, run: Path, out: Path) -> None:
    """Run or resume a stage in the folder ``out``, with what the run folder holds. Linear algebra
    takes one thread: with several its sums come out otherwise in their last bits.

    Raises what the stage raises.
    """
    from matter.compilation import jit

    module = load(stage)
    with jit.one_blas_thread():
        module.run(settings, run, out)


# what people write for a key, where spelling alone would lead elsewhere; the second text is a remark
_MEANT = {
    "diameter": (("radius", "half the diameter"),),
    "size": (("radius", ""),),
    "velocity": (("speed", ""),),
    "angle": (("angle_from_vertical", "0 is head-on"), ("friction_angle", "")),
    "angle_from_horizontal": (("angle_from_vertical", "90 deg minus it"),),
    "resolution": (("spacing_at_impact", ""),),
    "duration": (("end_time", ""),),
    "composition": (("material", ""),),
    "density": (("material", "which has one; a case changes it in [sph.materials]"), ("layers", "by their material")),
    "mass": (("radius", "with the density of the material"),),
    "depth": (("thickness", ""),),
    "radius": (
        ("thickness", "from the bottom of the layer to its top; those of all layers add up to the radius of a body"),
        ("layers", "the thicknesses of all layers add up to the radius"),
    ),
}


def nearest(word: str, words: Sequence[str], cutoff: float = 0.5) -> str:
    """``"; did you mean 'x'?"`` for that of ``words`` which is most likely meant, or an empty text; ``cutoff``: how
    alike the spelling has to be."""
    for meant, remark in _MEANT.get(word, ()):
        if meant in words:
            return f"; did you mean {meant!r}{f' ({remark})' if remark else ''}?"
    parts = [
        known for known in words if len(word) > 3 and (known.startswith(f"{word}_") or known.endswith(f"_{word}"))
    ]
    near = parts or difflib.get_close_matches(word, words, n=1, cutoff=cutoff)
    return f"; did you mean {near[0]!r}?" if near else ""
