"""Write a case's expected.toml from the runs of its errors, which it makes where they are missing.

    python studies/chain_error.py --case cases/valhalla_980km --preset quick --out runs [--threads T]

The runs are those of ``run_case CASE --errors`` (``pipeline/sweeps/error_study.py``). What is done is not made again:
the same command continues after any stop. The other presets' tables of the file stay as they are.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import tomlkit

from matter.errors import InputError, Stopped
from matter.files import archive
from pipeline.case import read as cases
from pipeline.settings import expected
from pipeline.store import provenance
from pipeline.sweeps import error_study
from pipeline.sweeps.error_study import ErrorStudy
from pipeline.uncertainty import chain_error
from pipeline.uncertainty.chain_error import Row


def main() -> int:
    """Make the runs, print the table, write expected.toml; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", type=Path, required=True, help="folder of the case")
    parser.add_argument("--preset", help="preset of the case (default: as run_case)")
    parser.add_argument("--out", type=Path, default=Path("runs"), help="folder of the runs")
    parser.add_argument("--threads", type=int, default=1, help="threads of each run")
    given = parser.parse_args()
    try:
        study = ErrorStudy(cases.read(given.case, given.preset), given.out)
        failed = error_study.make(study, given.threads, lambda words: print(words, flush=True))
        rows = study.rows()
    except (InputError, Stopped) as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    print(f"\n{chain_error.text(rows)}")
    preset = f" --preset {given.preset}" if given.preset else ""
    write(study, rows, f"run_case {given.case}{preset} --errors", given.case / expected.FILE)
    print(f"written to {given.case / expected.FILE}")
    return 1 if failed else 0


def write(study: ErrorStudy, rows: Sequence[Row], command: str, file: Path) -> None:
    """Write the rows as the preset's table of an ``expected.toml``. Raises ``InputError`` where the file that comes
    out cannot be read."""
    content = tomlkit.parse(file.read_text()) if file.is_file() else tomlkit.document()
    if not file.is_file():
        content.add(tomlkit.comment(f"What the presets of {study.case.name} come to, with errors; written by"))
        content.add(tomlkit.comment("studies/chain_error.py (formulas: pipeline/uncertainty/chain_error.py)."))
    made_by = provenance.commit()
    changed = " with changes" if made_by.get("uncommitted_changes") else ""
    table = tomlkit.table()
    table.add("command", command)
    table.add("commit", made_by.get("commit", "unknown") + changed)
    table.add("measured", time.strftime("%Y-%m-%d"))
    table.add("members", max(len(row.values) for row in rows))
    table.add("shocks", study.shocks)
    for crater in expected.CRATERS:
        if mine := [row for row in rows if row.crater == crater]:
            table.add(crater, {row.measure: _entry(row) for row in mine})
    content[study.case.preset or expected.NO_PRESET] = table
    archive.write_text(file, tomlkit.dumps(content))
    expected.read(file.parent)


def _entry(row: Row) -> dict[str, str]:
    factor, unit = expected.scale(row.measure, row.mean)
    cells = {"value": row.mean, "measuring": row.measuring, **row.parts}
    return {name: f"{cell * factor:.4g} {unit}".rstrip() for name, cell in cells.items()}


if __name__ == "__main__":
    sys.exit(main())
