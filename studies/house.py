"""The house counted: arguments, lengths, circles, raw columns, places to touch; of one checkout, or of several side by
side.

    python studies/house.py [CHECKOUT ...] [--lines]

A checkout is a folder that holds the rooms (``git worktree add ../before 1590728`` makes one of an older commit).
``--lines`` lists what was counted. Everything is read from the syntax trees of the files in the rooms; nothing is
imported, so that any commit can be counted. What is counted:

arguments    functions with more than 10 parameters (``self`` among them).
lines        functions of more than 60 and 100 lines, with their docstrings; a function inside another counts for both.
flat         files that lie in a room and in none of its folders, ``__init__`` apart.
floors       of a room: the longest chain of its folders and flat files in which each imports the next.
keys         of case files: fields of the settings (classes that come from ``Model``) and of the laws' ``Parameters``.
names        names of modules that more than one file has, ``__init__`` and ``__main__`` apart.
lines        of Python in the rooms, in kilolines.
tags         texts of Python that hold a tag of HTML.
wide lines   lines of 120 characters or more in any of these files, and in the tests.
circles      sets of modules that reach each other by imports (strong components), those inside functions and
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
from typing import Any, NamedTuple

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

TAG = re.compile(
    r"<!doctype|</?(?:a|b|body|br|button|canvas|code|div|em|fig\w+|h[1-6r]|head|html|i|img|input|label|li|link|meta|ol"
    r"|option|p|pre|script|section|select|small|span|strong|style|su[bp]|svg|t[dhr]|table|tbody|thead|title|ul)[\s>/]"
    r"|&(?:\w+|#\d+);",
    re.IGNORECASE,
)
GRAIN_TABLES = frozenset("XVWAFE")
"""Attributes of a list of grains: tables whose columns are named in ``dem/contact/columns.py``."""


class House(NamedTuple):
    """The files of a checkout: path from its root, source, tree."""

    files: dict[str, tuple[str, ast.Module]]

    @classmethod
    def read(cls, root: Path, folders: tuple[str, ...] = ROOMS) -> House:
        """Every Python file in these folders of the checkout ``root``."""
        texts = sources(root, folders)
        if not texts:
            raise SystemExit(f"{root} holds none of the rooms {', '.join(ROOMS)}")
        return cls({name: (text, ast.parse(text)) for name, text in texts.items()})

    def nodes(self, *kinds: type[ast.AST], room: str = "") -> Iterator[tuple[str, Any]]:
        """Every node of the trees with its file: of these kinds, in this room, if any are named."""
        for name, (_, tree) in self.files.items():
            if name.startswith(room):
                yield from ((name, node) for node in ast.walk(tree) if not kinds or isinstance(node, kinds))

    def functions(self) -> Iterator[tuple[str, Any]]:
        """Every function with its file."""
        return self.nodes(ast.FunctionDef, ast.AsyncFunctionDef)


def sources(root: Path, folders: tuple[str, ...]) -> dict[str, str]:
    """The text of every Python file in these folders of the checkout ``root``, by path from there."""
    paths = sorted(path for folder in folders for path in (root / folder).rglob("*.py"))
    return {path.relative_to(root).as_posix(): path.read_text() for path in paths}


def arguments(house: House) -> list[str]:
    """Functions with too many parameters, most first."""
    found = [
        (len([*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]), f"{name}:{node.lineno} {node.name}")
        for name, node in house.functions()
    ]
    return [f"{count} {where}" for count, where in sorted(found, reverse=True) if count > MOST_ARGUMENTS]


def long_functions(house: House, most: int) -> list[str]:
    """Functions of more than ``most`` lines, longest first."""
    found = [
        (node.end_lineno - node.lineno + 1, f"{name}:{node.lineno} {node.name}") for name, node in house.functions()
    ]
    return [f"{lines} {where}" for lines, where in sorted(found, reverse=True) if lines > most]


def wide_lines(root: Path) -> list[str]:
    """Lines of more than ``WIDEST_LINE`` characters, without what they say to mypy or to the linter at their end."""
    said = re.compile(r"\s+# (?:type: ignore|noqa|fmt:).*")
    return [
        f"{name}:{number} ({len(line)})"
        for name, lines in sources(root, (*ROOMS, *AROUND, "tests")).items()
        for number, line in enumerate(lines.splitlines(), 1)
        if len(said.sub("", line)) > WIDEST_LINE
    ]


def tags_in_python(root: Path) -> list[str]:
    """``file:line`` of texts in the rooms, docstrings apart, that hold a tag or an entity of HTML: those stand in
    templates."""
    house = House.read(root, (*ROOMS, "bolide"))
    said = {id(node.value) for _, node in house.nodes(ast.Expr)}
    found = [
        (name, node.lineno)
        for name, node in house.nodes(ast.Constant)
        if isinstance(node.value, str) and id(node) not in said and TAG.search(node.value)
    ]
    return [f"{name}:{line}" for name, line in sorted(found)]


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
    classes = list(house.nodes(ast.ClassDef))
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


def module_of(name: str) -> str:
    """The module of a file."""
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def imports(house: House) -> dict[str, set[str]]:
    """The modules that each module names in an import, wherever in the file it stands."""
    modules = {module_of(name) for name in house.files}
    edges: dict[str, set[str]] = defaultdict(set)
    for name, node in house.nodes(ast.ImportFrom, ast.Import):
        module = module_of(name)
        wanted = [alias.name for alias in node.names]
        if isinstance(node, ast.ImportFrom):
            wanted = [
                next((t for t in (f"{node.module}.{alias}", node.module) if t in modules), "") for alias in wanted
            ]
        edges[module] |= {other for other in wanted if other in modules and other != module}
    return edges


def circles(edges: dict[str, set[str]]) -> list[str]:
    """Strong components of more than one module."""
    from scipy.sparse import lil_array
    from scipy.sparse.csgraph import connected_components

    modules = sorted(set(edges).union(*edges.values()))
    graph = lil_array((len(modules), len(modules)), dtype=bool)
    for module, others in edges.items():
        graph[modules.index(module), [modules.index(other) for other in others]] = True
    count, labels = connected_components(graph, connection="strong") if modules else (0, [])
    rings = [[module for module, label in zip(modules, labels) if label == one] for one in range(count)]
    return sorted(", ".join(ring) for ring in rings if len(ring) > 1)


def _literal(node: ast.expr | None) -> int:
    """A number written out, -1 for anything else."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, int) else -1


def raw_columns(house: House, room: str, above: int = LAST_COORDINATE) -> list[str]:
    """Lines of a room that take a column by a number greater than ``above``."""
    found = set()
    for name, node in house.nodes(ast.Subscript, room=f"{room}/"):
        last = node.slice.elts[-1] if isinstance(node.slice, ast.Tuple) and node.slice.elts else node.slice
        # the bounds of a slice lie one behind the last column that it takes
        number = max(_literal(last.lower), _literal(last.upper) - 1) if isinstance(last, ast.Slice) else _literal(last)
        first_part = isinstance(node.slice, ast.Slice) and node.slice.lower is None
        if number > above and not first_part:
            found.add((name, node.lineno))
    return [f"{name}:{line}" for name, line in sorted(found)]


def raw_tables(root: Path) -> list[str]:
    """``file:line`` where a column of a table of grains (``GRAIN_TABLES``, an attribute) is taken by a number, in the
    rooms and around them."""
    found = set()
    for name, node in House.read(root, (*ROOMS, *AROUND)).nodes(ast.Subscript):
        table = node.value.attr if isinstance(node.value, ast.Attribute) else ""
        if table in GRAIN_TABLES and isinstance(node.slice, ast.Tuple):
            last = node.slice.elts[-1]
            ends = [last.lower, last.upper] if isinstance(last, ast.Slice) else [last]
            found |= {(name, node.lineno) for end in ends if _literal(end) >= 0}
    return [f"{name}:{line}" for name, line in sorted(found)]


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
    rows = {
        f"functions of more than {MOST_ARGUMENTS} parameters": arguments(house),
        f"functions of more than {LONG} lines": long_functions(house, LONG),
        f"functions of more than {VERY_LONG} lines": long_functions(house, VERY_LONG),
        "files flat in a room": [f"{room}/{name}" for room, names in flat_files(root).items() for name in names],
        "names that more than one module has": shared_names(root),
        **{f"floors of {room}": floors(house, room) for room in ROOMS},
        "keys of case files": keys(house),
        "lines of Python in the rooms / 1000": ["x"]
        * (sum(len(text.splitlines()) for text, _ in house.files.values()) // 1000),
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
