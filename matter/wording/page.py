"""Pages: one style for every report, in one HTML file that needs no network, on a wide screen, a phone and paper.

Whatever may be wider than a phone (tables, pictures) stands in a box of its own that scrolls sideways, so that nothing
is cut and the page itself never moves. Numbers are worded by ``readable``.
"""

from __future__ import annotations

import base64
import html
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from matter.wording import ledger_words, readable

STYLE = """
:root{--ink:#1c2530;--soft:#55606c;--line:#dfe5eb;--head:#f4f7fa}
*{box-sizing:border-box}
body{font:15px/1.5 system-ui,sans-serif;max-width:1120px;margin:1.6em auto;
padding:0 1.2em;color:var(--ink);background:#fff;overflow-wrap:break-word}
h1{font-size:1.6em;line-height:1.25;margin:.2em 0 .5em}
h2{font-size:1.2em;margin:1.8em 0 .4em;border-bottom:1px solid var(--line)}
.scroll{overflow-x:auto;max-width:100%;margin:.7em 0}
table{border-collapse:collapse;font-size:.9em;font-variant-numeric:tabular-nums}
th,td{padding:.25em .7em;text-align:right;border-bottom:1px solid var(--line);vertical-align:top}
th{vertical-align:bottom;background:var(--head)}td.n{white-space:nowrap}
th:first-child,td:first-child{text-align:left;padding-left:.3em}.word{text-align:left}
.note{text-align:left;color:var(--soft);font-size:.92em;min-width:15em;overflow-wrap:anywhere}p.note{min-width:0}
.pass,.met{color:#1b7f3b;font-weight:600}.fail,.unmet{color:#b3261e;font-weight:600}
.waived{color:#8a5c00;font-weight:600}
.not_measured,.not_applicable,.quantity{color:var(--soft)}
.key{display:block;color:var(--soft);font-size:.8em}
figure{margin:1em 0}figcaption{color:var(--soft);font-size:.9em}
figure img{display:block;width:100%;height:auto}figure.narrow img{max-width:640px}
ul.refs{columns:24em 2;font-size:.87em;padding-left:1.2em}ul.refs li{break-inside:avoid}
.live canvas{display:block;width:100%;height:min(62vh,70vw,560px);border:1px solid var(--line);
touch-action:none;cursor:grab}
.live-bar{display:flex;flex-wrap:wrap;gap:.3em 1.4em;align-items:center;font-size:.9em;margin:.4em 0}
.live-bar i{display:inline-block;width:6em;height:.7em;border:1px solid var(--line)}
@media(max-width:700px){body{margin:.8em auto;padding:0 .8em}
figure img{width:760px;max-width:none}figure.narrow img{width:520px}th:first-child,td:first-child{min-width:8em}}
@media print{@page{size:A4;margin:14mm}body{margin:0;padding:0;max-width:none;font-size:9.5pt}
h2{break-after:avoid}figure,tr,li{break-inside:avoid}
.scroll{overflow:visible}table{font-size:8pt}td,th{padding:.15em .4em}
figure img{max-height:230mm;width:auto;max-width:100%}.live{display:none}}
"""


def document(title: str, parts: Iterable[str]) -> str:
    """A whole page from its parts (HTML; empty ones are left out) under a ``title`` (plain text)."""
    body = "\n".join(part for part in parts if part)
    return (
        "<!doctype html>\n<html lang=en><head><meta charset=utf-8><meta name=viewport "
        "content='width=device-width,initial-scale=1'>"
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>\n"
        f"<h1>{escape(title)}</h1>\n{body}\n</body></html>\n"
    )


def heading(run: Path, words: str) -> str:
    """``words`` behind the title of the case that the ``run`` folder is of; alone where it has none."""
    try:
        case = tomllib.loads((run / "case.used.toml").read_text()).get("case", {})
    except (OSError, ValueError):
        return words
    title = case.get("title") if isinstance(case, dict) else None
    return f"{title} | {words}" if isinstance(title, str) and title else words


def escape(text: object) -> str:
    """Text for HTML, powers of ten and of units as they are printed."""
    return html.escape(readable.prose(str(text)))


def breakable(text: object) -> str:
    """``escape``, with room for a line break inside long chains without spaces."""
    return html.escape(re.sub(r"([,;/=\]])(?=\S)", "\\1\u200b", readable.prose(str(text))))


def cell(content: str, style: str = "n") -> str:
    """One cell of a table: ``content`` is HTML; ``style`` n (a number), word, note, or a verdict."""
    return f"<td class='{style}'>{content}</td>" if style else f"<td>{content}</td>"


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], words: Sequence[int] = (), notes: Sequence[int] = ()
) -> str:
    """A table in a box that scrolls. ``head`` and cells are HTML; a cell that starts with ``<td`` stands as it is.

    ``words`` and ``notes`` are the numbers of columns set left and in running text; the others are numbers, and do not
    break.
    """

    def style(k: int) -> str:
        return "note" if k in notes else "word" if k in words else "" if k == 0 else "n"

    top = "".join(f"<th class='{style(k)}'>{name}</th>" for k, name in enumerate(head))
    lines = [
        "".join(entry if entry.startswith("<td") else cell(entry, style(k)) for k, entry in enumerate(row))
        for row in rows
    ]
    body = "\n".join(f"<tr>{line}</tr>" for line in lines)
    return f"<div class=scroll><table>{f'<tr>{top}</tr>' if head else ''}\n{body}</table></div>"


def picture(path: Path, caption: str, narrow: bool = False, inline: bool = True) -> str:
    """A picture (PNG) with its caption (plain text), inside the page or, with ``inline`` off, beside it; empty where
    there is no file.

    ``narrow`` ones keep a reader's width on a wide screen and shrink on a phone; the others keep theirs there and
    scroll.
    """
    if not path.is_file():
        return ""
    source = (
        f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}" if inline else html.escape(path.name)
    )
    image = (
        f'<div class=scroll><img alt="{html.escape(caption)}" data-file="{html.escape(path.name)}" '
        f'src="{source}"></div>'
    )
    return f"<figure{' class=narrow' if narrow else ''}>{image}<figcaption>{escape(caption)}</figcaption></figure>"


def ledger(entries: Sequence[Mapping[str, Any]]) -> str:
    """The rows of a handoff's ledger as two tables: criteria (what in words, value, limit, verdict, note), and
    quantities, which have no limit.

    Two stages show it, each reading ``ledger.json``: the rows are the interface between them.
    """
    judged = [row for row in entries if row.get("limit") is not None]
    stated = [row for row in entries if row.get("limit") is None]
    criteria = [
        [
            *_ledger_cells(row)[:2],
            _ledger_value(row["limit"], str(row.get("unit", "1"))),
            _verdict(row),
            _ledger_cells(row)[2],
        ]
        for row in judged
    ]
    quantities = [list(_ledger_cells(row)) for row in stated]
    parts = (
        [table(["criterion", "value", "limit", "verdict", "note"], criteria, words=(3,), notes=(4,))]
        if criteria
        else []
    )
    parts += (
        ["<h3>Quantities</h3>" + table(["quantity", "value", "note"], quantities, notes=(2,))] if quantities else []
    )
    return "".join(parts)


def _ledger_cells(row: Mapping[str, Any]) -> tuple[str, str, str]:
    """What a row is called, its value, its note."""
    name, unit = str(row.get("name", "")), str(row.get("unit", "1"))
    note = breakable(
        row.get("note", "")
        if isinstance(row.get("value"), (int, float, type(None)))
        else f"{row['value']}; {row.get('note', '')}"
    )
    return key(ledger_words.words(name), name), _ledger_value(row.get("value"), unit), note


def _verdict(row: Mapping[str, Any]) -> str:
    verdict = str(row.get("verdict", ""))
    return cell(escape(verdict.replace("_", " ")), f"word {html.escape(verdict)}")


def _ledger_value(value: Any, unit: str) -> str:
    """A ledger's value in words; what is text (a table of counts) goes to the note."""
    return (
        escape(readable.amount(value, unit))
        if isinstance(value, (int, float)) and not isinstance(value, bool)
        else "–"
        if value is None
        else ""
    )


def key(words: str, name: str) -> str:
    """What a row is called in words, its name in the files in small print below."""
    return f"{escape(words)}<span class=key>{html.escape(name)}</span>"


def local(word: object, deep: int = 2) -> str:
    """A path, or ``key=path``, by its last ``deep`` parts: a page that is passed on names no folders of the machine
    that made it."""
    name, mark, text = str(word).rpartition("=")
    path = Path(text)
    return f"{name}{mark}{'/'.join(path.parts[1:][-deep:])}" if path.is_absolute() else str(word)
