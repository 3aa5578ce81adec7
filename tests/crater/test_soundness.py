"""Cautions and balances of a run: resolution, peak pressures, conservation against stated scales, the collapse."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from crater.ejecta.ballistic import Ballistic
from crater.measures.measure import Measures, Quantity
from crater.pages import report
from crater.results import handover, series, soundness
from crater.results.findings import Findings, GrainFindings, LastCrater, ShockFindings, judged
from matter.wording.crater_measures import UNITS
from sph.boundary import external_budget

SHOCK = {
    "projectile": {"particles": 37, "particles_per_radius": 2.07, "momentum_kg_m_s": 1e6},
    "peak_pressure_Pa": 558e9,
    "peak_pressure": {
        "projectile_largest_Pa": 558e9, "target_largest_Pa": 300e9, "projectile_half_Pa": 180e9,
        "projectile_nine_tenths_Pa": 90e9,
        "planar_limit_Pa": 215e9, "planar_speed_m_s": 12e3,
    },
    "removed_angular_momentum_over_projectile": 0.1036,
    "edges": None,
}  # fmt: skip
COLLAPSE = {
    "overlap_max": 0.2354,
    "overlap_warning": 0.15,
    "dissipated_returning_J": 1.77e23,
    "energy_error": -4e-4,
    "momentum_error": 2e-15,
}
AXES = "xyz"


def run_with(path, shock=None, collapse=None, rows=(), more=()):
    for folder, content in (("2_sph", shock), ("5_dem", collapse)):
        (path / folder).mkdir(parents=True, exist_ok=True)
        if content is not None:
            (path / folder / "stage_report.json").write_text(json.dumps(content))
    if rows:
        names = ["kinetic_J", "total_J", "mass_kg", *more]
        names += [
            f"{kind}_{axis}" for kind in ("momentum", "angular_momentum", "removed_angular_momentum") for axis in AXES
        ]
        lines = [",".join(names), *(",".join(str(row.get(name, 0.0)) for name in names) for row in rows)]
        (path / "2_sph" / "history.csv").write_text("\n".join(lines) + "\n")
    return path


def test_too_few_particles_and_too_much_pressure_are_cautions(tmp_path):
    found = soundness.facts(run_with(tmp_path, SHOCK))
    assert found["peak_over_planar_limit"] == pytest.approx(558 / 215)
    few, much, removed = found["cautions"]
    assert "2.1 particles per radius (37 in all)" in few and "not resolved" in few
    assert "558 GPa, is 2.6 times the planar limit of 215 GPa" in much and "higher than any shock" in much
    assert "10.4% of the projectile's angular momentum" in removed


@pytest.mark.parametrize(("of_all", "said"), [(0.0981, True), (2e-6, False)])
def test_what_was_removed_is_held_against_a_bodys_own_rotation_too(tmp_path, of_all, said):
    shock = {**SHOCK, "removed_angular_momentum_over_projectile": 269.0, "removed_angular_momentum_over_all": of_all}
    cautions = soundness.facts(run_with(tmp_path, shock))["cautions"]
    assert any("angular momentum" in words for words in cautions) == said


@pytest.mark.parametrize(
    ("ratio", "said"),
    [(0.5, "smears the first shock out"), (0.79, "smears"), (0.81, ""), (1.19, ""), (1.21, "higher than any shock")],
)
def test_where_a_peak_pressure_is_out_of_range(tmp_path, ratio, said):
    shock = {
        **SHOCK,
        "peak_pressure_Pa": ratio * 215e9,
        "removed_angular_momentum_over_projectile": 0.0,
        "projectile": {"particles_per_radius": 5.0},
    }
    cautions = soundness.facts(run_with(tmp_path, shock))["cautions"]
    assert len(cautions) == bool(said) and all(said in words for words in cautions)


def test_warnings_of_the_shock_stage_are_cautions(tmp_path):
    assert soundness.facts(run_with(tmp_path, {"warnings": ["The flow is viscous."]}))["cautions"] == [
        "The flow is viscous"
    ]


@pytest.mark.parametrize(("wide", "said"), [(84.0, "ends at 1.87 radii of the settled crater"), (135.1, "")])
def test_a_bed_that_ends_within_the_blanket_is_a_caution(tmp_path, wide, said):
    radii = soundness.bed_radii({"frame": "plane", "domain": {"radius_m": wide}}, 90.0)
    found = soundness.facts(tmp_path, radii)
    assert found["bed_radii"] == pytest.approx(wide / 45.0)
    assert len(found["cautions"]) == bool(said) and all(said in words for words in found["cautions"])


def test_radii_of_a_cap_and_of_a_whole_body():
    cap = {"frame": "sphere", "domain": {"datum_radius_m": 2e6, "cone_half_angle_rad": 0.75}}
    assert soundness.bed_radii(cap, 600e3) == pytest.approx(5.0)
    assert soundness.bed_radii({"frame": "solid", "domain": {"radius_m": 80.0}}, 40.0) is None
    assert soundness.bed_radii({"frame": "plane"}, 40.0) is None


def test_overlaps_and_returning_ejecta_are_cautions_by_number_or_by_note(tmp_path):
    overlap, lost = soundness.facts(run_with(tmp_path / "a", collapse=COLLAPSE))["cautions"]
    assert "0.235 radii, more than the 0.15" in overlap and "1.77 × 10²³ J" in lost
    notes = {
        "notes": [
            "Ocean grains have no friction.",
            "Overlaps reached 0.235 radii (warning above 0.15).",
            "Returning ejecta lost 1.8e+23 J.",
        ]
    }
    assert soundness.facts(run_with(tmp_path / "b", collapse=notes))["cautions"] == [
        note.rstrip(".") for note in notes["notes"][1:]
    ]
    fine = {**COLLAPSE, "overlap_max": 0.1, "dissipated_returning_J": 0.0}
    assert soundness.facts(run_with(tmp_path / "c", collapse=fine))["cautions"] == []


FIRST = {"kinetic_J": 1e10, "total_J": 1e10, "mass_kg": 5e9, "momentum_z": -1e6}


def test_a_vertical_impact_on_flat_ground_divides_by_no_zero(tmp_path):
    """No angular momentum at the start; the edges take 42 % of the momentum, and that is its own row."""
    last = {**FIRST, "total_J": 0.99e10, "momentum_z": -0.58e6, "angular_momentum_x": 5.54e4}
    run = run_with(tmp_path, {**SHOCK, "edges": {"sides": "quiet", "floor": "fixed"}}, rows=[FIRST, last])
    rows = dict(soundness.conservation_rows(run, 1e6, (600.0, "the transient crater's apparent radius")))
    edge, spin = (next(name for name in rows if name.startswith(kind)) for kind in ("linear", "angular"))
    assert "that the edges took (sides quiet, floor fixed), net of the weight" in edge and rows[edge] == "42.000%"
    assert "the transient crater's apparent radius (600 m)" in spin and rows[spin] == "0.009%"
    assert rows["total energy, at the end, over the initial kinetic energy"] == "-1.000%"


def test_what_weight_and_edges_gave_is_taken_out(tmp_path):
    first = FIRST | {name: 0.0 for name in external_budget.COLUMNS}
    last = first | {"total_J": 0.99e10, "momentum_z": -0.58e6}
    last |= {"outside_energy_J": -0.98e8, "outside_momentum_z": 0.42e6 - 3e-9, "outside_angular_momentum_y": 6e5}
    edges = {"edges": {"sides": "quiet", "floor": "quiet"}}
    run = run_with(tmp_path, {**SHOCK, **edges}, rows=[first, last], more=tuple(external_budget.COLUMNS))
    rows = dict(soundness.conservation_rows(run, 1e6, (600.0, "the radius")))
    assert rows["total energy, at the end, over the initial kinetic energy"] == "-0.020%"
    assert rows["energy that the edges took (sides quiet, floor quiet), the same way"] == "0.980%"
    left = rows["linear momentum, change beyond what edges and weight gave, over the projectile's"]
    assert left == "3 × 10⁻¹⁵"
    assert next(value for name, value in rows.items() if name.startswith("angular")) == "0.100%"


def test_on_a_body_momentum_is_conserved_and_what_was_removed_has_its_row(tmp_path):
    last = {**FIRST, "momentum_z": -1e6 * (1 + 7e-13), "removed_angular_momentum_y": 6.6e10}
    run = run_with(tmp_path, SHOCK, rows=[FIRST, last])
    rows = dict(soundness.conservation_rows(run, 1e6, (1e6, "the target's radius")))
    assert rows["linear momentum, change over the projectile's"] == "7 × 10⁻¹³"
    assert next(value for name, value in rows.items() if "correction of the tree's forces removed" in name) == "6.600%"
    assert rows["the same over the projectile's angular momentum about the target's centre"] == "10.360%"
    assert not any("edges" in name for name in rows)


def test_rows_of_resolution_and_collapse(tmp_path):
    run = run_with(tmp_path, SHOCK, COLLAPSE)
    (tmp_path / "5_dem" / "history.csv").write_text("kinetic_J,dissipated_returning_J\n1e24,0\n1e20,1.77e23\n")
    rows = dict(soundness.resolution_rows(run))
    assert rows["projectile: particles per radius"] == "2.07" and rows["projectile: particles"] == "37"
    assert rows["largest pressure of a single particle of the projectile"] == "558 GPa (2.60 of the planar limit)"
    assert rows["pressure that half of the projectile's mass reached"] == "180 GPa (0.84 of the planar limit)"
    rows = dict(soundness.collapse_rows(run))
    assert rows["largest overlap of two grains, in radii (warning above 0.15)"] == "0.235"
    assert (
        rows["energy taken from returning ejecta by scaled contacts, over the kinetic energy handed over"] == "17.700%"
    )


def test_a_run_without_reports_says_nothing(tmp_path):
    assert (
        soundness.facts(tmp_path) == {}
        and soundness.resolution_rows(tmp_path) == []
        and soundness.collapse_rows(tmp_path) == []
    )
    assert soundness.conservation_rows(tmp_path, 1.0, (1.0, "its radius")) == []


@pytest.mark.parametrize(("fine", "verdict"), [(2.07, True), (4.97, True), (4.99, False), (5.0, False), (None, False)])
def test_a_projectile_of_fewer_than_five_particles_per_radius_is_not_resolved(tmp_path, fine, verdict):
    shock = {"projectile": {"particles": 37, "particles_per_radius": fine}} if fine else {"warnings": ["w"]}
    found = soundness.facts(run_with(tmp_path, shock))
    assert ("not_resolved" in found) == verdict
    assert not verdict or "fewer than 5" in found["not_resolved"]


def test_the_manual_names_the_limit():
    page = (Path(__file__).parents[2] / "docs" / "site" / "understand" / "resolution.md").read_text()
    assert f"| particles per projectile radius | {soundness.FEWEST_PER_RADIUS:g} for the flow" in page
    assert "NOT RESOLVED" in page


def test_what_is_not_resolved_has_no_errors_but_those_with_the_chain():
    quantities = {
        "depth_m": Quantity(20.7123, 0.4, "m", parts={"azimuth": 0.4}),
        "diameter_apparent_m": Quantity(207.09, 3.0, "m", parts={"azimuth": 0.9, "chain": 2.9}),
        "volume_m3": Quantity(None, None, "m^3", "none"),
    }
    measures = Measures(quantities, None, None, None)
    crater = LastCrater(measures, 1.0, "x", Path("x"))
    grains = GrainFindings((), crater, None, {})
    findings = judged(Findings(SimpleNamespace(), None, grains), {"not_resolved": "2 particles"})
    left = findings.settled_grains.measures.quantities
    assert left["depth_m"].sigma is None and left["depth_m"].value == 20.7123
    assert left["diameter_apparent_m"].sigma == 3.0
    assert report.shown(left["depth_m"]) == "20.7 m" and report.shown(left["diameter_apparent_m"]) == "207.1 ± 3.0 m"
    assert judged(findings, {}).settled_grains is findings.settled_grains


def test_no_sentence_or_table_of_an_unresolved_run_has_an_error_of_its_own():
    """The crater right before and after the handover, and the ballistic one: as the table of measures."""
    quantities = {name: Quantity(20.7123, 0.4, UNITS[name], parts={"azimuth": 0.4}) for name in handover.NAMES}
    moment = series.Moment("sph", 0.3, Path("x"), Measures(quantities, None, None, None))
    shock = ShockFindings((), {"volume": moment}, (), 1.0, Path("x"), None, None, None, {}, handed=moment)
    grains = GrainFindings((), None, None, {}, began=moment)
    flown = Ballistic(None, quantities, 0.0, 0.3, "x")
    whole = Findings(SimpleNamespace(), shock, grains, ballistic=flown)
    found = judged(whole, {"not_resolved": "2 particles"})
    rows = handover.changes(*found.handed_over)
    assert set(rows) == set(handover.NAMES)
    assert all(one.sigma is None for row in rows.values() for one in row)
    assert all(one.sigma is None for one in found.ballistic.measures.values())
    assert judged(whole, {}).ballistic is flown and judged(whole, {}).shock is shock


@pytest.mark.parametrize(("growing", "ratio"), [((), "0.50"), (("volume",), "")])
def test_a_crater_that_still_grows_has_no_ratio_to_the_laws(growing, ratio):
    moment = SimpleNamespace(value=lambda _: 50.0, measures={"diameter_apparent_m": Quantity(50.0, 1.0, "m")})
    laws = {
        "diameter_m": {"zahnle_2003": 100.0},
        "final_rim_diameter_m": {},
        "range_m": [100.0, 100.0],
        "range_of": ["zahnle_2003", "zahnle_2003"],
        "formation_time_s": 3.0,
    }
    findings = SimpleNamespace(
        compared=SimpleNamespace(scaling=laws),
        transient={"volume": moment},
        growing=growing,
        at_end_of_shock=lambda moment: False,
    )
    found = report._scaling(findings)
    text = f"{found['rows']} {found['here']}"
    assert (ratio in text) if ratio else ("0.50" not in text and "still growing" in text)
