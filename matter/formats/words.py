"""Other codes' names in messages: short, however long they are and however many."""

from __future__ import annotations

from collections.abc import Iterable

_LONGEST, _MOST = 60, 12


def short(text: object) -> str:
    """A text of a file as it may stand in a message: in quotation marks, cut after 60 characters."""
    written = str(text)
    return repr(written if len(written) <= _LONGEST else written[:_LONGEST] + "...")


def listed(names: Iterable[object]) -> str:
    """Names between commas, the first 12 of them and the number of the others; 'none' without any."""
    every = [str(name) for name in names]
    some = [name if len(name) <= _LONGEST else name[:_LONGEST] + "..." for name in every[:_MOST]]
    return (", ".join(some) or "none") + (f" and {len(every) - _MOST:,} more" if len(every) > _MOST else "")
