"""``run_case --list``: what ships with the project and can be named in a case or on the command line."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

from matter.errors import InputError
from pipeline.case import shipped, stages

CASES = Path("cases")
Rows = list[tuple[str, str]]


def listing(kind: str | None = None) -> str:
    """All kinds of names, or those of one kind. Raises ``InputError`` for an unknown kind."""
    if kind is not None and kind not in KINDS:
        raise InputError(
            f"--list {kind}: there is no such list{stages.nearest(kind, list(KINDS))} (there are {', '.join(KINDS)})"
        )
    return "\n\n".join(_block(name, make()) for name, make in KINDS.items() if kind in (None, name))


def _block(name: str, rows: Rows) -> str:
    width = max((len(word) for word, _ in rows), default=0)
    lines = [f"  {word:<{width}}  {words}".rstrip() for word, words in rows] or ["  none here"]
    return "\n".join([f"{name}:", *lines])


def cases() -> Rows:
    """Cases in ``cases`` here and those that ship with the project, by their names, with their presets."""
    rows: dict[Path, tuple[str, str]] = {}
    named = [(str(file.parent), file) for file in sorted(CASES.glob("*/case.toml"))]
    for name, file in [*((name, folder / "case.toml") for name, folder in shipped.folders().items()), *named]:
        try:
            content = tomllib.loads(file.read_text())
        except (OSError, ValueError):
            continue  # who runs it is told
        presets = ", ".join(content.get("preset", {}))
        title = str(content.get("case", {}).get("title", ""))
        rows.setdefault(file.resolve(), (name, title + (f" (presets: {presets})" if presets else "")))
    return list(rows.values())


def materials() -> Rows:
    """Materials with their titles."""
    from matter.case import material

    return [(name, material.choices(name).get("title", "")) for name in material.names()]


def observed() -> Rows:
    """Observed and published craters."""
    from crater.comparison import observations

    return [(name, observations.load(name).title) for name in observations.names()]


def laws() -> Rows:
    """Laws by family, with the key that chooses one and the first sentence of its file."""
    from pipeline.case import keys

    rows: Rows = []
    for table, words in (
        ("sph.materials.ice", "[sph.materials.NAME]"),
        ("sph", "[sph]"),
        ("dem.contact", "[dem.contact]"),
    ):
        for one in keys.keys(keys.find(table)[0][0]):
            if one.path[-1] in LAWS[table]:
                rows.append((f"{words} {one.path[-1]}", one.allowed.replace('"', "")))
    return rows


LAWS = {
    "sph.materials.ice": ("eos", "strength", "porosity", "damage"),
    "sph": ("numerics", "gradients", "viscosity_switch", "sides", "floor"),
    "dem.contact": ("normal", "cohesion"),
}
KINDS: dict[str, Callable[[], Rows]] = {"cases": cases, "materials": materials, "observed": observed, "laws": laws}
