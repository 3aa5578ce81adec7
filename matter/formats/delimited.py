"""Delimited text, both ways.

Read: CSV with a header line, or columns of numbers with ``--columns``; commas, semicolons, tabs or blanks between.
Written: CSV with one header line of names and units, ``position_x [m],...``, one particle a line, every number exact.
Spreadsheets, pandas, R and ParaView read it, and so does ``read``. Only what particles carry fits into such a table:
time and names of materials stay behind.
"""

from __future__ import annotations

from pathlib import Path

from matter.errors import InputError
from matter.files import archive
from matter.formats import named_columns as named
from matter.formats import numbers
from matter.formats.reading import Reading
from matter.formats.words import listed
from matter.particles import FIELDS, Particles

_AT_ONCE = 50_000


def read(path: Path, columns: str | None = None) -> Reading:
    """What a text file holds, one particle per line; lines that start with ``#`` are comments (the last one before
    the data may be the header)."""
    lines = list(enumerate(numbers.text(path).splitlines(), 1))
    rows = [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not rows:
        raise InputError(f"{path} holds no data")
    header, own = columns, None
    if not _numeric(rows[0][1]):  # a header line; --columns replaces it
        own = rows.pop(0)[1]
        header = own if header is None else header
    elif header is None:
        comments = [line.lstrip()[1:] for _, line in lines[: rows[0][0] - 1] if line.lstrip().startswith("#")]
        if not comments:
            raise InputError(
                f"{path} has no header: name its columns with --columns 'x,y,z,vx,vy,vz,m,rho' ('-' leaves one out)"
            )
        header = comments[-1]
    if not rows:
        raise InputError(f"{path} holds a header and no data")
    table = numbers.table([(number, _blanks(line)) for number, line in rows], path)
    names = _names(header)
    if len(names) != table.values.shape[1]:
        raise InputError(f"{path}: {len(names)} column names for {table.values.shape[1]} columns ({listed(names)})")
    reading, called = Reading(path), _names(own) if own is not None else []
    named.enter(reading, names, table, own=called if len(called) == len(names) else None)
    return reading


def write(particles: Particles, path: Path) -> None:
    """Write every field as CSV. Raises ``InputError`` for particles without a position."""
    columns = named.components(particles)
    header = [f"{label} [{FIELDS[field].unit}]" if FIELDS[field].unit != "1" else label for label, field, _ in columns]
    with archive.replacing(Path(path)) as temporary, open(temporary, "w") as file:
        file.write(",".join(header) + "\n")
        for start in range(0, len(particles), _AT_ONCE):
            lists = [values[start : start + _AT_ONCE].tolist() for _, _, values in columns]
            file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*lists))


def _blanks(row: str) -> str:
    return row.replace(",", " ").replace(";", " ")


def _numeric(row: str) -> bool:
    return all(numbers.is_number(word) for word in _blanks(row).split())


def _names(header: str) -> list[str]:
    for mark in (",", ";", "\t"):
        if mark in header:
            return [name.strip() for name in header.split(mark)]
    return header.replace(" [", "[").split()
