"""Case files: overlays, shared tables, and every complaint at once with the line it stands on."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.case import shipped, stages, toml_lines
from pipeline.case.complaints import dotted
from pipeline.settings import used
from pipeline.settings.compose import compose, hash8
from pipeline.store import folder

REAL = dict(stages.MODULES)
VALHALLA = Path(__file__).resolve().parents[2] / "cases" / "valhalla_980km"


def composed(place: Path, *overrides: str, preset: str | None = None):
    return compose(cases.read(place, preset, overrides))


def complaint(place: Path, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        composed(place, *overrides)
    return str(caught.value)


@pytest.fixture(autouse=True)
def _fakes(fake_stages):
    """Every test here composes the settings of the fake stages."""


def test_shared_tables_reach_the_stages_that_declare_them(case_folder):
    settings = composed(case_folder)
    assert settings["sph"].target.radius == pytest.approx(1992e3)
    assert settings["sph"].impact.speed == settings["nbody"].impact.speed == 18234.0
    assert settings["bed"].contact.friction == settings["dem"].contact.friction == 0.7
    assert not hasattr(settings["crater"], "target")
    assert settings["nbody"].pinned is True


def test_a_key_inside_a_default_changes_only_that_key(case_folder):
    ocean = composed(case_folder, "dem.contact.ocean.rolling=0.3")["bed"].contact.ocean
    assert (ocean.rolling, ocean.width) == (0.3, 2.0)
    assert "did you mean 'rolling'" in complaint(case_folder, "dem.contact.ocean.roling=0.3")


def test_a_file_and_its_folder_are_the_same_case(case_folder):
    assert cases.read(case_folder) == cases.read(case_folder / "case.toml")


def test_everything_wrong_is_said_at_once_with_its_line(case_folder):
    file = case_folder / "case.toml"
    text = file.read_text()
    text = text.replace('spacing = "52 km"', 'spacng = "52 km"').replace('radius = "53.9 km"', 'radius = "-53.9 km"')
    text = text.replace('thickness = "150 km"', "thickness = 150").replace(
        'material = "basalt"', 'material = "bassalt"'
    )
    file.write_text(text)
    message = complaint(case_folder, "bed.radius=3 kg", "dem.contact.friction=7", "sph.eos=tilotson")
    lines = text.splitlines()
    for key, words in {
        "spacng": "sph.spacng: there is no such key; did you mean 'spacing'?",
        'radius = "-53.9': 'impact.projectile.radius: must be greater than 0 (given: "-53.9 km")',
        "thickness = 150": "target.layers[1].thickness: the unit is missing",
        "bassalt": "target.layers[0].material: unknown material 'bassalt'; did you mean 'basalt'?",
    }.items():
        line = next(number for number, line in enumerate(lines, 1) if key in line)
        assert f"case.toml:{line}  {words}" in message
    assert "--set bed.radius  bed.radius: '3 kg' is not a quantity in m" in message
    assert "--set dem.contact.friction  dem.contact.friction: must be at most 2 (given: 7)" in message
    assert "did you mean 'tillotson'" in message
    assert "7 errors" in message
    assert message.count("unknown material") == 1  # the shared target reaches two checks and is complained about once


def test_a_misspelt_table_and_a_missing_one(case_folder):
    file = case_folder / "case.toml"
    file.write_text(file.read_text().replace("[sph]", "[shp]").replace("[impact", "[impct"))
    message = complaint(case_folder)
    assert "shp: there is no such table; did you mean 'sph'?" in message
    assert "impct: there is no such table; did you mean 'impact'?" in message
    assert "impact: is missing" in message


def test_a_preset_lies_over_the_case_and_an_option_over_both(case_folder):
    assert composed(case_folder)["sph"].steps == 60
    assert composed(case_folder, preset="quick")["sph"].steps == 20
    assert composed(case_folder, "sph.steps=7", preset="quick")["sph"].steps == 7
    assert composed(case_folder, "target.layers.1.thickness=100 km")["sph"].target.radius == pytest.approx(1942e3)


def test_the_preset_thesis_is_taken_unless_another_is_asked_for(case_folder):
    file = case_folder / "case.toml"
    file.write_text(file.read_text() + "\n[preset.thesis.sph]\nsteps = 90\n")
    assert cases.read(case_folder).preset == "thesis"
    assert composed(case_folder)["sph"].steps == 90
    assert composed(case_folder, preset="quick")["sph"].steps == 20


def test_an_error_inside_a_preset_names_the_preset_line(case_folder):
    file = case_folder / "case.toml"
    file.write_text(file.read_text().replace("steps = 20", 'steps = "many"'))
    with pytest.raises(InputError, match=r"case.toml:31  sph.steps: must be a whole number \(given: \"many\"\)"):
        composed(case_folder, preset="quick")
    assert file.read_text().splitlines()[30] == 'steps = "many"'


@pytest.mark.parametrize(
    ("overrides", "preset", "words"),
    [
        ((), "quik", "no preset 'quik'; did you mean 'quick'?"),
        (("sph.steps",), None, "write it as key.path=value"),
        (("sph.steps.x=1",), None, "sph.steps: must be a whole number"),
        (("target.layers.5.thickness=1 km",), None, "there are 2 elements"),
        (("impact.speed=18",), None, "the unit is missing"),
        (("impact.speed=18 km",), None, "is not a quantity in m/s"),
        (("impact.angle_from_vertical=95 deg",), None, "must be at least 0 and less than 90 deg"),
        (("impact.speed=fast",), None, "cannot read 'fast' as a quantity"),
        (("impact.speed=nan",), None, "the unit is missing"),
        (("case.titel=x",), None, "did you mean 'title'"),
        (("target.layers=[]",), None, "target.layers"),
        (("sph=3",), None, "sph: is a table"),
    ],
)
def test_bad_input_is_a_message(case_folder, overrides, preset, words):
    with pytest.raises(InputError, match=words):
        composed(case_folder, *overrides, preset=preset)


def test_broken_toml_and_no_file_are_messages(tmp_path):
    with pytest.raises(InputError, match="no case at"):
        cases.read(tmp_path)
    (tmp_path / "case.toml").write_text("[case\n")
    with pytest.raises(InputError, match=r"not valid TOML.*line 1"):
        cases.read(tmp_path)
    (tmp_path / "case.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not valid TOML"):
        cases.read(tmp_path)
    (tmp_path / "case.toml").write_text("preset = 3\n")
    with pytest.raises(InputError, match="presets are tables"):
        cases.read(tmp_path)


def test_a_stage_that_is_not_installed_matters_only_when_it_would_run(case_folder, monkeypatch):
    from pipeline.case import stages

    monkeypatch.setitem(stages.MODULES, "crater", "fake_nowhere.stage")
    with pytest.raises(InputError, match="stage 'crater' is not part of this installation"):
        composed(case_folder)
    assert set(compose(cases.read(case_folder), ("nbody", "sph"))) == {"nbody", "sph", "bed", "handoff", "dem"}


def test_the_run_folder_name_follows_what_is_computed(case_folder):
    plain = hash8(cases.read(case_folder))
    assert len(plain) == 8
    assert plain != hash8(cases.read(case_folder, "quick"))
    assert plain != hash8(cases.read(case_folder, None, ["sph.steps=7"]))
    file = case_folder / "case.toml"
    file.write_text("# a comment\n" + file.read_text().replace("A small impact", "A small impact."))
    assert hash8(cases.read(case_folder)) == plain
    # not what was typed: a value that holds, in another unit, in another order, by a preset or by options
    assert hash8(cases.read(case_folder, None, ["impact.speed=18234 m/s", "sph.steps=60"])) == plain
    assert hash8(cases.read(case_folder, None, ["sph.steps=60", "impact.speed=18.234 km/s"])) == plain
    assert hash8(cases.read(case_folder, None, ["sph.steps=20"])) == hash8(cases.read(case_folder, "quick"))


def test_the_used_case_is_a_case_with_the_same_settings(case_folder, tmp_path):
    first = cases.read(case_folder, "quick", ["sph.spacing=33.3333333333 km"])
    before = compose(first)
    used.write(tmp_path / "case.used.toml", first, before)
    after = composed(tmp_path / "case.used.toml")
    assert {stage: folder.settings_text(item) for stage, item in after.items()} == {
        stage: folder.settings_text(item) for stage, item in before.items()
    }
    content = tomllib.loads((tmp_path / "case.used.toml").read_text())
    assert content["impact"]["speed"] == "18234.0 m/s"
    assert content["bed"]["radius"] == "1000.0 m"  # a default
    assert "contact" not in content["bed"] and content["dem"]["contact"]["friction"] == 0.7


def test_lines_of_keys_are_found_in_unusual_files():
    text = (
        'a.b = 1\n[x]\ntext = """\n[y]\nz = 3\n"""\n"quoted key" = 2\n[[x.list]]\nq = 1\n[[x.list]]\nq = { r = 2 '
        "}\n[x.list.inner]\nw = 1\n"
    )
    lines = toml_lines.key_lines(text)
    assert lines["a", "b"] == 1
    assert lines["x", "text"] == 3
    assert ("y",) not in lines and ("x", "z") not in lines
    assert lines["x", "quoted key"] == 7
    assert lines["x", "list", 0, "q"] == 9 and lines["x", "list", 1, "q"] == 11
    assert lines["x", "list", 1, "inner", "w"] == 13
    assert toml_lines.line_of(("x", "list", 1, "q", "r"), lines) == 11
    assert toml_lines.line_of(("nowhere",), lines) is None
    assert dotted(("x", "list", 1, "q")) == "x.list[1].q"


def test_speed_and_angle_may_be_left_to_the_encounters(case_folder, tmp_path):
    file = case_folder / "case.toml"
    text = file.read_text().replace('speed = "18.234 km/s"\n', "").replace('angle_from_vertical = "40 deg"\n', "")
    file.write_text(text)
    case = cases.read(case_folder)
    assert not case.pinned
    found = tmp_path / "impact.toml"
    found.write_text(
        'speed = "9.6 km/s"\nangle_from_vertical = "45 deg"\n[projectile]\nmaterial = "ice"\nradius = "10 km"\n'
    )
    impact = compose(cases.with_impact(case, found))["sph"].impact
    assert impact.speed == pytest.approx(9600.0)
    assert impact.projectile.radius == pytest.approx(10e3)  # the file is the one truth about the impact
    assert compose(case)["nbody"].pinned is False
    found.write_text('speed = "10 km"\nangle_from_vertical = "30 deg"\n')
    with pytest.raises(InputError, match=r"impact\.speed"):
        compose(cases.with_impact(case, found))


def test_an_impact_from_elsewhere_wins_over_the_case(case_folder, tmp_path):
    (case_folder / "mine.toml").write_text('speed = "9.6 km/s"\nangle_from_vertical = "45 deg"\n')
    impact = composed(case_folder, f"nbody.impact={case_folder / 'mine.toml'}")["sph"].impact
    assert impact.speed == pytest.approx(9600.0)
    (case_folder / "mine.toml").write_text('speed = "-9.6 km/s"\n')
    assert "impact.speed: must be greater than 0" in complaint(
        case_folder, f"nbody.impact={case_folder / 'mine.toml'}"
    )
    assert "nbody.impact: no file at" in complaint(case_folder, "nbody.impact=nowhere.toml")


def test_a_case_may_have_some_of_the_stages(case_folder, tmp_path):
    file = case_folder / "case.toml"
    text = file.read_text().replace('source = "Winter 2017"\n', 'source = "Winter 2017"\nstages = ["sph", "crater"]\n')
    text = text.replace("[nbody]\n", "")
    file.write_text(text.replace("[dem.contact]\nfriction = 0.7\n", ""))
    case = cases.read(case_folder)
    settings = compose(case)
    assert case.stages == tuple(settings) == ("sph", "crater")
    used.write(tmp_path / "case.used.toml", case, settings)
    assert cases.read(tmp_path / "case.used.toml").stages == ("sph", "crater")
    file.write_text(text)
    assert "dem: [case] stages does not include dem" in complaint(case_folder)
    file.write_text(text + '\n[preset.shock.case]\nstages = ["sph", "crater"]\n')
    assert "dem: [case] stages does not include dem" in complaint(case_folder)
    # a preset may leave stages out that the case has tables for
    whole = (case_folder / "case.toml").read_text().replace('stages = ["sph", "crater"]\n', "", 1)
    file.write_text(whole)
    assert tuple(composed(case_folder, preset="shock")) == ("sph", "crater")
    file.write_text(whole + '\n[preset.shock.dem]\nend_time = "1 s"\n')
    with pytest.raises(InputError, match=r"dem: \[case\] stages does not include dem"):
        composed(case_folder, preset="shock")
    file.write_text(text.replace('"crater"]', '"krater"]'))
    assert "case.stages" in complaint(case_folder)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        # the right name, where spelling alone would lead elsewhere
        (("impact.projectile.diameter=3 km",), "impact.projectile.diameter: there is no such key; did you mean "
                                               "'radius' (half the diameter)?"),
        (("impact.angle=40 deg",), "did you mean 'angle_from_vertical' (0 is head-on)?"),
        (("impact.velocity=4 km/s",), "did you mean 'speed'?"),
        (("target.radius=4 km",), "did you mean 'layers' (the thicknesses of all layers add up to the radius)?"),
        (("target.layers.0.radius=4 km",), "did you mean 'thickness' (from the bottom of the layer to its top"),
        (("impact.projectile.mass=4 kg",), "did you mean 'radius' (with the density of the material)?"),
        (("speed=4 km/s",), "--set speed  speed: there is no such table here; did you mean 'impact.speed'?"),
        (("sph.friction=0.4",), "sph.friction: there is no such key here; did you mean 'dem.contact.friction'"),
        # degrees where degrees are meant
        (("impact.angle_from_vertical=40",), "impact.angle_from_vertical: the unit is missing: write it as a string, "
                                             "'40 deg' for example"),
        (('impact.angle_from_vertical="40"',), "write it like '40 deg'"),
        # the option, where an option was wrong
        (("dem.contact.shel.friction=0.4",), "--set dem.contact.shel.friction  dem.contact.shel: there is no such "
                                             "key"),
        (("impact.angle_from_vertical=95 deg",), "impact.angle_from_vertical: must be at least 0 and less than 90 "
                                                 "deg (given: 95 deg; 0 is straight down)"),
        # what a value is, in a user's words
        (("dem.contact.friction=nan",), "dem.contact.friction: nan is not a finite number"),
        (("sph.steps=2.5",), "sph.steps: must be a whole number (given: 2.5)"),
        (("case.stages=sph",), 'case.stages: must be a list, ["sph"] for example (given: "sph")'),
        (("impact.speed",), "--set 'impact.speed': write it as key.path=value, --set 'sph.end_time=30 min' for "
                            "example"),
    ],
)  # fmt: skip
def test_a_message_says_what_to_write(case_folder, overrides, words):
    message = complaint(case_folder, *overrides)
    assert words in message and "1 error:" in message, message


def test_an_innocent_option_is_not_blamed(case_folder):
    file = case_folder / "case.toml"
    file.write_text(file.read_text().replace('"40 deg"', '"95 deg"'))
    message = complaint(case_folder, "impact.speed=3 km/s", "sph.steps=3")
    assert "--set" not in message and "case.toml:17  impact.angle_from_vertical:" in message


def test_a_mistake_in_the_stages_is_one_error(case_folder):
    message = complaint(case_folder, 'case.stages=["sph", "krater"]')
    assert (
        "1 error:" in message and "--set case.stages  case.stages[1]" in message and "did you mean 'crater'" in message
    )


def test_a_value_of_several_kinds_is_one_complaint():
    place = Path(__file__).resolve().parents[2] / "cases" / "valhalla_980km"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "MODULES", REAL)
        message = complaint(
            place,
            "handoff.time=later",
            "handoff.offset=x",
            "sph.materials.ice.strenth=x",
            "dem.accept=no_twist",
            "handoff.waive.x=3",
        )
    for words in (
        '--set handoff.time  handoff.time: must be "auto" or "last"',
        "or: cannot read 'later' as a quantity: write a number and a unit, '1.5 s' for example (given: \"later\")",
        '--set handoff.offset  handoff.offset: must be "auto", or: must be a number (given: "x")',
        "sph.materials.ice.strenth: there is no such key; did you mean 'strength'?",
        'dem.accept: must be a list, ["no_twist"] for example',
        "handoff.waive.x: must be a text in quotes (given: 3)",
    ):
        assert words in message, message
    assert "5 errors" in message and "functools" not in message and "function" not in message


def test_a_shipped_case_is_known_by_its_name_and_can_be_copied(tmp_path, monkeypatch, call):
    monkeypatch.chdir(tmp_path)
    assert cases.read(Path("valhalla_980km"), "tiny").file == VALHALLA / "case.toml"
    with pytest.raises(InputError, match=r"no case at valhala_980km.*did you mean 'valhalla_980km'"):
        cases.read(Path("valhala_980km"))
    done = call("run_case", "--copy", "valhalla_980km", "mine", cwd=tmp_path)
    assert (
        done.returncode == 0 and (tmp_path / "mine" / "case.toml").read_text() == (VALHALLA / "case.toml").read_text()
    ), done.stderr
    (tmp_path / "valhalla_980km").mkdir()  # what is there comes before what ships
    with pytest.raises(InputError, match="no case at valhalla_980km"):
        cases.read(Path("valhalla_980km"))
    with pytest.raises(InputError, match="is there already"):
        shipped.copy("valhalla_980km", Path("mine"))
    with pytest.raises(InputError, match="did you mean 'valhalla_980km'"):
        shipped.copy("valhala_980km", Path("new"))
