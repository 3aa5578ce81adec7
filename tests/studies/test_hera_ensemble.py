"""A forecast that stands on an ensemble: on members made by known laws it finds those laws again."""

import csv
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from pipeline.case import read as cases
from pipeline.sweeps import draws
from pipeline.sweeps.sweep import read_table
from studies import hera_ensemble, hera_forecast
from studies import hera_forecast_files as files

WHOLE, MEMBERS, SCATTER = 20, 32, 0.02
ENSEMBLE = Path(__file__).resolve().parents[2] / "cases" / "dart_dimorphos" / "ensemble.toml"


def laws(rho, friction, pull):
    """beta - 1 and width [m]: powers of the density, the friction and the cohesion."""
    rough = np.tan(np.radians(friction)) / math.tan(math.radians(31.0))
    return 1.7 * (rho / 2400.0) ** 0.5 * rough**-0.9, 110.0 * (rho / 2400.0) ** -0.45 * (1.0 + pull) ** -0.05


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """The table of a sweep by the shipped priors, its measures by ``laws``; the last member failed."""
    prior = read_table(cases.read(ENSEMBLE, "quick").sweep, ()).prior
    rows, random = [], np.random.default_rng(5)
    for k, drawn in enumerate(draws.drawn(prior, MEMBERS, 1)):
        rho, friction, pull = (float(str(drawn[name]).split()[0]) for name in hera_ensemble.DRAWN[:3])
        excess, wide = laws(rho, friction, pull)
        excess, wide = np.array([excess, wide]) * np.exp(SCATTER * random.standard_normal(2))
        row = {"member": f"m{k:04d}", "state": "done", "class": "", **drawn}
        row |= {"shock/beta_normal": 1.0 + excess, "shock/escaping_mass_kg": 6e7 * (1540.0 / rho)}
        if k < WHOLE:
            row |= {
                "body/beta_normal": 1.0 + 0.95 * excess, "body/beta_along_track": 1.0 + 1.05 * excess,
                "body/escaping_mass_kg": 5e7 * (1540.0 / rho), "body/hollow_across_m": wide,
                "body/height_change_lowest_m": -0.28 * wide, "body/resurfaced_share": 1.4e-5 * wide**2,
                "body/axis_ratio_a_over_b": 1.023 + 0.08 * (wide / 110.0) ** 3.6, "body/axis_ratio_a_over_c": 1.51,
                "class": "reshaped" if wide > 118.0 else "crater",
            }  # fmt: skip
        rows.append(row)
    rows[-1]["state"] = "failed"
    file = tmp_path_factory.mktemp("members") / "members.csv"
    with file.open("w", newline="") as lines:
        writer = csv.DictWriter(lines, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)
    return file


@pytest.fixture(scope="module")
def given():
    return hera_forecast.inputs("draft_v1") | {"prior_samples": 8192}


@pytest.fixture(scope="module")
def made(table, given):
    return *hera_ensemble.fitted(table), hera_ensemble.samples(given, table)


def test_samples_follow_the_laws_of_the_members(made, given):
    """What came out over the factors is the law, within the members' own scatter."""
    _, _, samples = made
    f = hera_forecast.factors(given, {})
    excess, wide = laws(f["density"], f["friction"], f["cohesion"])
    other = f["spacecraft"] * f["blocks"] * f["numerics"]
    off = np.log((samples["beta_normal"] - 1.0) / (0.95 * excess * other))
    assert abs(np.mean(off)) < 0.01 and SCATTER / 2 < np.std(off) < 2.5 * SCATTER
    grown = f["spacecraft"] ** (given["spacecraft_power"] / 3.0) * f["hollow_model"]
    off = np.log(samples["hollow"] / (wide * grown))
    assert abs(np.mean(off)) < 0.01 and np.std(off) < 2.5 * SCATTER
    assert np.all(samples["a_over_c"] >= samples["a_over_b"])


def test_a_member_left_out_lies_where_the_others_say(made):
    found, by, _ = made
    assert found.failed == 1 and len(found.x) == MEMBERS - 1
    shock, chain = by["excess"].left_out
    assert (len(shock.truth), len(chain.truth)) == (MEMBERS - 1, WHOLE)
    assert SCATTER / 2 < shock.rms < 2.5 * SCATTER and chain.rms < 0.01
    assert 0.85 < np.mean(np.abs(shock.z) < 1.96) <= 1.0


def test_wide_hollows_are_reshaped_bodies(made):
    _, _, samples = made
    for low, high, least, most in ((60.0, 95.0, 0.0, 0.15), (140.0, 200.0, 0.85, 1.0)):
        inside = (samples["hollow"] > low) & (samples["hollow"] < high) & (samples["class"] < 2.0)
        assert least <= np.mean(samples["class"][inside] == 1.0) <= most


def test_the_observed_change_of_speed_weights_the_samples(made, given):
    """Lighter bodies are pushed more: by the momentum of the runs 2.65 mm/s is some density, and so the mean."""
    _, _, samples = made
    weight = hera_forecast.weights(samples, given, "flat")
    mean = float(weight @ samples["dv_observable"] / weight.sum())
    assert mean == pytest.approx(2.65e-3, abs=0.02e-3)
    free = float(np.corrcoef(np.log(samples["density"]), np.log(samples["dv_track"]))[0, 1])
    assert free < -0.7


def test_too_few_members_are_refused(table):
    found = hera_ensemble.members(table)
    with pytest.raises(ValueError, match="hollow: 11 members have it, 12 are needed"):
        wide = found.columns["body/hollow_across_m"].copy()
        wide[11:] = np.nan
        found.process("hollow", wide)


def test_the_priors_are_those_of_the_members(given):
    """What the samples draw of the parameters is what the sweep draws, but for the density, which is weighted."""
    sweep = read_table(cases.read(ENSEMBLE, "quick").sweep, ()).prior
    f = hera_forecast.factors(given, {})
    drawn = draws.drawn(sweep, 2048, 3)
    for ours, theirs in zip(hera_ensemble.PARAMETERS[1:], hera_ensemble.DRAWN[1:]):
        x = np.array([float(str(one[theirs]).split()[0]) for one in drawn])
        x *= 1e3 if ours == "crush_onset" else 1.0
        levels = [0.05, 0.5, 0.95]
        assert np.quantile(f[ours], levels) == pytest.approx(np.quantile(x, levels), rel=0.06), ours


def test_its_table_says_what_it_stands_on(table, given, monkeypatch):
    """Members, their classes and the processes' leave-one-out stand in the file of the forecast."""
    monkeypatch.setattr(hera_forecast, "FOLDER", table.parent)
    (table.parent / "draft_v1_inputs.toml").write_text("")
    own = {**given, "members": table.name}
    text = tomllib.loads(files.text(own, *hera_forecast.draws(own)))
    assert (text["ensemble"]["done"], text["ensemble"]["whole_chain"], text["ensemble"]["failed"]) == (
        MEMBERS - 1,
        WHOLE,
        1,
    )
    assert {one["measure"] for one in text["process"]} == set(hera_ensemble.fitted(table)[1])
    assert next(q for q in text["quantity"] if q["name"] == "hollow")["derivation"].startswith(
        "process of the members"
    )
