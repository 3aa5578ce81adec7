"""OpenSPH's binary state files (``.ssf``), all versions up to 20210808.

Layout, from OpenSPH's own writer and reader (``core/io/Output.cpp``, ``Serializer.h``, commit f3033fa; little-endian,
every integer, bool and enum 8 bytes, every float a double, texts end with a zero byte):

* header of 256 bytes: ``SPH``, run time [s], particles, quantities, materials, time step [s], version, run type (16
  bytes), build date (16), wall clock, attractors, zeros;
* per quantity: identifier, order (number of derivatives), value type;
* per material: ``MAT``, its number, its parameters (identifier, type, value), per quantity its range and least value
  for the time step, the first particle and the one after the last, then the values of every quantity and its
  derivatives. Without materials: ``NOMAT``, the two numbers, values;
* per attractor: position, velocity, radius, mass, the number of its parameters, and these.

Vectors are (x, y, z, h): the fourth number of a position is the smoothing length (for runs of spheres, the radius).
The damage stored there is the cube root of what reduces the stress; pressure and stress are stored after damage and
yield, as here.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from matter.errors import InputError
from matter.formats.reading import Reading

_HEADER = 256
_LATEST = 20210808
# numbers stored per value of each type: scalar, vector, tensor, symmetric tensor, traceless tensor, index
_WIDTH = (1, 4, 9, 6, 5, 1)
_VECTOR, _TRACELESS, _INDEX = 1, 4, 5
# doubles or integers per parameter of each type; 4 is a text, 8 an enum with a dummy behind it
_PARAMETER = {0: 1, 1: 1, 2: 1, 3: 2, 5: 4, 6: 6, 7: 5, 8: 2}
_TEXT, _NAME = 4, 99
_ATTRACTOR = 10  # position and velocity of four numbers, radius, mass
_POSITION, _DAMAGE, _STRESS = 0, 10, 6
_SCALARS = {
    1: "mass",
    2: "pressure",
    3: "density",
    4: "specific_energy",
    5: "sound_speed",
    17: "distention",
    38: "neighbours",
    44: "identity",
}
_VECTORS = {20: "angular_velocity", 40: "initial_position"}
_SPHERES = ("nbody", "rubble-pile")
_SIZE = 3  # of a position's four numbers: radius of a sphere, else smoothing length over ``_SUPPORT``
# support of the cubic spline, OpenSPH's default kernel, in smoothing lengths
_SUPPORT = 2.0


class _Bytes:
    """A file read from front to back."""

    def __init__(self, path: Path):
        self.path, self.data, self.at = path, path.read_bytes(), 0

    def take(self, size: int) -> bytes:
        if size < 0 or self.at + size > len(self.data):
            raise InputError(
                f"{self.path} ends after {len(self.data)} bytes, in the middle of a value: not a whole .ssf file"
            )
        self.at += size
        return self.data[self.at - size : self.at]

    def integers(self, count: int = 1) -> np.ndarray:
        return np.frombuffer(self.take(8 * count), dtype="<i8")

    def floats(self, count: int = 1) -> np.ndarray:
        return np.frombuffer(self.take(8 * count), dtype="<f8")

    def text(self) -> str:
        end = self.data.find(b"\0", self.at)
        if end < 0:
            raise InputError(f"{self.path} ends in the middle of a text: not a whole .ssf file")
        raw = self.data[self.at : end]
        self.at = end + 1
        return raw.decode("utf-8", "replace")


def _pieces(
    file: _Bytes, path: Path, table: np.ndarray, materials: int
) -> tuple[list[str], list[dict[tuple[int, int, int], np.ndarray]], list[int]]:
    """Names of the materials, values of their particles and numbers of them."""
    names, blocks = [], []
    sizes: list[int] = []
    for number in range(max(materials, 1)):
        names.append(_material(file, number, len(table)) if materials else _no_material(file))
        first, end = (int(number) for number in file.integers(2))
        if first != sum(sizes) or end < first:
            raise InputError(f"{path}: material {number} holds the particles {first} to {end}, out of order")
        sizes.append(end - first)
        blocks.append(_values(file, table, end - first))
    return names, blocks, sizes


def read(path: Path, support: float = _SUPPORT) -> Reading:
    """What a state file holds; ``support`` is the kernel's support in smoothing lengths (2 for OpenSPH's default,
    the cubic spline).

    Materials keep their names (``materials`` among the attributes) and particles their persistent index, where the
    file has them; ``time`` [s], ``step_s``, ``opensph_version`` and ``attractors`` (how many point masses it holds,
    which are not read) are attributes. Raises ``InputError`` for a file of another kind, a newer version, or one that
    is cut short.
    """
    file = _Bytes(Path(path))
    if file.data[:4] != b"SPH\0":
        raise InputError(f"{path} is not an OpenSPH state file: it does not begin with 'SPH'")
    file.take(4)
    time = float(file.floats()[0])
    particles, quantities, materials = (int(number) for number in file.integers(3))
    step, version = float(file.floats()[0]), int(file.integers()[0])
    if version > _LATEST:
        raise InputError(f"{path} has version {version} of OpenSPH's format; versions up to {_LATEST} can be read")
    kind = file.take(16).split(b"\0")[0].decode("ascii", "replace") or "sph"
    file.take(24)
    attractors = int(file.integers()[0]) if version >= _LATEST else 0
    file.at = _HEADER
    table = file.integers(3 * quantities).reshape(quantities, 3)
    if np.any(table[:, 1] > 2) or np.any(table[:, 2] >= len(_WIDTH)) or np.any(table < 0):
        raise InputError(f"{path}: its table of quantities holds values that no version of OpenSPH writes")
    names, blocks, sizes = _pieces(file, path, table, materials)
    if sum(sizes) != particles:
        raise InputError(f"{path} says it holds {particles} particles, and its materials hold {sum(sizes)}")
    for _ in range(attractors):
        file.take(8 * _ATTRACTOR)
        _parameters(file, int(file.integers()[0]))
    if file.at != len(file.data):
        raise InputError(
            f"{path} holds {len(file.data) - file.at} bytes after its last value: not a file of OpenSPH's format "
            f"{version}"
        )
    values = {key: np.concatenate([block[key] for block in blocks]) for key in blocks[0]}
    reading = Reading(path)
    _enter(reading, values, kind, support)
    reading.take("material", np.repeat(np.arange(len(sizes)), sizes), "materials")
    reading.holds(particles)
    reading.at(time, "run time")
    reading.attributes |= {
        "stage": "dem" if kind in _SPHERES else "sph",
        "step_s": step,
        "opensph_version": version,
    }
    if any(names):
        reading.attributes["materials"] = [name or f"material_{number}" for number, name in enumerate(names)]
    if attractors:
        reading.attributes["attractors"] = attractors
        reading.leave(f"{attractors} attractors")
    return reading


def _material(file: _Bytes, number: int, quantities: int) -> str:
    """Pass over a material's parameters and ranges; its name, empty where it has none."""
    mark, read_number, count = file.text(), *(int(value) for value in file.integers(2))
    if mark != "MAT" or read_number != number:
        raise InputError(
            f"{file.path}: material {number} was expected at byte {file.at}, found {mark[:16]!r} {read_number}"
        )
    name = _parameters(file, count).get(_NAME, "")
    file.take(8 * 4 * quantities)
    return name


def _parameters(file: _Bytes, count: int) -> dict[int, str]:
    """Pass over ``count`` parameters; those that are texts, by their identifier."""
    texts = {}
    for _ in range(count):
        parameter, kind = (int(value) for value in file.integers(2))
        if kind == _TEXT:
            texts[parameter] = file.text()
        elif kind in _PARAMETER:
            file.take(8 * _PARAMETER[kind])
        else:
            raise InputError(f"{file.path}: parameter {parameter} is of an unknown type {kind} (byte {file.at})")
    return texts


def _no_material(file: _Bytes) -> str:
    if (mark := file.text()) != "NOMAT":
        raise InputError(f"{file.path}: 'NOMAT' was expected, found {mark[:16]!r}")
    return ""


def _values(file: _Bytes, table: np.ndarray, count: int) -> dict[tuple[int, int, int], np.ndarray]:
    """(identifier, derivative, value type) -> (count, width) values of one material's particles."""
    values = {}
    for quantity, order, kind in table.tolist():
        for derivative in range(order + 1):
            width = _WIDTH[kind]
            numbers = file.integers(count * width) if kind == _INDEX else file.floats(count * width)
            values[quantity, derivative, kind] = numbers.reshape(count, width)
    return values


def _enter(reading: Reading, values: dict[tuple[int, int, int], np.ndarray], kind: str, support: float) -> None:
    """Enter the quantities that have a field here, and name the others by their numbers (``QuantityId``)."""
    for (quantity, derivative, form), numbers in values.items():
        name = f"quantity {quantity}"
        if quantity == _POSITION and form == _VECTOR and derivative < 2:
            reading.take(("position", "velocity")[derivative], numbers[:, :3], name)
            if derivative == 0 and kind in _SPHERES:
                reading.take("radius", numbers[:, _SIZE], name)
            elif derivative == 0:
                reading.take("smoothing_length", support * numbers[:, _SIZE], name)
        elif derivative == 0 and quantity in _SCALARS and _WIDTH[form] == 1:
            reading.take(_SCALARS[quantity], numbers[:, 0], name)
        elif derivative == 0 and quantity in _VECTORS and form == _VECTOR:
            reading.take(_VECTORS[quantity], numbers[:, :3], name)
        elif derivative == 0 and quantity == _DAMAGE and _WIDTH[form] == 1:
            reading.take("damage", numbers[:, 0] ** 3, name)
        elif derivative == 0 and quantity == _STRESS and form == _TRACELESS:
            xx, yy, xy, xz, yz = numbers.T
            reading.take("deviatoric_stress", np.stack([xx, xy, xz, yy, yz, -xx - yy], axis=1), name)
        elif derivative == 0:
            reading.leave(name)
