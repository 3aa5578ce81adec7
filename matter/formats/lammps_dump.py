"""LIGGGHTS and LAMMPS text dumps (``dump custom``): the last time step of the file.

The dump names its columns (``ITEM: ATOMS id type x y z vx vy vz radius``). Numbers are SI, or in the unit style that
the file names (``ITEM: UNITS``, by ``dump_modify units yes``); the time is what ``ITEM: TIME`` says (``dump_modify
time yes``). Types count from 1 there and materials from 0 here. Unwrapped coordinates (``xu``) and diameters stand in
where there are no ``x`` and ``radius``; scaled ones (``xs``) are fractions of the box and are refused.
"""

from __future__ import annotations

from pathlib import Path

from matter.errors import InputError
from matter.formats import named_columns as named
from matter.formats import numbers
from matter.formats.reading import Reading
from matter.formats.unit_system import SI, style
from matter.formats.words import short

_ITEM = "ITEM:"
_HEAD = "ITEM: ATOMS"
_STEP, _COUNT, _TIME, _UNITS = "ITEM: TIMESTEP", "ITEM: NUMBER OF ATOMS", "ITEM: TIME", "ITEM: UNITS"
# taken where there is no column of the other name
_IN_PLACE_OF = {"xu": "x", "yu": "y", "zu": "z", "diameter": "radius"}
_SCALED = ("xs", "ys", "zs", "xsu", "ysu", "zsu")


def read(path: Path, columns: str | None = None) -> Reading:
    """What the last step of a dump holds; columns that have no field here are left out. ``columns`` replaces the
    dump's own names.

    Raises ``InputError`` for a last step that is cut short, for scaled coordinates and for units that are no system.
    """
    text = numbers.text(path)
    lines = text.splitlines()
    items = [k for k, line in enumerate(lines) if line.startswith(_ITEM)]
    atoms = [k for k in items if lines[k].startswith(_HEAD)]
    if not atoms:
        raise InputError(f"{path} is not a text dump: there is no line '{_HEAD} ...'")
    head, before = atoms[-1], atoms[-2] if len(atoms) > 1 else -1
    own = {lines[k].strip(): k for k in items if before < k < head}
    rows = [(number, line) for number, line in enumerate(lines[head + 1 :], head + 2) if line.strip()]
    if items[-1] != head:
        cut = next(k for k in items if k > head)
        raise InputError(
            f"{path} was cut short: line {cut + 1} begins a further step, and no atoms follow. Whole steps reach up "
            f"to line {cut}"
        )
    reading = Reading(path)
    step = _whole(lines, own[_STEP], path) if _STEP in own else 0
    reading.attributes |= {"stage": "dem", "step": step}
    if _COUNT in own:
        count = _whole(lines, own[_COUNT], path)
        if len(rows) < count:
            first = min(own.values())
            raise InputError(
                f"{path} was cut short: its last step, {step}, says {count} atoms and holds {len(rows)}. "
                + (f"Whole steps reach up to line {first}" if first else "There is no whole step")
            )
        reading.holds(count)
    if not text.endswith("\n"):
        raise InputError(
            f"{path}: its last line has no end and may be cut in the middle of a number; end it by a line break if it "
            f"is whole"
        )
    units = [k for k in items if lines[k].strip() == _UNITS and k < head]
    system = style(_below(lines, units[-1], path), f"{path}, line {units[-1] + 2}") if units else SI
    if _TIME in own:
        word = _below(lines, own[_TIME], path)
        if not numbers.is_number(word):
            raise InputError(f"{path}, line {own[_TIME] + 2}: the time {short(word)} is not a number")
        reading.at(float(word) * system.factor("s"), _TIME)
    if system is not SI:
        reading.remarks.append(f"its units are {system.name}, turned into SI")
    if not rows:
        raise InputError(f"{path}: its last step, {step}, holds no atoms")
    table = numbers.table(rows, path)
    names = columns.split(",") if columns else lines[head][len(_HEAD) :].split()
    if table.values.shape[1] != len(names):
        raise InputError(f"{path}: {len(names)} column names for {table.values.shape[1]} columns")
    taken = _taken(reading, names)
    if "type" in taken:
        k = taken.index("type")
        reading.take("material", table.whole(k, f"{path}: column 'type'") - 1, "type")
        taken[k] = None
    named.enter(reading, taken, table, system, names)
    return reading


def _taken(reading: Reading, names: list[str]) -> list[str | None]:
    """The names of the columns, ``-`` for those that are left; what stands for another column has its name."""
    bare, known = [named.split(name)[0] for name in names], named.slots()
    taken: list[str | None] = []
    for text, name in zip(names, bare):
        other = _IN_PLACE_OF.get(name)
        if other in bare or (name not in known and other is None):
            if name in _SCALED and name[0] not in bare and f"{name[0]}u" not in bare:
                raise InputError(
                    f"{reading.source} holds scaled coordinates ({name}), fractions of the box, and no {name[0]}: "
                    f"write x y z ('dump ... custom ... id type x y z')"
                )
            taken.append("-")
        else:
            if other is not None:
                reading.remarks.append(f"{name} stands for {other}")
            taken.append(other + text.strip()[len(name) :] if other and other != "radius" else text)
    return taken


def _below(lines: list[str], k: int, path: Path) -> str:
    if k + 1 >= len(lines):
        raise InputError(f"{path} ends after line {k + 1}, {short(lines[k])}")
    return lines[k + 1].strip()


def _whole(lines: list[str], k: int, path: Path) -> int:
    word = _below(lines, k, path)
    if not word.isdecimal() or len(word) > 18:
        raise InputError(f"{path}, line {k + 2}: {short(word)} is not the number that {short(lines[k])} asks for")
    return int(word)
