"""The files of a forecast: ``NAME.toml`` (definitions, quantiles, chances) with ``NAME_draws.h5`` beside it, and their
SHA-256. The same content gives the same bytes. ``pipeline.uncertainty.frozen_forecast`` scores them.

A forecast has one or more columns, each with draws of its own: what is known otherwise, or other fidelities.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from matter.errors import InputError
from matter.files import archive
from pipeline.store import provenance

LEVELS = (0.025, 0.16, 0.5, 0.84, 0.975)
"""The median, and the ends of the central 68 and 95 %."""
SUMS = "SHA256SUMS"


def names(name: str) -> tuple[str, str]:
    """Table and draws of the forecast of this name."""
    return f"{name}.toml", f"{name}_draws.h5"


def number(value: float) -> str:
    """Four digits, as a float of TOML."""
    text = f"{value:.4g}"
    return text if any(sign in text for sign in ".e") else f"{text}.0"


def key(name: str) -> str:
    """A key of TOML, in quotes where it needs them."""
    return str(tomlkit.key(name).as_string())


def pairs(content: Mapping[str, Any]) -> list[str]:
    """Lines of a table: texts, lists of texts, whole numbers and dates as TOML has them."""
    return [f"{key(name)} = {tomlkit.item(value).as_string()}" for name, value in content.items()]


def table_of(chances: Mapping[str, float]) -> str:
    """An inline table of numbers."""
    return "{ " + ", ".join(f"{key(name)} = {number(p)}" for name, p in chances.items()) + " }"


def quantity(words: Mapping[str, Any], columns: Mapping[str, np.ndarray]) -> list[str]:
    """The lines of one quantity: what it is (``name``, ``unit``, ``definition`` ...), and the quantiles ``LEVELS`` of
    the draws (n,) of each column that forecasts it."""
    lines = ["", "[[quantity]]", *pairs(words)]
    for column, draws in columns.items():
        values = np.quantile(np.asarray(draws, dtype=float), LEVELS)
        lines.append(f"{column} = [{', '.join(map(number, values))}]")
    return lines


def write(
    folder: Path, name: str, text: str, draws: Mapping[str, Any], attributes: Mapping[str, Any], frozen: bool
) -> dict[str, str]:
    """Write table and draws into ``folder``; their SHA-256 by name. Raises ``InputError``, and writes nothing, where
    one of a ``frozen`` forecast is there and would change."""
    table, arrays = names(name)
    with tempfile.TemporaryDirectory() as made:
        new = Path(made)
        archive.write_text(new / table, text)
        archive.write(new / arrays, draws, attributes, compress=False)
        for file in (table, arrays) if frozen else ():
            old = folder / file
            if old.is_file() and old.read_bytes() != (new / file).read_bytes():
                raise InputError(f"{old} is frozen and would change: give the new forecast a name of its own")
        for file in (table, arrays):
            with archive.replacing(folder / file) as temporary:
                temporary.write_bytes((new / file).read_bytes())
    return {file: provenance.file_sha256(folder / file) for file in (table, arrays)}


def write_sums(folder: Path, sums: Mapping[str, str]) -> None:
    """Write ``SHA256SUMS``, as ``sha256sum -c`` reads it and a score asks it."""
    archive.write_text(folder / SUMS, "".join(f"{code}  {file}\n" for file, code in sums.items()))


def range_words(values: Sequence[float], shown: Any) -> str:
    """Median (68 %; 95 %) of quantiles at ``LEVELS``; ``shown`` words one value."""
    low, less, middle, more, high = (shown(value) for value in values)
    return f"{middle} ({less} to {more}; {low} to {high})"
