"""``references.bib``: the papers of what a run really used.

A material names its source and a law names its paper, in words ("Benz & Asphaug 1999"). Every entry of the bibliography whose first
author and year stand in the texts of the used materials, or in the sources that a stage reaches by imports, goes into the run's list.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterable
from pathlib import Path

from matter import archive, material
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


def write(path: Path, case: Case, used_stages: Iterable[str], materials: Iterable[str]) -> list[str]:
    """Write the bibliography of a run and return its keys."""
    texts = [str(case.document.get("case", {}).get("source", ""))]
    texts += [str(section.get("source", "")) for name in materials for section in material.load(name).values()]
    texts += [source.read_text() for source in _sources(used_stages)]
    keys, known = cited("\n".join(texts)), entries()
    archive.write_text(path, "\n\n".join(known[key] for key in keys) + "\n")
    return keys


def _sources(used_stages: Iterable[str]) -> list[Path]:
    from matter import jit

    reached: set[Path] = set()
    for stage in used_stages:
        spec = importlib.util.find_spec(stages.MODULES[stage])
        if spec is not None and spec.origin:
            reached.update(jit.reached_sources(Path(spec.origin).resolve()))
    return sorted(reached)
