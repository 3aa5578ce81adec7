"""The page of all claims holds every claim and every verdict, and what its command reads is checked."""

import importlib.util
import json
from pathlib import Path

import pytest

from matter.errors import InputError
from studies import validation_page

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("validation_table", ROOT / "studies" / "validation_table.py")
assert spec is not None and spec.loader is not None
table = importlib.util.module_from_spec(spec)
spec.loader.exec_module(table)

CLAIMS = ROOT / "docs" / "claims.toml"
ROOMS = {"sph": ("V01", "V02")}
KNOWN = {
    "V01": table.Claim("V01", "a shock", "1 GPa", "1 %", "cases"),
    "V02": table.Claim("V02", "another", "2 GPa", "1 %", "cases"),
}


def left(results: Path, **row: str) -> None:
    """A result folder with one verdict."""
    (results / "shocks").mkdir(exist_ok=True)
    (results / "shocks" / "verdicts.json").write_text(json.dumps({"resolution": "50 layers", "verdicts": [row]}))


def test_the_page_of_the_kept_results_holds_every_claim_and_every_row(tmp_path, monkeypatch):
    for name in ("claims.toml", "results"):
        (tmp_path / name).symlink_to(ROOT / "docs" / name)
    monkeypatch.setattr(table, "DOCS", tmp_path)
    page, known = table.write().read_text(), table.claims(CLAIMS)
    assert [key for key in known if f"| {key} |" not in page] == []
    found = table.rows(ROOT / "docs" / "results", known)
    assert [row.id for row in found if f"(results/{row.folder}/README.md)" not in page] == []


def test_every_kind_of_source_reaches_the_page(tmp_path):
    left(tmp_path, id="V01", ours="0.8 | 0.9 GPa", verdict="not met", why="too coarse")
    ledger = [{"name": "V02", "value": 0.5, "limit": 0.1, "verdict": "waived", "unit": "1", "note": "it rings"}]
    (tmp_path / "shocks" / "ledger_quick.json").write_text(json.dumps(ledger))
    found = table.rows(tmp_path, KNOWN)
    assert [(row.id, row.verdict, row.resolution) for row in found] == [
        ("V01", "not met", "50 layers"),
        ("V02", "not met", "quick; 50 layers"),
    ]
    causes = [validation_page.Cause("Too few", "Particles are coarse.", ("V01", "V02"))]
    text = validation_page.page(KNOWN, found, ROOMS, causes)
    assert (
        r"| V01 | a shock | 1 GPa | 0.8 \| 0.9 GPa | 1 % | **not met** | 50 layers | too coarse | "
        r"[shocks](results/shocks/README.md) |" in text
    )
    assert "| cases | 0 | 0 | 2 | 0 | 0 | 0 | 2 |" in text and "| sph | 0 | 0 | 2 | 0 | 0 | 0 | 2 |" in text
    by_cause, every = text.index("### Too few"), text.index("## Every claim")
    assert text.index("| sph |") < by_cause < text.index("| V01 | a shock | 1 GPa | 0.8") < every


def test_a_ledgers_own_wider_limit_meets_no_published_one(tmp_path):
    (tmp_path / "shocks").mkdir()
    rows = [
        {"name": "V01", "value": value, "limit": 2.9, "verdict": "pass", "unit": "1", "note": "weight alone"}
        for value in (0.2, 0.009)
    ]
    (tmp_path / "shocks" / "ledger_quick.json").write_text(json.dumps(rows))
    found = table.rows(tmp_path, {"V01": KNOWN["V01"]._replace(tolerance="<= 0.01")})
    assert [row.verdict for row in found] == ["not met", "met"]
    assert found[0].why == "within the ledger's own limit, 2.9: weight alone"


def test_a_claim_nobody_looked_at_is_not_run():
    text = validation_page.page(KNOWN, [], ROOMS, [])
    assert "| V02 | another | 2 GPa | - | 1 % | not run |" in text
    assert "**0 are met**" in text and "| V02 | another | 2 GPa | 1 % |" in text


@pytest.mark.parametrize("verdict,causes", [("not met", ()), ("met", ("V01",)), ("in part", ("V02",))])
def test_what_is_not_met_has_a_cause_and_nothing_else_has_one(verdict, causes):
    found = [table.Row("V01", "shocks", "1 GPa", verdict)]
    with pytest.raises(InputError, match="V0"):
        validation_page.page(KNOWN, found, ROOMS, [validation_page.Cause("why", "so", causes)])


@pytest.mark.parametrize(
    "text,said",
    [
        ('[rooms]\nsph = ["V01"]\n', "not in exactly one room: V02"),
        ('[rooms]\nsph = ["V01-V02"]\ndem = ["V02"]\n', "not in exactly one room: V02"),
        ('[rooms]\nsph = ["V01-V03"]\n', "no claim 'V03'"),
        ('cause = [{title = "a", words = "b", claims = ["V01", "V01"]}]\n[rooms]\nsph = ["V01-V02"]\n', "two causes"),
    ],
)
def test_rooms_and_causes_that_do_not_fit_are_refused(tmp_path, text, said):
    (tmp_path / "claims.toml").write_text(text if "cause" in text else "cause = []\n" + text)
    with pytest.raises(InputError, match=said):
        validation_page.groups(tmp_path / "claims.toml", KNOWN)


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
