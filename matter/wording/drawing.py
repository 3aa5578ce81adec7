"""Whether pictures can be drawn here: matplotlib, pyvista and imageio-ffmpeg are the extra ``pictures``, and a node of
a cluster does without them. Stages then leave their pictures out and say so; what is asked for by name is refused."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable

from matter import progress
from matter.errors import InputError

INSTALL = "pip install 'bolide[pictures]'"


@functools.cache
def has(library: str = "matplotlib") -> bool:
    """Whether a library of the extra can be imported."""
    try:
        importlib.import_module(library)
    except ImportError:
        return False
    return True


def possible(what: str, say: Callable[[str], object] = progress.tell) -> bool:
    """Whether pictures of ``what`` ("the crater") can be drawn; where not, ``say`` is told so in one line."""
    if not has():
        say(f"no pictures of {what}: matplotlib is not installed ({INSTALL})")
    return has()


def require(what: str, library: str = "matplotlib") -> None:
    """Raise ``InputError`` where ``library``, which ``what`` cannot do without, is not installed."""
    if not has(library):
        raise InputError(f"{what} needs {library}: {INSTALL}")


def note() -> str:
    """What a page says that had to do without its pictures; empty where it has them."""
    return "" if has() else f"Without pictures: matplotlib was not installed where this was made ({INSTALL})."
