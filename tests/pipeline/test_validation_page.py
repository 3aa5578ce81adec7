"""docs/validation.md is what its command makes, and what the command reads is checked."""

import importlib.util
import json
from pathlib import Path

import pytest

from matter.errors import InputError

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("validation_table", ROOT / "studies" / "validation_table.py")
assert spec is not None and spec.loader is not None
table = importlib.util.module_from_spec(spec)
spec.loader.exec_module(table)

KNOWN = {
    "V01": table.Claim("V01", "a shock", "1 GPa", "1 %", "cases"),
    "V02": table.Claim("V02", "another", "2 GPa", "1 %", "cases"),
}


def left(results: Path, **row: str) -> None:
    """A result folder with one verdict."""
    (results / "shocks").mkdir(exist_ok=True)
    (results / "shocks" / "verdicts.json").write_text(json.dumps({"resolution": "50 layers", "verdicts": [row]}))


def test_the_page_is_what_the_command_makes():
    known = table.claims(ROOT / "docs" / "claims.toml")
    assert (
        table.page(known, table.rows(ROOT / "docs" / "results", known))
        == (ROOT / "docs" / "validation.md").read_text()
    )


def test_every_kind_of_source_reaches_the_page(tmp_path):
    left(tmp_path, id="V01", ours="0.8 | 0.9 GPa", verdict="not met", why="too coarse")
    ledger = [{"name": "V02", "value": 0.5, "limit": 0.1, "verdict": "waived", "unit": "1", "note": "it rings"}]
    (tmp_path / "shocks" / "ledger_quick.json").write_text(json.dumps(ledger))
    found = table.rows(tmp_path, KNOWN)
    assert [(row.id, row.verdict, row.resolution) for row in found] == [
        ("V01", "not met", "50 layers"),
        ("V02", "not met", "quick; 50 layers"),
    ]
    text = table.page(KNOWN, found)
    assert (
        r"| V01 | a shock | 1 GPa | 0.8 \| 0.9 GPa | 1 % | **not met** | 50 layers | too coarse | "
        r"[shocks](results/shocks/README.md) |" in text
    )
    assert "| cases | 0 | 0 | 2 | 0 | 0 | 0 | 2 |" in text


def test_a_claim_nobody_looked_at_is_not_run():
    assert "| V02 | another | 2 GPa | - | 1 % | not run |" in table.page(KNOWN, [])


@pytest.mark.parametrize(
    "row",
    [
        {"id": "V99", "verdict": "met"},
        {"id": "V01", "verdict": "passed"},
        {"id": "V01", "verdict": "met", "because": "x"},
    ],
)
def test_a_wrong_row_is_refused(tmp_path, row):
    left(tmp_path, ours="1 GPa", **row)
    with pytest.raises(InputError):
        table.rows(tmp_path, KNOWN)


def test_notes_of_old_ledgers_are_in_readable_units():
    assert table.readable_note("328 cells of 8.391e+04 ... 3.356e+05 m") == "328 cells of 83.9 km to 336 km"
    assert (
        table.readable_note("source 1.2057e+16 m^3, bed 1.2022e+16 m^3")
        == "source 12.06 million km3, bed 12.02 million km3"
    )
    for other in (
        "sum m|v| = 5.0119e+22 kg m/s",
        "sum m|r||v| = 1.0214e+29 kg m^2/s, about the origin",
        "source 1.4213e+25 J",
    ):
        assert table.readable_note(other) == other
