"""The house's words: names of functions and modules that say too little, and tests that state nothing. What stands for
a count of ``studies/house.py`` are lists here; ``tests/studies/test_house.py`` holds them empty."""

from __future__ import annotations

import ast
from pathlib import Path

from studies.house import AROUND, ROOMS, House

SAY_NO_RESULT = frozenset(("of", "draw", "lines", "points", "kept"))
"""Names that say nothing of what a function returns."""
BANNED = frozenset(
    """
    place places share shares apart lean standing anew make_anew to_make_anew heads
    thin thinned warmth youth push soften softened Soft hold Surroundings
    meeting held_pull pull_held pull_of_all laid spilt Spill Lie departures parted gone flown
    loosened laying Unrolled unrolled deciding Foot wells strangers Lot lot Sky places_of places_before tells_datum
    """.split()
)
"""Words that are no terms of the field: for position, folder or index, fraction, distance; of sph, of dem, and of the
other rooms."""
KEYS_OF_CASES = {
    "share": ("matter/case/body.py", "sph/bodies/projectile.py"),
    "loosened": ("handoff/source/cloud_surface.py", "handoff/transfer/ejecta.py", "handoff/transfer/transfer.py"),
}
"""Keys of cases among them, and the files that read them."""


def banned_names(root: Path) -> list[str]:
    """``file:line name`` of functions called as in ``SAY_NO_RESULT``, and of names in ``BANNED``, in the rooms and
    around them; modules among these names."""
    found = []
    house = House.read(root, (*ROOMS, *AROUND))
    for file in house.files:
        for name, node in house.nodes(room=file):
            said = {str(getattr(node, key, "")) for key in ("id", "arg", "attr", "name")} & BANNED
            said = {word for word in said if name not in KEYS_OF_CASES.get(word, ())}
            if isinstance(node, ast.FunctionDef):
                said |= {node.name} & SAY_NO_RESULT
            found += [f"{name}:{getattr(node, 'lineno', 0)} {word}" for word in sorted(said)]
        found += [f"{file}: {Path(file).stem}"] if Path(file).stem in BANNED else []
    return found


def _asserts(node: ast.AST) -> bool:
    """Whether a node states something that may fail a test: ``assert``, ``pytest.raises``, ``warns`` or ``fail``, or a
    call whose name begins with ``assert``."""
    if isinstance(node, ast.Assert):
        return True
    called = node.func if isinstance(node, ast.Call) else None
    name = called.attr if isinstance(called, ast.Attribute) else called.id if isinstance(called, ast.Name) else ""
    return name.startswith("assert") or (
        isinstance(called, ast.Attribute)
        and name in ("raises", "warns", "fail")
        and ast.unparse(called.value) == "pytest"
    )


def tests_without_assertion(root: Path) -> list[str]:
    """``file:line name`` of tests that state nothing, neither themselves nor in a function of the tests or of the
    fixtures that they call, in the same file or by an import from ``tests`` or ``fixtures``."""
    read = House.read(root, ("tests", "fixtures")).files
    trees = {name.removesuffix(".py").replace("/", "."): tree for name, (_, tree) in read.items()}
    known: dict[str, dict[str, tuple[str, str]]] = {}
    functions: dict[tuple[str, str], ast.AST] = {}
    for module, tree in trees.items():
        names = known[module] = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                functions[module, node.name], names[node.name] = node, (module, node.name)
            elif isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    names[alias.asname or alias.name] = (node.module or "", alias.name)
    said: dict[tuple[str, str], bool] = {}

    def states(key: tuple[str, str]) -> bool:
        if key not in said and key in functions:
            said[key] = False  # a circle of calls states nothing
            said[key] = any(
                _asserts(node) or (isinstance(node, ast.Call) and states(called(key[0], node.func)))
                for node in ast.walk(functions[key])
            )
        return said.get(key, False)

    def called(module: str, function: ast.expr) -> tuple[str, str]:
        if isinstance(function, ast.Attribute):
            package, name = known[module].get(ast.unparse(function.value), ("", ""))
            return f"{package}.{name}", function.attr
        return known[module].get(function.id, ("", "")) if isinstance(function, ast.Name) else ("", "")

    return sorted(
        f"{module.replace('.', '/')}.py:{getattr(node, 'lineno', 0)} {name}"
        for (module, name), node in functions.items()
        if name.startswith("test_") and module.startswith("tests.") and not states((module, name))
    )
