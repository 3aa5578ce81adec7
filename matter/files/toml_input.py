"""TOML from outside: read within limits, so that no file and no option ends in a traceback."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from matter.errors import InputError

DEEPEST = 50
"""Tables and lists within one another; a case has five."""
LARGEST = 2**63 - 1
"""The largest whole number of TOML 1.0; the least is one further from zero."""


class BeyondLimits(ValueError):
    """Valid TOML that is nested too deeply, or holds a whole number that is too large."""


def loads(text: str) -> dict[str, Any]:
    """The content of a TOML text. Raises ``tomllib.TOMLDecodeError`` where it is none, ``BeyondLimits`` where it is
    beyond them; both are ``ValueError``."""
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise BeyondLimits(f"nested more than {DEEPEST} deep") from None
    except ValueError:  # Python reads no whole number of more than 4,300 digits
        raise BeyondLimits(f"a whole number is larger than {LARGEST}") from None
    level: list[Any] = [content]
    for _ in range(DEEPEST):
        level = [inner for outer in level for inner in _inside(outer)]
        if any(isinstance(value, int) and not -LARGEST - 1 <= value <= LARGEST for value in level):
            raise BeyondLimits(f"a whole number is larger than {LARGEST}")
        if not level:
            return content
    raise BeyondLimits(f"nested more than {DEEPEST} deep")


def read(path: Path) -> tuple[str, dict[str, Any]]:
    """Text and content of a TOML file. Raises ``InputError`` where it is no TOML, or not even text."""
    try:
        text = path.read_text()
        return text, loads(text)
    except ValueError as reason:
        raise InputError(f"{path} is not valid TOML: {reason}") from None


def _inside(value: Any) -> Any:
    return value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
