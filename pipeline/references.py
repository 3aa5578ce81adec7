"""``references.bib``: the papers of what a run really used.

A material names its source and a law names its paper, in words ("Benz & Asphaug 1999"). Every entry of the bibliography whose first
author and year stand in the texts of the used materials, or in the sources that a stage reaches by imports, goes into the run's list. A stage with a choice of
laws says by ``idle_sources(settings)`` which files, and by ``idle_sections(settings)`` which (material, section) a run leaves idle: these do not count.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from matter import archive, material
from matter.body import Model
from pipeline import stages
from pipeline.case import Case

BIBLIOGRAPHY = Path(__file__).with_name("references.bib")


def entries() -> dict[str, str]:
    """The bibliography: BibTeX text by key."""
    found = re.split(r"^(?=@)", BIBLIOGRAPHY.read_text(), flags=re.MULTILINE)
    return {_part(r"@\w+\{(\w+),", text): text.strip() for text in found if text.startswith("@")}


def cited(text: str) -> list[str]:
    """Keys of the entries that a text cites by first author and year."""
    return [key for key, entry in entries().items() if _pattern(entry).search(text)]


def _part(pattern: str, entry: str) -> str:
    found = re.search(pattern, entry)
    if found is None:
        raise ValueError(f"{BIBLIOGRAPHY.name}: nothing matches {pattern} in {entry[:60]!r}")
    return found.group(1)


def _pattern(entry: str) -> re.Pattern:
    author, year = _part(r"author = \{([^,]+),", entry), _part(r"year = \{(\d+)\}", entry)
    spelt = re.escape(author).replace("ä", "(?:ä|ae|a)")
    return re.compile(rf"\b{spelt}\b[^.;\d]{{0,60}}?(?:et al\.)?[^.;\d]{{0,20}}?\b{year}\b")


def write(path: Path, case: Case, settings: Mapping[str, Model], materials: Iterable[str]) -> list[str]:
    """Write the bibliography of a run, made with the ``settings`` of its stages, and return its keys."""
    texts = [str(case.document.get("case", {}).get("source", ""))]
    idle = {pair for stage, chosen in settings.items() for pair in _said(stage, "idle_sections", chosen)}
    texts += [str(section.get("source", "")) for name in materials for title, section in material.load(name).items() if (name, title) not in idle]
    texts += [source.read_text() for source in _sources(settings)]
    keys, known = cited("\n".join(texts)), entries()
    archive.write_text(path, "\n\n".join(known[key] for key in keys) + "\n")
    return keys


def _sources(settings: Mapping[str, Model]) -> list[Path]:
    from matter import jit

    reached: set[Path] = set()
    for stage, chosen in settings.items():
        spec = importlib.util.find_spec(stages.MODULES[stage])
        if spec is not None and spec.origin:
            idle = {path.resolve() for path in _said(stage, "idle_sources", chosen)}
            reached.update(set(jit.reached_sources(Path(spec.origin).resolve())) - idle)
    return sorted(reached)


def _said(stage: str, name: str, chosen: Model) -> Iterable[Any]:
    """What a stage's function ``name`` says of its settings; nothing where it has no such function."""
    function = getattr(stages.load(stage), name, None)
    return function(chosen) if function else ()
