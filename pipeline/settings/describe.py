"""What a run writes down about itself before it starts: every parameter, the provenance, the papers."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from matter.case.body import Impact, Model, Target
from matter.files import archive
from pipeline.case import stages
from pipeline.case.read import Case
from pipeline.settings import references, used
from pipeline.store import folder, provenance


def describe(run_folder: Path, case: Case, wanted: tuple[str, ...], settings: dict[str, Model], threads: int) -> None:
    """Write ``case.used.toml``, ``provenance.json`` (one entry per session) and ``references.bib``."""
    used.write(run_folder / "case.used.toml", case, settings)
    before = folder.record(run_folder / "provenance.json")
    sessions = before.get("sessions", [])
    session = {
        "command": sys.argv,
        "started_at": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "threads": threads,
        **provenance.machine(),
    }
    computed = [stage for stage in wanted if stage not in case.outside]
    content = {
        "distribution": {"name": provenance.DISTRIBUTION, "version": provenance.version(), **provenance.commit()},
        "libraries": provenance.libraries(),
        "case": before.get("case", _case(case)) if case.run else _case(case),
        "sources_sha256": {stage: provenance.source_key(stages.MODULES[stage]) for stage in computed},
        "sessions": [*sessions, session],
    }
    archive.write_json(run_folder / "provenance.json", content)
    done = [
        stage
        for stage in stages.ORDER
        if (stages.folder(run_folder, stage) / folder.DONE).exists() and stage not in case.outside
    ]
    used_stages = {
        stage: settings[stage]
        for stage in (*computed, *(stage for stage in done if stage not in computed))
        if stage in settings
    }
    references.write(run_folder / "references.bib", case, used_stages, materials(settings.values()))


def _case(case: Case) -> dict[str, Any]:
    elsewhere = {
        stage: {"file": str(path.resolve()), "sha256": provenance.file_sha256(path)}
        for stage, path in case.outside.items()
    }
    return {
        "file": str(case.file.resolve()),
        "sha256": provenance.file_sha256(case.file),
        "preset": case.preset,
        "overrides": list(case.overrides),
        "from_elsewhere": elsewhere,
        "impact_as_given": None if case.pinned else case.document.get("impact"),
    }


def materials(settings: Iterable[Model]) -> list[str]:
    """Names of the materials of the target and the projectile."""
    names: set[str] = set()
    for one in settings:
        for name in type(one).model_fields:
            value = getattr(one, name)
            if isinstance(value, Target):
                names.update([*value.materials, *value.block_materials])
            elif isinstance(value, Impact):
                names.update(value.projectile.materials)
    return sorted(names)
