"""``references.bib``: the papers of what a run really used.

Keys come from the case (``[case] sources``), from the sections of the materials that a run takes (``sources``), and
from every source file that one of its stages reaches by imports (``SOURCES``, ``pipeline.case.bibliography``). A stage
with a choice of laws says by ``idle_sources(settings)`` which of these files, and by ``idle_sections(settings)`` which
(material, section), a run leaves idle: these do not count.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from matter.case import material
from matter.case.body import Model
from matter.files import archive
from pipeline.case import bibliography, stages
from pipeline.case.read import Case


def write(path: Path, case: Case, settings: Mapping[str, Model], materials: Iterable[str]) -> list[str]:
    """Write the bibliography of a run, made with the ``settings`` of its stages, and return its keys in the order of
    the bibliography."""
    cited = set(case.sources)
    idle = {pair for stage, chosen in settings.items() for pair in _said(stage, "idle_sections", chosen)}
    for name in materials:
        cited |= {
            key
            for title, section in material.load(name).items()
            if (name, title) not in idle
            for key in section.get("sources", ())
        }
    for file in _files(settings):
        cited |= set(bibliography.named_by(file))
    if fault := bibliography.fault(sorted(cited)):
        raise KeyError(fault)
    known = bibliography.entries()
    keys = [key for key in known if key in cited]
    archive.write_text(path, "\n\n".join(known[key] for key in keys) + "\n")
    return keys


def _files(settings: Mapping[str, Model]) -> set[Path]:
    """Source files that the stages reach and do not leave idle."""
    from matter.compilation import jit

    reached: set[Path] = set()
    for stage, chosen in settings.items():
        spec = importlib.util.find_spec(stages.MODULES[stage])
        if spec is not None and spec.origin:
            idle = {path.resolve() for path in _said(stage, "idle_sources", chosen)}
            reached.update(set(jit.reached_sources(Path(spec.origin).resolve())) - idle)
    return reached


def _said(stage: str, name: str, chosen: Model) -> Iterable[Any]:
    """What a stage's function ``name`` says of its settings; nothing where it has no such function."""
    function = getattr(stages.load(stage), name, None)
    return function(chosen) if function else ()
