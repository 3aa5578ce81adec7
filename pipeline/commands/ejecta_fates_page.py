"""The fates that ``fly_ejecta`` found, on the page of the run whose ejecta they are."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

from crater.pages import ejecta_fates
from matter.errors import InputError
from matter.files import archive
from pipeline.store import view


def show(run: Path, out: Path) -> int:
    """Put the masses of ``out/ejecta_fates.json`` on the page of ``run``, and say so; a run whose page is not there is
    told, and nothing else is lost. Returns the exit code."""
    report = run / "6_crater" / "report.html"
    try:
        with view.owned(run, "crater") if report.is_file() else nullcontext():
            ejecta_fates.show(report, archive.read_json(out / "ejecta_fates.json"))
    except InputError as reason:
        print(reason)
    else:
        print(f"{report}: what became of the ejecta")
    return 0
