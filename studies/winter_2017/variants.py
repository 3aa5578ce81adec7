"""A named set of variants of a case, each run to the end of the shock stage and measured; what is there already is not
made again.

A variant is a case, a preset and ``--set`` texts; its run folder is the one that ``run_case`` gives them. Measures are
those of the crater stage, in ``<out>/measured/<name>/``, beside ``interior.json`` of
``studies.winter_2017.follow_run``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from matter.errors import InputError
from matter.files import archive
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.running.request import Request
from pipeline.running.run_process import as_process
from pipeline.settings.compose import compose
from pipeline.store import folder

DAMAGE_AT = 396.0
"""Time [s] at which damage against distance is kept: 6.6 min, that of the published pictures."""


@dataclass(frozen=True)
class Variant:
    """``case`` with ``preset`` and ``overrides`` (texts of ``--set``), under a ``name``."""

    name: str
    case: Path
    preset: str
    overrides: tuple[str, ...] = ()

    def read(self) -> cases.Case:
        """The composed case; raises ``InputError``."""
        return cases.read(self.case, self.preset, self.overrides)

    def run_folder(self, out: Path) -> Path:
        """Where ``run_case --out out`` puts it."""
        return Request(self.read(), Path(out)).run_folder

    def measured(self, out: Path) -> Path:
        """Where its measures are."""
        return Path(out) / "measured" / self.name


def chosen(variants: Iterable[Variant], names: Iterable[str] | None) -> list[Variant]:
    """The variants of these names, in their own order (all, without names); raises ``InputError`` for an unknown
    one."""
    known = {variant.name: variant for variant in variants}
    wanted = list(names or known)
    for name in wanted:
        if name not in known:
            raise InputError(f"no run {name!r}{stages.nearest(name, list(known))} (known: {', '.join(known)})")
    return [variant for name, variant in known.items() if name in wanted]


def run(variant: Variant, out: Path, threads: int | None = None) -> int:
    """``run_case ... --until sph`` as its own process, resumed where it stopped; its exit code. SIGTERM and SIGINT are
    handed on."""
    command = [str(variant.case), "--preset", variant.preset, "--out", str(out), "--until", "sph"]
    command += [part for text in variant.overrides for part in ("--set", text)]
    return as_process(command + (["--threads", str(threads)] if threads else []))


def state(variant: Variant, out: Path) -> str:
    """Hash of the finished shock stage; empty where it is not finished."""
    return str(folder.record(stages.folder(variant.run_folder(out), "sph") / folder.DONE).get("inputs_sha256", ""))


def measure(variant: Variant, out: Path) -> Path | None:
    """Measure a finished run, unless that was done by the same code; the folder of the measures, None where the run is
    not finished."""
    finished = state(variant, out)
    if not finished:
        return None
    from crater import stage  # here: --help of a script that uses this needs no numerics
    from matter.compilation import jit
    from studies.winter_2017 import follow_run

    settings = compose(variant.read())["crater"]
    assert isinstance(settings, stage.Settings)
    room = Path(stage.__file__).resolve().parent
    reached = {
        path for module in (stage, follow_run) for path in jit.reached_sources(Path(module.__file__ or "").resolve())
    }
    sources = b"".join(path.read_bytes() for path in sorted(reached) if path.parent in (room, Path(__file__).parent))
    key = hashlib.sha256(finished.encode() + folder.settings_text(settings).encode() + sources).hexdigest()
    target = variant.measured(out)
    if folder.record(target / folder.DONE).get("key") == key:
        return target
    target.mkdir(parents=True, exist_ok=True)
    run_folder = variant.run_folder(out)
    stage.run(settings, _shock_only(run_folder, target), target)
    largest = (
        json.loads((target / "measures.json").read_text())["transient"]
        .get("at_maximum_volume", {})
        .get("diameter_apparent_m", {})
        .get("value")
    )
    follow_run.write(run_folder, 0.5 * (largest or settings.impact.expected_transient_diameter), DAMAGE_AT, target)
    archive.write_text(target / folder.DONE, json.dumps({"key": key, "run": run_folder.name}))
    return target


def _shock_only(run_folder: Path, target: Path) -> Path:
    """A folder that holds the run's shock stage alone: a late stage of grains, where there is one, is not what a sweep
    compares."""
    view = target / "run"
    view.mkdir(exist_ok=True)
    link = view / stages.folder(run_folder, "sph").name
    link.unlink(missing_ok=True)
    link.symlink_to(stages.folder(run_folder, "sph").resolve())
    return view
