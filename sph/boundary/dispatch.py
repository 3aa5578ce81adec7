"""Which boundary ends flat ground at its sides and below: the family's list, and the keys of ``[sph]`` that its files
bring.

A file of this family is named like the value of ``sides`` or ``floor`` that selects it. It brings

``WORDS``           what the description of the keys says of it
``TAKES_MOMENTUM``  whether it pushes back: it carries the ground's weight, and takes momentum from what hits it
``FLOOR``           whether it may end the ground below
``NEEDS_BLOCK``     whether it ends the sides of a block only
``Parameters``      its own keys of ``[sph]``, a NamedTuple of annotations with defaults
``RESTS_ON``        other files of the family that act in it
``SOURCES``         keys of the bibliography

and one of these:

``planes(axis, *ends)``  the ``images.Plane``s that end the axis at the positions ``ends`` [m]
``RIM``                  the outermost support radius is a rim that never moves (``sph.boundary.fixed``)

A rim may have a layer before it: ``width(p, target, spacing_far)`` its width [m], ``coefficient(inside, width)`` what
each particle in it has by its distance from the rim, and ``fade``, one step of it.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from matter.compilation.law_family import Family
from sph.boundary import fixed, free, periodic, quiet, wall

FAMILY = Family("sides", "boundary", (free, fixed, quiet, wall, periodic))


def having(flag: str) -> tuple[str, ...]:
    """The boundaries that set a flag."""
    return tuple(name for name, has in zip(FAMILY.names, FAMILY.having(flag)) if has)


def module(name: str) -> Any:
    """The file of a boundary."""
    return FAMILY.module(FAMILY.kind(name))


def values(law: ModuleType, settings: Any) -> Any:
    """The ``Parameters`` of a boundary, taken from the ``settings`` of the stage; None where it has none."""
    kind = getattr(law, "Parameters", None)
    return kind and kind(*(getattr(settings, key) for key in kind._fields))


if TYPE_CHECKING:
    Side: TypeAlias = str
    Floor: TypeAlias = str
else:
    Side, Floor = Literal.__getitem__(FAMILY.names), Literal.__getitem__(having("FLOOR"))

WORDS = "; ".join(f"``{name}``, {module(name).WORDS}" for name in FAMILY.names)
"""What there is, for the description of the keys."""
