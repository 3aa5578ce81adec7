"""Particles: one numpy array per field, and the single table that says what each field is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from matter.errors import InputError


class Field(NamedTuple):
    """Trailing shape, dtype, SI unit and meaning of one per-particle field."""

    shape: tuple[int, ...]
    dtype: str
    unit: str
    meaning: str


FIELDS: dict[str, Field] = {
    # every stage
    "identity": Field((), "int64", "1", "number that stays with a particle for life"),
    "position": Field(
        (3,), "float64", "m", "centre of the particle; the target's centre is the origin, +z points to the impact"
    ),
    "velocity": Field((3,), "float64", "m/s", "velocity of the centre"),
    "mass": Field((), "float64", "kg", "mass"),
    "material": Field((), "int32", "1", "index into the file's attribute 'materials'"),
    # shock physics
    "density": Field((), "float64", "kg/m^3", "bulk density"),
    "specific_energy": Field((), "float64", "J/kg", "internal energy per mass"),
    "smoothing_length": Field((), "float64", "m", "support radius of the kernel"),
    "pressure": Field((), "float64", "Pa", "pressure, positive in compression, after damage"),
    "deviatoric_stress": Field((6,), "float64", "Pa", "trace-free stress xx xy xz yy yz zz, after yield and damage"),
    "damage": Field((), "float64", "1", "0 intact, 1 broken"),
    "widening": Field((), "float64", "1", "of ground laid flat: volume on the body over that in the flat frame"),
    "distention": Field((), "float64", "1", "alpha = solid density / bulk density"),
    "sound_speed": Field((), "float64", "m/s", "bulk sound speed"),
    "peak_pressure": Field((), "float64", "Pa", "largest pressure so far"),
    "plastic_strain": Field((), "float64", "1", "plastic strain gathered, equivalent of von Mises"),
    "vibration": Field((), "float64", "m/s", "speed of the shaking that takes friction from broken rock"),
    "temperature": Field((), "float64", "K", "temperature; 0 where the material's laws know none"),
    "entropy": Field((), "float64", "J/(kg K)", "specific entropy, on the law's own zero; 0 where it knows none"),
    "gravity": Field((3,), "float64", "m/s^2", "gravitational acceleration"),
    "layer": Field((), "int32", "1", "layer of the target, counted from the centre; -1 is the projectile"),
    "initial_position": Field((3,), "float64", "m", "position at the start of the impact"),
    "neighbours": Field((), "int32", "1", "number of particles inside the support"),
    "block": Field((), "int32", "1", "which block of blocks.h5 it belongs to; -1 is the ground between them"),
    "size": Field((3,), "float64", "m", "full axes of a block along x, y and z"),
    "resolved": Field((), "int8", "1", "1 for a block that has particles of its own in the shock stage"),
    # grains
    "radius": Field((), "float64", "m", "radius of the sphere"),
    "angular_velocity": Field((3,), "float64", "rad/s", "spin of the sphere"),
    "species": Field((), "int32", "1", "index into the file's attribute 'species': contact parameters"),
    "headroom": Field((), "int8", "1", "1 for grains above the datum, weightless until the handoff"),
    "stiffness": Field(
        (), "float64", "N/m", "normal contact stiffness of the grain; a pair uses the softer of its two"
    ),
    "state": Field((), "int8", "1", "0 in contact search, 1 ballistic, 2 left the domain or escaped"),
    # where the matter that a grain stands for came from, and how strongly it was shocked
    "melting_fraction": Field(
        (),
        "float32",
        "1",
        "fraction of its mass shocked above what begins to melt its material; 0 where that is not known",
    ),
    "melt_fraction": Field(
        (), "float32", "1", "fraction of its mass shocked above what melts its material; 0 where that is not known"
    ),
    "vapour_fraction": Field(
        (), "float32", "1", "fraction of its mass shocked above what boils its material; 0 where that is not known"
    ),
    "projectile_fraction": Field((), "float32", "1", "fraction of its mass that came with the projectile"),
    "block_fraction": Field((), "float32", "1", "fraction of its mass that comes from resolved blocks"),
    "peak_pressure_mean": Field((), "float32", "Pa", "mean of the largest pressures of its matter"),
    "peak_pressure_largest": Field((), "float32", "Pa", "largest pressure that any of its matter felt"),
    "first_depth": Field(
        (), "float32", "m", "mean depth of its target matter below the datum at the start; NaN of projectile alone"
    ),
    "first_distance": Field(
        (), "float32", "m", "mean distance of that matter from the axis along the datum; NaN of projectile alone"
    ),
}

ORIGINS = (
    "melting_fraction",
    "melt_fraction",
    "vapour_fraction",
    "projectile_fraction",
    "peak_pressure_mean",
    "peak_pressure_largest",
    "first_depth",
    "first_distance",
)
"""Fields of grains that say what matter they stand for: given by the handoff, unchanged from then on."""

OF_BLOCKS = ("block", "block_fraction")
"""What grains carry besides where the ground holds blocks."""

UNDEFINED = ("first_depth", "first_distance")
"""Fields that are NaN where there is nothing to say."""

ALIASES = {"support_radius": "smoothing_length"}
"""Other name -> the field's in files. What files call the smoothing length is the radius of the kernel's support,
twice what many codes call by that name."""


class Particles(Mapping[str, np.ndarray]):
    """A set of particles: ``particles.position`` and ``particles["position"]`` are the same array.

    Parameters
    ----------
    fields : name -> array of shape ``(n, *shape)``; names as in ``FIELDS``.
    attributes : facts on the whole set (``time`` in s, ``stage``, ``frame``, ``materials`` ...).
    tables : further arrays that belong to the set but not to single particles, as ``"contacts/pair"``.

    Raises ``InputError`` for an unknown field, a wrong shape or lengths that differ.
    """

    def __init__(
        self,
        fields: Mapping[str, Any],
        attributes: Mapping[str, Any] | None = None,
        tables: Mapping[str, Any] | None = None,
    ):
        self.attributes: dict[str, Any] = dict(attributes or {})
        self.tables: dict[str, np.ndarray] = {name: np.asarray(table) for name, table in (tables or {}).items()}
        self._fields: dict[str, np.ndarray] = {}
        for name, values in fields.items():
            self[name] = values

    def __setitem__(self, name: str, values: Any) -> None:
        name = ALIASES.get(name, name)
        if name not in FIELDS:
            raise InputError(f"unknown particle field {name!r}; known: {', '.join(FIELDS)}")
        entry = FIELDS[name]
        array = np.ascontiguousarray(_exact(name, values, np.dtype(entry.dtype)), dtype=entry.dtype)
        if array.shape[1:] != entry.shape:
            raise InputError(f"field {name!r} needs shape (n, {', '.join(map(str, entry.shape))}), got {array.shape}")
        if self._fields and len(array) != len(self):
            raise InputError(f"field {name!r} has {len(array)} values for {len(self)} particles")
        self._fields[name] = array

    def __getitem__(self, name: str) -> np.ndarray:
        return self._fields[ALIASES.get(name, name)]

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError:
            raise AttributeError(
                f"these particles have no field {name!r}; they have {', '.join(self._fields)}"
            ) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        """Number of particles (not of fields)."""
        return len(next(iter(self._fields.values()))) if self._fields else 0

    def __contains__(self, name: object) -> bool:
        return ALIASES.get(str(name), name) in self._fields

    def need(self, *names: str) -> None:
        """Raise ``InputError`` naming every field of ``names`` that is missing."""
        missing = [ALIASES.get(name, name) for name in names if name not in self]
        if missing:
            raise InputError(
                f"the snapshot lacks {', '.join(missing)} "
                f"({'; '.join(f'{m}: {FIELDS[m].meaning} [{FIELDS[m].unit}]' for m in missing)})"
            )

    def select(self, which: np.ndarray) -> Particles:
        """The particles chosen by a mask or by indices, as copies, with the same attributes (tables are left
        behind)."""
        return Particles({name: array[which] for name, array in self._fields.items()}, self.attributes)


def _exact(name: str, values: Any, dtype: np.dtype) -> Any:
    """``values`` as they are. Raises ``InputError`` where ``dtype``, one of whole numbers, would change them:
    fractions, NaN, numbers beyond its range, and floating-point numbers too large to be exact."""
    array = np.asarray(values)
    if dtype.kind != "i" or array.size == 0 or np.can_cast(array.dtype, dtype, "safe"):
        return values
    limits = np.iinfo(dtype)
    if array.dtype.kind in "iu":
        bad, why = (array < limits.min) | (array > limits.max), "beyond what is stored"
    elif array.dtype.kind == "f":
        exact = 2.0 ** (np.finfo(array.dtype).nmant + 1)
        least, most = max(float(limits.min), -exact), min(float(limits.max), exact)
        bad = ~((array >= least) & (array <= most) & (np.floor(array) == array))
        why = "not whole, or not exact"
    else:
        raise InputError(f"field {name!r} holds whole numbers, and {array.dtype} was given")
    if bad.any():
        first = int(np.argmax(bad))
        raise InputError(
            f"field {name!r} holds whole numbers from {limits.min} to {limits.max}: {int(bad.sum())} of {array.size} "
            f"are {why} (the first is particle {first + 1}: {array.ravel()[first]})"
        )
    return values
