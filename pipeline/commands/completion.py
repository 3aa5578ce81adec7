"""What a shell offers for the values of options; it is asked at every press of the key, so nothing heavy is
imported."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path


def stage_names(incomplete: str) -> list[str]:
    """The stages."""
    from pipeline.case import stages

    return [stage for stage in stages.ORDER if stage.startswith(incomplete)]


def presets(incomplete: str) -> list[str]:
    """The presets of the case that stands on the line."""
    # bash; zsh, fish and PowerShell
    line = os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS") or ""
    for word in line.split()[1:]:
        file = Path(word) / "case.toml" if Path(word).is_dir() else Path(word)
        if file.suffix == ".toml" and file.is_file():
            try:
                names = tomllib.loads(file.read_text()).get("preset", {})
            except (OSError, ValueError):
                return []
            return [name for name in names if name.startswith(incomplete)]
    return []


def paths(incomplete: str) -> list[str]:
    """Folders and TOML files, and cases by their folder."""
    here = Path(incomplete)
    parent = here if incomplete.endswith("/") else here.parent
    try:
        candidates = sorted(path for path in parent.iterdir() if not path.name.startswith("."))
    except OSError:
        return []
    return [
        f"{path}/" if path.is_dir() else str(path)
        for path in candidates
        if (path.is_dir() or path.suffix == ".toml") and str(path).startswith(str(here) if incomplete else "")
    ]
