"""Other codes' files as snapshots."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

from matter.errors import InputError


def import_snapshot(
    file: str | Path,
    out: str | Path,
    *,
    form: str | None = None,
    columns: str | None = None,
    materials: str | None = None,
    time: float | str | None = None,
    origin: Sequence[float] | None = None,
    up: Sequence[float] | None = None,
) -> Path:
    """Write another code's output as a snapshot, as the command ``import_snapshot`` does; the path written.

    ``columns`` names the columns of a text (``"x [km],y [km],z [km],vx,vy,vz,m,rho"``) or the datasets of an HDF5
    file, ``materials`` the names behind its material numbers (``"basalt,water,ice"``); ``time`` after the impact [s],
    or a text with unit; ``origin`` [m] and ``up`` turn its frame (``matter.formats.turned_frame``).
    Warns of what was left out, and of fields that the stages will miss. Raises ``InputError`` for what cannot be read,
    for values that no particle can have, and for an ``out`` that does not end in ``.vtkhdf``.
    """
    from matter import formats
    from matter.case import quantity
    from matter.files import archive

    path = Path(out)
    archive.check_file(path)
    try:
        when = quantity.parse(time, "s") if isinstance(time, str) else None if time is None else float(time)
    except ValueError as reason:
        raise InputError(f"time: {reason}") from None
    _, *others = formats.convert(Path(file), path, form, columns, materials, origin, up, when)
    if others:
        warnings.warn(f"{path}: {'; '.join(others)}", stacklevel=2)
    return path
