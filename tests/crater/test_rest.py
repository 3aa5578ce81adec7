"""Whether a crater has come to rest, and what a column is called if it has not."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from crater.results import column_labels, rest
from crater.results.series import Moment

T = np.linspace(10.0, 1000.0, 40)


def series(depth, diameter, stage="sph", spacing=10.0):
    """Moments with these depths and diameters [m]; the volume is that of their paraboloid."""
    made = []
    for t, d, D in zip(T, np.broadcast_to(depth, T.shape), np.broadcast_to(diameter, T.shape)):
        values = {"depth_m": d, "diameter_apparent_m": D, "volume_m3": np.pi / 8 * D**2 * d}
        quantities = {
            name: SimpleNamespace(value=float(value) if np.isfinite(value) else None) for name, value in values.items()
        }

        class Measured(dict):
            ground = SimpleNamespace(columns=SimpleNamespace(spacing=np.array([spacing])))

        made.append(Moment(stage, float(t), Path("x"), Measured(quantities)))
    return made


def test_a_crater_that_stands_still_is_settled():
    wobble = 1.0 + 0.005 * (-1.0) ** np.arange(len(T))
    assert rest.of_series(series(300.0 * wobble, 2000.0 * wobble)).settled


def test_one_that_grows_is_not():
    """V ~ t^0.4: 1 - 0.822^0.4 = 7.5 % from the first snapshot in the last fifth (822 of 1000 s)."""
    grown = (T / 1000.0) ** (0.4 / 3.0)
    found = rest.of_series(series(300.0 * grown, 2000.0 * grown))
    assert not found.settled and found.state == "still growing"
    assert "volume +8%" in found.reason


def test_one_that_collapses_is_moving():
    found = rest.of_series(series(300.0 - 0.2 * T, 2000.0 + 0.1 * T))
    assert not found.settled and found.state == "still moving" and "depth -" in found.reason


def test_scatter_and_less_than_a_tenth_of_a_spacing_are_no_motion():
    rng = np.random.default_rng(3)
    assert rest.of_series(series(300.0 * (1 + 0.02 * rng.normal(size=len(T))), 2000.0)).settled
    assert rest.of_series(series(5.0 - 0.004 * T, np.nan, spacing=100.0)).settled
    assert not rest.of_series(series(5.0 - 0.004 * T, np.nan, spacing=1.0)).settled


def test_too_few_snapshots_cannot_tell():
    found = rest.of_series(series(300.0, 2000.0)[:2])
    assert not found.settled and found.state == "not known to be at rest"


@pytest.mark.parametrize(
    ("report", "settled"), [({"still": True}, True), ({"still": False, "profile_change_radii": 0.31}, False)]
)
def test_grains_are_at_rest_when_the_collapse_says_so(tmp_path, report, settled):
    path = tmp_path / "stage_report.json"
    path.write_text(json.dumps(report))
    found = rest.of_grains(path, series(300.0 - 0.2 * T, 2000.0, "dem"))
    assert found.settled == settled
    if not settled:
        assert "0.31 grain radii" in found.reason and found.as_dict() == {
            "settled": False,
            "state": "still moving",
            "settled_reason": found.reason,
        }


def entry(time, depth=1.0, **more):
    return {
        "depth_m": {"value": depth, "sigma": 0.1, "unit": "m"},
        "time_s": {"value": time, "sigma": 0.0, "unit": "s"},
        **more,
    }


def test_both_maxima_are_named_with_their_times():
    transient = {"at_maximum_volume": entry(420.0, stage="sph"), "at_maximum_depth": entry(360.0, stage="sph")}
    found = column_labels.columns(
        {"transient": transient, "final": entry(3840.0, settled=True, **{"from": "settled grains"})}
    )
    assert [label.line for label, _ in found] == [
        "transient, maximum volume, 7.0 min, SPH", "transient, maximum depth, 6.0 min, SPH",
        "final, 64.0 min, settled grains"]  # fmt: skip
    transient["at_maximum_depth"] = entry(420.0, stage="sph")
    assert [label.line for label, _ in column_labels.columns({"transient": transient})] == [
        "transient, maximum volume and depth, 7.0 min, SPH"
    ]


def test_what_still_grows_is_the_last_snapshot_and_stands_there_once():
    transient = {
        "at_maximum_volume": entry(6.0, stage="sph", growing=True),
        "at_maximum_depth": entry(4.0, stage="sph", growing=False),
    }
    last = entry(6.0, settled=False, state="still growing", **{"from": "all-SPH late stage"})
    lines = [label.line for label, _ in column_labels.columns({"transient": transient, "final": last})]
    assert lines == ["transient, maximum depth, 4 s, SPH", "last snapshot, still growing, 6 s, all-SPH late stage"]
    lines = [label.line for label, _ in column_labels.columns({"transient": transient, "final": {"reason": "none"}})]
    assert lines[0] == "last snapshot, volume still growing, 6 s, SPH" and not any("final" in line for line in lines)


@pytest.mark.parametrize(("time", "state"), [(1200.0, ""), (1300.0, "cut by end_time")])
def test_a_crater_that_end_time_cut_is_not_final(tmp_path, time, state):
    """The series ends at 1000 s and stands still; T is good to a fifth."""
    report = tmp_path / "stage_report.json"
    report.write_text(json.dumps({"expected_growth_s": time}))
    found = rest.of_shock(report, series(300.0, 2000.0))
    assert found.state == state and found.settled == (not state)
    assert state == "" or ("16.7 min" in found.reason and "21.7 min" in found.reason)


def test_without_an_expected_time_the_series_decides(tmp_path):
    assert rest.of_shock(tmp_path / "stage_report.json", series(300.0, 2000.0)).settled
