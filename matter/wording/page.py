"""Pages: one style for every report, in one HTML file that needs no network, on a wide screen, a phone and paper.

Every tag stands in a template (jinja2): the layout in ``templates/page.html.j2``, tables, pictures and the ledger in
``templates/parts.html.j2``, the rest in a folder ``templates`` beside each module that makes a page. A page begins
with one ``headline``, the ``title`` of its case and a picture; then come tables. Whatever may be wider than a phone
(tables, pictures) stands in a box of its own that scrolls sideways, so that nothing is cut and the page never moves.
"""

from __future__ import annotations

import base64
import functools
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from matter.wording import ledger_words, readable

if TYPE_CHECKING:
    from jinja2 import Environment

PARTS = "matter/wording/templates/parts.html.j2"


class Cell(NamedTuple):
    """A cell of a table with its name in the files (``key``) in small print below, or with a ``style``: a verdict."""

    text: str
    key: str = ""
    style: str = ""


def render(template: str, part: str = "", **facts: Any) -> str:
    """A page made from its ``template``, a path from the folder that holds the packages, with the ``facts`` that it
    takes; or one ``part`` of it, a macro.

    Texts among the facts are escaped, so that no name in a case becomes a tag, and worded as ``readable.prose`` does;
    what was rendered before stands as it is. Raises ``jinja2.UndefinedError`` where a fact is missing.
    """
    found = _environment().get_template(template)
    return str(found.render(facts)) if not part else getattr(found.module, part)(**facts)


@functools.cache
def _environment() -> Environment:
    import jinja2

    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parents[2]), autoescape=True, undefined=jinja2.StrictUndefined,
        finalize=_worded, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    made.filters |= {"breakable": breakable, "base64": lambda path: base64.b64encode(path.read_bytes()).decode()}
    made.globals |= {"readable": readable}
    return made


def _worded(value: Any) -> Any:
    return readable.prose(value) if isinstance(value, str) and not hasattr(value, "__html__") else value


def breakable(text: str) -> str:
    """With room for a line break inside long chains without spaces."""
    return re.sub(r"([,;/=\]])(?=\S)", "\\1\u200b", readable.prose(text))


def heading(run: Path, words: str) -> str:
    """``words`` behind the title of the case that the ``run`` folder is of; alone where it has none."""
    try:
        case = tomllib.loads((run / "case.used.toml").read_text()).get("case", {})
    except (OSError, ValueError):
        return words
    title = case.get("title") if isinstance(case, dict) else None
    return f"{title} | {words}" if isinstance(title, str) and title else words


def ledger(entries: Sequence[Mapping[str, Any]]) -> str:
    """The rows of a handoff's ledger as two tables: criteria (what in words, value, limit, verdict, note), and
    quantities, which have no limit.

    Two stages show it, each reading ``ledger.json``: the rows are the interface between them.
    """
    criteria, quantities = [], []
    for row in entries:
        name, unit, value, note = (row.get(key, "") for key in ("name", "unit", "value", "note"))
        if not isinstance(value, int | float | None):  # a table of counts goes to the note
            value, note = "", f"{value}; {note}"
        words, shown = Cell(ledger_words.words(name), key=name), _ledger_value(value, unit)
        if row.get("limit") is None:
            quantities.append([words, shown, note])
        else:
            verdict = str(row.get("verdict", ""))
            judged = Cell(verdict.replace("_", " "), style=verdict)
            criteria.append([words, shown, _ledger_value(row["limit"], unit), judged, note])
    return render(PARTS, "ledger", criteria=criteria, quantities=quantities)


def _ledger_value(value: Any, unit: str) -> str:
    return "–" if value is None else value if isinstance(value, str) else readable.amount(value, unit)


def local(word: object) -> str:
    """A path, or ``key=path``, by its last two parts: a page that is passed on names no folders of the machine
    that made it."""
    name, mark, text = str(word).rpartition("=")
    path = Path(text)
    return f"{name}{mark}{'/'.join(path.parts[1:][-2:])}" if path.is_absolute() else str(word)
