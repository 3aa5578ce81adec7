"""Rows of numbers in a text file, with the line of the file in every complaint."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from matter.errors import InputError


def text(path: Path) -> str:
    """The content of a text file. Raises ``InputError`` for one that is no text."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file") from None


def table(lines: Sequence[tuple[int, str]], path: Path) -> np.ndarray:
    """Numbers between blanks, shape (lines, columns); ``lines`` holds (number in the file, text).

    Raises ``InputError`` naming the first line that has another count of numbers than the first one, or something that
    is not a number.
    """
    rows = [line.split() for _, line in lines]
    try:
        return np.array(rows, dtype=float).reshape(len(rows), -1)
    except ValueError:
        pass
    for (number, _), row in zip(lines, rows):
        if len(row) != len(rows[0]):
            raise InputError(f"{path}, line {number}: {len(row)} values, and {len(rows[0])} in line {lines[0][0]}")
        for column, word in enumerate(row, 1):
            if not is_number(word):
                raise InputError(f"{path}, line {number}: {word!r} in column {column} is not a number")
    raise InputError(f"{path} holds no table of numbers")


def is_number(word: str) -> bool:
    """Whether a word can be read as a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True
