"""Choices that no shipped case takes: their tests hold them, no run that was looked at does. ``run_case --describe``
and the warnings of a case say so.

A test keeps the list true: what a shipped case takes is not experimental.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from matter.case.body import Model

CHOICES: dict[str, tuple[Any, ...]] = {
    "bed.shape": ("whole",),
    "sph.symmetry": ("half",),
    "sph.materials.NAME.eos": ("table", "murnaghan", "ideal_gas"),
    "dem.contact.normal": ("hertz",),
    "dem.contact.cohesion": ("sjkr",),
}
"""Path of a key, with ``NAME`` for any material -> the values that are experimental; an empty tuple: any but its
default."""


def remark(path: tuple[str, ...]) -> str:
    """What the description of a key adds, or an empty text."""
    if (values := CHOICES.get(".".join(path))) is None:
        return ""
    return f" Experimental{': ' + ', '.join(map(_written, values)) if values else ''} (no shipped case takes it)."


def used(settings: Mapping[str, Model]) -> Iterator[str]:
    """One warning for each experimental choice that the ``settings`` of a case's stages take."""
    bed = settings.get("bed")
    if getattr(bed, "on_patch", False) and (shape := getattr(bed, "shape", "")) != "bowl":
        flat = "of an ellipsoid's or mesh's ground, laid flat,"
        yield f"[bed] shape = {_written(shape)} {flat} is experimental: tests hold it"
    for path, values in CHOICES.items():
        *names, key = path.split(".")
        for title, owner in _owners(names, settings):
            if not isinstance(owner, Model) or key not in type(owner).model_fields:
                continue
            value = getattr(owner, key)
            if value in values or (not values and value != type(owner).model_fields[key].default):
                yield (f"[{title}] {key} = {_written(value)} is experimental: tests hold it, no shipped case takes it")


def _owners(names: list[str], settings: Mapping[str, Model]) -> Iterator[tuple[str, Any]]:
    """Title and value of each table at a path; ``NAME`` stands for all that are there."""
    # [target] is shared: it stands in the settings of each stage that takes it
    title = names[0]
    shared = [getattr(one, title) for one in settings.values() if title in type(one).model_fields]
    found: list[tuple[str, Any]] = [("", {title: shared[0], **settings} if shared else settings)]
    for name in names:
        found = [
            (
                f"{title}.{inner}".lstrip("."),
                value.get(inner) if isinstance(value, Mapping) else getattr(value, inner, None),
            )
            for title, value in found
            for inner in (value if name == "NAME" and isinstance(value, Mapping) else (name,))
        ]
    yield from found


def _written(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else f'"{value}"' if isinstance(value, str) else f"{value:g}"
