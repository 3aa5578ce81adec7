"""Members of a sweep that were computed elsewhere: on other machines, or in an earlier part of a long sweep whose run
folders are gone.

A ``table.csv`` of the same sweep, under any name in the folder ``elsewhere`` of the sweep's folder, stands for their
run folders. A row counts where its member has the same name, run folder and last stage: the run folder's name follows
from every value that the member computes with, so a row of other values counts for nothing.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matter.errors import InputError

FOLDER = "elsewhere"
NEEDED = ("member", "run", "state", "until")
_WORDS: Mapping[str, Any] = {"": None, "True": True, "False": False}
_TEXTS = ("member", "run", "state", "reason", "until", "case", "commit", "class")


def rows_in(folder: Path) -> dict[tuple[str, str], dict[str, Any]]:
    """The rows of all tables in a ``folder``; empty where there is none. Raises ``InputError``."""
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for file in sorted(folder.glob("*.csv")):
        rows |= _rows_of(file)
    return rows


def _rows_of(file: Path) -> dict[tuple[str, str], dict[str, Any]]:
    """The rows of the members that are done, by member and run folder, with numbers as such and None where a cell is
    empty. Raises ``InputError`` where the file cannot be read or is no table of a sweep."""
    try:
        with file.open(newline="") as lines:
            reader = csv.DictReader(lines)
            rows = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as reason:
        raise InputError(f"{file} cannot be read: {reason}") from None
    if lacking := [name for name in NEEDED if name not in (reader.fieldnames or ())]:
        raise InputError(f"{file} is no table.csv of a sweep: it has no column {' or '.join(lacking)}")
    return {
        (row["member"], row["run"]): {name: _value(name, text) for name, text in row.items() if name is not None}
        for row in rows
        if row["state"] == "done"
    }


def _value(name: str, text: str | None) -> Any:
    """A cell of the table, as the sweep that wrote it had it."""
    if name in _TEXTS:
        return text or ""
    if text is None or text in _WORDS:
        return _WORDS[text or ""]
    try:
        return int(text) if text.lstrip("-").isdigit() else float(text)
    except ValueError:
        return text
