"""Hydrostatic bodies and their particles."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from matter.case.body import Impact, Layer, Projectile, Target
from sph import cost_prediction
from sph.bodies import projectile, target
from sph.materials import rows as materials
from sph.planning import resolution
from sph.settings import Settings
from tests.sph.stage_runs import CALLISTO, IMPACT


@pytest.fixture(scope="module")
def profile():
    return target.hydrostatic(CALLISTO)


def test_profile_against_an_independent_solution(profile):
    """Winter 2017 model 2, relaxed: pressure and density within 0.5 % away from interfaces, radius within 1 km."""
    path = Path(__file__).parent.parent / "data" / "callisto_model2_relaxed.csv"
    rows = list(csv.DictReader(line for line in path.open() if not line.startswith("#")))
    interfaces = np.array([1802.8e3, 1947.0e3, 2101.9e3])
    checked = 0
    for row in rows:
        r = float(row["radius_m"])
        if np.abs(interfaces - r).min() < 5e3:
            continue
        assert np.interp(r, profile.middle, profile.pressure) == pytest.approx(float(row["pressure_Pa"]), rel=5e-3)
        assert np.interp(r, profile.middle, profile.density) == pytest.approx(float(row["density_kg_m3"]), rel=5e-3)
        checked += 1
    assert checked > 50
    assert profile.radius[-1] == pytest.approx(2101.9e3, abs=1e3)
    assert profile.gravity[-1] == pytest.approx(1.2840, rel=1e-3)
    assert profile.pressure[0] == pytest.approx(4.355e9, rel=5e-3)


def test_literal_profile_is_uniform():
    literal = target.hydrostatic(CALLISTO.model_copy(update={"start": "literal"}))
    assert literal.radius[-1] == pytest.approx(2142e3)
    assert literal.gravity[-1] == pytest.approx(1.2363, rel=1e-4)
    assert literal.mass[-1] == pytest.approx(8.4989e22, rel=1e-4)
    assert np.all(literal.pressure == 0.0)


@pytest.mark.parametrize("uniform", [True, False])
def test_particles_carry_the_layer_masses(profile, uniform):
    rows = materials.collect(CALLISTO.materials)
    zones = (
        target.Zones(140e3, 1e3, 140e3, 1e3, 140e3, 0.1)
        if uniform
        else target.Zones(75e3, 100e3, 110e3, 400e3, 260e3, 0.15)
    )
    body = target.build(CALLISTO, profile, rows, zones, seed=1)
    for layer, (inner, outer) in enumerate(zip((0, 1842e3, 1992e3), (1842e3, 1992e3, 2142e3))):
        rho0 = rows.rho0[rows.index(CALLISTO.layers[layer].material)]
        assert body.mass[body.layer == layer].sum() == pytest.approx(
            rho0 * 4 / 3 * math.pi * (outer**3 - inner**3), rel=1e-12
        )
    r = np.linalg.norm(body.position, axis=1)
    assert r.max() < profile.radius[-1]
    assert (body.density[body.layer == 0] > 2700).all()


@pytest.mark.parametrize("symmetry", [pytest.param("none", marks=pytest.mark.validation), "quarter"])
def test_a_body_a_thousand_times_as_large_as_its_fine_part_is_full_there(symmetry):
    """A thousandth of the radius about the impact holds 1e-9 of the body, and no even sample of it."""
    ball = Target(layers=(Layer(name="soil", material="basalt", thickness=448.0),), start="literal")
    rows = materials.collect(ball.materials)
    zones = target.Zones(0.3, 1.0, 0.3, 1.0, 60.0, 0.15)
    body = target.build(ball, target.hydrostatic(ball, materials=rows), rows, zones, 1, symmetry)
    distance = np.linalg.norm(body.position - [0.0, 0.0, 448.0], axis=1)
    parts = 4 if symmetry == "quarter" else 1
    for inner, outer in ((0.0, 1.0), (1.0, 3.0), (3.0, 10.0), (10.0, 60.0)):
        near = (distance >= inner) & (distance < outer)
        wanted = 2.0 / 3.0 * math.pi * np.diff([d**3 * (1.0 - 3.0 * d / (8.0 * 448.0)) for d in (inner, outer)])[0]
        assert body.mass[near].sum() * parts / body.density[0] == pytest.approx(wanted, rel=0.1)
    volume = (body.mass / body.density)[distance < 0.9]
    assert np.median(volume) ** (1.0 / 3.0) == pytest.approx(0.3, rel=0.05)
    assert len(body.mass) * parts == pytest.approx(resolution.count(ball, zones), rel=0.1)


def test_projectile_flies_to_the_pole():
    rows = materials.collect(("ice",))
    ball = projectile.build(CALLISTO, IMPACT, 26e3, 2102e3, 52e3, rows)
    assert ball.mass.sum() == pytest.approx(6.0148e17, rel=1e-3)
    centre = ball.position.mean(axis=0)
    lowest = centre[2] - 53.9e3
    assert lowest - 2102e3 == pytest.approx(52e3, rel=1e-9)
    time = (2102e3 + 53.9e3 - centre[2]) / IMPACT.velocity[2]
    assert centre + time * np.array(IMPACT.velocity) == pytest.approx(np.array([0, 0, 2102e3 + 53.9e3]), abs=1.0)


@pytest.mark.parametrize("symmetry,copies", [("none", 1), ("half", 2), ("quarter", 4)])
@pytest.mark.parametrize("wanted", [1, 3, 4, 20, 300])
def test_a_projectile_has_the_particles_that_the_check_promises(wanted, symmetry, copies):
    """Up to three are one (in every part), whatever the radius: two and three hung on its last digit."""
    for radius in (0.0376, 1.0, 53.9e3):
        ball = Projectile(material="copper", radius=radius)
        impact = Impact(
            speed=2e3, angle_from_vertical=0.0, projectile=ball, expected_transient_diameter=400.0 * radius
        )
        ground = Layer(name="ground", material="basalt", thickness=600.0 * radius)
        chosen = Settings(
            target=Target(layers=(ground,), shape="half_sphere", gravity=1e-4),
            impact=impact,
            projectile_particles=wanted,
            symmetry=symmetry,
        )
        body = projectile.build(
            chosen.target, impact, chosen.projectile_spacing, 0.0, radius, chosen.chosen_materials(), 2.0, symmetry
        )
        assert cost_prediction.projectile_particles(chosen) == copies * len(body.mass)
        assert copies * body.mass.sum() == pytest.approx(8900.0 * ball.volume, rel=1e-12)
        assert (
            len(body.mass) == 1
            if wanted < 3.5 * copies
            else copies * len(body.mass) == pytest.approx(wanted, rel=0.45)
        )


@pytest.mark.parametrize("wanted,shorter", [(3, 1.0), (16, 0.26)])
def test_a_fine_projectile_shortens_the_step_that_is_predicted(wanted, shorter):
    """Copper of 0.27 of the ground's spacing and 1.05 of its waves' speed; one heavy particle has no say."""
    ball = Projectile(material="copper", radius=0.0376)
    impact = Impact(speed=2e3, angle_from_vertical=0.0, projectile=ball, expected_transient_diameter=14.5)
    steps = [
        cost_prediction.step(
            Settings(
                target=Target(layers=(Layer(name="soil", material="basalt", thickness=22.0),), shape="half_sphere"),
                impact=impact,
                spacing_at_impact=0.09,
                contact_refinement=1.0,
                projectile_particles=count,
            )
        )
        for count in (1, wanted)
    ]
    assert steps[1] / steps[0] == pytest.approx(shorter, abs=0.02)
