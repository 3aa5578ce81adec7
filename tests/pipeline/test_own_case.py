"""A case of ten lines: what it leaves open is filled in sensibly for every size of projectile and target, and it runs
from an empty folder to the report."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import bolide
from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.running import prediction
from pipeline.running.request import Request, sensible, settings_of
from pipeline.settings import sense
from pipeline.settings.compose import compose
from sph import cost_prediction
from sph.planning import resolution
from sph.stepping import sides_and_floor

ROOT = Path(__file__).resolve().parents[2]
OWN = ROOT / "examples" / "own_case.toml"
HALF_SPACE = 'shape = "half_space"\ngravity = "9.81 m/s^2"\nlayers = [{ material = "granite" }]'
BODY = """layers = [
  { material = "iron", thickness = "1500 km" },
  { material = "basalt", thickness = "1400 km" },
  { material = "granite", thickness = "100 km" },
]"""
IMPACT = (
    '\n\n[impact]\nspeed = "12 km/s"\nangle_from_vertical = "45 deg"\nprojectile = { material = "granite", radius = '
    '"%s" }\n'
)
FEW = "particles per projectile radius, fewer than 5: the result will be NOT RESOLVED and without errors"
RADII = {"1 m": "0.5 m", "200 m": "100 m", "50 km": "25 km"}


def written(place: Path, target: str, size: str) -> Path:
    file = place / "mine.toml"
    file.write_text("[target]\n" + target + IMPACT % RADII[size])
    return file


def test_the_case_has_ten_lines_and_no_numerical_key():
    lines = [line for line in OWN.read_text().splitlines() if line and not line.startswith("#")]
    assert len(lines) <= 10 and not any(
        line.startswith(("[sph", "[bed", "[handoff", "[dem", "[crater", "[case")) for line in lines
    )


@pytest.mark.parametrize(("size", "held"), [("1 m", True), ("200 m", False), ("50 km", False)])
def test_a_half_space_is_filled_in_for_every_projectile(tmp_path, size, held):
    case = cases.read(written(tmp_path, HALF_SPACE, size), size="quick")
    request = Request(case, tmp_path)
    settings = settings_of(request)
    sph, diameter = settings["sph"], settings["sph"].impact.expected_transient_diameter
    said = sensible(request, settings)  # the crater of a large projectile is few of its radii wide
    few = cost_prediction.per_radius(sph) < 5.0
    assert len(said) == few == (size != "50 km") and all(FEW in words for words in said)
    assert f"in {sph.target.layers[-1].material}, by the scaling laws of " in sense.in_words(settings)
    assert case.stages == (("sph", "crater") if held else ("sph", "bed", "handoff", "dem", "crater"))
    assert ("strength holds it" in sense.in_words(settings)) == held
    assert ("the chain ends" in sense.in_words(settings)) == held  # unless a case asks for a collapse all the same
    assert "chain ends" not in sense.in_words(dict(settings, dem=settings["sph"]))
    rows = prediction.predictions(request, settings)
    assert resolution.count(sph.target, sph.zones) == pytest.approx(20_000, rel=0.03)
    assert sum(row["wall_s"] for row in rows.values()) < 3600.0
    # the crater and the quiet layer fit into the ground, the projectile has two particles per radius
    assert (
        sph.target.half_width - sides_and_floor.layers(sph)["quiet"] > 1.2 * 0.5 * diameter
        and sph.target.radius > 2.0 * diameter
    )
    assert sph.impact.projectile.radius / sph.zones.contact >= 2.0 and 0.5 * diameter / sph.zones.fine > 8.0
    assert sph.relaxation_time == 0.0 and settings["crater"].ground == "rock"


def test_a_body_is_filled_in_and_one_that_is_too_large_is_told_to_be_flat(tmp_path):
    request = Request(cases.read(written(tmp_path, BODY, "50 km"), size="quick"), tmp_path)
    settings = settings_of(request)
    (warning,) = sensible(request, settings)
    assert warning.startswith("3.4 particles") and f"{FEW} (--size standard has 10)" in warning
    assert request.case.stages == ("sph", "bed", "handoff", "dem", "crater")
    # sound takes 1500 km / 4070 m/s + 1400 km / 3145 m/s + 100 km / 4319 m/s through the radius
    assert settings["sph"].relaxation_time == pytest.approx(1.5 * 836.0, rel=0.05)
    assert settings["bed"].arc_radius == pytest.approx(1.65 * settings["bed"].impact.expected_transient_diameter)
    request = Request(cases.read(written(tmp_path, BODY, "200 m"), size="quick"), tmp_path)
    assert any(
        'shape = "half_space", gravity = "2.8 m/s^2"' in text for text in sensible(request, settings_of(request))
    )
    request = Request(cases.read(written(tmp_path, BODY, "1 m"), size="quick"), tmp_path)
    with pytest.raises(InputError, match=r"is lost among particles .* take it as a half space"):
        sensible(request, settings_of(request))


@pytest.mark.parametrize(("size", "particles"), [("quick", 20_000), ("standard", 300_000), ("fine", 1_400_000)])
def test_a_size_aims_at_a_number_of_particles_and_grains(tmp_path, size, particles):
    request = Request(cases.read(OWN, size=size), tmp_path)
    settings = settings_of(request)
    assert prediction.predictions(request, settings)["sph"]["particles"] == pytest.approx(particles, rel=0.03)
    assert settings["bed"].count == particles
    shipped = settings_of(Request(cases.read(ROOT / "cases" / "valhalla_980km", size=size), tmp_path))
    assert shipped["bed"].count == particles and shipped["sph"].end_time == 3600.0
    request = Request(cases.read(ROOT / "cases" / "valhalla_980km", size=size), tmp_path)
    assert prediction.predictions(request, shipped)["sph"]["particles"] == pytest.approx(particles, rel=0.03)


def test_a_size_is_refused_with_a_preset_and_when_unknown():
    with pytest.raises(InputError, match="both say how fine"):
        cases.read(ROOT / "cases" / "valhalla_980km", "tiny", size="quick")
    with pytest.raises(InputError, match="did you mean 'quick'"):
        cases.read(OWN, size="quik")


def test_a_check_takes_less_than_two_seconds_of_its_own(tmp_path):
    settings_of(Request(cases.read(OWN), tmp_path))  # imports
    began = time.process_time()
    request = Request(cases.read(OWN, size="fine"), tmp_path)
    settings = settings_of(request)
    sensible(request, settings), prediction.words(request, settings), prediction.predictions(request, settings)
    assert time.process_time() - began < 2.0


def test_a_liquid_without_weight_has_no_expected_crater(tmp_path):
    message = "neither weight nor strength ends the growth"
    with pytest.raises(InputError, match=message):
        compose(cases.read(OWN, None, ("target.layers.0.material=water", 'target.gravity="0 m/s^2"')))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (['sph.materials.granite.strength="drucker_prager"'], "sph"),
        (['target.gravity="0 m/s^2"', "bed.count=500"], "without gravity no crater collapses"),
        (["sph.materials.basalt.predamaged=true"], "material 'basalt' is not used in this run"),
        (['sph.particles="many"'], "sph.particles"),
    ],
)
def test_a_default_that_cannot_be_worked_out_is_a_message(changes, words):
    with pytest.raises(InputError, match=words):
        compose(cases.read(OWN, None, changes))


def test_too_few_particles_are_as_few_as_make_sense():
    sph = compose(cases.read(OWN, None, ["sph.particles=500"]))["sph"]
    # the contact's two particles per projectile radius and the grading from there take some 6,000
    assert (
        500 < resolution.count(sph.target, sph.zones) < 7000
        and sides_and_floor.layers(sph)["quiet"] < 0.4 * sph.target.radius
    )


def test_what_follows_from_a_mistake_is_no_second_one(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(OWN.read_text().replace('speed = "12 km/s"', 'speed = "12 km"'))
    with pytest.raises(InputError) as caught:
        compose(cases.read(file))
    assert "1 error" in str(caught.value) and "is not a quantity in m/s" in str(caught.value)


def test_the_impact_of_the_encounters_sizes_the_crater_anew(tmp_path):
    file = tmp_path / "mine.toml"
    left = [line for line in OWN.read_text().splitlines() if not line.startswith(("speed", "angle"))]
    file.write_text("\n".join([*left, "[nbody]"]))
    case = cases.read(file)
    assert case.stages[0] == "nbody"
    found = tmp_path / "impact.toml"
    found.write_text('speed = "30 km/s"\nangle_from_vertical = "45 deg"\n')
    faster = cases.with_impact(case, found)
    before, after = (compose(one)["sph"].impact.expected_transient_diameter for one in (case, faster))
    assert after / before == pytest.approx((30.0 / 15.0) ** 0.44, rel=0.05)


@pytest.mark.validation
def test_ten_lines_run_from_an_empty_folder_to_the_report(tmp_path):
    """The 50 km sphere: with fewer particles and grains than any ``--size`` has, all five stages run and the page of
    the crater is written."""
    file = written(tmp_path, HALF_SPACE, "50 km")
    command = [
        sys.executable,
        "-c",
        "from pipeline.cli import run_case; run_case()",
        str(file),
        "--threads",
        "1",
        "--out",
        str(tmp_path / "runs"),
    ]
    ended = subprocess.run(
        [*command, "--set", "sph.particles=3000", "--set", "bed.count=1000"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode in (0, 1), ended.stderr  # 1: so few grains fail rows of the handoff's ledger
    (run,) = (tmp_path / "runs").glob("mine-*")
    assert "Traceback" not in ended.stderr and (run / "6_crater" / "report.html").exists()
    measures = json.loads((run / "6_crater" / "measures.json").read_text())
    transient = measures["transient"]["diameter_apparent_m"]["value"]
    # scaling laws of rock give 150 km; two particles per crater radius find it within a third
    assert 100e3 < transient < 200e3


MISTAKES = {
    "speed": ("speed", None, r"\n.*own\.toml:\d+  impact\.speed: is missing, \"15 km/s\" for example .*\[nbody\]\)$"),
    "angle": ("angle", None, r"\n.* impact\.angle_from_vertical: is missing, \"45 deg\" for example"),
    "gravity": (
        "gravity",
        None,
        r"\n.* target\.gravity: is missing: flat ground needs it, .*\"0 m/s\^2\" where none acts",
    ),
    "95 deg": (
        "angle",
        'angle_from_vertical = "95 deg"',
        r"\n.*impact\.angle_from_vertical: .*90 deg \(given: 95 deg; 0",
    ),
    "axes": ("gravity", 'gravity = "1 m/s^2"\naxes = ["1 m", "1 m", "1 m"]', r"\n.* target: axes: needed by shape"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_the_mistakes_of_the_first_day_are_each_told_as_what_they_are(tmp_path, call, name):
    """One line for one mistake: what follows from it is not told, and nothing is taken in its place."""
    key, instead, words = MISTAKES[name]
    text = OWN.read_text().splitlines()
    assert sum(line.startswith(key) for line in text) == 1
    changed = [(instead or "") if line.startswith(key) else line for line in text]
    (tmp_path / "own.toml").write_text("\n".join(changed))
    done = call("run_case", tmp_path / "own.toml", "--check", cwd=tmp_path)
    assert done.returncode == 2 and ", 1 error:" in done.stderr, done.stdout + done.stderr
    assert re.search(words, done.stderr.strip(), re.DOTALL), done.stderr


def test_encounters_find_speed_and_angle_together(tmp_path):
    text = OWN.read_text()
    for gone, left in (("speed", "angle_from_vertical"), ("angle", "speed")):
        own = "\n".join(line for line in text.splitlines() if not line.startswith(gone))
        (tmp_path / "own.toml").write_text(own + "\n[nbody]\n")
        with pytest.raises(InputError, match=rf"1 error:\n.*impact\.{left}: .*give both, or leave both out"):
            compose(cases.read(tmp_path / "own.toml"))
    (tmp_path / "own.toml").write_text(
        "\n".join(x for x in text.splitlines() if x[:5] not in ("speed", "angle")) + "\n[nbody]"
    )
    assert (
        cases.read(tmp_path / "own.toml").stages[0] == "nbody"
        and not compose(cases.read(tmp_path / "own.toml"))["nbody"].pinned
    )


@pytest.mark.parametrize(("material", "said"), [("sandstone", True), ("granite", False), ("copper", False)])
def test_strength_that_does_not_fall_with_size_is_said(tmp_path, material, said):
    """Granite has flaws; the sandstone's 1.5 MPa holds a crater of metres whatever its size."""
    text = "[target]\n" + HALF_SPACE.replace("granite", material) + IMPACT % "0.5 m"
    (tmp_path / "mine.toml").write_text(text)
    request = Request(cases.read(tmp_path / "mine.toml", size="quick"), tmp_path)
    settings = settings_of(request)
    assert sense.crater(settings["sph"]).held
    assert any("does not fall with size" in words for words in sensible(request, settings)) == said


def test_a_crater_in_the_sea_and_a_body_that_breaks_get_no_grains(tmp_path):
    """A crater in water is measured, a body that breaks ends with its fragments."""
    sea = 'shape = "half_space"\ngravity = "9.81 m/s^2"\nlayers = [{ material = "basalt" }, %s]'
    ball = 'layers = [{ material = "basalt", thickness = "%s" }]'
    potato = 'shape = "ellipsoid"\naxes = ["80 km", "70 km", "60 km"]\nlayers = [{ material = "regolith_ryugu" }]'
    for target, stages, words in (
        (potato, ("sph", "crater"), "by the scaling laws of sand"),
        (sea % '{ material = "water", thickness = "50 km" }', ("sph", "crater"), "waves close a cavity in a liquid"),
        (sea % '{ material = "water", thickness = "10 m" }', ("sph", "bed", "handoff", "dem", "crater"), "in basalt"),
        (ball % "1 km", ("sph",), "breaks as a whole"),
        (ball % "30 km", ("sph", "crater"), "in basalt"),
    ):
        request = Request(cases.read(written(tmp_path, target, "200 m"), size="quick"), tmp_path)
        settings = settings_of(request)
        assert request.case.stages == stages and words in sense.in_words(settings), target
        assert settings["sph"].impact.expected_transient_diameter <= 2e3 or stages != ("sph",)
    file = written(tmp_path, ball % "1 km", "200 m")
    asked = cases.read(file, None, ['case.stages=["sph", "crater"]'], size="quick")
    assert "expected transient crater" in sense.in_words(settings_of(Request(asked, tmp_path)))


@pytest.mark.parametrize(("material", "said"), [("dunite", True), ("water", False), ("granite", False)])
def test_ground_whose_strength_is_not_known_is_said(tmp_path, material, said):
    text = "[target]\n" + HALF_SPACE.replace("granite", material) + IMPACT % "100 m"
    (tmp_path / "mine.toml").write_text(text)
    request = Request(cases.read(tmp_path / "mine.toml", size="quick"), tmp_path)
    assert any("flows like a liquid" in words for words in sensible(request, settings_of(request))) == said


@pytest.mark.validation
@pytest.mark.parametrize(
    "end",
    [
        "8 s",
        pytest.param(
            "16 s",
            marks=pytest.mark.xfail(strict=True, reason="8.2 % deeper: not converged in c (docs/results/sph_late)"),
        ),
    ],
)
def test_the_late_stage_that_follows_leaves_the_crater_of_the_rocks_own_sound_speed(tmp_path, end):
    """Ten lines in a shock stage of 3,000 particles: depth and apparent diameter at the formation time, and at twice
    that, within 8 % of a run that keeps the moduli of the rock and takes the late viscosity at the same moment.
    Measured with 6,000: 3 and 2 %; 8.1 % of the depth at twice the time. Without a late viscosity the crater stays
    narrower by a fifth (docs/results/sph_late)."""
    few = {"case.stages": ["sph", "crater"], "sph.particles": 3000, "sph.end_time": end}
    switch = settings_of(Request(cases.read(OWN)))["sph"].late.at
    stiff = {"sph.late": {"at": f"{switch} s", "sound_speed": "20 km/s"}}

    def crater(**settings):
        found = bolide.run(OWN, out=tmp_path, threads=1, quiet=True, **few, **settings).measures["final"]
        return [found[name].value for name in ("depth_m", "diameter_apparent_m")]

    assert crater() == pytest.approx(crater(**stiff), rel=0.08)
