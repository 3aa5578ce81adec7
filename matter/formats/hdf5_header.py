"""What the header of a GADGET-like HDF5 file says about its particles: how many, when, in which units.

* ``Header``: ``NumPart_ThisFile`` (particles of each type, ``/PartType<k>``), ``NumFilesPerSnapshot``, ``Time``;
* units: SWIFT's group ``Units`` (``Unit length in cgs (U_L)``, mass ``(U_M)``, time ``(U_t)``), else attributes of
  ``Header`` or ``Parameters`` (GADGET-4, AREPO: ``UnitLength_in_cm``, ``UnitMass_in_g``, ``UnitVelocity_in_cm_per_s``;
  GIZMO: ``UnitLength_In_CGS`` ...);
* any file: its own attributes ``time`` [s] and ``Time``.
"""

from __future__ import annotations

import math
import re
from typing import Any, NamedTuple

import numpy as np

from matter.errors import InputError
from matter.formats.reading import Reading
from matter.formats.unit_system import SI, UnitSystem
from matter.formats.words import short

_SWIFT = ("Unit length in cgs (U_L)", "Unit mass in cgs (U_M)", "Unit time in cgs (U_t)")
_GADGET = (
    ("UnitLength_in_cm", "UnitMass_in_g", "UnitVelocity_in_cm_per_s"),
    ("UnitLength_In_CGS", "UnitMass_In_CGS", "UnitVelocity_In_CGS"),
)


class Header(NamedTuple):
    """What a file declares: particles of each type (none where it does not say), files of its snapshot, its time and
    the name of that, the ``system`` of its units."""

    counts: list[int]
    files: int
    time: float | None
    time_name: str
    system: UnitSystem


def read(file: Any, source: str) -> Header:
    """The declarations of an open file. Raises ``InputError`` for one that is no number."""
    header = _attributes(file, "Header")
    time, name = None, ""
    for said, key, words in ((file.attrs, "time", "time"), (header, "Time", "Header/Time")):
        if time is None and key in said:
            time, name = _number(said[key], f"{source}: {words}"), words
    counts = [int(_number(value, f"{source}: Header/NumPart_ThisFile")) for value in _row(header, "NumPart_ThisFile")]
    files = header.get("NumFilesPerSnapshot", 1)
    return Header(
        counts, int(_number(files, f"{source}: Header/NumFilesPerSnapshot")), time, name, _system(file, header, source)
    )


def declare(reading: Reading, header: Header, datasets: list[str], units_by_hand: bool) -> None:
    """Enter what the header says of the particles of ``datasets``; ``units_by_hand``: the user named units, so that
    the file's time without one is no number of seconds.

    Raises ``InputError`` for a file that is one of several.
    """
    kinds = {int(match.group(1)) for name in datasets if (match := re.match(r"PartType(\d{1,3})/", name))}
    for kind in kinds:
        if kind < len(header.counts):
            reading.holds(header.counts[kind])
    if header.files > 1 and kinds:
        raise InputError(
            f"{reading.source} is one of {header.files} files of its snapshot (Header/NumFilesPerSnapshot) and holds "
            f"only some of the particles: join them first"
        )
    if header.system is not SI:
        reading.remarks.append(f"its units ({header.system.name}) are turned into SI where --columns names none")
    if header.time is None:
        return
    if header.system is SI and header.time_name != "time" and units_by_hand:
        reading.leave(f"{header.time_name} = {header.time:g} (it has no unit)")
    else:
        reading.at(header.time * header.system.time, header.time_name)


def _system(file: Any, header: Any, source: str) -> UnitSystem:
    units = _attributes(file, "Units")
    if all(key in units for key in _SWIFT):
        length, mass, time = (_positive(units[key], f"{source}: Units/{key}") for key in _SWIFT)
        return _named(length, mass, time, "Units")
    parameters = _attributes(file, "Parameters")
    for said, group_name in ((header, "Header"), (parameters, "Parameters")):
        for keys in _GADGET:
            if all(key in said for key in keys):
                length, mass, speed = (_positive(said[key], f"{source}: {group_name}/{key}") for key in keys)
                return _named(length, mass, length / speed, group_name)
    return SI


def _named(length: float, mass: float, time: float, group_name: str) -> UnitSystem:
    """The system of units given in cgs."""
    words = f"{group_name}: {length:.6g} cm, {mass:.6g} g, {time:.6g} s"
    return UnitSystem(1e-2 * length, 1e-3 * mass, time, words)


def _attributes(file: Any, group: str) -> Any:
    return file[group].attrs if group in file else {}


def _row(said: Any, key: str) -> list[Any]:
    return list(np.ravel(said[key])) if key in said else []


def _number(value: Any, where: str) -> float:
    numbers = np.ravel(np.asarray(value))
    if numbers.size == 0 or numbers.dtype.kind not in "iufb" or not math.isfinite(float(numbers[0])):
        raise InputError(f"{where} is no finite number: {short(value)}")
    return float(numbers[0])


def _positive(value: Any, where: str) -> float:
    if not (number := _number(value, where)) > 0.0:
        raise InputError(f"{where} must be above 0, and is {number:g}")
    return number
