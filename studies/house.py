"""The house counted: arguments, lengths, circles, raw columns, places to touch; of one checkout, or of several side by
side.

    python studies/house.py [CHECKOUT ...] [--lines]

A checkout is a folder that holds the rooms (``git worktree add ../before 1590728`` makes one of an older commit).
``--lines`` lists what was counted. Everything is read from the syntax trees of the files in the rooms; nothing is
imported, so that any commit can be counted. What is counted:

arguments    functions with more than 10 parameters (``self`` among them). Functions whose parameters are the options
             of a command (``typer``, or a module ``options``) are counted apart: the command line declares them.
lines        functions of more than 60 and 100 lines, with their docstrings; a function inside another counts for both.
flat         files that lie in a room and in none of its folders, ``__init__`` apart.
floors       of a room: the longest chain of its folders and flat files in which each imports the next.
keys         of case files: fields of the settings (classes that come from ``Model``) and of the laws' ``Parameters``.
names        names of modules that more than one file has, ``__init__`` and ``__main__`` apart.
lines        of Python in the rooms, in kilolines.
tags         texts of Python that hold a tag of HTML.
wide lines   lines of 120 characters or more in any of these files, and in the tests.
circles      sets of modules that reach each other by imports (Tarjan's strong components), those inside functions and
             under ``TYPE_CHECKING`` included.
raw columns  lines with a number above 2 as last index, ``V[:, 7]``, ``report[4]``, ``row[4:7]``: 0, 1, 2 are the
             coordinates of a vector. Components of symmetric tensors (3, 4, 5) are among them, and so are shown beside
             those above 5. Not counted is a first part alone, ``text[:12]``.
tables       lines that take a column of a table of grains by its number, ``bed.X[:, :3]``, 0, 1, 2 among them, outside
             compiled loops: those get the tables as arguments, and read coordinates one by one.
numpy        lines of scalar laws (``law`` of ``matter.compilation.jit``) that call numpy, which compilers for devices
             refuse: ``math`` has the same functions.
places       lines in the rooms that name a given law, outside of its own file and of the tests: what has to be touched
             for one more like it. The law is one that nothing but its family knows (``PLACES``). A line counts if a
             name in it holds the law's as a word between underscores (``normal_hertz``, ``SJKR``, ``as_murnaghan``),
             or a text without spaces does (a key, ``"murnaghan"``); comments and docstrings do not.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import sys
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOMS = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline")
AROUND = ("bolide", "fixtures", "studies", "benchmarks", "examples", "docs")
"""What stands around the rooms and is held to the same lengths."""
WIDEST_LINE = 119
MOST_ARGUMENTS, LONG, VERY_LONG, MOST_FLAT, LAST_COORDINATE, LAST_OF_TENSOR = 10, 60, 100, 6, 2, 5

PLACES = {
    "equation of state": ("murnaghan", "sph/eos/murnaghan.py"),
    "contact law": ("sjkr", "dem/laws/cohesion_sjkr.py"),
    "kernel": ("wendland", "sph/kernels/wendland.py"),
    "measure": ("wall_slope_deg", ""),
    "measure in all tables": ("depth_rim_to_floor_m", ""),
    "boundary": ("periodic", "sph/boundary/periodic.py"),
}
"""Per kind: the law that stands for it, and its own file. A measure has none of its own; where it is formed counts as
a place."""

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
TAG = re.compile(
    r"<!doctype|</?(?:a|b|body|br|button|canvas|code|div|em|fig\w+|h[1-6r]|head|html|i|img|input|label|li|link|meta|ol"
    r"|option|p|pre|script|section|select|small|span|strong|style|su[bp]|svg|t[dhr]|table|tbody|thead|title|ul)[\s>/]"
    r"|&(?:\w+|#\d+);",
    re.IGNORECASE,
)
GRAIN_TABLES = frozenset("XVWAFE")
"""Attributes of a list of grains: tables whose columns are named in ``dem/contact/columns.py``."""
KEYS_OF_CASES = {
    "share": ("matter/case/body.py", "sph/bodies/projectile.py"),
    "loosened": ("handoff/source/cloud_surface.py", "handoff/transfer/ejecta.py", "handoff/transfer/transfer.py"),
}
"""Keys of cases among them, and the files that read them."""


class House(NamedTuple):
    """The files of a checkout: path from its root, source, tree."""

    files: dict[str, tuple[str, ast.Module]]

    @classmethod
    def read(cls, root: Path) -> House:
        """Every Python file in the rooms of the checkout ``root``."""
        paths = sorted(path for room in ROOMS for path in (root / room).rglob("*.py"))
        if not paths:
            raise SystemExit(f"{root} holds none of the rooms {', '.join(ROOMS)}")
        texts = {path.relative_to(root).as_posix(): path.read_text() for path in paths}
        return cls({name: (text, ast.parse(text)) for name, text in texts.items()})

    def functions(self) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
        """Every function with its file."""
        for name, (_, tree) in self.files.items():
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    yield name, node


def arguments(house: House) -> tuple[list[str], list[str]]:
    """Functions with too many parameters, most first: all but those of the command line, and those."""
    found: tuple[list[tuple[int, str]], list[tuple[int, str]]] = ([], [])
    for name, node in house.functions():
        taken = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        if len(taken) > MOST_ARGUMENTS:
            options = sum(
                "typer" in ast.dump(part) or "id='options'" in ast.dump(part)
                for part in [*node.args.defaults, *[a.annotation for a in taken if a.annotation]]
            )
            declared = 2 * options > len(taken) or any("command" in ast.dump(part) for part in node.decorator_list)
            found[declared].append((len(taken), f"{len(taken)} {name}:{node.lineno} {node.name}"))
    free, declared_by_typer = ([text for _, text in sorted(part, key=lambda row: -row[0])] for part in found)
    return free, declared_by_typer


def long_functions(house: House, most: int) -> list[str]:
    """Functions of more than ``most`` lines, longest first."""
    found = [
        ((node.end_lineno or 0) - node.lineno + 1, f"{name}:{node.lineno} {node.name}")
        for name, node in house.functions()
    ]
    return [f"{lines} {where}" for lines, where in sorted(found, reverse=True) if lines > most]


def sources(root: Path, folders: tuple[str, ...]) -> dict[str, list[str]]:
    """The lines of every Python file in these folders of the checkout ``root``, by path from there."""
    paths = sorted(path for folder in folders for path in (root / folder).rglob("*.py"))
    return {path.relative_to(root).as_posix(): path.read_text().splitlines() for path in paths}


def wide_lines(root: Path) -> list[str]:
    """Lines of more than ``WIDEST_LINE`` characters, without what they say to mypy or to the linter at their end."""
    said = re.compile(r"\s+# (?:type: ignore|noqa|fmt:).*")
    return [
        f"{name}:{number} ({len(line)})"
        for name, lines in sources(root, (*ROOMS, *AROUND, "tests")).items()
        for number, line in enumerate(lines, 1)
        if len(said.sub("", line)) > WIDEST_LINE
    ]


def tags_in_python(root: Path) -> list[str]:
    """``file:line`` of texts in the rooms, docstrings apart, that hold a tag or an entity of HTML: those stand in
    templates."""
    found = []
    for path in sorted(path for room in (*ROOMS, "bolide") for path in (root / room).rglob("*.py")):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        said = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        for node in nodes:
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
                found += [(path.relative_to(root).as_posix(), node.lineno)] if TAG.search(node.value) else []
    return [f"{name}:{line}" for name, line in sorted(found)]


def banned_names(root: Path) -> list[str]:
    """``file:line name`` of functions called as in ``SAY_NO_RESULT``, and of names in ``BANNED``, in the rooms and
    around them; modules among these names."""
    found = []
    for path in sorted(path for room in (*ROOMS, *AROUND) for path in (root / room).rglob("*.py")):
        name = path.relative_to(root).as_posix()
        for node in ast.walk(ast.parse(path.read_text())):
            said = {str(getattr(node, key, "")) for key in ("id", "arg", "attr", "name")} & BANNED
            said = {word for word in said if name not in KEYS_OF_CASES.get(word, ())}
            if isinstance(node, ast.FunctionDef):
                said |= {node.name} & SAY_NO_RESULT
            found += [f"{name}:{getattr(node, 'lineno', 0)} {word}" for word in sorted(said)]
        found += [f"{name}: {path.stem}"] if path.stem in BANNED else []
    return found


def flat_files(root: Path) -> dict[str, list[str]]:
    """The files that lie in each room and in none of its folders."""
    return {
        room: sorted(
            path.name for path in (root / room).glob("*.py") if path.name not in ("__init__.py", "__main__.py")
        )
        for room in ROOMS
    }


def floors(house: House, room: str) -> list[str]:
    """The longest chain of the room's folders and flat files in which each imports the next, from the top down."""
    below: dict[str, set[str]] = defaultdict(set)
    for module, others in imports(house).items():
        for other in others:
            if module.startswith(f"{room}.") and other.startswith(f"{room}."):
                one, two = module.split(".")[1], other.split(".")[1]
                below[one] |= {two} - {one}
    chains: dict[str, list[str]] = {}

    def chain(name: str) -> list[str]:
        if name not in chains:
            chains[name] = []  # a circle ends here
            chains[name] = [name, *max((chain(other) for other in sorted(below[name])), key=len, default=[])]
        return chains[name]

    return max((chain(name) for name in sorted(below)), key=len, default=[])


def keys(house: House) -> list[str]:
    """``file:line class.key`` of each key that a case file may set."""
    classes = [
        (name, node)
        for name, (_, tree) in house.files.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    ]
    bases = {id(node): {ast.unparse(base).rpartition(".")[2] for base in node.bases} for _, node in classes}
    models, known = {"Model"}, 0
    while len(models) > known:
        known = len(models)
        models |= {node.name for _, node in classes if bases[id(node)] & models}
    return [
        f"{name}:{field.lineno} {node.name}.{field.target.id}"
        for name, node in classes
        if bases[id(node)] & models or (node.name == "Parameters" and "NamedTuple" in bases[id(node)])
        for field in node.body
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
    ]


def shared_names(root: Path) -> list[str]:
    """Names of modules that more than one file in the rooms has, with the number of these files."""
    names = Counter(Path(name).stem for name in sources(root, ROOMS))
    return [f"{count} {name}" for name, count in names.most_common() if count > 1 and not name.startswith("__")]


def imports(house: House) -> dict[str, set[str]]:
    """The modules that each module names in an import, wherever in the file it stands."""
    modules = {name.removesuffix(".py").removesuffix("/__init__").replace("/", "."): name for name in house.files}
    edges: dict[str, set[str]] = defaultdict(set)
    for module, name in modules.items():
        for node in ast.walk(house.files[name][1]):
            if isinstance(node, ast.ImportFrom):
                wanted = [
                    next((t for t in (f"{node.module}.{alias.name}", node.module) if t in modules), "")
                    for alias in node.names
                ]
            elif isinstance(node, ast.Import):
                wanted = [alias.name for alias in node.names]
            else:
                continue
            edges[module] |= {other for other in wanted if other in modules and other != module}
    return edges


def circles(edges: dict[str, set[str]]) -> list[str]:
    """Strong components of more than one module (Tarjan 1972)."""
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[str] = []

    def visit(module: str) -> None:
        number[module] = low[module] = len(number)
        stack.append(module)
        for other in sorted(edges.get(module, ())):
            if other not in number:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], number[other])
        if low[module] == number[module]:
            ring = stack[stack.index(module) :]
            del stack[stack.index(module) :]
            if len(ring) > 1:
                found.append(", ".join(sorted(ring)))

    for module in sorted(edges):
        if module not in number:
            visit(module)
    return sorted(found)


def _literal(node: ast.expr | None) -> int:
    """A number written out, -1 for anything else."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, int) else -1


def raw_columns(house: House, room: str, above: int = LAST_COORDINATE) -> list[str]:
    """Lines of a room that take a column by a number greater than ``above``."""
    found = set()
    for name, (_, tree) in house.files.items():
        if not name.startswith(f"{room}/"):
            continue
        for node in ast.walk(tree):
            if not isinstance(node, ast.Subscript):
                continue
            last = node.slice.elts[-1] if isinstance(node.slice, ast.Tuple) and node.slice.elts else node.slice
            # the bounds of a slice lie one behind the last column that it takes
            number = (
                max(_literal(last.lower), _literal(last.upper) - 1) if isinstance(last, ast.Slice) else _literal(last)
            )
            first_part = isinstance(node.slice, ast.Slice) and node.slice.lower is None
            if number > above and not first_part:
                found.add((name, node.lineno))
    return [f"{name}:{line}" for name, line in sorted(found)]


def raw_tables(root: Path) -> list[str]:
    """``file:line`` where a column of a table of grains (``GRAIN_TABLES``, an attribute) is taken by a number, in the
    rooms and around them."""
    found = set()
    for path in sorted(path for room in (*ROOMS, *AROUND) for path in (root / room).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if (
                isinstance(node, ast.Subscript)
                and isinstance(node.value, ast.Attribute)
                and node.value.attr in GRAIN_TABLES
                and isinstance(node.slice, ast.Tuple)
            ):
                last = node.slice.elts[-1]
                ends = [last.lower, last.upper] if isinstance(last, ast.Slice) else [last]
                found |= {(path.relative_to(root).as_posix(), node.lineno) for end in ends if _literal(end) >= 0}
    return [f"{name}:{line}" for name, line in sorted(found)]


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
    trees = {
        ".".join(path.relative_to(root).with_suffix("").parts): ast.parse(path.read_text())
        for room in ("tests", "fixtures")
        for path in sorted((root / room).rglob("*.py"))
    }
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


def law_mentions(house: House, law: str, own: str) -> list[str]:
    """Lines that name a law outside of its own file."""
    word = re.compile(rf"(?<![a-z0-9]){law}(?![a-z0-9])", re.IGNORECASE)
    found = []
    for name, (text, _) in house.files.items():
        if name == own:
            continue
        lines = set()
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            key = token.type == tokenize.STRING and not re.search(r"\s", token.string)
            if (key or token.type == tokenize.NAME) and word.search(token.string):
                lines.add(token.start[0])
        found += [f"{name}:{line}" for line in sorted(lines)]
    return found


def numpy_in_laws(house: House) -> list[str]:
    """Lines of functions with the decorator ``law`` that call a function of numpy."""
    found, kind = set(), re.compile(r"u?int\d|float\d|bool")  # a change of type is no call of numpy's
    for name, function in house.functions():
        marks = [mark.func if isinstance(mark, ast.Call) else mark for mark in function.decorator_list]
        if not any(isinstance(mark, ast.Name) and mark.id == "law" for mark in marks):
            continue
        for node in ast.walk(function):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and ast.unparse(node.func.value) == "np"
                and not kind.match(node.func.attr)
            ):
                found.add((name, node.lineno))
    return [f"{name}:{line}" for name, line in sorted(found)]


def count(root: Path) -> dict[str, list[str]]:
    """Rows of the table for the checkout ``root``: what was counted, each with the places where it is."""
    house = House.read(root)
    free, declared = arguments(house)
    rows = {
        f"functions of more than {MOST_ARGUMENTS} parameters": free,
        "  more, declared by the command line": declared,
        f"functions of more than {LONG} lines": long_functions(house, LONG),
        f"functions of more than {VERY_LONG} lines": long_functions(house, VERY_LONG),
        "files flat in a room": [f"{room}/{name}" for room, names in flat_files(root).items() for name in names],
        "names that more than one module has": shared_names(root),
        **{f"floors of {room}": floors(house, room) for room in ROOMS},
        "keys of case files": keys(house),
        "lines of Python in the rooms / 1000": ["x"] * (sum(map(len, sources(root, ROOMS).values())) // 1000),
        f"lines of more than {WIDEST_LINE} characters": wide_lines(root),
        "tags of HTML in Python": tags_in_python(root),
        "circles of imports": circles(imports(house)),
        "  modules in them": [module for ring in circles(imports(house)) for module in ring.split(", ")],
    }
    for room in ROOMS:
        rows[f"raw columns in {room}"] = raw_columns(house, room)
        rows[f"  above {LAST_OF_TENSOR} in {room}"] = raw_columns(house, room, LAST_OF_TENSOR)
    rows["tables of grains by the number of a column"] = raw_tables(root)
    rows["lines of scalar laws that call numpy"] = numpy_in_laws(house)
    for kind, (law, own) in PLACES.items():
        touched = law_mentions(house, law, own)
        rows[f"places for one more {kind} (as {law})"] = touched
        rows[f"  files with places for one more {kind}"] = sorted({mention.partition(":")[0] for mention in touched})
    return rows


def main() -> int:
    """Count, print; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkouts", type=Path, nargs="*", default=[Path(".")], help="folders that hold the rooms")
    parser.add_argument("--lines", action="store_true", help="list what was counted")
    given = parser.parse_args()
    counted = [count(root) for root in given.checkouts]
    width = max(len(row) for row in counted[0])
    columns = [max(8, len(str(root))) for root in given.checkouts]
    print(" " * width, *(f"{root!s:>{wide}}" for root, wide in zip(given.checkouts, columns)))
    for row in counted[0]:
        print(f"{row:<{width}}", *(f"{len(table[row]):>{wide}}" for table, wide in zip(counted, columns)))
        if given.lines:
            for root, table in zip(given.checkouts, counted):
                print("".join(f"    {root}: {mention}\n" for mention in table[row]), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
