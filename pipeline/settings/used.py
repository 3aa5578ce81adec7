"""``case.used.toml``: every parameter that a run used, defaults included, in SI with units.

The file is itself a case: running it gives the same settings to the last bit, whatever the defaults have become since.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
from pathlib import Path
from typing import Any

import tomlkit

from matter.case.body import Model
from matter.case.identity_fields import following
from matter.errors import InputError
from matter.files import archive
from pipeline.case import stages
from pipeline.case.plain import plain
from pipeline.case.read import Case


def write(path: Path, case: Case, settings: dict[str, Model]) -> None:
    """Write what ``settings`` hold, shared tables once."""
    content: dict[str, Any] = {"case": {"title": case.title}}
    if isinstance(source := case.document.get("case", {}).get("source"), str):
        content["case"]["source"] = source
    if case.sources:
        content["case"]["sources"] = list(case.sources)
    if case.stages != stages.ORDER:
        content["case"]["stages"] = list(case.stages)
    for stage in stages.ORDER:
        if stage not in settings:
            continue
        table = plain(settings[stage])
        for name in stages.SHARED_TABLES:
            if name in table and name in case.document:
                content.setdefault(name, table.pop(name))
        for *outer, name in following(type(settings[stage])):
            functools.reduce(dict.__getitem__, outer, table).pop(name, None)
        if (
            stage == "bed"
            and isinstance(case.document.get("dem"), dict)
            and "contact" not in case.document.get("bed", {})
        ):
            table.pop("contact", None)  # stands in [dem.contact]
        content[stage] = table
    for stage, file in case.outside.items():
        content.setdefault(stage, {})[stages.OUTSIDE[stage]] = str(file.resolve())
    head = _head_of(path) if case.run else ""
    if not head:
        preset = f"preset {case.preset}" if case.preset else "no preset"
        changes = "".join(f"\n# --set {assignment}" for assignment in case.overrides)
        head = (
            f"# All parameters of a run of {case.file.name} ({case.name}, {preset}), in SI units; this file is itself "
            f"a case.{changes}\n\n"
        )
    archive.write_text(path, _sealed(head + tomlkit.dumps(content)))


_SEAL = "# SHA-256 of the text above, by which a run knows its own values: "


def _sealed(text: str) -> str:
    return f"{text}\n{_SEAL}{hashlib.sha256(text.encode()).hexdigest()}\n"


def check(path: Path) -> None:
    """Raise ``InputError`` where the file of a run is not as the run wrote it: to go on with other values would mix
    two runs in one folder. A file without a seal (of an older version) passes."""
    try:
        text, seal, _ = path.read_text().rpartition(f"\n{_SEAL}")
    except ValueError:  # not even text: whoever reads it as a case says so
        return
    if seal and _sealed(text) != path.read_text():
        raise InputError(
            f"{path} was changed since the run wrote it, and a run goes on with the values that it was begun with: "
            f"restore it, or copy it elsewhere and run the copy"
        )


def _head_of(path: Path) -> str:
    """The comment that a run's file begins with: it says which case and options the run was begun with."""
    lines = path.read_text().splitlines() if path.is_file() else []
    head = list(itertools.takewhile(lambda line: line.startswith("#"), lines))
    return "\n".join(head) + "\n\n" if head else ""
