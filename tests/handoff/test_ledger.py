import json

import pytest
from pydantic import ValidationError

from handoff import ledger as ledgers
from handoff.ledger import LIMITS, WAIVABLE, Ledger
from handoff.report import text
from handoff.stage import Settings
from matter import ledger_words
from matter.errors import InputError

# the acceptance list of the project: name and limit
ACCEPTANCE = {
    "mass_total_rel": 1e-12, "momentum_linear_rel_after": 1e-10, "momentum_angular_rel_after": 1e-10, "momentum_local_rel": 0.05,
    "kinetic_energy_change_min": -0.1, "kinetic_energy_change_max": 0.01, "velocity_field_L2": 0.05, "velocity_direction_deg_mean": 5,
    "overlap_max_over_r": 0.01, "overlap_energy_over_KE": 0.001, "overlap_release_speed_over_median_flow": 0.01, "bulk_density_rel": 0.03,
    "cavity_hausdorff_over_r": 1.5, "cavity_volume_rel": 0.02, "cavity_radius_over_r_DEM_min": 5, "ejecta_mass_curve_rel": 0.02,
    "residual_pressure_over_bulk_modulus": 0.001, "elastic_over_kinetic_energy": 0.01, "t_handoff_over_T_crater_max": 0.1,
    "final_D_change_on_t_handoff_x2": 0.05, "final_d_change_on_t_handoff_x2": 0.1, "final_D_change_on_vcut_x2": 0.05,
    "final_D_change_on_alpha_x1.5": 0.03, "bed_residual_speed_over_sqrt_g_r": 0.001, "control_no_impact_run_drift_over_r": 0.05,
    "mass_raw_rel": 0.01, "momentum_linear_raw_rel": 0.01, "momentum_angular_raw_rel": 0.02, "correction_max_dv_over_rms_v": 0.05,
}  # fmt: skip


def test_every_row_of_the_acceptance_list_is_there():
    assert {name: limit.limit for name, limit in LIMITS.items()} == ACCEPTANCE
    book = Ledger()
    book.measure("mass_raw_rel", 0.5)
    book.complete()
    assert {row["name"] for row in book.rows} == set(ACCEPTANCE)
    assert all(set(row) == {"name", "value", "limit", "verdict", "unit", "note"} for row in book.rows)


@pytest.mark.parametrize(
    ("name", "value", "verdict"),
    [
        ("mass_raw_rel", 0.01, "pass"),
        ("mass_raw_rel", 0.0101, "fail"),
        ("kinetic_energy_change_min", -0.09, "pass"),
        ("kinetic_energy_change_min", -0.11, "fail"),
        ("kinetic_energy_change_max", -0.5, "pass"),
        ("cavity_radius_over_r_DEM_min", 5.1, "pass"),
        ("cavity_radius_over_r_DEM_min", 4.9, "fail"),
        ("velocity_field_L2", float("nan"), "fail"),
        ("velocity_field_L2", float("inf"), "fail"),
    ],
)
def test_verdicts(name, value, verdict):
    book = Ledger()
    book.measure(name, value)
    assert book[name]["verdict"] == verdict
    assert book.failures == ([name] if verdict == "fail" else [])


def test_a_waived_row_keeps_its_value_and_limit_and_gives_the_reason(tmp_path):
    name = WAIVABLE[0]
    book = Ledger({name: "the window is empty at this scale"})
    book.measure(name, 0.7, "a note")
    row = book[name]
    assert row["verdict"] == "waived" and row["value"] == 0.7 and row["limit"] == LIMITS[name].limit
    assert "the window is empty at this scale" in row["note"] and "a note" in row["note"]
    assert book.failures == []
    assert f"{0.7:.4g}" in text(book) and "0.1" in text(book)
    met = Ledger({name: "not needed"})
    met.measure(name, 0.05)
    assert met[name]["verdict"] == "pass"
    book.measure("velocity_field_L2", float("inf"))
    book.write(tmp_path / "ledger.json")
    json.loads((tmp_path / "ledger.json").read_text(), parse_constant=lambda word: pytest.fail(f"not JSON: {word}"))
    assert ledgers.read(tmp_path / "ledger.json").failures == ["velocity_field_L2"]


def test_only_three_limits_can_be_waived_and_only_with_a_reason():
    assert Settings(waive={name: "because" for name in WAIVABLE}).waive
    for waive, word in (
        ({"mass_raw_rel": "because"}, "binding"),
        ({"t_handof": "because"}, "unknown"),
        ({WAIVABLE[1]: "  "}, "no reason"),
    ):
        with pytest.raises(ValidationError, match=word):
            Settings(waive=waive)


def test_a_missing_ledger_is_a_clear_message(tmp_path):
    with pytest.raises(InputError, match="has the handoff run"):
        ledgers.read(tmp_path / "ledger.json")


def test_every_limit_has_a_name_in_words():
    assert set(LIMITS) <= set(ledger_words.WORDS)
    assert not any("_" in words for words in ledger_words.WORDS.values())
