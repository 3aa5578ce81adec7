"""A case's own densities (``[sph.materials]``) reach what the other stages expect, and stand in no file of theirs."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from matter.case import at_rest, formation_time
from matter.case.body import Impact, Target
from matter.case.identity_fields import identity_fields
from matter.errors import InputError
from matter.particles import Particles
from pipeline.case import keys
from pipeline.case import read as cases
from pipeline.commands import schema
from pipeline.running import prediction
from pipeline.running.request import Request
from pipeline.settings import compose, used

CASES = Path(__file__).parents[2] / "cases"
DART = CASES / "dart_dimorphos"
PLAIN = (
    "sph.materials.basalt.tillotson.rho0=2700 kg/m^3",
    "sph.materials.basalt.p_alpha.alpha0=1.0000001",
)
"""The body as dense as the library's basalt."""
BALL = Target.model_validate(
    {"layers": [{"name": name, "material": "basalt", "thickness": 4e3} for name in ("core", "shell")]}
)
SHOT = Impact.model_validate(
    {
        "speed": 5e3,
        "angle_from_vertical": 0.0,
        "projectile": {"material": "ice", "radius": 100.0},
        "expected_transient_diameter": 2e3,
    }
)
STAGES = ("bed", "handoff", "dem")
SIZES = (*prediction.SIZES, *prediction.MEASURES)


def composed(*overrides: str) -> dict:
    return compose.compose(cases.read(DART, "quick", overrides))


def test_every_stage_hears_of_them():
    settings = composed()
    for stage in STAGES:
        own = settings[stage].densities
        assert set(own) == {"basalt", "aluminum"}
        assert own["basalt"].solid == 3500.0 and own["basalt"].bulk == pytest.approx(1540.0, rel=1e-4)
        assert own["aluminum"].bulk == pytest.approx(1000.0, rel=1e-3)


def test_times_of_the_collapse_and_what_comes_back_go_by_them():
    """T goes as 1 / sqrt(g) and g as the bulk density: 1,540 kg/m^3, of which the shock stage's own target.json says
    the same."""
    from sph import stage

    settings = composed()
    facts = stage.target_facts(settings["sph"])
    gravity = at_rest.surface_gravity(settings["dem"].target, settings["dem"].densities)
    assert gravity == pytest.approx(facts["surface_gravity_m_s2"], rel=1e-9)
    T = formation_time.of_crater(settings["dem"].impact.expected_transient_diameter, gravity)
    assert settings["dem"].still_interval == float(f"{5 / 6 * T:.2g}")
    assert composed(*PLAIN)["dem"].still_interval < settings["dem"].still_interval
    shared = {name: getattr(settings["handoff"], name) for name in ("target", "impact", "densities")}
    assert type(settings["handoff"])(**shared).until == float(f"{10.0 * T:.2g}")
    assert type(settings["dem"])(**shared).end_time == float(f"{5.0 * T:.2g}")


@pytest.mark.validation
def test_the_step_that_a_bed_is_expected_to_have_goes_by_them():
    """k goes as the pressure, rho g, and m as rho: the step as 1 / sqrt(g)."""
    steps = []
    for overrides in ((), PLAIN):
        case = cases.read(DART, "quick", overrides)
        steps.append(prediction.predictions(Request(case), compose.compose(case))["bed"]["bed_step"])
    assert steps[0] / steps[1] == pytest.approx(math.sqrt(2700.0 / 1540.0), rel=1e-3)


def test_the_step_of_a_spheres_grains_goes_by_their_mass():
    """m goes as the bulk density; k as rho g, its square, in a shallow bed, and 2 K r in a deep one."""
    from dem.beds import expected_grains
    from dem.beds.settings import Settings

    large = BALL.model_copy(update={"layers": (BALL.layers[0].model_copy(update={"thickness": 2.0e6}),)})
    for ball, depth, ratio in ((BALL, None, math.sqrt(2.0)), (large, 2.0e5, math.sqrt(0.5))):
        steps = [
            expected_grains.expected(Settings(target=ball, impact=SHOT, densities=own, depth=depth)).step
            for own in ({}, {"basalt": at_rest.AtRest(solid=2700.0, bulk=1350.0)})
        ]
        assert steps[1] / steps[0] == pytest.approx(ratio, rel=1e-9)


def test_nothing_is_said_where_the_file_is_right():
    settings = compose.compose(cases.read(CASES / "valhalla_980km", "quick"))
    assert [settings[stage].densities for stage in STAGES] == [{}, {}, {}]


def test_they_are_no_keys(tmp_path):
    """They follow from ``[sph.materials]``: told nowhere else, or a changed value there would leave them behind. So do
    the sizes that a prediction takes from the stages before."""
    case = cases.read(DART, "quick")
    settings = compose.compose(case)
    assert all("densities" not in identity_fields(settings[stage]) for stage in STAGES)
    used.write(tmp_path / "case.used.toml", case, settings)
    assert "densities" not in (tmp_path / "case.used.toml").read_text()
    again = compose.compose(cases.read(tmp_path / "case.used.toml"))
    assert again["bed"].densities == settings["bed"].densities
    assert "densities" not in [key.path[-1] for table in keys.tables("bed") for key in keys.keys(table)]
    assert "densities" not in [part for table in keys.tables("dem") for part in table.path]
    written = json.loads(json.dumps(schema.schema()))
    assert all("densities" not in written["properties"][stage]["properties"] for stage in STAGES)
    assert all(set(SIZES).isdisjoint(again[stage].model_fields_set) for stage in ("handoff", "dem", "crater"))
    assert set(SIZES).isdisjoint(key.path[-1] for table in keys.tables("dem") for key in keys.keys(table))
    assert set(SIZES).isdisjoint(written["properties"]["dem"]["properties"])


@pytest.mark.parametrize("stage", STAGES)
def test_a_case_that_says_them_is_told_there_is_no_such_key(stage):
    with pytest.raises(InputError, match=rf"{stage}\.densities: there is no such key"):
        composed(f"{stage}.densities.basalt.solid=2700 kg/m^3", f"{stage}.densities.basalt.bulk=2700 kg/m^3")
    with pytest.raises(InputError, match=r"dem\.bed_grains: there is no such key"):
        composed("dem.bed_grains=2000")
    with pytest.raises(InputError, match=r"dem\.contact\.ocean: there is no such key any more: liquid grains"):
        composed("dem.contact.ocean.friction=0.1")


def test_springs_of_a_layered_bed_are_bounded_by_the_solid_of_the_case(tmp_path):
    """From the case through ``target.json`` into the grains: k_n at its bound goes as m / rho0."""
    from dem.beds import grain_masses
    from dem.beds import settings as bed_settings
    from dem.beds import stage as bed_stage
    from dem.beds.layered_body import LayeredBody
    from dem.contact.settings import Contact
    from sph import settings as shock
    from sph import stage

    soft = Contact(static_overlap=1e-9)  # the weight alone would ask for springs beyond the bound
    bound = {}
    for rho in (2700.0, 3500.0):
        chosen = {} if rho == 2700.0 else {"basalt": {"tillotson": {"rho0": f"{rho} kg/m^3"}}}
        facts = stage.target_facts(shock.Settings(target=BALL, impact=SHOT, materials=chosen))
        assert [layer.get("reference_density_kg_m3") for layer in facts["layers"]] == [rho if chosen else None] * 2
        (tmp_path / "target.json").write_text(json.dumps(facts))
        body = LayeredBody.read(tmp_path / "target.json")
        bed = bed_settings.Settings(target=BALL, impact=SHOT, contact=soft)
        domain = bed_stage.domain_of(bed, body)
        place = np.array([[0.0, 0.0, body.radius - 500.0]])
        grains = Particles({"position": place, "radius": np.array([50.0])})
        made = grain_masses.matched(grains, None, body, domain, soft)
        bound[rho] = float(made.stiffness[0] / made.mass[0])
    assert bound[2700.0] / bound[3500.0] == pytest.approx(3500.0 / 2700.0, rel=1e-9)


FORMER = {
    "sph.shortest": 0.7, "sph.longest": 2.0, "sph.length_terms": "false", "sph.conductivity": 8.0,
    "sph.materials.ice.crush_form": '"density"', "nbody.pinned": "true", "handoff.mapping": '"nearest"',
    "bed.pull_interval": '"3 s"', "dem.pull_interval": '"3 s"', "dem.contact.liquids": '["water"]',
    "dem.contact.expected_speed": '"1 m/s"', "dem.contact.rayleigh_fraction": 0.2,
    "crater.along_track": "[1.0, 0.0, 0.0]", "sph.viscosity": '"monaghan"', "sph.volumes": '"start"',
    "sph.smoothing": '"fixed"', "sph.kernel": '"wendland"', "sph.support": 2.0, "handoff.pictures": "false",
    "nbody.integrator": '"rkck"', "nbody.published_speed": '"18 km/s"', "nbody.published_angle": '"40 deg"',
    "sph.materials.ice.crush": '"two_power"', "dem.contact.mindlin_history": '"force"', "bed.growth": 0.0,
    "dem.contact.shell.restitution_tangential": 0.5, "dem.contact.shell.rolling": 1.0,
    "target.companion.longitude": '"0 deg"', "crater.reference.0.at": '"depth"',
}  # fmt: skip


@pytest.mark.parametrize("half", [0, 1])  # a message lists thirty mistakes at most
def test_former_keys_say_what_replaces_them(half):
    former = list(FORMER)[half::2]
    sets = tuple(f"{key}={FORMER[key]}" for key in former)
    with pytest.raises(InputError) as found:
        compose.compose(cases.read(CASES / "valhalla_980km", "quick", sets))
    for key in former:
        assert f"{key.replace('.0.', '[0].')}: there is no such key any more: " in str(found.value), key
