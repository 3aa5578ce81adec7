"""Frozen forecasts: nobody has changed them, they say what their draws say, and the script makes them again."""

import hashlib
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from crater.bodies import classes
from matter.errors import InputError
from matter.files import archive
from studies import hera_forecast as forecast
from studies import hera_forecast_files as files
from studies import hera_references

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "forecasts"
FROZEN = {
    "hera_v0.toml": "6d43d461a0ce681ec4194b803f6b836601f568017543b4ac5983eef96b1f1230",
    "hera_v0_draws.h5": "13a04e66ce99d0f485ad453ef5b9e3da34a395a8128d18dfebe5d71ff709fcfb",
    "hera_v0_inputs.toml": "8738bc186bb81a286c0978712463618d4b675dfbc6d864ea3cc65aa9177e37e7",
    "hera_references.toml": "3c733ad5e4e7bc62de75a7eae2983fb86cdaad11445be2bf6f1f1d576924af44",
    "hera_references_draws.h5": "d609d73bcd8edf9ba97ca7bcb84101fb9738fb3af08595da2fb73ed2f70754b3",
}
"""Never to be changed: a later version is a new file, and a new row here."""
LEVELS = [0.025, 0.16, 0.5, 0.84, 0.975]


@pytest.fixture(scope="module")
def table() -> dict:
    return tomllib.loads((FOLDER / "hera_v0.toml").read_text())


@pytest.fixture(scope="module")
def drawn() -> dict[str, np.ndarray]:
    return archive.read(FOLDER / "hera_v0_draws.h5")[0]


@pytest.fixture(scope="module")
def remade() -> tuple[dict[str, forecast.Samples], dict[str, float]]:
    return forecast.draws(forecast.inputs())


def test_no_frozen_file_has_changed():
    found = {
        file.name: hashlib.sha256(file.read_bytes()).hexdigest()
        for file in FOLDER.glob("hera_*")
        if file.suffix != ".png"
    }
    assert found == FROZEN
    listed = dict(reversed(line.split()) for line in (FOLDER / "SHA256SUMS").read_text().splitlines())
    assert listed == FROZEN


def test_page_and_changelog_give_the_hashes():
    page, changes = (FOLDER / "README.md").read_text(), (ROOT / "CHANGELOG.md").read_text()
    assert [name for name, code in FROZEN.items() if code not in page] == []
    assert [name for name, code in FROZEN.items() if code not in changes and "inputs" not in name] == []


def test_the_page_shows_the_frozen_numbers(table):
    assert files.table(table) in (FOLDER / "README.md").read_text()


def test_quantiles_rise_and_are_those_of_the_draws(table, drawn):
    assert table["levels"] == LEVELS
    for quantity in table["quantity"]:
        for column in forecast.COLUMNS:
            assert sorted(set(quantity[column])) == quantity[column], (quantity["name"], column)
            found = np.quantile(drawn[f"{column}/{quantity['name']}"].astype(float), LEVELS)
            assert quantity[column] == pytest.approx(found, rel=1e-3), (quantity["name"], column)


def test_classes_sum_to_one_and_are_those_of_the_draws(table, drawn):
    for column in forecast.COLUMNS:
        given = table["class"][f"p_{column}"]
        assert sum(given.values()) == pytest.approx(1.0, abs=2e-4)
        found = np.bincount(drawn[f"{column}/class"], minlength=3) / table["draws"]
        assert list(given) == list(forecast.CLASSES)
        assert list(given.values()) == pytest.approx(found, abs=1e-4)
        assert table["rotation"][f"p_{column}"] == pytest.approx(drawn[f"{column}/excited"].mean(), abs=1e-4)


def test_mass_is_density_times_volume(drawn):
    for column in forecast.COLUMNS:
        mass = drawn[f"{column}/density"].astype(float) * drawn[f"{column}/volume"]
        np.testing.assert_allclose(drawn[f"{column}/mass"], mass, rtol=3e-7)  # single precision


def test_momentum_is_that_of_the_observed_push(drawn):
    """M dv = p c (1 + kappa (beta - 1)), and dv is what was observed, within its error and that of the reshaping."""
    fit = forecast.fits(forecast.inputs())
    for column in forecast.COLUMNS:
        one = {name: drawn[f"{column}/{name}"].astype(float) for name in ("mass", "beta_track", "dv_track")}
        given = fit["momentum"] * fit["cosine_track"] * one["beta_track"]
        np.testing.assert_allclose(one["mass"] * one["dv_track"], given, rtol=3e-7)
        assert 2.5e-3 < np.median(one["dv_track"]) < 2.7e-3


def test_made_again_it_is_the_same(table, drawn, remade):
    made, _ = remade
    again = files.arrays(made)
    assert set(again) == set(drawn)
    for name, entry in again.items():
        np.testing.assert_allclose(entry[0], drawn[name], rtol=1e-6, err_msg=name)
    text = tomllib.loads(files.text(forecast.inputs(), *remade))
    assert text == table


def test_a_frozen_file_is_never_written_over(tmp_path, monkeypatch, remade):
    monkeypatch.setattr(forecast, "draws", lambda given: remade)
    monkeypatch.setattr(files.hera_forecast_picture, "picture", lambda made, path: None)
    given = forecast.inputs()
    files.write(given, tmp_path)
    files.write(given, tmp_path)
    before = (tmp_path / "hera_v0.toml").read_bytes() + b"# a word\n"
    (tmp_path / "hera_v0.toml").write_bytes(before)
    with pytest.raises(InputError, match="frozen"):
        files.write(given, tmp_path)
    assert (tmp_path / "hera_v0.toml").read_bytes() == before


def test_the_runs_push_by_their_betas():
    """The along-track momentum balance gives each run's change of speed from its beta, and a power of the density
    through the first and the last run the one between them, which was run afterwards."""
    given = forecast.inputs()
    fit, runs = forecast.fits(given), given["run"]
    for run in runs:
        mass = fit["volume_m3"] * run["density_kg_m3"] - run["mass_left_kg"][0]
        push = fit["momentum"] * fit["cosine_track"] * run["beta_track"][0] / mass
        assert 1e3 * push == pytest.approx(-run["dv_track_mm_s"][0], rel=3e-3)
    ends = forecast.power(
        [runs[0]["density_kg_m3"], runs[2]["density_kg_m3"]], [-runs[k]["dv_track_mm_s"][0] for k in (0, 2)]
    )
    assert ends[0] * 1707.0 ** ends[1] == pytest.approx(2.72, abs=0.04)
    assert ends[1] == pytest.approx(-0.88, abs=0.01)


def test_the_change_of_shape_takes_the_period_that_its_formula_gives():
    """86 to 88 s from 177 x 174 x 116 m to a/b = 1.3, a/c = 1.6 (Nakano et al. 2024 simulate some 125 s)."""
    body = forecast.inputs()["body"]
    volume = np.array(np.pi / 6.0 * np.prod(body["axes_m"]))
    ratios = (1.3, 1.6), (177 / 174, 177 / 116)
    after, before = (forecast.elongation(*map(np.array, pair), volume, body) for pair in ratios)
    assert 2.0 * (after - before) * 3600.0 * body["period_h"] == pytest.approx(87.8, abs=0.5)


def test_laws_are_those_of_scipy():
    u = np.linspace(0.001, 0.999, 101)
    for law, values, exact in (
        ("normal", [3.0, 2.0], stats.norm(3.0, 2.0)),
        ("lognormal", [3.0, 0.5], stats.lognorm(0.5, scale=3.0)),
        ("uniform", [3.0, 5.0], stats.uniform(3.0, 2.0)),
        ("log_uniform", [3.0, 50.0], stats.loguniform(3.0, 50.0)),
        ("triangular", [0.0, 0.5, 2.0], stats.triang(0.25, scale=2.0)),
    ):
        np.testing.assert_allclose(forecast.valued(law, values, u), exact.ppf(u), rtol=1e-9, err_msg=law)
    cut = forecast.valued("normal", [3.0, 2.0], u, [2.0, 7.0])
    np.testing.assert_allclose(cut, stats.truncnorm(-0.5, 2.0, 3.0, 2.0).ppf(u), rtol=1e-9)
    with pytest.raises(ValueError, match="no law"):
        forecast.valued("cauchy", [0.0], u)


def test_a_column_is_weighted_by_its_prior_and_the_push_alone(remade):
    """Without the observed push the headline's density is the mixture that it says, cut at the samples' ends."""
    given = forecast.inputs()
    made = forecast.samples(given)
    weight = forecast.weights(made, given, "makadia", without="dv_track")
    rho = np.arange(900.0, 3300.0)
    mixture = 0.7 * stats.norm(1540, 220).pdf(rho) + 0.3 * stats.norm(2400, 300).pdf(rho)
    mean = weight @ made["density"] / weight.sum()
    assert mean == pytest.approx(rho @ mixture / mixture.sum(), rel=5e-3)
    assert min(remade[1].values()) > 4096  # more independent samples than draws


def test_the_class_is_that_of_the_project():
    """A hollow without cohesion is reshaped once it takes more than the widest crater's part of the surface."""
    body = forecast.inputs()["body"]
    assert body["widest_crater"] == pytest.approx(classes.LOCAL, rel=1e-9)
    volume = np.full(4, np.pi / 6.0 * np.prod(body["axes_m"]))
    sure = {"edge": np.zeros(4), "neither": np.array([0.0, 0.0, 0.0, 1.0])}
    found = forecast.classed(np.array([60.0, 118.0, 120.0, 60.0]), volume, sure, body)
    assert list(found) == [0, 0, 1, 2]


# -- references, and the trial on what is known


def test_references_made_again_are_the_same(tmp_path):
    hera_references.write(
        tmp_path, hera_references.NAME, hera_references.references(forecast.inputs()), hera_references.WORDS, True
    )
    for name in ("hera_references.toml", "hera_references_draws.h5"):
        assert hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() == FROZEN[name]


def test_references_are_what_they_say():
    """Percentiles of the mixtures, by hand; the prior is that of the headline; nothing changes in ``no_change``."""
    made = hera_references.references(forecast.inputs())
    rho = np.arange(900.0, 3300.0)
    mixture = 0.5 * stats.norm(1540, 220).pdf(rho) + 0.5 * stats.norm(2400, 300).pdf(rho)
    assert made["published"]["density"].mean() == pytest.approx(rho @ mixture / mixture.sum(), rel=0.02)
    assert np.quantile(made["published"]["hollow"], 0.84) == pytest.approx(50.0 * np.exp(0.3), rel=0.05)
    assert np.mean(made["published"]["class"] == 1) == pytest.approx(2.5 / 4.5, abs=0.05)
    weights = 0.7 * stats.norm(1540, 220).pdf(rho) + 0.3 * stats.norm(2400, 300).pdf(rho)
    assert made["prior"]["density"].mean() == pytest.approx(rho @ weights / weights.sum(), rel=0.02)
    # dry sand at 2,400 kg/m^3: what cases/dart_dimorphos expects, 78 m, lies among the laws
    low, high = np.quantile(made["scaling_law"]["hollow"], (0.05, 0.95))
    assert 60.0 < low < 78.0 < high < 130.0
    before = made["no_change"]
    assert np.mean(before["a_over_b"]) == pytest.approx(1.04, abs=0.005)
    assert {name for name, values in before.items() if not values.any()} == {
        "mass_left", "hollow", "deepest", "resurfaced", "plane_turned", "dv_observable", "excited",
    }  # fmt: skip


def test_the_page_shows_the_trial(remade):
    """Each known observable left out: PIT and skill as the page has them. With nothing left out but the push, it is
    the ``left_out`` of the frozen file."""
    rows = hera_references.trial(forecast.inputs())
    assert hera_references.trial_table(rows) in (FOLDER / "README.md").read_text()
    by_name = {row["what"].split(" (")[0]: row for row in rows}
    assert by_name["mass that left"]["pit"] < 0.1 and by_name["mass that left"]["skill_prior"] < -1.0
    assert by_name["change of speed"]["skill_no_change"] > 0.9 and by_name["density"]["skill_prior"] > 0.5


def test_what_is_left_out_is_no_condition():
    """Weights of a forecast without an observable do not move with its observed value, and do with another's."""
    given = forecast.inputs()
    moved = {
        **given,
        "observed": {**given["observed"], "shape": {**given["observed"]["shape"], "a_over_b": [1.1, 0.02]}},
    }
    same, other = (
        [hera_references.left_out(one, name)[name].mean() for one in (given, moved)]
        for name in ("a_over_b", "density")
    )
    assert same[0] == same[1] and other[0] != other[1]
