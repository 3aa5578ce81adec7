"""A frozen forecast is scored as it stands, and nothing else is."""

import shutil
from pathlib import Path

import pytest

import bolide
from bolide import InputError
from matter import scores
from matter.files import archive

FORECAST = Path(__file__).resolve().parents[2] / "forecasts" / "hera_v0.toml"


def test_what_was_observed_is_scored():
    table = bolide.score(FORECAST, {"mass": (2.6e9, 2e7), "hollow": 50.0, "class": "crater", "excited": False})
    assert 0.5 < table.loc["mass", "pit"] < 0.65 and table.loc["hollow", "pit"] < 0.01
    draws = archive.read(FORECAST.with_name("hera_v0_draws.h5"))[0]["makadia/mass"]
    assert table.loc["mass", "crps"] == pytest.approx(scores.crps(draws, 2.6e9), rel=0.01)
    assert table.loc["hollow", "interval_95"] > 1000.0  # far outside
    near = bolide.score(FORECAST, {"mass": (2.6e9, 2e7), "hollow": 117.0})
    assert 0.1 < near.loc["jointly", "energy"] < 1.0 < table.loc["jointly", "energy"] < 6.0
    assert table.loc["class", "brier"] == pytest.approx(0.7739**2 + 0.7329**2 + 0.041**2, abs=1e-3)
    assert table.loc["excited", "chance"] == pytest.approx(0.4021)
    flat = bolide.score(FORECAST, {"mass": 4.3e9}, column="flat")
    assert flat.loc["mass", "crps"] < bolide.score(FORECAST, {"mass": 4.3e9}).loc["mass", "crps"]


@pytest.mark.parametrize(
    "observed, column, words",
    [
        ({"dv_track": 2.6e-3}, "", "a condition of the column 'makadia'"),
        ({"a_over_b": 1.3}, "all_known", "a condition of the column 'all_known'"),
        ({"weight": 1.0}, "", "forecasts no 'weight'"),
        ({"mass": 2.6e9}, "other", "no column 'other'"),
        ({"mass": (2.6e9, -1.0)}, "", "no value with an error"),
        ({"class": "pit"}, "", "none of crater, reshaped, neither"),
    ],
)
def test_what_it_does_not_forecast_is_refused(observed, column, words):
    with pytest.raises(InputError, match=words):
        bolide.score(FORECAST, observed, column)


def test_a_changed_forecast_is_not_scored(tmp_path):
    for file in FORECAST.parent.iterdir():
        shutil.copy(file, tmp_path)
    bolide.score(tmp_path / FORECAST.name, {"mass": 2.6e9})
    with open(tmp_path / FORECAST.name, "a") as file:
        file.write("# wider\n")
    with pytest.raises(InputError, match="not what was frozen"):
        bolide.score(tmp_path / FORECAST.name, {"mass": 2.6e9})
    with pytest.raises(InputError, match="missing"):
        bolide.score(tmp_path / "hera_v9.toml", {"mass": 2.6e9})
