"""On which line of a TOML file a key stands: ``tomllib`` does not say, and a message that names the line is read
sooner."""

from __future__ import annotations

import re

KeyPath = tuple[str | int, ...]

_WORD = r"""(?:"[^"]*"|'[^']*'|[A-Za-z0-9_-]+)"""
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_WORD}(?:\s*\.\s*{_WORD})*)\s*\]\]?")
_ENTRY = re.compile(rf"\s*({_WORD}(?:\s*\.\s*{_WORD})*)\s*=")


def _words(dotted: str) -> list[str]:
    return [word.strip("\"'") for word in re.findall(_WORD, dotted)]


def key_lines(text: str) -> dict[KeyPath, int]:
    """Line number (from 1) of every table header and key, by its path; array-of-tables elements count from 0."""
    lines: dict[KeyPath, int] = {}
    counts: dict[KeyPath, int] = {}
    table: KeyPath = ()
    quote = ""
    for number, line in enumerate(text.splitlines(), 1):
        if quote:  # inside a multi-line string nothing is a key
            quote = "" if quote in line else quote
            continue
        if header := _HEADER.match(line):
            table = _table(header.group(1) == "[[", _words(header.group(2)), counts)
            _note(lines, table, number)
        elif entry := _ENTRY.match(line):
            _note(lines, (*table, *_words(entry.group(1))), number)
        for mark in ('"""', "'''"):
            if line.count(mark) % 2:
                quote = mark
    return lines


def _table(element: bool, words: list[str], counts: dict[KeyPath, int]) -> KeyPath:
    path: KeyPath = ()
    for position, word in enumerate(words):
        path = (*path, word)
        last = position == len(words) - 1
        if last and element:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _note(lines: dict[KeyPath, int], path: KeyPath, number: int) -> None:
    for length in range(1, len(path) + 1):
        lines.setdefault(path[:length], number)


def line_of(path: KeyPath, lines: dict[KeyPath, int]) -> int | None:
    """The line of ``path``, or of the nearest table around it that has one."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None
