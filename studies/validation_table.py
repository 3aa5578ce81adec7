"""What was published beside what was found here, as one page.

    python studies/validation_table.py

Reads ``docs/claims.toml`` (each claim: id, what it says, what was published, when it counts as reproduced) and, in the
folders of ``docs/results``,

* ``verdicts.json``: ``{"resolution": "...", "verdicts": [{"id", "ours", "verdict", "resolution", "why", "claim",
  "published", "tolerance"}]}``, all but the first three optional; the resolution at the top holds for rows without
  their own, and for the folder's other kinds of file;
* ``claims.json`` of ``python studies/encounter_claims.py`` and ``studies/valhalla_claims.py``;
* ``ledger_*.json`` of the handoff, whose rows are named like the criteria;
* ``shocks.json`` of ``studies/sph_verification.py``;

and writes ``docs/validation.md`` (``studies.validation_page``): verdicts by room, what is not met by its cause, every
claim. A claim may have several rows; one without any is ``not run``. The site makes the page with every build
(``docs/site/reference_pages.py``); it is not kept in git.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

from matter.errors import InputError
from matter.files import archive
from matter.wording import readable
from studies import validation_page
from studies.validation_page import VERDICTS, Claim, Row

ROOT = Path(__file__).resolve().parents[1]

DOCS = ROOT / "docs"
OF_LEDGER = {"pass": "met", "fail": "not met", "waived": "not met", "not_measured": "not run"}
OF_SOLUTIONS = {
    "V03": (
        "solutions/pressure wave", "solutions/shear wave",
        *(f"solutions/wave along a bar of {name}, corrected" for name in ("basalt", "ice", "aluminum")),
    ),
    "V04": ("solutions/rod",),
    "V15": ("solutions/collapse",),
    "V16": ("solutions/blast 1.4 36", "solutions/blast 1.67 36"),
    "V17": ("solutions/spin, corrected",),
}  # fmt: skip
PARTLY = {"V15": "to 0.8 of free fall only"}


_POWER = r"\d\.\d+e\+\d+"


def claims(path: Path) -> dict[str, Claim]:
    """The claims by id, in the order of the file."""
    found: dict[str, Claim] = {}
    for chapter in tomllib.loads(path.read_text())["chapter"]:
        for key, (text, published, tolerance) in chapter["claims"].items():
            if key in found:
                raise InputError(f"{path}: {key} stands there twice")
            found[key] = Claim(key, text, published, tolerance, chapter["title"])
    return found


def of_verdicts(path: Path, known: dict[str, Claim]) -> Iterator[Row]:
    """Rows of a ``verdicts.json``. Raises ``InputError`` for an unknown id, key or verdict."""
    content = json.loads(path.read_text())
    for row in content["verdicts"]:
        if row.get("id") not in known:
            raise InputError(f"{path}: no claim {row.get('id')!r} in claims.toml")
        if row.get("verdict") not in VERDICTS:
            raise InputError(f"{path}: verdict {row.get('verdict')!r} of {row['id']} is none of {', '.join(VERDICTS)}")
        if odd := sorted(set(row) - set(Row._fields)):
            raise InputError(f"{path}: unknown {', '.join(odd)} in {row['id']}")
        yield Row(**{"folder": path.parent.name, "resolution": content.get("resolution", ""), **row})


def of_claims(path: Path, known: dict[str, Claim], resolution: str) -> Iterator[Row]:
    """Rows of a ``claims.json``; what is no numbered claim (checks of the numerics) stays on its own page."""
    for row in json.loads(path.read_text())["claims"]:
        if row["id"] in known:
            error = f" (error {row['error']})" if row.get("error") else ""
            yield Row(
                row["id"], path.parent.name, row.get("ours", row.get("found", "")) + error, row["verdict"], resolution,
                row.get("why", row.get("note", "")),
                row["claim"], row["published"], row["tolerance"],
            )  # fmt: skip


def of_ledger(path: Path, known: dict[str, Claim], resolution: str) -> Iterator[Row]:
    """Rows of a handoff's ledger; one that does not apply says nothing. They are judged by the limit that the table
    prints, also where the ledger goes by a wider one of its own (of weight alone, of coarse grains)."""
    size = path.stem.removeprefix("ledger_")
    for row in json.loads(path.read_text()):
        if row["name"] in known and row["verdict"] in OF_LEDGER:
            ours = "-" if row["value"] is None else f"{row['value']:.3g}"
            verdict, note = OF_LEDGER[row["verdict"]], readable_note(row["note"])
            printed = re.fullmatch(r"<= ([\d.e+-]+)", known[row["name"]].tolerance)
            if verdict == "met" and printed and row["value"] > float(printed[1]):
                verdict, note = "not met", f"within the ledger's own limit, {row['limit']:.3g}: {note}"
            yield Row(
                row["name"], path.parent.name, ours, verdict, f"{size}; {resolution}".removesuffix("; "), note
            )  # fmt: skip


def readable_note(note: str) -> str:
    """A note of a kept ledger with its lengths [m] and volumes [m^3] in the units of today's ledgers: ``328 cells of
    83.9 km to 336 km``."""
    note = re.sub(rf"({_POWER}) \.\.\. ({_POWER}) m\b", r"\1 m to \2 m", note)
    note = re.sub(rf"({_POWER}) m\^3", lambda found: readable.volume(float(found[1])), note)
    return re.sub(rf"({_POWER}) m\b(?![\^/])", lambda found: readable.length(float(found[1])), note)


def of_shocks(path: Path, known: dict[str, Claim], resolution: str) -> Iterator[Row]:
    """The columns and bodies of the shock stage's verification: per claim one row, of the largest errors or of all
    values."""
    done = json.loads(path.read_text())["done"]
    for key, start in (
        ("V01", "pistons/"),
        ("V02", "compaction/aluminum"),
        ("V02b", ("compaction/basalt", "compaction/ice")),
    ):
        if found := [row for name, row in done.items() if name.startswith(start)]:
            worst = {part: max(abs(row[f"{part}_error"]) for row in found) for part in ("P", "rho", "u", "speed")}
            words = "largest error of " if len(found) > 1 else "error of "
            ours = words + ", ".join(f"{part} {100 * value:.2f} %" for part, value in worst.items())
            ours += (
                f", front {max(row['front_width_h'] for row in found):.1f} h, alpha behind at most "
                f"{max(row['distention'] for row in found):.4f}"
            )
            yield Row(
                key,
                path.parent.name,
                ours,
                "met" if all(row["met"] for row in found) else "not met",
                resolution,
                f"{len(found)} columns",
            )
    for key, names in OF_SOLUTIONS.items():
        found = [
            row
            for name in names
            for solution in done
            if solution.startswith(name)
            for row in done[solution].get("rows", ())
            if "met" in row
        ]
        if key in known and found:
            met = all(row["met"] for row in found)
            ours = "; ".join(
                f"{row['what'].removeprefix('... ')} {row['value']:.4g} ({row['wanted']:g} +- {row['limit']:g})"
                for row in found
            )
            yield Row(
                key,
                path.parent.name,
                ours,
                "not met" if not met else "in part" if key in PARTLY else "met",
                resolution,
                PARTLY.get(key, ""),
            )


def rows(results: Path, known: dict[str, Claim]) -> list[Row]:
    """All findings below ``results``, folder by folder in the order of the alphabet."""
    found: list[Row] = []
    for folder in sorted(path for path in results.iterdir() if path.is_dir()):
        resolution = ""
        if (path := folder / "verdicts.json").exists():
            resolution = json.loads(path.read_text()).get("resolution", "")
            found += of_verdicts(path, known)
        if (path := folder / "claims.json").exists():
            found += of_claims(path, known, resolution)
        for path in sorted(folder.glob("ledger_*.json")):
            found += of_ledger(path, known, resolution)
        if (path := folder / "shocks.json").exists():
            found += of_shocks(path, known, resolution)
    return found


def write() -> Path:
    """Write the page of the kept results, ``docs/validation.md``. Raises ``InputError``."""
    known = claims(DOCS / "claims.toml")
    text = validation_page.page(
        known, rows(DOCS / "results", known), *validation_page.groups(DOCS / "claims.toml", known)
    )
    path = DOCS / "validation.md"
    archive.write_text(path, text)
    return path


def main() -> int:
    """Exit code 0, or 2 for bad input."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    try:
        print(write())
    except InputError as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
