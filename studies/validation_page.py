"""The page of ``studies.validation_table``: verdicts first, what is not met by its cause, then every claim with its
numbers."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from matter.errors import InputError

VERDICTS = ("met", "in part", "not met", "not run", "input", "arithmetic")
OPEN = ("not met", "in part")
"""Verdicts that ask for a cause."""
HEAD = ("id", "claim", "published", "ours", "reproduced if", "verdict", "resolution", "why, notes", "result")
SHORT = ("id", "claim", "published", "ours", "verdict", "result")


class Claim(NamedTuple):
    """One line of ``claims.toml``."""

    id: str
    claim: str
    published: str
    tolerance: str
    chapter: str


class Row(NamedTuple):
    """One finding: the claim's id, where it was found, and the words of the table; empty words are those of the
    claim."""

    id: str
    folder: str
    ours: str
    verdict: str
    resolution: str = ""
    why: str = ""
    claim: str = ""
    published: str = ""
    tolerance: str = ""


class Cause(NamedTuple):
    """Why some claims are not met: a title, the reason in words, and their ids."""

    title: str
    words: str
    claims: tuple[str, ...]


def groups(path: Path, known: Mapping[str, Claim]) -> tuple[dict[str, tuple[str, ...]], list[Cause]]:
    """The rooms with their claims, and the causes, of ``claims.toml``.

    Raises ``InputError`` for an unknown id, and for a claim that stands in no room or in two, or under two causes.
    """
    content = tomllib.loads(path.read_text())
    rooms = {room: tuple(spread(parts, known, path)) for room, parts in content["rooms"].items()}
    causes = [Cause(one["title"], one["words"], tuple(spread(one["claims"], known, path))) for one in content["cause"]]
    placed = Counter(key for keys in rooms.values() for key in keys)
    if odd := [key for key in known if placed[key] != 1]:
        raise InputError(f"{path}: not in exactly one room: {', '.join(odd)}")
    caused = Counter(key for cause in causes for key in cause.claims)
    if odd := [key for key, count in caused.items() if count > 1]:
        raise InputError(f"{path}: under two causes: {', '.join(odd)}")
    return rooms, causes


def spread(parts: Iterable[str], known: Mapping[str, Claim], path: Path) -> list[str]:
    """Ids of a list in which ``W01-W37`` stands for all from the one to the other, in the order of the file."""
    order = list(known)
    found = []
    for part in parts:
        first, _, last = part.partition("-")
        for key in (first, last or first):
            if key not in known:
                raise InputError(f"{path}: no claim {key!r} for {part!r}")
        found += order[order.index(first) : order.index(last or first) + 1]
    return found


def cell(text: str) -> str:
    """Text that keeps a Markdown table whole."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def lines_of(claim: Claim, found: list[Row], head: Sequence[str]) -> list[str]:
    """The table's lines of one claim, in the columns ``head``."""
    if measured := [row for row in found if row.verdict != "not run"]:
        found = measured
    lines = []
    for row in found or [Row(claim.id, "", "-", "not run")]:
        words = {
            "id": claim.id,
            "claim": row.claim or claim.claim,
            "published": row.published or claim.published,
            "ours": row.ours,
            "reproduced if": row.tolerance or claim.tolerance,
            "verdict": f"**{row.verdict}**" if row.verdict == "not met" else row.verdict,
            "resolution": row.resolution,
            "why, notes": row.why,
        }
        words = {name: cell(text) for name, text in words.items()}
        words["result"] = f"[{row.folder}](results/{row.folder}/README.md)" if row.folder else ""
        if not row.folder:  # nobody looked: nothing to say but the claim
            words |= {"resolution": "", "why, notes": ""}
        lines.append("| " + " | ".join(words[name] for name in head) + " |")
    return lines


def verdict_of(found: list[Row]) -> str:
    """A claim's one verdict for the count: that of its worst row."""
    verdicts = {row.verdict for row in found} - {"not run"}
    if not verdicts:
        return "not run"
    return next(verdict for verdict in ("not met", "in part", "met", "arithmetic", "input") if verdict in verdicts)


def page(
    known: dict[str, Claim],
    found: list[Row],
    rooms: Mapping[str, Sequence[str]],
    causes: Sequence[Cause],
) -> str:
    """The whole page. Raises ``InputError`` where a claim that is not met, or in part only, has no cause, or one
    that is met has one."""
    by_id = {key: [row for row in found if row.id == key] for key in known}
    verdicts = {key: verdict_of(rows) for key, rows in by_id.items()}
    caused = {key for cause in causes for key in cause.claims}
    if odd := [key for key, verdict in verdicts.items() if (verdict in OPEN) != (key in caused)]:
        raise InputError(f"claims.toml: a cause for what is not met, and for nothing else: see {', '.join(odd)}")
    count = Counter(verdicts.values())
    asked = count.total() - count["input"] - count["arithmetic"]
    text = [
        "# What was published, and what was found here",
        "",
        f"Of {asked} published claims and criteria that can be met or missed, **{count['met']} are met**, "
        f"{count['in part']} in part, **{count['not met']} are not met**",
        f"and {count['not run']} were not run. Claims that are not met stay, with their cause as far as it is known.",
        "",
        *counts("room", {room: [verdicts[key] for key in keys] for room, keys in rooms.items()}),
        "",
        "A claim with several rows counts by the worst of them; a limit that a case waives counts as not met. In",
        "part: what was looked at is met, the rest not run. Input: a value that was taken over; arithmetic: a printed",
        "formula or sum that was worked out again. Made by `python studies/validation_table.py` from",
        "[claims.toml](claims.toml) and the files in [results](results/README.md); edit those, not this page.",
        "",
        "## What is not met, by cause",
    ]
    for cause in causes:
        text += ["", f"### {cause.title}", "", cause.words, "", *header_rows(SHORT)]
        for key in known:
            if key in cause.claims:
                text += lines_of(
                    known[key], gathered([row for row in by_id[key] if row.verdict == verdicts[key]]), SHORT
                )
    text += ["", "## What was not run", "", *header_rows(("id", "claim", "published", "reproduced if"))]
    text += [
        "| " + " | ".join(map(cell, (key, claim.claim, claim.published, claim.tolerance))) + " |"
        for key, claim in known.items()
        if verdicts[key] == "not run"
    ]
    text += ["", "## Every claim, by source", ""]
    chapters = dict.fromkeys(claim.chapter for claim in known.values())
    of_source = {title: [verdicts[key] for key, one in known.items() if one.chapter == title] for title in chapters}
    text += counts("source", of_source)
    for title in chapters:
        text += ["", f"### {title}", "", *header_rows(HEAD)]
        for key, claim in known.items():
            if claim.chapter == title:
                text += lines_of(claim, by_id[key], HEAD)
    return "\n".join(text) + "\n"


def gathered(found: list[Row]) -> list[Row]:
    """The first row of each wording of a claim, which says how many more there are (other resolutions, mostly)."""
    first: dict[str, list[Row]] = {}
    for row in found:
        first.setdefault(row.claim, []).append(row)
    return [
        one._replace(ours=f"{one.ours}; and {len(more)} more below") if more else one for one, *more in first.values()
    ]


def header_rows(names: Sequence[str]) -> list[str]:
    """The first two lines of a table."""
    return ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]


def counts(what: str, verdicts: Mapping[str, Sequence[str]]) -> list[str]:
    """A table of how often each verdict was given, a line each of ``verdicts``."""
    rows = [
        [title, *(str(Counter(given)[one]) for one in VERDICTS), str(len(given))] for title, given in verdicts.items()
    ]
    return [*header_rows((what, *VERDICTS, "all")), *("| " + " | ".join(row) + " |" for row in rows)]
