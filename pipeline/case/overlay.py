"""Overlays on a case: ``[preset.<name>.<table>]`` and ``--set key.path=value``, merged key by key over the file's
tables."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import tomlkit

from matter.errors import InputError
from matter.files import toml_input
from pipeline.case.toml_lines import KeyPath


def merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """``base`` with ``over`` laid on top: tables are merged, anything else (lists too) is replaced. Neither is
    changed."""
    result = copy.deepcopy(base)
    for key, value in over.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = merged(result[key], value) if both else copy.deepcopy(value)
    return result


def toml(value: Any) -> str:
    """A value as TOML writes it on one line."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{tomlkit.key(key).as_string()} = {toml(one)}" for key, one in value.items())
        return f"{{ {inside} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    return tomlkit.item(value).as_string()


def parsed(assignment: str) -> tuple[KeyPath, Any]:
    """Key path and value of one ``--set`` text.

    The value is read as TOML where it is valid TOML (``12``, ``true``, ``[1, 2]``, ``"x"``) and as plain text where it
    is not, so that ``--set sph.end_time="30 min"`` needs no second pair of quotes.

    Raises ``InputError`` when there is no ``=`` or a part of the key is empty.
    """
    key, equals, text = assignment.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts) or len(parts) > toml_input.DEEPEST:
        raise InputError(
            f"--set {assignment[:80]!r}: write it as key.path=value, --set 'sph.end_time=30 min' for example"
        )
    text = text.strip()
    try:
        table = toml_input.loads(f"value = {text}")
        value = table["value"] if set(table) == {"value"} else text
    except toml_input.BeyondLimits as reason:
        raise InputError(f"--set {key}: {reason}") from None
    except ValueError:
        value = text
    return tuple(int(part) if _is_index(part) else part for part in parts), value


def _is_index(part: str) -> bool:
    return part.isascii() and part.isdecimal() and len(part) < 10


def assigned(document: dict[str, Any], path: KeyPath, value: Any) -> dict[str, Any]:
    """``document`` with ``value`` at ``path``; missing tables are made, a list index has to exist.

    Raises ``InputError`` when the path leads through something that is neither a table nor a list element.
    """
    result = copy.deepcopy(document)
    here: Any = result
    for depth, part in enumerate(path):
        last = depth == len(path) - 1
        where = ".".join(map(str, path[: depth + 1]))
        if isinstance(here, list):
            if not isinstance(part, int) or part >= len(here):
                raise InputError(f"--set {where}: there are {len(here)} elements, numbered from 0")
        elif isinstance(here, dict):
            part = str(part)
            if not last:
                here.setdefault(part, {})
        else:
            raise InputError(f"--set {where}: {'.'.join(map(str, path[:depth]))} is a value, not a table")
        if last:
            here[part] = value
        else:
            here = here[part]
    return result


def at(document: Any, key: str) -> Any:
    """The value of a dotted key; None where there is none."""
    for part in key.split("."):
        try:
            document = document[int(part) if isinstance(document, list) else part]
        except (KeyError, IndexError, TypeError, ValueError):
            return None
    return document
