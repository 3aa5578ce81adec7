"""Rows of numbers in a text file, with the line of the file in every complaint."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from matter.formats.words import short

_EXACT = 2**53
"""Whole numbers up to this one are exact in floating point."""


def text(path: Path) -> str:
    """The content of a text file. Raises ``InputError`` for one that is no text."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file") from None


class Table(NamedTuple):
    """Numbers of a text file: ``values`` (lines, columns), the ``words`` that they were read from, and for each line
    its number in the file."""

    values: np.ndarray
    words: list[list[str]]
    lines: list[int]

    def whole(self, column: int, where: str) -> np.ndarray:
        """A column of whole numbers (lines,), exact to the last digit. Raises ``InputError`` naming the first that is
        none, or that 64 bits cannot hold."""
        try:
            return np.array([row[column] for row in self.words], dtype=np.int64)
        except (ValueError, OverflowError):  # "1.0", or what is no whole number
            numbers = [self._whole(row, column, where) for row in range(len(self.words))]
        return np.array(numbers, dtype=np.int64)

    def _whole(self, row: int, column: int, where: str) -> int:
        word = self.words[row][column]
        try:
            number = int(word)
        except ValueError:
            value = float(self.values[row, column])
            if not value.is_integer() or abs(value) > _EXACT:
                raise InputError(f"{where}, line {self.lines[row]}: {short(word)} is not a whole number") from None
            number = int(value)
        if not -(2**63) <= number < 2**63:
            raise InputError(f"{where}, line {self.lines[row]}: {short(word)} is more than 64 bits can hold")
        return number


def table(lines: Sequence[tuple[int, str]], path: Path) -> Table:
    """Numbers between blanks; ``lines`` holds (number in the file, text).

    Raises ``InputError`` naming the first line that has another count of numbers than the first one, or something that
    is not a number.
    """
    rows, line_numbers = [line.split() for _, line in lines], [number for number, _ in lines]
    try:
        values = np.array(rows, dtype=float).reshape(len(rows), -1)
        if not any("_" in line for _, line in lines):  # Python reads 1_0 as ten
            return Table(values, rows, line_numbers)
    except ValueError:
        pass
    for number, row in zip(line_numbers, rows):
        if len(row) != len(rows[0]):
            raise InputError(f"{path}, line {number}: {len(row)} values, and {len(rows[0])} in line {line_numbers[0]}")
        for column, word in enumerate(row, 1):
            if not is_number(word):
                raise InputError(f"{path}, line {number}: {short(word)} in column {column} is not a number")
    raise InputError(f"{path} holds no table of numbers")


def is_number(word: str) -> bool:
    """Whether a word can be read as a number."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word
