"""``run_case CASE --invert``: from an observed crater to what made it, by the sweep's table that is there; with
``--check``: what the data can tell apart, before the sweep is finished."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matter.errors import InputError


def inverted(case: Any, out: Path, others: list[tuple[Any, str]], check: bool = False) -> int:
    """Write the inversion of a case and say what it says; ``check``: only say what the data can tell. Raises
    ``InputError`` for options that do not go with it (``others``)."""
    if refused := [option for given, option in others if given]:
        raise InputError(f"--invert runs nothing, it reads the table of a sweep: leave out {' and '.join(refused)}")
    from pipeline.inverse import inversion, result_files

    if check:
        print(result_files.planned(*inversion.planned(case, out)), flush=True)
        return 0
    found = inversion.of_case(case, out)
    result_files.write(found)
    print(result_files.terminal(found), flush=True)
    return 0
