"""The bibliography: BibTeX entries by key, and the keys that a source file names.

A law or method that stands on papers names them in its file, ``SOURCES = ("Murnaghan1944",)``; a section of a material
and a case by ``sources``.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterable
from pathlib import Path

from pipeline.case.stages import nearest

FILE = Path(__file__).parent.parent / "settings" / "references.bib"


@functools.cache
def entries() -> dict[str, str]:
    """BibTeX text by key."""
    blocks = re.split(r"^(?=@)", FILE.read_text(), flags=re.MULTILINE)
    return {_key(text): text.strip() for text in blocks if text.startswith("@")}


def _key(entry: str) -> str:
    match = re.match(r"@\w+\{(\w+),", entry)
    if match is None:
        raise ValueError(f"{FILE.name}: no key in {entry[:60]!r}")
    return match.group(1)


@functools.cache
def named_by(source: Path) -> tuple[str, ...]:
    """The ``SOURCES`` of a Python file, read without importing it; empty where it names none."""
    for statement in ast.parse(source.read_text()).body:
        if isinstance(statement, ast.Assign) and any(
            isinstance(target, ast.Name) and target.id == "SOURCES" for target in statement.targets
        ):
            return tuple(ast.literal_eval(statement.value))
    return ()


def fault(keys: Iterable[str]) -> str:
    """Which of the ``keys`` the bibliography lacks, with the nearest that it has; an empty text where it has all."""
    lacking = [key for key in keys if key not in entries()]
    return ", ".join(f"{key!r} is not in {FILE.name}{nearest(key, list(entries()))}" for key in lacking)
