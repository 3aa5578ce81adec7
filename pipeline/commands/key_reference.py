"""``run_case --describe``: the keys of a case file as text for a terminal."""

from __future__ import annotations

import shutil
import textwrap

from pipeline.case import keys
from pipeline.case.keys import Key, Table


def describe(name: str | None = None) -> str:
    """All tables and keys, or those of the table ``name`` and of the tables inside it, or one key. Raises
    ``InputError`` with the nearest name."""
    tables, single = keys.find(name) if name else (list(keys.tables()), [])
    blocks = [_table(table) for table in tables] + [_key(key, key.name) for key in single]
    return "\n\n".join(blocks)


def _table(table: Table) -> str:
    head = f"[[{table.name}]]" if table.listed else f"[{table.name}]"
    meaning = table.meaning + (" NAME is that of a material." if keys.of_material(table.path) else "")
    return "\n".join(
        [f"{head}  {_wrapped(meaning, len(head) + 2)}", *(_key(key, key.path[-1]) for key in keys.keys(table))]
    )


def _key(key: Key, name: str) -> str:
    default = "required" if key.default == "required" else f"default {key.default}"
    return f"  {name}  ({key.allowed}; {default})\n      {_wrapped(key.meaning, 6)}".rstrip()


def _wrapped(text: str, indent: int) -> str:
    width = max(60, min(shutil.get_terminal_size((100, 24)).columns, 120)) - 6
    first, *more = textwrap.wrap(" " * (indent - 6) + text, width, break_on_hyphens=False, break_long_words=False) or [
        ""
    ]
    return "\n".join([first.strip(), *(f"      {line}" for line in more)])
