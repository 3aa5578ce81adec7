"""A forecast by a sweep over priors: what its files say is what its members came to, on made-up tables."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import bolide
from matter import scores
from matter.errors import InputError, Unsound
from matter.files import archive
from pipeline.case import read as cases
from pipeline.commands import sweep_command
from pipeline.store import provenance
from pipeline.sweeps import sweep_forecast, sweep_run, sweep_table
from pipeline.sweeps.sweep import planned_sweep, read_table

ROOT = Path(__file__).resolve().parents[2]
MEMBERS, WHOLE = 40, 24
PRIORS = f"""
[sweep]
kind = "prior"
members = {MEMBERS}
whole_chain = {WHOLE}
prior."impact.speed" = {{ distribution = "uniform", low = "10 km/s", high = "20 km/s" }}
"""
Z = stats.norm.ppf((np.arange(MEMBERS) + 0.5) / MEMBERS)
BETA = 2.0 + 0.5 * np.random.default_rng(1).permutation(Z)


@pytest.fixture
def read(case_folder, fake_stages):
    (case_folder / "case.toml").write_text((case_folder / "case.toml").read_text() + PRIORS)
    return cases.read(case_folder)


@pytest.fixture
def sweep(read, tmp_path):
    return planned_sweep(read, read_table(read.sweep, ()), tmp_path / "runs")


def rows_of(sweep, error=0.0):
    """Shock stages of all members, the whole chain of the first; the second failed in its grains."""
    rows = []
    for k, member in enumerate(sweep.members):
        row = {"member": member.name, "state": "done", "reason": "", "until": "crater", **sweep.values[member.name]}
        row["shock/beta_normal"] = BETA[k]
        if k == 1:
            row |= {"state": "failed", "reason": 'dem: "overlap" \u00d7 2'}
        elif k < WHOLE:
            row |= {
                "body/beta_normal": BETA[k] - 0.2,
                "body/beta_normal_sigma": error,
                "body/hollow_across_m": 90.0 + k,
            }
            row["class"] = "crater" if k < 8 else "reshaped"
        rows.append(row)
    return rows


def table_of(sweep):
    return tomllib.loads((sweep.folder / "forecast.toml").read_text())


def test_it_says_what_its_members_came_to(read, sweep):
    rows = rows_of(sweep)
    sums = sweep_forecast.write(sweep, read, rows)
    table, (draws, _) = table_of(sweep), archive.read(sweep.folder / "forecast_draws.h5")
    beta, hollow = sorted(table["quantity"], key=lambda one: one["name"])
    assert (beta["name"], beta["unit"], hollow["name"], hollow["unit"]) == ("beta_normal", "1", "hollow_across_m", "m")
    assert beta["shock_stage"] == pytest.approx(np.quantile(BETA, table["levels"]), rel=1e-3)
    whole = np.delete(BETA[:WHOLE], 1) - 0.2
    assert beta["whole_chain"] == pytest.approx(np.quantile(whole, table["levels"]), rel=1e-3)
    assert "shock_stage" not in hollow and table["headline"] == "whole_chain"
    assert table["values"] == {"whole_chain": WHOLE - 1, "shock_stage": MEMBERS}
    # the failed member is counted, listed, and has no draw of the chain that it did not end
    assert (table["members"], table["done"], table["failed"]) == (MEMBERS, MEMBERS - 1, 1)
    assert table["member_failed"] == [{"member": "m0002", "reason": 'dem: "overlap" \u00d7 2'}]
    assert np.flatnonzero(np.isnan(draws["whole_chain/beta_normal"])).tolist() == [1, *range(WHOLE, MEMBERS)]
    assert np.array_equal(draws["shock_stage/beta_normal"], BETA)
    speeds = [float(row["impact.speed"].split()[0]) for row in rows]
    assert draws["drawn/impact.speed"].tolist() == speeds and table["sweep"] == read.sweep
    # 7 craters, 16 reshaped, 0 and 0 of the others
    assert table["class"]["members_whole_chain"] == {"crater": 7, "not resolved": 0, "reshaped": 16, "no hollow": 0}
    chances = table["class"]["p_whole_chain"]
    assert chances == pytest.approx({"crater": 0.3, "not resolved": 0.02, "reshaped": 0.66, "no hollow": 0.02})
    files = {name: provenance.file_sha256(sweep.folder / name) for name in ("forecast.toml", "forecast_draws.h5")}
    listed = dict(reversed(line.split()) for line in (sweep.folder / "SHA256SUMS").read_text().splitlines())
    assert files == sums == listed
    page = (sweep.folder / "forecast.html").read_text()
    assert all(
        text in page for text in (*files.values(), "m0002", "reshaped with a chance of 0.66", "39 of 40 members")
    )


def test_it_is_scored_by_its_members_and_their_errors(read, sweep):
    sweep_forecast.write(sweep, read, rows_of(sweep, error=0.3))
    file = sweep.folder / "forecast.toml"
    whole = np.delete(BETA[:WHOLE], 1) - 0.2
    assert table_of(sweep)["quantity"][-1]["error_whole_chain"] == 0.3
    found = bolide.score(file, {"beta_normal": (2.6, 0.4), "hollow_across_m": 100.0, "class": "no hollow"})
    assert found.loc["beta_normal", "crps"] == pytest.approx(scores.crps(scores.blurred(whole, 0.5), 2.6), rel=0.05)
    assert np.isfinite(found.loc["jointly", "energy"]) and found.loc["class", "chance"] == pytest.approx(0.02)
    assert bolide.score(file, {"beta_normal": 2.6}, "shock_stage").loc["beta_normal", "crps"] == pytest.approx(
        scores.crps(BETA, 2.6)
    )
    for observed, column, words in (
        ({"hollow_across_m": 90.0}, "shock_stage", "does not forecast hollow_across_m"),
        ({"class": "crater"}, "shock_stage", "gives no chances of 'class'"),
        ({"excited": True}, "", "gives no chances of 'excited'"),
        ({"mass": 1.0}, "", "forecasts no 'mass' .it has .*, class"),
    ):
        with pytest.raises(InputError, match=words):
            bolide.score(file, observed, column)


def test_members_errors_widen_the_quantiles(read, sweep):
    rows = rows_of(sweep, error=2.0)
    sweep_forecast.write(sweep, read, rows)
    low, _, _, _, high = table_of(sweep)["quantity"][-1]["whole_chain"]
    assert high - low == pytest.approx(2 * 1.96 * np.hypot(2.0, 0.5), rel=0.05)
    # of two members as well: the mixture of both
    sweep_forecast.write(sweep, read, [rows[0], rows[2]])
    one, other = (rows[k]["body/beta_normal"] for k in (0, 2))
    low, _, _, _, high = table_of(sweep)["quantity"][-1]["whole_chain"]
    assert stats.norm(one, 2.0).cdf(low) + stats.norm(other, 2.0).cdf(low) == pytest.approx(0.05, abs=0.01)
    assert stats.norm(one, 2.0).sf(high) + stats.norm(other, 2.0).sf(high) == pytest.approx(0.05, abs=0.01)


def test_made_again_it_is_the_same_and_keeps_its_date(read, sweep, monkeypatch):
    first = sweep_forecast.write(sweep, read, rows_of(sweep))
    text = (sweep.folder / "forecast.toml").read_text()
    older = text.replace(f"made = {table_of(sweep)['made']}", "made = 2020-02-29")
    (sweep.folder / "forecast.toml").write_text(older)
    sweep_forecast.write(sweep, read, rows_of(sweep))
    assert (sweep.folder / "forecast.toml").read_text() == older != text
    rows = rows_of(sweep)
    rows[0]["body/beta_normal"] = 9.0
    assert sweep_forecast.write(sweep, read, rows) != first
    assert str(table_of(sweep)["made"]) != "2020-02-29"


def test_one_more_member_lies_in_the_interval_as_often_as_is_said():
    for count in (5, 24):
        u = np.random.default_rng(count).uniform(size=(20000, count))
        low, high = np.quantile(u, (0.025, 0.975), axis=1)
        assert np.mean(high - low) == pytest.approx(sweep_forecast.coverage(count), abs=2e-3)


def test_too_few_members_forecast_nothing(read, sweep):
    rows = rows_of(sweep)[:1]
    with pytest.raises(Unsound, match="fewer than two members have a measure in common"):
        sweep_forecast.write(sweep, read, rows)
    assert not (sweep.folder / "forecast.toml").exists()


def test_the_command_runs_the_sweep_and_tells_the_forecast(read, sweep, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sweep_run.Runner, "run", lambda self: {"m0002": 2})
    monkeypatch.setattr(sweep_table, "write", lambda sweep, failed: rows_of(sweep))
    arguments = (read, tmp_path / "runs", [], None, None, 1, [], None, None)
    assert sweep_command.swept(*arguments) == 1 and not (sweep.folder / "forecast.toml").exists()
    capsys.readouterr()
    assert sweep_command.swept(*arguments, forecast=True) == 1
    told = capsys.readouterr().out
    assert "chances: crater 0.30, not resolved 0.02, reshaped 0.66" in told
    assert provenance.file_sha256(sweep.folder / "forecast.toml") in told and "shock stage" in told


@pytest.mark.parametrize(
    "change, vary, ensemble, words",
    [
        ({}, ["impact.speed=1,2 km/s"], None, "leave out --vary"),
        ({}, [], 4, "leave out --ensemble"),
        ({"kind": "sobol"}, [], None, 'has kind = "sobol"'),
        (None, [], None, r"has no \[sweep\]"),
    ],
)
def test_without_priors_it_is_refused(read, tmp_path, change, vary, ensemble, words):
    read.sweep.update(change or {})
    if change is None:
        read.sweep.clear()
    with pytest.raises(InputError, match=words):
        sweep_command.swept(read, tmp_path / "runs", vary, ensemble, None, 1, [], None, None, forecast=True)


def test_the_shipped_example_is_ten_lines_and_draws_its_members(tmp_path):
    file = ROOT / "examples" / "own_forecast.toml"
    said = [line for line in file.read_text().splitlines() if line and not line.startswith("#")]
    assert len(said) <= 13
    read = cases.read(file)
    drawn = planned_sweep(read, read_table(read.sweep, ()), tmp_path).members
    assert [member.until for member in drawn] == [None, None, "sph", "sph"]
    key = "sph.materials.regolith_ryugu.p_alpha.alpha0"
    assert all(
        2700.0 / member.values[key] == pytest.approx(float(member.drawn["density"].split()[0])) for member in drawn
    )
