"""Sweeps that draw from distributions: the draws, what is derived from them, and what becomes of members that fail."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from matter.errors import InputError, Stopped
from matter.files import archive
from pipeline.case import derived, keys
from pipeline.case import read as cases
from pipeline.case.prior_table import Prior
from pipeline.commands import sweep_command
from pipeline.running import run_process
from pipeline.settings.compose import compose
from pipeline.store.store import STORE
from pipeline.sweeps import draws, sweep_cost, sweep_jobs, sweep_run, sweep_table
from pipeline.sweeps.sweep import check, members, planned_sweep, read_table

FAKES = Path(__file__).resolve().parent / "fake_rooms"
ROOT = Path(__file__).resolve().parents[2]
ENSEMBLE = ROOT / "cases" / "dart_dimorphos" / "ensemble.toml"

NORMAL = {"distribution": "normal", "mean": "1540 kg/m^3", "sd": "220 kg/m^3"}
SPEED = {"distribution": "uniform", "low": "10 km/s", "high": "20 km/s"}


def table(prior, derive=None, **more):
    return read_table({"kind": "prior", "prior": prior, "derive": derive or {}, **more}, ())


# -- the draws

locations, widths = st.floats(-100.0, 100.0), st.floats(0.1, 50.0)
ends = st.tuples(st.floats(-2.0, 0.0), st.floats(0.1, 2.0))


def truncated(cdf, ppf, low, high):
    """F^-1 of a distribution between two limits."""
    return lambda share: ppf(cdf(low) + share * (cdf(high) - cdf(low)))


@st.composite
def priors(draw):
    """A prior and its inverse distribution by ``scipy.stats``."""
    mean, sd, (one, other) = draw(locations), draw(widths), draw(ends)
    low, high = mean + one * sd, mean + other * sd
    kind = draw(st.sampled_from(["normal", "truncated", "uniform", "log_uniform", "mixture"]))
    if kind == "normal":
        return Prior(distribution="normal", mean=mean, sd=sd), stats.norm(mean, sd).ppf
    if kind == "truncated":
        prior = Prior(distribution="normal", mean=mean, sd=sd, low=low, high=high)
        return prior, truncated(stats.norm(mean, sd).cdf, stats.norm(mean, sd).ppf, low, high)
    if kind == "uniform":
        return Prior(distribution="uniform", low=low, high=high), stats.uniform(low, high - low).ppf
    if kind == "log_uniform":
        low, high = math.exp(low / 20.0), math.exp(high / 20.0)
        return Prior(distribution="log_uniform", low=low, high=high), stats.loguniform(low, high).ppf
    weight, apart = draw(st.floats(0.05, 0.95)), draw(st.floats(0.0, 8.0))
    parts = [
        {"weight": weight, "mean": mean, "sd": sd},
        {"weight": 1.0 - weight, "mean": mean + apart * sd, "sd": 0.5 * sd},
    ]
    whole = stats.Mixture(
        [stats.Normal(mu=part["mean"], sigma=part["sd"]) for part in parts],
        weights=[part["weight"] for part in parts],
    )
    return Prior(distribution="mixture", components=parts, low=low), truncated(whole.cdf, whole.icdf, low, np.inf)


@settings(max_examples=40)
@given(priors(), st.integers(0, 1000), st.integers(3, 6))
def test_one_draw_lies_between_each_two_neighbouring_quantiles(case, seed, power):
    """Of 2^m draws, by ``scipy.stats``; as written, with six digits."""
    prior, inverse = case
    count = 2**power
    found = np.sort([row["x"] for row in draws.drawn({"x": prior}, count, seed)])
    edges = np.asarray(inverse(np.linspace(0.0, 1.0, count + 1)))
    digits = 1e-5 * np.abs(found) + 1e-9
    assert (found >= edges[:-1] - digits).all() and (found <= edges[1:] + digits).all()
    low, high = prior.limits
    assert (found >= low - 1e-5 * abs(low)).all() and (found <= high + 1e-5 * abs(high)).all()


def test_choices_are_drawn_equally_often_and_stay_what_they_are():
    given_values = [3, "ice", True, 0.5]
    found = [row["x"] for row in draws.drawn({"x": Prior(distribution="choices", values=given_values)}, 64, 2)]
    assert [sum(type(one) is type(value) and one == value for one in found) for value in given_values] == [16] * 4


@settings(max_examples=25)
@given(st.integers(1, 70), st.integers(1, 70), st.integers(0, 99))
def test_more_members_leave_the_first_ones_as_they_are(few, more, seed):
    """Names and values; no number of members is warned of."""
    prior = {"density": NORMAL, "impact.speed": SPEED, "draw": {"distribution": "choices", "values": [1, 2, 3]}}
    derive = {"sph.spacing": "'2 m' * draw", "a.alpha": "'3500 kg/m^3' / density"}
    few, more = sorted((few, more))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        short, long = (members(table(prior, derive, members=count, seed=seed)) for count in (few, more))
    assert long[:few] == short and len(long) == more
    assert [one.name for one in long] == [f"m{number:04d}" for number in range(1, more + 1)]


def test_amounts_keep_their_unit_and_tails_are_finite():
    found = draws.drawn({"x": Prior(**NORMAL), "y": Prior(distribution="normal", mean=0, sd=1)}, 4096, 1)
    assert all(re.fullmatch(r"[\d.e+]+ kg/m\^3", row["x"]) for row in found)
    assert np.isfinite([row["y"] for row in found]).all()
    for prior, middle in ((NORMAL, "1540 kg/m^3"), (SPEED, "15 km/s"), (SPEED | {"low": "5000 m/s"}, "12500 m/s")):
        assert draws.written(Prior(**prior), np.array([0.5])) == [middle]


# -- what is derived


@given(st.floats(500.0, 5000.0), st.floats(5.0, 60.0), st.integers(0, 10**6))
def test_derived_values_are_exact(density, angle, seed):
    drawn = {"density": f"{density!r} kg/m^3", "angle": f"{angle!r} deg", "seed": seed, "law": "collins", "on": True}
    for text, value in (
        ("'3500 kg/m^3' / density", 3500.0 / density),
        ("2 * density - '1 g/cm^3'", None),
        ("tan(angle)", math.tan(math.radians(angle))),
        ("seed + 100", seed + 100),
        ("-(seed - 3) * 2", -(seed - 3) * 2),
        ("density", drawn["density"]), ("law", "collins"), ("on", True), ("seed", seed),
        ("sqrt(density / density) + exp(0) - log(1) + sin(0) + cos(0) + 2 ** 3", 11.0),
    ):  # fmt: skip
        assert derived.faults(text, drawn) == []
        found = derived.value(text, drawn)
        if value is None:
            number, unit = found.split(" ")
            assert float(number) == pytest.approx(2.0 * density - 1000.0, rel=1e-12) and unit == "kg/m^3"
        elif text.startswith("tan"):
            assert found == pytest.approx(value, rel=1e-9)
        else:
            assert found == value and type(found) is type(value)
    number, unit = derived.value("atan(tan(angle))", drawn).split(" ")
    assert math.degrees(float(number)) == pytest.approx(angle, rel=1e-9) and unit == "rad"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("densty * 2", "no quantity 'densty' is drawn; did you mean 'density'"),
        ("tann(angle)", "no function 'tann'; did you mean 'tan'"),
        ("__import__('os')", "no function '__import__'"),
        ("density.real", "'density.real' is no part of an expression"),
        ("density if angle else 1", "is no part of an expression"),
        ("[1]", "is no part of an expression"),
        ("density[0]", "is no part of an expression"),
        ("density % 2", "is no part of an expression"),
        ("tan(angle, 2)", "is no part of an expression"),
        ("1j * density", "is no part of an expression"),
        ("True + density", "True is not a number"),
        ("'3 furlongsx' * 2", "cannot read '3 furlongsx'"),
        ("density +", "cannot read 'density \\+' as an expression"),
        ("(" * 150, "as an expression"),
        ("1" * 201, "at most 200 characters"),
    ],
)
def test_what_is_no_expression_is_told_and_never_evaluated(text, words):
    (found,) = [fault for fault in derived.faults(text, ["density", "angle"]) if re.search(words, fault)]
    assert len(found) < 600


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("density + angle", "Cannot convert"),
        ("angle + 2", "adds a number to a quantity with a unit"),
        ("log(density)", "log is of a number or an angle"),
        ("law + 1", "cannot read 'collins'"),
        ("on * 2", "on is true or false"),
        ("1 / (seed - seed)", "zero"),
        ("(1 - seed) ** 0.5 + 1", "root of a negative number"),
        ("9 ** 9 ** 9 ** 9", "not a finite number"),
        ("1e308 * 10 * seed", "not a finite number"),
    ],
)
def test_what_has_no_value_is_told(text, words):
    drawn = {"density": "1540 kg/m^3", "angle": "30 deg", "seed": 3, "law": "collins", "on": True}
    assert derived.faults(text, drawn) == []
    with pytest.raises(ValueError, match=words):
        derived.value(text, drawn)


# -- the table


@pytest.mark.parametrize(
    ("prior", "words"),
    [
        ({"distribution": "norml"}, "distribution: must be .* did you mean 'normal'"),
        ({**NORMAL, "sd": "0 kg/m^3"}, "sd must be greater than 0 (given: 0 kg/m^3)"),
        ({**SPEED, "low": "30 km/s"}, "low must be less than high (given: 30 km/s and 20 km/s)"),
        ({**SPEED, "low": "20 km/s"}, "low must be less than high"),
        ({**SPEED, "distribution": "log_uniform", "low": "0 km/s"}, "low must be greater than 0"),
        ({**NORMAL, "low": "9000 kg/m^3"}, "of the distribution, less than 1e-06"),
        ({**NORMAL, "sd": "3 m"}, "its amounts are not of one kind: mean in kg/m^3, sd in m"),
        ({**NORMAL, "sd": 3}, "mean in kg/m^3, sd in no unit"),
        ({**NORMAL, "sd": "3 mm per"}, "sd: cannot read"),
        ({**NORMAL, "mean": math.nan, "sd": 1}, "mean is not a finite number"),
        ({"distribution": "normal", "mean": "20 degC", "sd": "5 degC"}, "'20 degC' has a zero of its own"),
        ({"distribution": "normal", "mean": 3}, "sd is missing"),
        ({**SPEED, "mean": "3 km/s"}, "uniform takes no mean (it takes low, high)"),
        ({"distribution": "choices", "values": []}, "values is missing"),
        (
            {"distribution": "mixture", "components": [{"weight": 0.7, "mean": 1, "sd": 1}] * 2},
            "the weights of the components add up to 1.4, not to 1",
        ),
        (
            {"distribution": "mixture", "components": [{"weight": 1, "mean": 1, "sd": -1}]},
            "components[0] sd must be greater than 0",
        ),
    ],
)
def test_a_distribution_that_cannot_be_drawn_is_told(prior, words):
    with pytest.raises(InputError) as told:
        table({"impact.speed": prior})
    assert str(told.value).startswith("[sweep] cannot be used, 1 error:\n  sweep.prior.impact.speed")
    assert re.search(words, str(told.value)) if ".*" in words else words in str(told.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"derive": {"a.x": "dens"}}, "sweep.derive.a.x: no quantity 'dens' is drawn; did you mean 'density'"),
        ({"derive": {"a.x": "1"}}, "sweep.prior.density: is drawn, and nothing in [sweep.derive] takes it up"),
        ({"derive": {"a.x": "density", "impact.speed": "density"}}, "derive.impact.speed: is set by [sweep.prior]"),
        ({"common": {"a.x": "1 m"}}, "sweep.common.a.x: is set by [sweep.derive] too"),
        ({"prior": {}}, "nothing is drawn"),
        ({"prior": {"run": NORMAL}}, "sweep.prior.run: this is the name of a function, or of a column"),
        ({"prior": {"a b": NORMAL}}, "a name of one's own has letters"),
        ({"vary": {"b.y": [1, 2]}}, "draws its values"),
        ({"whole_chain": -1}, "sweep.whole_chain: must be at least 0"),
        ({"whole_chan": 3}, "sweep.whole_chan: there is no such key; did you mean 'whole_chain'"),
        ({"kind": "sobol", "vary": {"b.y": [1, 2]}}, 'sweep.prior: goes with kind = "prior"'),
    ],
)  # fmt: skip
def test_tables_that_do_not_fit_together_are_told(change, words):
    good = {"kind": "prior", "prior": {"density": NORMAL, "impact.speed": SPEED}, "derive": {"a.x": "density"}}
    assert len(members(read_table(good, ()))) == 16
    with pytest.raises(InputError, match=re.escape(words)):
        read_table(good | change, ())


def test_every_mistake_is_told_at_once(drive, case_folder):
    """On the command line, with exit code 2."""
    text = """
        [sweep]
        kind = "prior"
        members = 0
        prior.density = { distribution = "norml", mean = "1 kg/m^3" }
        prior."impact.speed" = { distribution = "uniform", low = "3 km/s", high = "2 km/s" }
        derive."a.x" = "densty"
        derive."a.y" = "open(density)"
    """
    (case_folder / "case.toml").write_text((case_folder / "case.toml").read_text() + text)
    code, _, err = drive(case_folder, "--sweep", "--check")
    assert code == 2 and "5 errors" in err and "Traceback" not in err, err
    for words in ("did you mean 'normal'", "low must be less", "'densty'", "'open'", "members: must be at least 1"):
        assert words in err
    assert drive(case_folder, "--check")[0] == 2  # and of a case that runs alone


def test_a_case_with_priors_may_run_alone():
    priors = {"kind": "prior", "prior": {"impact.speed": SPEED}}
    check(priors)
    with pytest.raises(InputError, match="members: must be at least 1"):
        check(priors | {"members": 0})


def test_units_that_do_not_fit_are_told_of_all_derived_keys():
    made = table({"density": NORMAL}, {"a.x": "density + '1 m'", "a.y": "log(density)"})
    with pytest.raises(InputError, match=r"(?s)member m0001 \(density = .*sweep.derive.a.x: .*sweep.derive.a.y: "):
        members(made)


# -- runs


@pytest.fixture
def sweep(case_folder, tmp_path, fake_stages, monkeypatch):
    """``sweep(members, whole_chain)`` of the fake stages: two speeds, and times of the handoff of which one fails."""
    monkeypatch.setattr(run_process, "_COMMAND", "import drive; drive.cli.run_case()")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(FAKES)]))
    monkeypatch.setattr(sweep_run, "EVERY_S", 0.05)
    (case_folder / "case.toml").write_text(
        (case_folder / "case.toml").read_text()
        + """
        [preset.ensemble.sweep]
        kind = "prior"
        [preset.ensemble.sweep.prior."impact.speed"]
        distribution = "choices"
        values = ["10 km/s", "20 km/s"]
        [preset.ensemble.sweep.prior.time]
        distribution = "choices"
        values = ["60 s", "120 s"]
        [preset.ensemble.sweep.derive]
        handoff.time = "time"
        handoff.alpha = "time / '40 s'"
        """
    )

    def make(count, whole_chain):
        read = cases.read(case_folder, "ensemble")
        return planned_sweep(
            read, read_table({**read.sweep, "members": count, "whole_chain": whole_chain}, ()), tmp_path / "runs"
        )

    return make


@pytest.mark.validation
def test_members_that_fail_are_counted_and_listed_and_more_members_redo_none(sweep):
    one = sweep(3, 2)
    bad, good = sorted(one.members[:2], key=lambda member: member.drawn["time"])
    assert (bad.drawn["time"], good.drawn["time"]) == ("120 s", "60 s")
    failed = sweep_run.Runner(one, 1, 2, lambda text: None).run()
    assert failed == {bad.name: 2}  # 120 s: the fake handoff has no such snapshot
    rows = sweep_table.write(one, failed)
    with open(one.folder / sweep_table.CSV, newline="") as file:
        found = {row["member"]: row for row in csv.DictReader(file)}
    for member, state, why, until, depth in (
        (bad, "failed", "handoff: no snapshot near that time", "crater", ""),
        (good, "done", "", "crater", "12000.0"),
        (one.members[2], "done", "", "sph", ""),
    ):
        row = found[member.name]
        assert [row[name] for name in ("state", "reason", "until", "final/depth_m")] == [state, why, until, depth]
        assert row["time"] == row["handoff.time"] == member.drawn["time"]
        assert float(row["handoff.alpha"]) == float(member.drawn["time"].split()[0]) / 40.0
        assert row["impact.speed"] == member.values["impact.speed"]
    counted = "2 of 3 members are done, 1 failed. 2 run all stages, the others end with the shock stage."
    page = (one.folder / sweep_table.PAGE).read_text()
    assert all(part in page for part in counted.rstrip(".").split(". "))
    assert "Members that failed" in page and page.count("handoff: no snapshot near") == 1
    told = sweep_table.text(rows)
    assert counted in told and f"{bad.name} failed: handoff: no snapshot near that time" in told
    assert "no snapshot near that time" in sweep_run.status(one)
    arrays = archive.read(one.folder / sweep_table.HDF5)[0]
    assert arrays["time"].tolist() == [float(member.drawn["time"].split()[0]) for member in one.members]
    # the third has its shock stage alone
    runs = {name: request.run_folder for name, request in one.requests.items()}
    assert sorted(path.name for path in runs["m0003"].glob("[1-6]_*")) == ["1_nbody", "2_sph"]
    # four members, and all of the chain in three: nothing that is done is made again
    before = shock_stages(one)
    more = sweep(4, 3)
    assert [more.requests[name].run_folder for name in runs] == list(runs.values()) and len(before) == 2
    heard = []
    sweep_run.Runner(more, 1, 2, heard.append).run()
    assert {line.partition(":")[0] for line in heard if "begins" in line} == {bad.name, "m0003", "m0004"}
    assert shock_stages(more) == before == ["0\n", "0\n"]


def cells(row):
    """What a row of a sweep's table says."""
    return {name: value for name, value in row.items() if value not in (None, "")}


def test_members_that_are_done_elsewhere_are_not_computed_again(sweep, tmp_path):
    there = sweep(3, 2)
    sweep_run.Runner(there, 1, 2, lambda text: None).run()
    rows = sweep_table.write(there)
    done = [row["member"] for row in rows if row["state"] == "done"]
    assert len(done) == 2 and "m0003" in done  # one of the first two fails in its handoff

    def carried(to):
        """The sweep with the table from there in its folder."""
        file = to.folder / "elsewhere" / "there.csv"
        file.parent.mkdir(parents=True)
        file.write_text((there.folder / sweep_table.CSV).read_text())
        return to

    # no run folder in sight: the same rows, numbers and all
    here = carried(replace(there, out=tmp_path / "other"))
    told, measured = (
        [cells(row) for row in table if row["member"] in done] for table in (sweep_table.rows_of(here), rows)
    )
    assert told == measured
    assert "2 done" in sweep_run.status(here) and sweep_cost.rows_of(here)["sph"].made == 1
    heard = []
    sweep_run.Runner(here, 1, 2, heard.append).run()
    assert {line.partition(":")[0] for line in heard if "begins" in line}.isdisjoint(done)
    # the third was a shock stage alone; as a whole chain it is another matter, and so are other values
    assert set(carried(replace(sweep(4, 3), out=tmp_path / "third")).elsewhere) == set(done) - {"m0003"}
    other = replace(there, out=tmp_path / "fourth", overrides=('impact.angle_from_vertical="30 deg"',))
    assert carried(other).elsewhere == {}


@pytest.mark.parametrize(
    "text, words", [("a,b\n1,2\n", "no column member or run"), ("member,\udcff", "cannot be read")]
)
def test_a_table_from_elsewhere_that_is_none_is_refused(sweep, text, words):
    one = sweep(2, None)
    file = one.folder / "elsewhere" / "table.csv"
    file.parent.mkdir(parents=True)
    file.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(InputError, match=words):
        sweep_table.rows_of(one)


def shock_stages(sweep) -> list[str]:
    """How often each shock stage was begun."""
    return [path.read_text() for path in (sweep.out / STORE).glob("sph-*/starts.txt")]


def test_the_command_ends_with_1_where_members_failed(sweep, case_folder, tmp_path, monkeypatch, capsys):
    sweep(2, None)  # the case file with its preset
    read = cases.read(case_folder, "ensemble")
    for failed, code in (({"m0002": 2}, 1), ({}, 0)):
        monkeypatch.setattr(sweep_run.Runner, "run", lambda self, failed=failed: failed)
        assert sweep_command.swept(read, tmp_path / "runs", [], None, None, 1, [], None, None) == code
        told = capsys.readouterr().out
        assert ("0 of 16 members are done, 15 to do, 1 failed." in told) == bool(failed)
        assert ("m0002 failed: exit code 2" in told) == bool(failed)


def test_a_sweep_that_stops_leaves_its_table(sweep, case_folder, tmp_path, monkeypatch):
    sweep(2, None)  # the case file with its preset
    read = cases.read(case_folder, "ensemble")

    def stop(self):
        raise Stopped("the sweep was stopped")

    monkeypatch.setattr(sweep_run.Runner, "run", stop)
    with pytest.raises(Stopped):
        sweep_command.swept(read, tmp_path / "runs", [], None, None, 1, [], None, None)
    assert len(list((tmp_path / "runs").glob("*-sweep-*/table.csv"))) == 1


def test_a_member_that_was_refused_or_killed_is_listed_by_its_exit_code(sweep):
    one = sweep(2, None)
    log = sweep_run.log_of(one, "m0001")
    log.parent.mkdir(parents=True)
    log.write_text("run folder: x\nthe case needs 3 TB of disk\n\n")
    rows = sweep_table.rows_of(one, {"m0001": 2, "m0002": -9})
    assert [(row["state"], row["reason"]) for row in rows] == [
        ("failed", "exit code 2: the case needs 3 TB of disk"), ("failed", "exit code -9"),
    ]  # fmt: skip
    assert [row["state"] for row in sweep_table.rows_of(one)] == ["to do", "to do"]


def test_members_of_the_shock_stage_alone_end_there_on_a_cluster_too(sweep):
    one = sweep(3, 1)
    sweep_jobs.write(one, "slurm-array", 1)
    lines = (one.folder / "commands.txt").read_text().splitlines()
    assert ["--until sph" in line for line in lines] == [False, True, True]
    assert [one.last_stage(member) for member in one.members] == [None, "sph", "sph"]


# -- what bodies came to


def test_a_table_of_bodies_holds_the_shock_stage_beside_the_end(tmp_path):
    cell = {"value": 2.5, "sigma": 0.1}
    measures = {"beta_normal": cell, "axis_a_m": {"before": cell, "after": {"value": 181.0, "sigma": 0.5}}}
    for stage, name, content in (
        ("2_sph", "stage_report.json", {"escaping": {"mass_kg": 4e7, "beta": 2.6}}),
        ("6_crater", "measures.json", {"body": {"final": "dem", "dem": {"class": "crater", "measures": measures}}}),
    ):
        (tmp_path / stage).mkdir()
        row = sweep_table._of_body(tmp_path)
        (tmp_path / stage / name).write_text(json.dumps(content))
    assert row == {"shock/beta_normal": 2.6, "shock/escaping_mass_kg": 4e7}  # before the crater was measured
    row = sweep_table._of_body(tmp_path)
    assert (row["class"], row["body/beta_normal"], row["body/beta_normal_sigma"]) == ("crater", 2.5, 0.1)
    assert (row["body/axis_a_m"], row["body/delta_v_m_s"]) == (181.0, None)
    assert sweep_table.unit_of("body/axis_a_m") == "m" and "beta along" in sweep_table._meaning("shock/beta_normal")


# -- what ships


def test_the_ensemble_of_dimorphos_is_drawn_as_it_says(tmp_path):
    read = cases.read(ENSEMBLE, "quick")
    made = planned_sweep(read, read_table(read.sweep, ()), tmp_path)
    drawn = [member.drawn for member in made.members]
    assert len(drawn) == 96 and [member.until for member in made.members] == [None] * 32 + ["sph"] * 64
    density = np.array([float(one["bulk_density"].split()[0]) for one in drawn])
    assert density.min() > 900.0 and density.max() < 3200.0
    # the mixture: mean 0.7 1540 + 0.3 2400, less what the lower limit takes
    assert density.mean() == pytest.approx(1798.0, rel=0.02)
    for member, value in zip(made.members, density, strict=True):
        assert member.values["sph.materials.basalt.p_alpha.alpha0"] == 3500.0 / value
        assert "dem.contact.friction_angle" not in member.values  # the grains take that of the ground
    first = planned_sweep(read, read_table({**read.sweep, "members": 2}, ()), tmp_path)
    sets = compose(first.requests["m0001"].case)
    angle = math.radians(float(drawn[0]["friction_angle"].split()[0]))
    assert angle < math.radians(34.0)
    assert sets["dem"].contact.friction_angle == pytest.approx(angle, rel=1e-9)
    held = sets["sph"].chosen_materials().loose("basalt").cohesion
    assert 0.0085 * sets["dem"].contact.shell.cohesion == pytest.approx(held, rel=1e-9)
    chosen = sets["sph"].chosen_materials()
    basalt = chosen.index("basalt")
    assert float(chosen.bulk_density[basalt]) == pytest.approx(density[0], rel=1e-9)


def test_priors_are_described():
    (tables, single) = keys.find("sweep.prior")
    assert [one.name for one in tables] == ["sweep.prior.NAME", "sweep.prior.NAME.components"] and not single
    assert keys.find("sweep.prior.density.sd")[1][0].name == "sweep.prior.NAME.sd"
    assert {key.path[-1] for key in keys.keys(tables[0])} == {"distribution", "mean", "sd", "low", "high", "values"}
