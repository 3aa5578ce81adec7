"""Ground and grains of a case share one friction angle, and cohesion acts in both stages or in none."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from dem.trials import angle_of_friction, friction_angle
from pipeline.case import read
from pipeline.settings import compose, sense

CASES = Path(__file__).parents[2] / "cases"
GROUND = "sph.materials.basalt.drucker_prager.friction_angle={} deg"


def contact(*overrides: str, preset: str = "quick"):
    return compose.compose(read.read(CASES / "dart_dimorphos", preset, overrides))["dem"].contact


@pytest.mark.parametrize(("angle", "friction"), [(30.0, 0.269), (31.0, 0.302), (34.46, 0.5)])
def test_the_grains_take_the_friction_of_the_ground(angle, friction):
    found = contact(GROUND.format(angle))
    assert math.degrees(found.friction_angle) == pytest.approx(angle, rel=1e-5)
    assert friction_angle.resolved(found).shell.friction == pytest.approx(friction, abs=1e-4)


def test_the_bed_is_settled_with_it_too():
    settings = compose.compose(read.read(CASES / "dart_dimorphos", "quick", ()))
    assert settings["bed"].contact == settings["dem"].contact


def test_what_the_case_says_of_the_grains_stands():
    assert contact("dem.contact.shell.friction=0.4").friction_angle is None
    assert contact("dem.contact.shell.shape=0.2").friction_angle is None
    assert math.degrees(contact("dem.contact.friction_angle=25 deg").friction_angle) == pytest.approx(25.0)


def test_steeper_ground_gives_the_steepest_grains_and_rock_gives_none():
    steep = math.degrees(contact(GROUND.format(45)).friction_angle)
    assert steep == pytest.approx(angle_of_friction.STEEPEST)
    # less than was measured would be searched for in the bed's stage, and might not be found
    flat = contact(GROUND.format(0))
    assert math.degrees(flat.friction_angle) == pytest.approx(angle_of_friction.LEAST)
    assert friction_angle.resolved(flat).shell.friction == pytest.approx(0.15, abs=1e-4)
    assert contact("sph.strength=false", "impact.expected_transient_diameter=78 m").friction_angle is None
    ice = compose.compose(read.read(CASES / "valhalla_980km", "quick", ()))["dem"].contact
    assert ice.friction_angle is None


def test_an_angle_that_was_not_measured_is_not_read_off_the_line():
    assert angle_of_friction.friction(20.0) is None and angle_of_friction.friction(40.0) is None
    low, high = (angle_of_friction.friction(angle) for angle in (27.0, 28.0))
    assert 0.15 < low < high < 0.269


def warnings(case: str, preset: str | None, *overrides: str) -> list[str]:
    chosen = read.read(CASES / case, preset, overrides)
    said = sense.judged(compose.compose(chosen), chosen.outside, chosen.stages)[1]
    return [line for line in said if "cohesion" in line]


def test_cohesion_of_one_stage_alone_is_said():
    assert warnings("sci_ryugu", "quick") == [] and warnings("sci_ryugu", "cohesive") == []
    grains = warnings("sci_ryugu", "quick", "dem.contact.cohesion=zhang", "dem.contact.shell.cohesion=1 Pa")
    assert len(grains) == 1 and grains[0].startswith("the grains have cohesion and the shock stage none")
    held = ("sph.materials.basalt.drucker_prager.cohesion=1 Pa", "sph.materials.basalt.predamaged=false")
    ground = warnings("sci_ryugu", "quick", *held)
    assert len(ground) == 1 and ground[0].startswith("the ground of the shock stage has cohesion and its grains none")


@pytest.mark.validation
@pytest.mark.parametrize("friction", [0.2, 0.4])
def test_between_the_points_the_line_is_what_shear_gives(friction):
    """A friction at which nothing was measured before, with a seed of its own: within 1.5 deg."""
    from dem.contact.settings import Contact

    law = Contact.model_validate({"shell": {"friction": friction}})
    found = friction_angle.measure(law, "shear", seed=7)["mohr_coulomb_deg"]
    assert angle_of_friction.friction(found) == pytest.approx(friction, abs=0.06)
