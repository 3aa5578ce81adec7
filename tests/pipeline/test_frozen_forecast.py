"""A frozen forecast is scored as it stands, and nothing else is."""

import shutil
from pathlib import Path

import numpy as np
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


def test_skill_is_one_less_the_ratio_of_the_scores():
    """Against the forecast's own columns it is what their scores say; against itself it is 0."""
    observed = {"mass": (4.0e9, 2e7), "a_over_b": 1.3, "class": "crater"}
    found = bolide.score(FORECAST, observed, against=FORECAST)
    assert found["skill_makadia"].tolist() == [0.0, 0.0, 0.0, 0.0]
    flat = bolide.score(FORECAST, observed, column="flat")
    assert found.loc["mass", "skill_flat"] == 1.0 - found.loc["mass", "crps"] / flat.loc["mass", "crps"] < 0.0
    assert found.loc["class", "skill_flat"] == 1.0 - found.loc["class", "brier"] / flat.loc["class", "brier"]
    # a/b is a condition there, so it has no skill against that column, nor have both together
    assert np.isnan(found.loc[["a_over_b", "jointly"], "skill_all_known"].to_numpy(float)).all()
    assert np.isfinite(found.loc["mass", "skill_all_known"])


def test_joint_skill_measures_both_in_the_same_lengths():
    """The reference's own spread would forgive a wide reference: its energy is taken in the forecast's lengths."""
    observed = {"mass": 2.5e9, "hollow": 117.0}
    found = bolide.score(FORECAST, observed, against=FORECAST.with_name("hera_references.toml"))
    draws = [archive.read(FORECAST.with_name(f"{name}_draws.h5"))[0] for name in ("hera_v0", "hera_references")]
    ours, theirs = (
        np.column_stack([one[f"{column}/{name}"] for name in observed]).astype(float)
        for one, column in zip(draws, ("makadia", "published"))
    )
    seen = np.array(list(observed.values()))
    ratio = scores.energy(ours, seen) / scores.energy(theirs, seen, ours.std(axis=0))
    assert found.loc["jointly", "skill_published"] == pytest.approx(1.0 - ratio)
    assert np.isnan(found.loc["jointly", "skill_scaling_law"])  # it has no mass
    # of three quantities the reference has two: together they are another thing
    more = bolide.score(FORECAST, observed | {"deepest": 31.0}, against=FORECAST.with_name("hera_references.toml"))
    assert np.isnan(more.loc["jointly", "skill_published"]) and np.isfinite(more.loc["jointly", "skill_prior"])


def test_a_file_that_is_no_forecast_is_told(tmp_path):
    for name in ("x.toml", "x_draws.h5"):
        shutil.copy(FORECAST.with_name("hera_v0_draws.h5"), tmp_path / name)
    (tmp_path / "x.toml").write_text("name = 1\n")
    with pytest.raises(InputError, match=r"x\.toml is no forecast: it lacks headline, columns, quantity"):
        bolide.score(tmp_path / "x.toml", {"mass": 1.0})
    (tmp_path / "x.toml").write_text("name = \n")
    with pytest.raises(InputError, match=r"x\.toml cannot be read"):
        bolide.score(tmp_path / "x.toml", {"mass": 1.0})
