"""The pages of the laws: one for each file, with its docstring, its picture (``law_pictures``) and its checks
(``law_checks``)."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import law_checks

ROOT = Path(__file__).resolve().parents[2]


class Kind(NamedTuple):
    """A folder of laws: its title, the lists of its families, and the keys of a case that choose from them."""

    title: str
    of_one: str
    lists: tuple[str, ...]
    keys: tuple[str, ...]


LAW_FOLDERS = {
    "sph/eos": Kind(
        "Equations of state", "equation of state", ("sph.eos.dispatch", "sph.materials.families"), ("eos",)
    ),
    "sph/strength": Kind("Strength", "strength", ("sph.strength.dispatch", "sph.materials.families"), ("strength",)),
    "sph/porosity": Kind(
        "Porosity",
        "porosity",
        ("sph.porosity.dispatch", "sph.porosity.crush", "sph.materials.families"),
        ("porosity",),
    ),
    "sph/damage": Kind("Damage", "damage", ("sph.damage.growth", "sph.materials.families"), ("damage",)),
    "sph/kernels": Kind("Kernels", "smoothing kernel", ("sph.kernels.dispatch",), ("numerics",)),
    "sph/boundary": Kind(
        "Edges of flat ground", "edge of flat ground", ("sph.boundary.dispatch",), ("sides", "floor")
    ),
    "dem/laws": Kind(
        "Contacts of grains",
        "contact of grains",
        ("dem.laws.dispatch",),
        ("normal", "tangential", "rolling", "twisting", "cohesion"),
    ),
}
NO_LAWS = frozenset(
    f"{folder}/{name}" for folder in LAW_FOLDERS for name in ("__init__", "__main__", "dispatch")
) | {"sph/porosity/crush", "sph/porosity/matrix", "sph/damage/growth", "sph/damage/seeding"} | {
    "sph/boundary/edge", "sph/boundary/sides_and_floor", "sph/eos/table_slopes", "sph/eos/densest", "sph/eos/release"
}  # fmt: skip
"""Files that choose among laws, or carry out what a case chose: they state no law of their own."""
MOST = 12
"""Checks that a page spells out; of the others it says where they are."""


def names() -> list[str]:
    """Every law, as ``sph/eos/tillotson``, folder by folder."""
    found = [
        str(file.relative_to(ROOT).with_suffix(""))
        for folder in LAW_FOLDERS
        for file in sorted((ROOT / folder).glob("*.py"))
    ]
    return [name for name in found if name not in NO_LAWS]


def page_path(name: str) -> str:
    """The page of a law, below ``reference/laws``."""
    return name.removeprefix("sph/").replace("dem/laws", "contacts")


def pages(prose: Callable[[str], str], html: Callable[[str], str]) -> dict[str, str]:
    """The list of all laws and the page of each; ``prose`` makes Markdown of a docstring, ``html`` of one line.

    Raises ``ValueError`` for a law without docstring or check.
    """
    parts = [
        "# Laws",
        "One law, one file, one page: equation, units, sources and range as they stand at the top of the file, a "
        "picture that the law's own code draws while these pages are made, and the tests that hold it.",
    ]
    made = {}
    for folder, kind in LAW_FOLDERS.items():
        mine = [name for name in names() if name.startswith(f"{folder}/")]
        parts.append(f"## {kind.title}")
        for name in mine:
            doc = ast.get_docstring(tree(name)) or ""
            first = " ".join(doc.split("\n\n")[0].split())
            parts.append(f"* {{doc}}`{title(name)} <laws/{page_path(name)}>`: {html(first)}")
            made[f"laws/{page_path(name)}"] = page(name, kind, prose, html)
        tree_of = "\n".join(f"{title(name)} <laws/{page_path(name)}>" for name in mine)
        parts.append(f"::::{{toctree}}\n:hidden:\n\n{tree_of}\n::::")
    return {"laws": "\n\n".join(parts) + "\n"} | made


def tree(name: str) -> ast.Module:
    """The source of a law."""
    return ast.parse((ROOT / f"{name}.py").read_text())


def title(name: str) -> str:
    """The name of a law in words."""
    return name.rpartition("/")[2].replace("_", " ")


def page(name: str, kind: Kind, prose: Callable[[str], str], html: Callable[[str], str]) -> str:
    """The page of one law."""
    source = tree(name)
    doc = ast.get_docstring(source)
    checks = law_checks.checks_of_law(ROOT / f"{name}.py", kind.lists, kind.keys)
    if not doc:
        raise ValueError(f"{name}.py says nothing at its top: a law without a docstring has no page")
    if not checks:
        raise ValueError(f"{name}.py: no test reaches this law, so its page could name no check")
    parts = [
        f"# {title(name)}: {kind.of_one}",
        prose(doc),
        f"```{{figure}} {name.rpartition('/')[2]}.svg\n:alt: {title(name)}\n\n@caption@\n```",
        *values(source, html),
        *sources(source, html),
        "## Its check",
        *told(checks, html),
        f"Source: `{name}.py`.",
    ]
    return "\n\n".join(parts) + "\n"


def values(source: ast.Module, html: Callable[[str], str]) -> list[str]:
    """What a case or a material gives the law: the docstring of its ``Parameters``."""
    for node in source.body:
        if isinstance(node, ast.ClassDef) and node.name == "Parameters":
            return ["## Its values", html(ast.get_docstring(node) or "")]
    return []


def sources(source: ast.Module, html: Callable[[str], str]) -> list[str]:
    """The papers that the law follows, from the bibliography."""
    from pipeline.case import bibliography

    for node in source.body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "SOURCES" for t in node.targets):
            keys = ast.literal_eval(node.value)
            if keys:
                return ["## Papers", "\n".join(f"* {html(cited(bibliography.entries()[key]))}" for key in keys)]
    return []


def cited(entry: str) -> str:
    """A BibTeX entry in a line: authors, year, title, where."""

    def held(field: str) -> str:
        found = re.search(rf"\b{field}\s*=\s*\{{((?:[^{{}}]|\{{[^{{}}]*\}})*)\}}", entry)
        text = " ".join(found[1].split()) if found else ""
        return re.sub(r"\\['`\"^~c]?\{?([A-Za-z])\}?", r"\1", text).replace("{", "").replace("}", "")

    where = held("journal") or held("booktitle") or held("institution") or held("publisher") or held("howpublished")
    numbers = " ".join(part for part in (held("volume"), held("pages").replace("--", "-")) if part)
    parts = [
        held("author").replace(" and ", "; ").rstrip("."),
        held("year"),
        held("title"),
        f"{where} {numbers}".strip(),
    ]
    return ". ".join(part for part in parts if part) + "."


def told(checks: list[law_checks.Check], html: Callable[[str], str]) -> list[str]:
    """The checks as lists: those of this law, and those that go through its family."""
    parts = []
    for family, words in ((False, "Tests of this law:"), (True, "Tests that visit every law of its family:")):
        mine = [check for check in checks if check.family is family]
        if mine:
            lines = [f"* {html(check.states)} (`{check.file}`, `{check.name}`)" for check in mine[:MOST]]
            if rest := mine[MOST:]:
                files = sorted({check.file for check in rest})
                lines.append(f"* and {len(rest)} more, in {', '.join(f'`{file}`' for file in files)}")
            parts += [words, "\n".join(lines)]
    return parts


def draw_laws(out: Path) -> dict[str, str]:
    """Draw every law below ``out`` and return the captions by law.

    In a process of its own, where the laws are plain Python: nothing is compiled for a picture. Raises ``ValueError``
    with what that process said where a law has no picture.
    """
    done = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("law_pictures.py")), str(out)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"},
    )
    if done.returncode:
        raise ValueError(f"pictures of the laws: {done.stderr.strip()[-2000:]}")
    return dict(line.split("\t", 1) for line in done.stdout.splitlines() if "\t" in line)
