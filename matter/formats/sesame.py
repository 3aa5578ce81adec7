"""Tables of an equation of state in the SESAME-like text that SWIFT and WoMa read.

    12 lines of header, for people
    date                                    YYYYMMDD
    number of densities, number of temperatures
    the densities [kg/m^3], ascending
    the temperatures [K], ascending
    u [J/kg]  P [Pa]  c [m/s]  s [J/(kg K)] one line a node, all densities of the first temperature first

What stands above follows the description of the reader in SWIFT (``equation_of_state/planetary/sesame.h``). A first
density or temperature of zero is left out, equal densities count once. Files may be compressed (``.gz``, ``.xz``).
A table whose entropies are all zero has none.
"""

from __future__ import annotations

import functools
import gzip
import lzma
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from matter.errors import InputError

HEADER = 12
MOST = 4_000_000
"""Nodes beyond which a file is refused: 160 MB of numbers."""
_RANGES = {"u": (1e16, "J/kg"), "P": (1e22, "Pa"), "c": (299_792_458.0, "m/s"), "s": (1e9, "J/(kg K)")}
_FALL = (
    0.05  # fraction of its span by which the energy of one density may fall back with temperature before it is refused
)
_UNITS = 5.0  # factor by which columns may miss each other in the middle of all nodes


class Table(NamedTuple):
    """Densities (n,) [kg/m^3], temperatures (k,) [K]; specific energy [J/kg], pressure [Pa], sound speed [m/s] and
    entropy [J/(kg K)] as (n, k) arrays."""

    rho: np.ndarray
    T: np.ndarray
    u: np.ndarray
    P: np.ndarray
    c: np.ndarray
    s: np.ndarray


def read(path: str | Path) -> Table:
    """The table of a file; raises ``InputError`` naming the first thing that is wrong with it."""
    path = Path(path)
    try:
        known = path.stat()
    except OSError:
        raise InputError(f"no table at {path}") from None
    return _read(path, known.st_mtime_ns, known.st_size)


@functools.lru_cache(maxsize=8)
def _read(path: Path, _changed: int, _size: int) -> Table:
    words = _lines(path)
    counts = _counts(path, words)
    n, k = counts
    numbers = _numbers(path, words[HEADER + 2 :], n + k + 4 * n * k)
    rho, T = numbers[:n], numbers[n : n + k]
    u, P, c, s = np.moveaxis(numbers[n + k :].reshape(k, n, 4), (0, 1, 2), (2, 1, 0))
    _ascending(path, "densities", rho, "kg/m^3")
    _ascending(path, "temperatures", T, "K")
    kept = np.concatenate([[rho[0] > 0.0], np.diff(rho) > 0.0])
    warm = T > 0.0
    cut = np.ix_(kept, warm)
    table = Table(rho[kept], T[warm], *(np.ascontiguousarray(one[cut]) for one in (u, P, c, s)))
    if min(table.u.shape) < 4:
        raise InputError(f"{path}: {n} densities and {k} temperatures are too few: 4 of each are the least")
    _whole(path, table)
    _in_range(path, table)
    _rising(path, table)
    _fitting(path, table)
    return table


def _lines(path: Path) -> list[str]:
    opened: Any = {".gz": gzip.open, ".xz": lzma.open}.get(path.suffix, open)
    try:
        with opened(path, "rt", encoding="utf-8", errors="replace") as file:
            text = file.read(120 * MOST)
    except (OSError, EOFError, lzma.LZMAError) as reason:
        raise InputError(f"{path} cannot be read: {reason}") from None
    return text.splitlines()


def _counts(path: Path, lines: list[str]) -> tuple[int, int]:
    """Numbers of densities and temperatures."""
    if len(lines) < HEADER + 4:
        raise InputError(
            f"{path} has {len(lines)} lines: a table begins with {HEADER} of header, a date and its counts"
        )
    date, counts = lines[HEADER].split(), lines[HEADER + 1].split()
    if len(date) != 1 or not date[0].isdigit() or len(counts) != 2 or not all(word.isdigit() for word in counts):
        raise InputError(
            f"{path}: after {HEADER} lines of header, line {HEADER + 1} should hold a date (YYYYMMDD) and line "
            f"{HEADER + 2} the numbers of densities and temperatures; they hold {lines[HEADER][:30].strip()!r} and "
            f"{lines[HEADER + 1][:30].strip()!r}"
        )
    n, k = int(counts[0]), int(counts[1])
    if not 0 < n * k <= MOST:
        raise InputError(f"{path}: {n} densities and {k} temperatures make {n * k} nodes; 1 to {MOST} can be read")
    return n, k


def _numbers(path: Path, lines: list[str], expected: int) -> np.ndarray:
    words = " ".join(lines).split()
    try:
        numbers = np.array(words, dtype=float)
    except ValueError:
        number, word = next((i, word) for i, word in enumerate(words) if not _is_number(word))
        raise InputError(f"{path}: value {number + 1} after the counts is {word[:30]!r}, not a number") from None
    if len(numbers) != expected:
        what = "cut short" if len(numbers) < expected else "longer than its counts say"
        raise InputError(f"{path} is {what}: {len(numbers)} values follow the counts, {expected} should")
    return numbers


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _ascending(path: Path, what: str, axis: np.ndarray, unit: str) -> None:
    bad = np.flatnonzero(~np.isfinite(axis) | (axis < 0.0))
    if len(bad):
        raise InputError(f"{path}: {what}: number {bad[0] + 1} is {axis[bad[0]]:g} {unit}")
    bad = np.flatnonzero(np.diff(axis) < 0.0)
    if len(bad):
        i = bad[0]
        raise InputError(f"{path}: {what} must ascend; {axis[i + 1]:g} {unit} follows {axis[i]:g} {unit}")
    if what == "temperatures" and (np.diff(axis) == 0.0).any():
        raise InputError(f"{path}: {what} must ascend; {axis[1:][np.diff(axis) == 0.0][0]:g} {unit} stands twice")


def _position(table: Table, bad: np.ndarray) -> str:
    i, j = np.unravel_index(int(np.argmax(bad)), bad.shape)
    return f"at {table.rho[i]:.6g} kg/m^3 and {table.T[j]:.6g} K"


def _whole(path: Path, table: Table) -> None:
    """No value missing: neither NaN nor a node of nothing but zeros."""
    for name in "uPcs":
        bad = ~np.isfinite(getattr(table, name))
        if bad.any():
            raise InputError(f"{path}: {name} is no number {_position(table, bad)} (and {int(bad.sum()) - 1} more)")
    hole = (table.u == 0.0) & (table.P == 0.0) & (table.c == 0.0) & (table.s == 0.0)
    if hole.any():
        raise InputError(
            f"{path}: a hole {_position(table, hole)}: u, P, c and s are zero (and {int(hole.sum()) - 1} more)"
        )


def _in_range(path: Path, table: Table) -> None:
    for axis, most, unit in ((table.rho, 1e8, "kg/m^3"), (table.T, 1e11, "K")):
        if axis[-1] > most:
            raise InputError(f"{path}: {axis[-1]:g} {unit} is beyond {most:g} {unit}: are the units SI?")
    for name, (most, unit) in _RANGES.items():
        value = getattr(table, name)
        bad = (np.abs(value) > most) | ((value < 0.0) & (name == "c"))
        if bad.any():
            least = 0.0 if name == "c" else -most
            raise InputError(
                f"{path}: {name} is {value[bad][0]:g} {unit} {_position(table, bad)}; {least:g} to {most:g} can be: "
                f"are the units SI?"
            )


def _rising(path: Path, table: Table) -> None:
    """Energy rises with temperature, but for small falls of a cold and dense table, which interpolation mends."""
    highest = np.maximum.accumulate(table.u, axis=1)
    span = np.ptp(table.u, axis=1)[:, None]
    bad = (highest - table.u > _FALL * span) | (span == 0.0)
    if bad.any():
        raise InputError(
            f"{path}: the energy falls as temperature rises {_position(table, bad)}: are the nodes in order?"
        )


def _fitting(path: Path, table: Table) -> None:
    """The columns hold the units of one system: c^2 is near dP/drho, T ds near du, and -rho^2 ds/drho near dP/dT (in
    the middle of all nodes)."""
    rho, T = table.rho[:, None], table.T[None, :]

    def along(value: np.ndarray, axis: int) -> np.ndarray:
        step = np.diff(table.rho)[:, None] if axis == 0 else np.diff(table.T)[None, :]
        return np.diff(value, axis=axis) / step

    pairs = {"c^2 and dP/drho": (0.5 * (table.c[1:] ** 2 + table.c[:-1] ** 2), along(table.P, 0))}
    if table.s.any():
        pairs["T ds and du"] = (0.5 * (T[:, 1:] + T[:, :-1]) * along(table.s, 1), along(table.u, 1))
        pairs["-rho^2 ds/drho and dP/dT"] = (
            (-rho[1:] * rho[:-1] * along(table.s, 0))[:, 1:],
            along(table.P, 1)[1:],
        )
    for words, (one, other) in pairs.items():
        held = (one > 0.0) & (other > 0.0)
        ratio = float(np.median(one[held] / other[held])) if held.any() else 0.0
        if not 1.0 / _UNITS < ratio < _UNITS:
            raise InputError(
                f"{path}: {words} should be alike and stand {ratio:.3g} to one: the columns are not all in SI "
                f"(kg/m^3, K, J/kg, Pa, m/s, J/(kg K)), or not in the order u P c s"
            )
