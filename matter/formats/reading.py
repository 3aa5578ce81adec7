"""What a reader takes from another code's file, held against what the file says about itself: one check for all
formats.

A reader enters each field that it takes, names what it leaves, and declares what the file says: how many particles it
holds, at which time. ``particles`` then refuses a count that is not met, a field that is given twice, vectors with a
component missing, whole numbers that are none or would be rounded, and identities that stand twice.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.formats.words import listed, short
from matter.particles import ALIASES, FIELDS, Particles


class Reading:
    """What was read from ``source``: fields, ``attributes``, names that were ``left_out``, ``remarks`` (sentences)."""

    def __init__(self, source: object) -> None:
        self.source = str(source)
        self.attributes: dict[str, Any] = {}
        self.left_out: list[str] = []
        self.remarks: list[str] = []
        self._declared: int | None = None
        self._parts: dict[tuple[str, int | None], np.ndarray] = {}
        self._by: dict[tuple[str, int | None], str] = {}

    def take(self, field: str, values: Any, name: object, component: int | None = None) -> None:
        """Enter ``values`` (SI) as a field, or as one component of it; ``name`` is what the file calls them.

        Raises ``InputError`` where the field is there already, whole or in part.
        """
        field = ALIASES.get(field, field)
        slot = field, component
        others = [key for key in self._parts if key[0] == field and (key == slot or None in (component, key[1]))]
        if others:
            raise InputError(
                f"{self.source}: {field} is given twice, by {short(self._by[others[0]])} and by {short(name)}: leave "
                f"one of them out (--columns)"
            )
        self._parts[slot], self._by[slot] = np.asarray(values), str(name)

    def leave(self, *names: object) -> None:
        """Name what the file holds and no field takes."""
        self.left_out += [str(name) for name in names]

    def holds(self, count: int) -> None:
        """Declare how many particles the file says that it holds."""
        self._declared = int(count)

    def at(self, time: float, name: str) -> None:
        """Declare the time [s] of the file. Raises ``InputError`` for one that is not finite."""
        if not math.isfinite(time):
            raise InputError(f"{self.source}: its time, {short(name)}, is not finite")
        self.attributes["time"] = float(time)

    def particles(self) -> Particles:
        """The particles, checked; identities are counted where there are none. Raises ``InputError``."""
        fields: dict[str, np.ndarray] = {}
        lengths = {len(values) if values.ndim else 0 for values in self._parts.values()}
        if len(lengths) > 1:
            raise InputError(f"{self.source}: {listed(self._by.values())} differ in length: {sorted(lengths)}")
        for field in dict.fromkeys(field for field, _ in self._parts):
            if (field, None) in self._parts:
                fields[field] = self._parts[field, None]
                continue
            width = FIELDS[field].shape[0]
            missing = [k for k in range(width) if (field, k) not in self._parts]
            if missing:
                raise InputError(f"{self.source}: {field} lacks component {', '.join(map(str, missing))}")
            fields[field] = np.column_stack([self._parts[field, k] for k in range(width)])
        try:
            particles = Particles(fields, self.attributes)
        except InputError as reason:
            raise InputError(f"{self.source}: {reason}") from None
        checked(particles, self.source, self._declared)
        if "identity" not in particles:
            particles["identity"] = np.arange(len(particles))
        return particles


def checked(particles: Particles, source: str, declared: int | None = None) -> Particles:
    """The particles of a file that says it holds ``declared`` of them.

    Raises ``InputError`` for another number of them, none at all, no positions, and identities that stand twice.
    """
    particles.need("position")
    if declared is not None and declared != len(particles):
        raise InputError(f"{source} says it holds {declared} particles, and {len(particles)} are there")
    if len(particles) == 0:
        raise InputError(f"{source} holds no particles")
    if "identity" not in particles:
        return particles
    numbers, counts = np.unique(particles.identity, return_counts=True)
    if len(numbers) != len(particles):
        twice = int(numbers[np.argmax(counts > 1)])
        doubled = np.flatnonzero(particles.identity == twice)[:2] + 1
        raise InputError(
            f"{source}: {int((counts > 1).sum())} identities stand for more than one particle; the first, {twice}, "
            f"for the particles {doubled[0]} and {doubled[1]}"
        )
    return particles
