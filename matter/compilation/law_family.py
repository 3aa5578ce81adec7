"""A family of laws: one list of its files, and each of its functions behind one compiled call that chooses by a
number.

numba wants static calls, so a family keeps one tuple of its law modules by hand; everything else is derived from it
here: names, numbers, the width of a row, and the branches. ``FAMILY.choose("density", "P, u")`` compiles what one
would write as

    def density(kind, row, P, u):
        if kind == 0:
            return tillotson.density(P, u, tillotson.Parameters(row[0], row[1], ...))
        if kind == 1:
            ...

A law file brings, besides its functions:

``Parameters``  a NamedTuple whose annotations pydantic validates a table of a case or material file into
``Row``         what its compiled functions take as their last argument, where that is not ``Parameters`` itself: a
                NamedTuple of numbers, or None for the bare row, of ``WIDTH`` numbers (of a law that reads a table:
                the least; a run's rows are as wide as its longest)
``row(p)``      the numbers of that row from ``Parameters``, where they are not its values in their order
``fault(p)``    what is wrong with the values together, or an empty text
``EXAMPLE``     values that the family's tests and pictures may use
``SOURCES``     keys of the bibliography
"""

from __future__ import annotations

import sys
import typing
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from pydantic.fields import FieldInfo

from matter.compilation.jit import law


class Family:
    """The laws of one kind: ``laws`` their modules, ``prefix`` what their file names begin with, ``none`` whether a
    material may take none of them.

    ``key`` is the case file's word for the family, ``called`` the plain one. With ``none`` the number 0 stands for no
    law, and the first law has the number 1. ``by_values``: a case chooses a law by the table of its values alone.
    """

    def __init__(
        self,
        key: str,
        called: str,
        laws: Sequence[ModuleType],
        prefix: str = "",
        none: bool = False,
        by_values: bool = False,
    ):
        self.key, self.called, self.laws, self.prefix, self.first = key, called, tuple(laws), prefix, int(none)
        self.by_values = by_values

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What a case file calls the laws, in the order of their numbers; ``none`` first where the family has it."""
        return ("none",) * self.first + tuple(self.title(module).removeprefix(self.prefix) for module in self.laws)

    @staticmethod
    def title(module: ModuleType) -> str:
        """The name of a law's file, which is that of its table in a material file."""
        return module.__name__.rpartition(".")[2]

    @cached_property
    def titles(self) -> tuple[str, ...]:
        """Tables of values that the laws take in a material file."""
        return tuple(self.title(module) for module in self.laws if hasattr(module, "Parameters"))

    def kind(self, name: str) -> int:
        """The number of a law."""
        return self.names.index(name)

    def module(self, kind: int) -> ModuleType | None:
        """The file of the law with the number ``kind``; None for ``none``."""
        return self.laws[kind - self.first] if kind >= self.first else None

    def having(self, flag: str) -> tuple[bool, ...]:
        """Which laws set a flag, by number: the value of a module's constant, False where a law does not mention
        it."""
        return (False,) * self.first + tuple(bool(getattr(module, flag, False)) for module in self.laws)

    @cached_property
    def width(self) -> int:
        """Numbers in a row: those of the law that needs most."""
        return max(_width(module) for module in self.laws)

    def row(self, kind: int, p: Any, *of: Any) -> Sequence[float]:
        """The numbers that the compiled functions of a law read, from its ``Parameters`` and what else the family's
        rows are made ``of``."""
        module: Any = self.module(kind)
        return module.row(p, *of) if hasattr(module, "row") else tuple(p)

    def fault(self, kind: int, p: Any) -> str:
        """What is wrong with the values of a law together, or an empty text."""
        return getattr(self.module(kind), "fault", lambda _: "")(p)

    def idle_files(self, taken: set[int]) -> set[Path]:
        """Files of the laws whose numbers are not in ``taken``."""
        return {
            Path(str(module.__file__)) for number, module in enumerate(self.laws, self.first) if number not in taken
        }

    def choose(
        self,
        function: str,
        arguments: str,
        *,
        about: str,
        otherwise: str | None = None,
        rows: bool = True,
        inline: bool = False,
    ) -> Callable[..., Any]:
        """The compiled ``function(kind, row, arguments)``, or without ``row`` where ``rows`` is False, of the law with
        the number ``kind``.

        ``otherwise``: the expression that stands for laws without such a function and for ``none``; without it each
        law must have the function. ``about`` is the docstring; ``inline``: always in the caller's code. Raises
        ``TypeError`` naming the law that lacks it.
        """
        having = [module for module in self.laws if hasattr(module, function)]
        if otherwise is None and (self.first or len(having) < len(self.laws)):
            lacking = ["none"] * self.first + [self.title(module) for module in self.laws if module not in having]
            raise TypeError(f"{self.key}: {', '.join(lacking)} has no function {function!r}")
        names: dict[str, Any] = {}
        lines = [f"def {function}({', '.join(filter(None, ('kind', 'row' if rows else '', arguments)))}):"]
        for module in having:
            title, number = self.title(module), self.laws.index(module) + self.first
            names[title] = getattr(module, function)
            given = ", ".join(filter(None, (arguments, self._row_text(module, names) if rows else "")))
            last = otherwise is None and module is having[-1]
            lines += (
                [f"    return {title}({given})"]
                if last
                else [f"    if kind == {number}:", f"        return {title}({given})"]
            )
        if otherwise is not None:
            lines.append(f"    return {otherwise}")
        return compiled(function, lines, names, about, inline, sys._getframe(1))

    def _row_text(self, module: ModuleType, names: dict[str, Any]) -> str:
        row = _row_type(module)
        if row is None:
            return "row"
        names[f"{self.title(module)}_row"] = row
        return f"{self.title(module)}_row({', '.join(f'row[{i}]' for i in range(len(row._fields)))})"


def keys(families: Sequence[Family]) -> dict[str, Any]:
    """Annotation and default of every key that the ``Parameters`` in the files of the laws hold, for
    ``pydantic.create_model``; laws that share a key say what each takes it for."""
    kinds_by_key: dict[str, tuple[Any, Any]] = {}
    words: dict[str, dict[str, list[str]]] = {}
    for family in families:
        for name, module in zip(family.names[family.first :], family.laws):
            if not hasattr(module, "Parameters"):
                continue
            kinds = typing.get_type_hints(module.Parameters, include_extras=True)
            for key, default in module.Parameters._field_defaults.items():
                kinds_by_key.setdefault(key, (kinds[key], default))
                about = next(
                    (
                        part.description
                        for part in typing.get_args(kinds[key])
                        if isinstance(part, FieldInfo) and part.description
                    ),
                    "",
                )
                words.setdefault(key, {}).setdefault(about, []).append(f'``{family.key} = "{name}"``')
    fields = {}
    for key, (kind, default) in kinds_by_key.items():
        said = words[key]
        text = (
            next(iter(said))
            if len(said) == 1
            else " ".join(f"With {' or '.join(laws)}: {about}" for about, laws in said.items())
        )
        fields[key] = (kind, FieldInfo(default=default, description=text))
    return fields


def compiled(
    function: str, lines: Sequence[str], names: dict[str, Any], about: str, inline: bool, frame: FrameType
) -> Callable[..., Any]:
    """The compiled ``function`` whose ``lines`` are written by a program, with the ``names`` that it reads; ``frame``
    is that of its caller.

    The compiled code is kept, and thrown away, with the caller's file.
    """
    text = "\n" * (frame.f_lineno - 1) + "\n".join(lines) + "\n"
    exec(compile(text, frame.f_code.co_filename, "exec"), names)
    names[function].__doc__, names[function].__module__ = about, frame.f_globals["__name__"]
    return law(names[function], forceinline=True) if inline else law(names[function])


def _row_type(module: ModuleType) -> Any:
    return module.Row if hasattr(module, "Row") else module.Parameters


def _width(module: ModuleType) -> int:
    row = _row_type(module)
    return module.WIDTH if row is None else len(row._fields)
