"""Which tests check a law: found in the sources of ``tests/`` by what each test reaches, never written by hand.

A test checks a law when its code, with the names of its module that it uses, refers to something of the law's file,
gives the law's name as the value of a key of its family (``sides="quiet"``), names it as a text in a module that takes
the family's list, or bears its name. A test that goes through the whole family (``FAMILY.laws``) checks every law of
it.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PREFIXES = ("normal_", "tangential_", "rolling_", "twisting_", "cohesion_", "crush_", "growth_")


WHOLE = ("FAMILY", "FAMILIES", "FAMILY.laws", "FAMILY.names", "FAMILY.titles", "FAMILY.module", "FAMILY.having")
"""What of a family's list a test takes that goes through all its laws."""


class Check(NamedTuple):
    """A test: its file from the repository's root, its name, what it states, and whether it is one of the whole
    family."""

    file: str
    name: str
    states: str
    family: bool


class _Test(NamedTuple):
    file: str
    name: str
    states: str
    reached: frozenset[str]  # dotted names of the project
    texts: frozenset[str]  # constants of the test and of what it uses
    values: frozenset[tuple[str, str]]  # those that stand as the value of a keyword or of a key, with it


def checks_of_law(law: Path, listed: tuple[str, ...], keys: tuple[str, ...]) -> list[Check]:
    """The checks of the law file ``law``; ``listed`` the dotted names of its family's lists (``sph.eos.dispatch``),
    ``keys`` the words of a case that choose from it (``eos``)."""
    module = ".".join(law.relative_to(ROOT).with_suffix("").parts)
    names = {law.stem, *(law.stem.removeprefix(prefix) for prefix in PREFIXES)}
    room = f"tests/{law.relative_to(ROOT).parts[0]}/"
    member = any(law.stem in _names(ROOT / f"{one.replace('.', '/')}.py") for one in listed)
    found = []
    for test in tests():
        own = any(name == module or name.startswith(f"{module}.") for name in test.reached)
        knows = any(name.startswith(one) for one in listed for name in test.reached)
        if test.file.startswith(room):
            own = own or bool(
                names & test.texts if knows else {(key, name) for key in keys for name in names} & test.values
            )
            own = own or (len(law.stem) > 4 and law.stem in test.name)
        through = bool({f"{one}.{part}" for one in listed for part in WHOLE} & test.reached)
        if own or (member and through and test.file.startswith(room)):
            found.append(Check(test.file, test.name, test.states, not own))
    return sorted(found, key=lambda one: (one.family, one.file, one.name))


@functools.cache
def tests() -> tuple[_Test, ...]:
    """Every test of ``tests/``."""
    return tuple(test for file in sorted((ROOT / "tests").rglob("test_*.py")) for test in _of_file(file))


def _of_file(file: Path) -> Iterator[_Test]:
    tree = ast.parse(file.read_text())
    imported: dict[str, str] = {}
    for node in tree.body:
        if isinstance(node, ast.Import):
            imported |= {(a.asname or a.name.partition(".")[0]): (a.asname and a.name) or a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            imported |= {a.asname or a.name: f"{node.module}.{a.name}" for a in node.names}
    local: dict[str, ast.stmt] = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            local[node.name] = node
        elif isinstance(node, ast.Assign):
            local |= {t.id: node for one in node.targets for t in ast.walk(one) if isinstance(t, ast.Name)}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            used = list(_reach(node, local))
            yield _Test(
                str(file.relative_to(ROOT)),
                node.name,
                statement(node),
                frozenset(name for part in used for name in _dotted(part, imported)),
                frozenset(text for part in used for text in _texts(part)),
                frozenset(text for part in used for text in _values(part)),
            )


@functools.cache
def _names(file: Path) -> frozenset[str]:
    """The names that a file refers to."""
    return frozenset(node.id for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Name))


def statement(test: ast.FunctionDef) -> str:
    """What a test states: the first sentence of its docstring, else its name as words."""
    doc = " ".join((ast.get_docstring(test) or "").split())
    first = re.split(r"(?<!eq)(?<!eqs)(?<!al)\. (?=[A-Z(])", doc)[0].rstrip(".")
    words = test.name.removeprefix("test_").replace("_", " ")
    return first or words[:1].upper() + words[1:]


def _reach(node: ast.stmt, local: dict[str, ast.stmt]) -> Iterator[ast.AST]:
    """A statement and those of its module that it uses, directly or through others; docstrings left out."""
    seen, waiting = {id(node)}, [node]
    while waiting:
        one = waiting.pop()
        yield one
        names = {n.id for n in ast.walk(one) if isinstance(n, ast.Name)}
        names |= {argument.arg for n in ast.walk(one) if isinstance(n, ast.arguments) for argument in n.args}
        for name in names & set(local):
            if id(local[name]) not in seen:
                seen.add(id(local[name]))
                waiting.append(local[name])


def _dotted(node: ast.AST, imported: dict[str, str]) -> Iterator[str]:
    """What of the project a statement names, as ``sph.eos.murnaghan.pressure``."""
    within: set[int] = set()  # of a longer name that was told already
    for one in ast.walk(node):
        parts: list[str] = []
        inner: ast.AST = one
        if id(one) in within:
            continue
        while isinstance(inner, ast.Attribute):
            parts.append(inner.attr)
            inner = inner.value
            within.add(id(inner))
        if isinstance(inner, ast.Name) and inner.id in imported:
            yield ".".join([imported[inner.id], *reversed(parts)])


def _texts(node: ast.AST) -> Iterator[str]:
    return (one.value for one in ast.walk(node) if isinstance(one, ast.Constant) and isinstance(one.value, str))


def _values(node: ast.AST) -> Iterator[tuple[str, str]]:
    for one in ast.walk(node):
        held: list[tuple[object, ast.expr]] = []
        if isinstance(one, ast.Dict):
            held = [(key.value, value) for key, value in zip(one.keys, one.values) if isinstance(key, ast.Constant)]
        elif isinstance(one, ast.keyword):
            held = [(one.arg, one.value)]
        for key, value in held:
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield str(key).rpartition(".")[2], value.value
