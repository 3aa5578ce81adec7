"""What acts on flat ground from outside is booked where it acts, so that its ledger closes."""

import csv
import json

import numpy as np
import pytest

from sph.boundary import external_budget
from sph.stepping import history
from tests.sph.stage_runs import finished_run
from tests.sph.test_ground import IMPACT, flat, settings

OBLIQUE = {"impact": IMPACT.model_copy(update={"angle_from_vertical": 0.7}), "numerics": "reconstructed"}


def finished(folder, **changes):
    """Report, first and last row of the history of a run."""
    out = finished_run(settings(**changes), folder)
    with open(out / "history.csv", newline="") as file:
        rows = [{k: float(v) for k, v in row.items() if k != "dt_limit"} for row in csv.DictReader(file)]
    return json.loads((out / "stage_report.json").read_text()), rows[0], rows[-1]


@pytest.mark.parametrize(
    "changes,energy",
    [
        (OBLIQUE | {"end_time": 6.0}, 1e-3),  # the layers take some 3 % of the projectile's energy by then
        (OBLIQUE | {"symmetry": "half", "end_time": 3.0}, 1e-3),
        ({"target": flat("block", gravity=9.81, width=24e3), "sides": "wall", "floor": "fixed"}, 1e-3),
    ],
    ids=["quiet", "half", "block"],
)
def test_what_weight_and_edges_gave_closes_the_ledger(changes, energy, tmp_path):
    report, first, last = finished(tmp_path, **changes)
    drift, scale = report["drift_over_projectile"], report["projectile"]
    assert drift["momentum_kg_m_s"] < 1e-12 and drift["energy_J"] < energy
    # without what was booked neither would hold
    moved = np.array([last[f"momentum_{a}"] - first[f"momentum_{a}"] for a in "xyz"])
    assert np.linalg.norm(moved) > 1e-3 * scale["momentum_kg_m_s"]
    assert report["edges"]["momentum_taken_kg_m_s"] == pytest.approx(-moved, abs=1e-12 * scale["momentum_kg_m_s"])
    if changes.get("end_time", 0.0) >= 3.0:
        assert first["total_J"] - last["total_J"] > 5.0 * energy * scale["kinetic_energy_J"]
        assert report["edges"]["energy_taken_J"] > 5.0 * energy * scale["kinetic_energy_J"]


def test_rows_of_a_run_begun_before_it_was_booked_are_taken_up(tmp_path):
    path = tmp_path / "history.csv"
    old = [name for name in history.COLUMNS if name not in external_budget.COLUMNS]
    rows = [{name: "sound" if name == "dt_limit" else float(k) for name in old} for k in range(2)]
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, old)
        writer.writeheader()
        writer.writerows(rows)
    taken = history.History(path)
    taken.restore(10)
    assert len(taken.rows) == 2 and all(np.isnan(taken.rows[0][name]) for name in external_budget.COLUMNS)
    taken.write()
    assert taken.drift() == {
        "energy_J": 1.0,
        "momentum_kg_m_s": pytest.approx(3**0.5),
        "angular_momentum_kg_m2_s": pytest.approx(3**0.5),
    }


def test_a_body_gets_nothing_from_outside(tmp_path):
    block = {"target": flat("half_sphere"), "edge_width": None, "relaxation_time": 0.0}
    report, _, last = finished(tmp_path, **block, end_time=0.3, sides="free")
    assert report["edges"] is None and report["drift_over_projectile"]["momentum_kg_m_s"] < 1e-12
    assert all(last[name] == 0.0 for name in last if name.startswith("outside_"))
