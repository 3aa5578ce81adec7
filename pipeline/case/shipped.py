"""Cases that ship with the project: in a checkout in ``cases/``, in an installation in the package ``bolide``.
``run_case NAME`` takes them by name."""

from __future__ import annotations

import shutil
from pathlib import Path

from matter.errors import InputError
from pipeline.case import stages

_HOUSE = Path(__file__).resolve().parents[2]
FOLDERS = (_HOUSE / "cases", _HOUSE / "bolide" / "cases")


def folders() -> dict[str, Path]:
    """Every shipped case by its name."""
    return {
        file.parent.name: file.parent for folder in reversed(FOLDERS) for file in sorted(folder.glob("*/case.toml"))
    }


def located(where: Path) -> Path:
    """``where`` itself where it is there, else the shipped case of that name; raises ``InputError`` with the nearest
    name."""
    where = Path(where)
    if where.exists():
        return where
    known = folders()
    if len(where.parts) == 1 and where.name in known:
        return known[where.name]
    near = stages.nearest(where.name, list(known)) if len(where.parts) == 1 else ""
    raise InputError(
        f"no case at {where}: give a folder that holds case.toml, the file itself, or the name of a shipped "
        f"case{near} (run_case --list cases)"
    )


def copy(name: str, to: Path) -> Path:
    """Copy a shipped case into a folder that is not there yet, to change it; the folder. Raises ``InputError``."""
    known, to = folders(), Path(to)
    if name not in known:
        raise InputError(f"no shipped case {name!r}{stages.nearest(name, list(known))} (there are {', '.join(known)})")
    if to.exists() and (not to.is_dir() or any(to.iterdir())):
        raise InputError(f"--copy {name}: {to} is there already: name a new folder")
    shutil.copytree(known[name], to, dirs_exist_ok=True)
    return to
