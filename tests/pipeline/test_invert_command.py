"""``run_case --invert`` and ``bolide.invert``: by scaling laws, by the table of a made-up sweep; what they refuse."""

import csv
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pandas
import pytest

import bolide
from matter.errors import InputError
from matter.files import archive
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.commands import invert_command
from pipeline.sweeps.sweep import planned_sweep, read_table
from tests.pipeline.conftest import CASE, FAKES

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE, SAND = ROOT / "examples" / "own_inverse.toml", ROOT / "examples" / "sand_inverse.toml"
MEMBERS = 32
TABLES = f"""
[inverse]
observed = {{ diameter_apparent_m = ["600 km", "6 km"], "transient/depth_m" = ["60 km", "3 km"] }}
discrepancy = {{ diameter_apparent_m = 0.02 }}
[sweep]
kind = "prior"
members = {MEMBERS}
prior."impact.speed" = {{ distribution = "log_uniform", low = "10 km/s", high = "20 km/s" }}
prior.friction = {{ distribution = "uniform", low = 0.2, high = 0.8 }}
derive."dem.contact.friction" = "friction"
"""


@pytest.fixture
def file(case_folder, fake_stages):
    path = case_folder / "case.toml"
    path.write_text(path.read_text().replace("[dem.contact]\nfriction = 0.7\n", "") + TABLES)
    return path


def write_table(file, out, done=MEMBERS, of_friction=lambda friction: -0.02 * (friction - 0.5), rim=None):
    """The table of the sweep: D grows with speed^0.8 and falls little with friction, the rim follows; one member
    failed."""
    read = cases.read(file)
    sweep = planned_sweep(read, read_table(read.sweep, ()), out)
    rows = []
    for k, member in enumerate(sweep.members[:done]):
        speed, friction = float(member.drawn["impact.speed"].split()[0]), float(member.drawn["friction"])
        size = 600e3 * (speed / 14.0) ** 0.8 * np.exp(of_friction(friction))
        row = {"member": member.name, "state": "done", "reason": "", "final/diameter_apparent_m": size}
        row |= {
            "final/diameter_apparent_m_sigma": 3e3,
            "transient/depth_m": 0.1 * size,
            "final/rim_height_m": rim(speed, friction) if rim else 0.01 * size,
        }
        failed = {"member": member.name, "state": "failed", "reason": "dem: overlap"}
        rows.append(failed if k == 3 else row)
    sweep.folder.mkdir(parents=True, exist_ok=True)
    with (sweep.folder / "table.csv").open("w", newline="") as lines:
        writer = csv.DictWriter(lines, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def test_a_sweeps_table_gives_back_the_speed_and_not_the_friction(file, tmp_path):
    write_table(file, tmp_path)
    found = bolide.invert(file, out=tmp_path)
    speed = found.summary.loc["impact.speed"]
    assert speed["q50"] == pytest.approx(14e3, rel=0.02) and speed["q16"] < 14e3 < speed["q84"]
    assert found.identified == ["impact.speed"] and found.summary.loc["friction", "width"] > 0.95
    assert "friction not identified" in found.verdict and "speed 1" in found.verdict
    assert found.samples["impact.speed"].median() == pytest.approx(speed["q50"], rel=0.01)
    assert found.samples.attrs["units"] == {"impact.speed": "m/s", "friction": "1"}
    # what was not used is predicted: the rim follows the diameter
    assert found.predict("rim_height_m").median() == pytest.approx(6e3, rel=0.02)
    with pytest.raises(InputError, match="did you mean 'rim_height_m'"):
        found.predict("rim_heigth_m")
    told = tomllib.loads((found.folder / "inverse.toml").read_text())
    assert told["verdict"] == found.verdict and told["not_identified"] == ["friction"] and told["failed"] == 1
    assert [one["discrepancy_fraction"] for one in told["observed"]] == [0.02, 0.15]
    assert told["observed"][0]["members"] == MEMBERS - 1 and "no_discrepancy" not in told
    arrays, _ = archive.read(found.folder / "posterior.h5")
    assert arrays["posterior/impact.speed"].mean() == pytest.approx(speed["mean"], rel=0.01)
    assert arrays["prior/friction"].min() > 0.2 and np.std(arrays["prior/friction"]) == pytest.approx(0.173, rel=0.02)
    page = (found.folder / "inverse.html").read_text()
    shown = ("m0004", "dem: overlap", "not identified", "Not identified", "corner.png", "left_out.png", "31")
    assert all(words in page for words in shown)
    assert len(found.corner().axes) == 4


def test_a_check_says_what_the_data_can_tell_and_writes_nothing(file, tmp_path, capsys):
    """By scaling laws, by five members, by all of them."""
    said = checked(file, tmp_path, capsys)
    assert said.startswith(f"0 of {MEMBERS} members are done: run_case {file} --sweep --check says what the others")
    assert "Scaling laws do not give transient/depth_m, left out here." in said and "By scaling laws." in said
    assert (
        "Apparent diameter fixes 1 of 2 directions: speed.\nNot told, for the data hardly depend on it: frict" in said
    )
    write_table(file, tmp_path, 6)  # the fourth failed
    assert "5 of 32 members are done" in (said := checked(file, tmp_path, capsys)) and "By 5 members." in said
    assert "Apparent diameter and depth together fix 1 of 2 directions: speed." in said
    write_table(file, tmp_path, of_friction=lambda friction: -0.6 * (friction - 0.5))
    said = checked(file, tmp_path, capsys)
    assert "together fix 1 of 2 directions: speed / friction.\nSpeed and friction are not told apart." in said
    assert not list(tmp_path.glob("small-inverse-*"))
    file.write_text(
        file.read_text()
        .replace('diameter_apparent_m = ["600 km", "6 km"], ', "")
        .replace("{ diameter_apparent_m = 0.02 }", "{}")
    )
    next(tmp_path.glob("small-sweep-*/table.csv")).unlink()
    assert "known when some members are done" in checked(file, tmp_path, capsys)


def checked(file, out, capsys):
    capsys.readouterr()
    assert invert_command.inverted(cases.read(file), out, [], True) == 0
    return capsys.readouterr().out


def test_a_measure_that_sees_what_is_not_known_would_help_most(file, tmp_path):
    """The rim follows friction alone here. It is said to help most, more so with a smaller error, and when it is
    observed the posterior is as wide as was expected."""
    write_table(file, tmp_path, rim=lambda speed, friction: 6e3 * np.exp(2.0 * (friction - 0.5)))
    found = bolide.invert(file, out=tmp_path)
    gains = found.gains()
    assert gains.index[0] == "rim_height_m" and set(gains.index[1:]) == {"diameter_apparent_m", "transient/depth_m"}
    rim = gains.loc["rim_height_m"]
    assert rim["error"] == 0.1 and rim["friction"] < 0.75 and rim["impact.speed"] == pytest.approx(1.0, abs=0.03)
    assert (
        found.gains(0.01).loc["rim_height_m", "friction"]
        < rim["friction"]
        < found.gains(0.4).loc["rim_height_m", "friction"]
    )
    # half the error of the diameter, 0.5 % for 1 %: less than half as wide, for chain and discrepancy stay
    assert 0.5 < gains.loc["diameter_apparent_m", "impact.speed"] < 1.0
    assert gains.loc["diameter_apparent_m", "friction"] == pytest.approx(1.0, abs=0.03)
    page = (found.folder / "inverse.html").read_text()
    assert "What would help" in page and "apparent diameter, half its error" in page
    told = tomllib.loads((found.folder / "inverse.toml").read_text())
    assert told["gain"][0]["measure"] == "rim_height_m" and told["direction"][0]["parameters"][0] == "impact.speed"
    assert found.directions.loc[0, "impact.speed"] > 0.9 and len(found.directions) == 2
    with pytest.raises(InputError, match="must be greater than 0"):
        found.gains(0.0)
    now = found.summary.loc["friction", "width"]
    file.write_text(file.read_text().replace("observed = {", 'observed = { rim_height_m = ["6 km", "0.6 km"],'))
    seen = bolide.invert(file, out=tmp_path)
    # in the middle of the prior, where it is widest
    assert rim["friction"] < seen.summary.loc["friction", "width"] / now < 1.2 * rim["friction"]


def test_an_answer_is_asked_again_without_runs_and_case(file, tmp_path):
    write_table(file, tmp_path)
    found = bolide.invert(file, out=tmp_path)
    shutil.rmtree(next(tmp_path.glob("small-sweep-*")))
    file.unlink()
    kept = {one.name: one.read_bytes() for one in found.folder.iterdir()}
    again = bolide.invert(found.folder)
    assert {one.name: one.read_bytes() for one in found.folder.iterdir()} == kept
    assert again.verdict == found.verdict and again.identified == found.identified
    pandas.testing.assert_frame_equal(again.samples, found.samples)
    pandas.testing.assert_frame_equal(again.summary, found.summary)
    for measure in ("diameter_apparent_m", "transient/depth_m", "rim_height_m"):
        pandas.testing.assert_series_equal(again.predict(measure), found.predict(measure))
    arrays, _ = archive.read(found.folder / "posterior.h5")
    assert np.array_equal(arrays["posterior/impact.speed"], again.samples["impact.speed"])
    with pytest.raises(InputError, match="takes no other settings"):
        bolide.invert(found.folder, **{"inverse.model": "pi_scaling"})


@pytest.mark.parametrize(
    "name, damage, words",
    [
        ("inverse.toml", lambda path: path.unlink(), "inverse.toml"),
        ("inverse.toml", lambda path: path.write_text("verdict = "), "inverse.toml"),
        ("inverse.toml", lambda path: path.write_text('verdict = "yes"\n'), "not those of one inversion: .*sweep"),
        ("emulator.h5", lambda path: path.write_bytes(b"no"), "emulator.h5"),
        ("emulator.h5", lambda path: archive.write(path, {"a": np.zeros(3)}), "not those of one inversion: .*speed"),
    ],
)
def test_an_answer_that_is_damaged_is_said(answer, tmp_path, name, damage, words):
    copy = shutil.copytree(answer, tmp_path / "copy")
    damage(copy / name)
    with pytest.raises(InputError, match=words):
        bolide.invert(copy)


@pytest.fixture(scope="module")
def answer(tmp_path_factory):
    """The folder of an answer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FAKES))
        patch.setattr(stages, "MODULES", {stage: f"fake_{stage}" for stage in stages.ORDER})
        folder = tmp_path_factory.mktemp("answer")
        path = folder / "case.toml"
        path.write_text(CASE.replace("[dem.contact]\nfriction = 0.7\n", "") + TABLES)
        write_table(path, folder)
        return bolide.invert(path, out=folder).folder


def test_one_of_several_values_is_found_or_said_not_to_be(file, tmp_path):
    """Friction of three values: where it takes a third off the diameter the likely one is named, elsewhere none."""
    text = file.read_text()
    values = '{ distribution = "choices", values = [0.2, 0.5, 0.8] }'
    file.write_text(text.replace('{ distribution = "uniform", low = 0.2, high = 0.8 }', values))
    text = file.read_text().replace('low = "10 km/s", high = "20 km/s"', 'low = "13.8 km/s", high = "14.2 km/s"')
    file.write_text(text)
    write_table(file, tmp_path, of_friction=lambda friction: -1.0 * (friction - 0.2))
    found = bolide.invert(file, out=tmp_path)
    assert "friction 0.2 (1" in found.verdict and "friction" in found.identified
    assert found.samples["friction"].value_counts(normalize=True).loc[0.2] > 0.97
    told = tomllib.loads((found.folder / "inverse.toml").read_text())
    [row] = [one for one in told["parameter"] if one["name"] == "friction"]
    assert row["values"] == [0.2, 0.5, 0.8] and sum(row["chances"]) == pytest.approx(1.0, abs=1e-3)
    assert row["chances"][0] == max(row["chances"]) and row["posterior_over_prior_width"] < 0.2
    assert "0.2 (1)" in (found.folder / "inverse.html").read_text()
    pandas.testing.assert_frame_equal(bolide.invert(found.folder).samples, found.samples)
    write_table(file, tmp_path)  # the same file, its table made by a law of little friction
    again = bolide.invert(file, out=tmp_path)
    assert "friction not identified" in again.verdict and again.summary.loc["friction", "width"] > 0.9


def test_a_value_that_no_member_has_is_refused(file, tmp_path):
    """A member a value, and one of them failed (``write_table``)."""
    values = f'"choices", values = [{", ".join(str(0.01 * k) for k in range(1, MEMBERS + 1))}]'
    file.write_text(file.read_text().replace('"uniform", low = 0.2, high = 0.8', values))
    write_table(file, tmp_path)
    with pytest.raises(InputError, match=r"no member with diameter_apparent_m has friction = 0\.[0-9]*: raise"):
        bolide.invert(file, out=tmp_path)


def test_errors_above_and_below_may_differ(file, tmp_path):
    """A crater that may be a good deal larger than it was read, and hardly smaller, was made faster; as much by the
    catalogue's file."""
    write_table(file, tmp_path)
    even = bolide.invert(file, out=tmp_path).summary.loc["impact.speed"]
    text = file.read_text()
    file.write_text(text.replace('["600 km", "6 km"]', '["600 km", "6 km", "60 km"]'))
    uneven = bolide.invert(file, out=tmp_path)
    speed = uneven.summary.loc["impact.speed"]
    assert speed["q50"] > even["q50"] + 0.5 * even["sd"] and speed["q95"] > even["q95"] + even["sd"]
    assert abs(speed["q5"] - even["q5"]) < even["sd"]
    assert "600 +60/−6 km" in (uneven.folder / "inverse.html").read_text()
    own = '[measures.diameter_apparent_m]\nvalue = "600 km"\nminus = "6 km"\nplus = "60 km"\n'
    (file.parent / "mine.toml").write_text(f'title = "Mine"\nsource = "a test"\n{own}')
    file.write_text(text.replace('["600 km", "6 km"]', '"mine.toml"'))
    assert bolide.invert(file, out=tmp_path).summary.loc["impact.speed", "q50"] == speed["q50"]


def test_no_discrepancy_is_said_and_narrows(file, tmp_path):
    write_table(file, tmp_path)
    usual = bolide.invert(file, out=tmp_path)
    zero = {"inverse.discrepancy.diameter_apparent_m": 0.0}
    bare = bolide.invert(file, out=tmp_path, **zero)
    assert bare.summary.loc["impact.speed", "width"] < 0.9 * usual.summary.loc["impact.speed", "width"]
    cautions = [tomllib.loads((one.folder / "inverse.toml").read_text())["cautions"] for one in (usual, bare)]
    assert [any("too narrow" in words for words in said) for said in cautions] == [False, True]


@pytest.mark.parametrize(
    "old, new, words",
    [
        (TABLES.partition("[sweep]")[0], "\n", r"has none \(run_case --describe inverse"),
        ('["600 km", "6 km"]', '["600 km", "0 km"]', "standard error must be greater than 0"),
        ('["600 km", "6 km"]', '["600 km", "-6 km"]', "standard error must be greater than 0"),
        ('["600 km", "6 km"]', '["600 kg", "6 kg"]', "not a quantity in m"),
        ('["600 km", "6 km"]', "[600, 6]", "must be a text with a unit, in m"),
        ('["600 km", "6 km"]', '["600 km"]', "a value with its standard error, or with one below"),
        ('["600 km", "6 km"]', '"sci_ryuga"', "did you mean 'sci_ryugu'"),
        ('["600 km", "6 km"]', '"ganymede_callisto_trend"', "has no diameter_apparent_m"),
        ("diameter_apparent_m = [", "diameter_aparent_m = [", "did you mean 'diameter_apparent_m'"),
        ('"transient/depth_m"', '"transient/rim_height_m"', "the sweep's table has no 'transient/rim_height_m'"),
        ("[inverse]", '[inverse]\nmodel = "pi_scalling"', "pi_scaling"),
        ("[inverse]", "[inverse]\nmeasured = 3", "measured"),
        ("= 0.02 }", "= 2.0 }", "a fraction from 0 to below 1"),
        ('kind = "prior"', 'kind = "sobol"', 'has kind = "sobol"'),
        ("low = 0.2, high = 0.8", "low = 0.2, high = 0.2", "low must be less than high"),
        ('"uniform", low = 0.2, high = 0.8', '"normal", mean = 0.2, sd = 0.0', "sd must be greater than 0"),
        ('"uniform", low = 0.2, high = 0.8', '"choices", values = []', "values is missing"),
        ('"uniform", low = 0.2, high = 0.8', '"choices", low = 0.2', "values is missing; choices takes no low"),
        ('["600 km", "6 km"]', '["600 km", "6 km", "-9 km"]', "standard error must be greater than 0"),
        ('["600 km", "6 km"]', '["600 km", "6 km", "9 s"]', "not a quantity in m"),
        ('["600 km", "6 km"]', '["600 km", "6 km", "9 km", "9 km"]', "or with one below and one above it"),
        ("{ diameter_apparent_m = 0.02 }", "{ depth_m = 0.02 }", "discrepancy: depth_m is not observed"),
    ],
)
def test_what_is_wrong_is_one_clear_message(file, tmp_path, old, new, words):
    write_table(file, tmp_path)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=words) as caught:
        invert_command.inverted(cases.read(file), tmp_path, [])
    assert len(str(caught.value).splitlines()) <= 3


def test_a_table_that_is_missing_or_too_short_is_refused(file, tmp_path):
    with pytest.raises(InputError, match=r"no table of the sweep at .*--sweep makes it"):
        bolide.invert(file, out=tmp_path)
    write_table(file, tmp_path, 8)
    with pytest.raises(InputError, match="7 of 32 members have diameter_apparent_m, and 2 parameters need 8 at least"):
        bolide.invert(file, out=tmp_path)
    with pytest.raises(InputError, match="leave out --forecast"):
        invert_command.inverted(cases.read(file), tmp_path, [(True, "--forecast"), (False, "--errors")])


def test_the_command_refuses_with_exit_code_2_and_no_traceback(file, tmp_path, drive):
    code, _, said = drive(file, "--invert", "--out", tmp_path)
    assert code == 2 and "no table of the sweep" in said and "Traceback" not in said


@pytest.mark.parametrize("check", [True, False])
@pytest.mark.parametrize(
    "old, new, words",
    [
        ('"sand_centrifuge_500g"', '"sand_centrifuge"', "did you mean 'sand_centrifuge_500g'?"),
        ('"sand_centrifuge_500g"', '["7.6 cm", "1 s"]', "'1 s' is not a quantity in m"),
        ("[inverse]", "[invrese]", "has none, but [invrese]"),
        ("members = 48", "member = 48", "did you mean 'members'?"),
        ('"uniform"', '"unifrom"', "did you mean 'uniform'?"),
        ('= "friction_angle"', '= "friction_agnle"', "did you mean 'friction_angle'?"),
        ("housen_holsapple_2003", "housen_holsaple_2003", "did you mean 'housen_holsapple_2003'?"),
    ],
)
def test_a_new_users_slip_is_said_with_exit_code_2(tmp_path, drive, old, new, words, check):
    text = SAND.read_text()
    assert old in text
    own = tmp_path / "own.toml"
    own.write_text(text.replace(old, new))
    code, _, said = drive(own, "--invert", *(["--check"] if check else []), "--out", tmp_path)
    assert code == 2 and words in said and "Traceback" not in said
    assert list(tmp_path.iterdir()) == [own]


def test_the_shipped_example_answers_by_scaling_laws(tmp_path, capsys):
    said = [line for line in EXAMPLE.read_text().splitlines() if line and not line.startswith("#")]
    assert len(said) <= 12
    assert invert_command.inverted(cases.read(EXAMPLE), tmp_path, []) == 0
    told = capsys.readouterr().out
    assert "cohesion below 0.2" in told and "Pa (95 %); density not identified" in told
    [folder] = tmp_path.iterdir()
    assert {one.name for one in folder.iterdir()} == {
        "corner.png", "left_out.png", "posterior.h5", "emulator.h5", "inverse.toml", "inverse.html"
    }  # fmt: skip
    # friction is not in the laws, and is said not to be identified
    text = EXAMPLE.read_text().replace("prior.density", "prior.friction_angle", 1)
    text = text.replace('mean = "1190 kg/m^3", sd = "100 kg/m^3"', 'mean = "30 deg", sd = "5 deg"')
    text = text.partition('derive."sph.materials.basalt.p_alpha')[0]
    text += 'derive."sph.materials.basalt.drucker_prager.friction_angle" = "friction_angle"\n'
    own = tmp_path / "own.toml"
    own.write_text(text)
    found = bolide.invert(own, out=tmp_path)
    assert found.identified == ["cohesion"] and found.summary.loc["friction_angle", "width"] > 0.9
    [line] = [row for row in (found.folder / "inverse.html").read_text().splitlines() if ">friction_angle<" in row]
    assert "°" in line


def test_a_laboratory_crater_does_not_give_its_friction_back_by_scaling_laws(tmp_path, capsys):
    """Sand at 500 g: 35 deg, no cohesion, 1.9 km/s. The laws have no friction in them, and say so; what they have
    comes back: cohesion below a limit that the crater's own weight sets, and the speed where it is asked for."""
    said = [line for line in SAND.read_text().splitlines() if line and not line.startswith("#")]
    assert len(said) <= 12
    capsys.readouterr()
    assert invert_command.inverted(cases.read(SAND), tmp_path, [], True) == 0
    told = capsys.readouterr().out
    assert "fixes 1 of 2 directions: cohesion" in told and "hardly depend on it: friction angle" in told
    found = bolide.invert(SAND, out=tmp_path)
    assert found.identified == ["cohesion"] and found.summary.loc["friction_angle", "width"] > 0.98
    weight = 1472.0 * 4905.0 * 0.076
    assert 0.1 * weight < found.summary.loc["cohesion", "q95"] < weight
    text = SAND.read_text()
    speed = 'prior."impact.speed" = { distribution = "log_uniform", low = "0.5 km/s", high = "6 km/s" }\n'
    lines = [line for line in text.splitlines() if "cohesion" not in line]
    (tmp_path / "speed.toml").write_text("\n".join(lines).replace("prior.friction", f"{speed}prior.friction"))
    row = bolide.invert(tmp_path / "speed.toml", out=tmp_path).summary.loc["impact.speed"]
    assert row["q16"] < 1900.0 < row["q84"] and row["width"] < 0.7
    (tmp_path / "few.toml").write_text(text.replace("members = 48", "members = 4"))
    with pytest.raises(InputError, match="4 of 4 members have diameter_apparent_m, and 2 parameters need 8 at least"):
        invert_command.inverted(cases.read(tmp_path / "few.toml"), tmp_path, [], True)
