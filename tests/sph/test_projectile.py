"""A projectile of parts: as heavy and as fast as the ball it stands for, each part where it was put."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from matter.case.body import Impact, Layer, Part, Projectile, Target
from sph import cost_prediction
from sph.bodies import projectile
from sph.materials import rows as materials
from sph.planning import ground_strength
from sph.settings import Settings

FLAT = Target(layers=(Layer(name="soil", material="basalt", thickness=40.0),), shape="half_sphere")
DIMORPHOS = {
    "layers": [{"name": "rubble", "material": "basalt"}],
    "shape": "ellipsoid",
    "axes": ["177 m", "174 m", "116 m"],
    "latitude": "-8.84 deg",
    "longitude": "264.3 deg",
}
# a bus and two panels beside it, 8.5 by 2.4 m
PARTS = (
    Part(share=0.88, size=(1.8, 1.9, 2.6)),
    Part(share=0.06, size=(0.05, 8.5, 2.4), offset=(0.2, 5.2, 0.0), material="copper"),
    Part(share=0.06, size=(0.05, 8.5, 2.4), offset=(0.2, -5.2, 0.0), material="copper"),
)


def impact(parts=PARTS, angle=17.0) -> Impact:
    ball = Projectile(material="aluminum", radius=0.37, parts=parts)
    return Impact(
        speed=6144.9, angle_from_vertical=math.radians(angle), projectile=ball, expected_transient_diameter=20.0
    )


def made(chosen: Impact, target: Target = FLAT, spacing=0.5, gap=1.0):
    rows = materials.collect(("basalt", *chosen.projectile.materials))
    surface = target.impact_point[2]
    return projectile.build(target, chosen, spacing, surface, gap, rows), rows


@pytest.mark.parametrize("angle", [0.0, 17.0, 60.0])
@pytest.mark.parametrize("target", [FLAT, Target.model_validate(DIMORPHOS)], ids=["flat", "ellipsoid"])
def test_parts_weigh_what_the_ball_weighs_and_fly_to_the_site(angle, target):
    lopsided = (PARTS[0], PARTS[1].model_copy(update={"share": 0.12}))
    chosen = impact(lopsided, angle)
    body, rows = made(chosen, target)
    ball = rows.bulk_density[rows.index("aluminum")] * chosen.projectile.volume
    assert body.mass.sum() == pytest.approx(ball, rel=1e-12)
    site, along = np.array(target.impact_point), np.array(target.aim(chosen)) / chosen.speed
    centre = body.mass @ body.position / body.mass.sum()
    assert np.linalg.norm(np.cross(centre - site, along)) == pytest.approx(0.0, abs=1e-9)
    normal = target.placed.normal if target.solid else np.array([0.0, 0.0, 1.0])
    size = (body.mass / body.density) ** (1.0 / 3.0)
    assert np.min((body.position - site) @ normal - 0.5 * size) == pytest.approx(1.0, rel=1e-9)


def test_a_box_has_its_size_and_lies_across_the_flight():
    body, rows = made(impact())
    axes = projectile.axes_of_flight(np.array(FLAT.aim(impact())) / 6144.9, np.array([0.0, 0.0, 1.0]))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    place = (body.position - body.mass @ body.position / body.mass.sum()) @ axes.T
    panel = body.material == rows.index("copper")
    assert panel.sum() == 2 * 17 * 5 and (~panel).sum() == 4 * 4 * 5
    assert body.mass[panel].sum() / body.mass.sum() == pytest.approx(0.12, rel=1e-12)
    # cells end half a cell before the edge of a box
    assert np.abs(place[panel, 1]).max() == pytest.approx(5.2 + 4.25 - 0.25, rel=1e-9)
    assert np.ptp(place[~panel], axis=0) == pytest.approx([1.8 * 3 / 4, 1.9 * 3 / 4, 2.6 * 4 / 5], rel=1e-9)
    assert np.ptp(place[panel, 0]) == pytest.approx(0.0, abs=1e-9)
    # straight up is up: the third axis of an impact at 17 degrees leans forward by as much
    assert axes[2] == pytest.approx([math.cos(math.radians(17)), 0.0, math.sin(math.radians(17))], abs=1e-12)


def test_one_part_without_a_size_is_the_ball():
    alone, _ = made(impact((Part(share=1.0),), 0.0), spacing=0.1)
    ball, _ = made(impact((), 0.0), spacing=0.1)
    assert np.sort(alone.mass) == pytest.approx(np.sort(ball.mass), rel=1e-12)
    middle = [body.position - body.position.mean(axis=0) for body in (alone, ball)]
    distance = [np.sort(np.linalg.norm(place, axis=1)) for place in middle]
    assert distance[0] == pytest.approx(distance[1], rel=1e-9)


def test_the_check_counts_particles_of_parts_and_knows_their_step():
    common = {"target": FLAT, "spacing_at_impact": 0.5, "contact_refinement": 1.0, "spacing_far": 4.0}
    parts, ball = (Settings(**common, impact=impact(chosen)) for chosen in (PARTS, ()))
    assert cost_prediction.projectile_particles(parts) == 80 + 170
    assert cost_prediction.projectile_particles(ball) == 1
    rows = parts.chosen_materials()
    rock, metal = (ground_strength.ground(rows, name, 1.0, True).wave for name in ("basalt", "aluminum"))
    assert cost_prediction.step(parts) / cost_prediction.step(ball) == pytest.approx(
        rock / metal, rel=1e-9
    )  # cells as wide as the ground's
    drop = impact((Part(share=0.99), Part(share=0.01)))  # a ball of its own, of 13 cm
    small = cost_prediction.step(Settings(**common, impact=drop))
    own = (0.01 * ball.impact.projectile.volume) ** (1.0 / 3.0)
    assert small / cost_prediction.step(ball) == pytest.approx(own / 0.5 * rock / metal, rel=1e-9)


@pytest.mark.parametrize(
    "change,complaint",
    [
        ({"parts": PARTS[:2]}, "the shares of all parts must add up to 1, they add up to 0.94"),
        (
            {"parts": (Part(share=1.0, size=(0.1, 0.1, 0.1)),)},
            r"number 1: 0.212 m\^3 .* do not fit into a box of 0.001",
        ),
        ({"projectile_particles": 50}, "leave it out"),
        ({"symmetry": "half"}, "parts is not taken for its own mirror image"),
    ],
)
def test_what_parts_cannot_be_is_said(change, complaint):
    parts = change.pop("parts", PARTS)
    with pytest.raises(ValidationError, match=complaint):
        Settings(target=FLAT, impact=impact(parts), spacing_at_impact=0.5, **change)
