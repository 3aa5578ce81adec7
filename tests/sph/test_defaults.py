"""What the shock stage takes when a case does not say it: counts against packings, strengths and times against figures
worked out by hand or published."""

from __future__ import annotations

import math

import numpy as np
import pytest

from matter.case import formation_time
from matter.case.body import Impact, Target
from sph import stage
from sph.bodies import ground as grounds
from sph.bodies import target
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.planning import durations, ground_strength, late_speeds, resolution
from sph.stepping import late as stepping_late

IMPACT = Impact.model_validate(
    {
        "speed": 12e3,
        "angle_from_vertical": 0.7,
        "projectile": {"material": "granite", "radius": 100.0},
        "expected_transient_diameter": 2000.0,
    }
)


def flat(shape: str = "half_space", **more) -> Target:
    layer = {"name": "ground", "material": "granite", "thickness": 4400.0}
    return Target.model_validate({"shape": shape, "gravity": 9.81, "layers": [layer], **more})


BODY = Target.model_validate({"layers": [{"name": "rock", "material": "basalt", "thickness": 8e3}]})


def within(body: Target, points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    away = np.linalg.norm(points, axis=1)
    if body.shape == "sphere":
        return away < 8e3
    if body.shape == "half_sphere":
        return (z < 0.0) & (away <= 4400.0)
    across = np.hypot(x, y) < 4400.0 if body.shape == "half_space" else np.maximum(np.abs(x), np.abs(y)) < 3e3
    return (z < 0.0) & (z > -4400.0) & across


@pytest.mark.parametrize(
    "body", [flat(), flat("half_sphere"), flat("block", width=6e3), BODY], ids=lambda body: body.shape
)
def test_the_share_of_a_sphere_inside_the_target(body):
    """Against random directions from the impact point."""
    rng = np.random.default_rng(3)
    for distance in (500.0, 4000.0, 5000.0):
        points = rng.normal(size=(400_000, 3))
        points *= distance / np.linalg.norm(points, axis=1)[:, None]
        points[:, 2] += body.impact_point[2]
        inside = within(body, points)
        share = resolution.area(body, np.array([distance]))[0] / (4.0 * math.pi * distance**2)
        assert share == pytest.approx(inside.mean(), abs=4e-3)


@pytest.mark.parametrize("body", [flat(), BODY], ids=lambda body: body.shape)
def test_the_expected_number_is_that_of_the_packing(body):
    settings = stage.Settings(target=body, impact=IMPACT, particles=8000)
    materials, zones = settings.chosen_materials(), settings.zones
    if body.flat:
        made = grounds.build(body, grounds.hydrostatic(body, materials), materials, zones, 1)
    else:
        made = target.build(body, target.hydrostatic(body, materials=materials), materials, zones, 1)
    assert resolution.count(body, zones) == pytest.approx(8000, rel=0.03)
    assert len(made.mass) == pytest.approx(8000, rel=0.05)


def test_the_contact_has_two_particles_per_radius_at_least_and_converges():
    coarse, fine, finest = (resolution.refinement(spacing, 1.0) for spacing in (4.0, 0.5, 0.05))
    assert 4.0 / coarse <= 0.5 and coarse == 8.0
    assert fine == 2.0 and finest == 1.0


def test_strength_falls_with_the_size_of_the_piece():
    """Granite: 90 MPa at 0.1 m, Weibull's m = 6.2."""
    materials = collect(("granite",))
    small, large = (ground_strength.ground(materials, "granite", size) for size in (0.1, 14.0))
    assert small.kind == "rock" and small.strength == pytest.approx(90e6, rel=1e-9)
    assert large.strength == pytest.approx(90e6 * 140.0 ** (-3.0 / 6.2), rel=1e-9)
    assert 0.7 < large.strength / 6.9e6 < 1.5  # hard rock, Holsapple 1993
    assert ground_strength.ground(materials, "granite", 14.0, damage=False).strength == pytest.approx(90e6, rel=1e-9)
    assert ground_strength.ground(materials, "granite", 14.0, strength=False).kind == "fluid"


def test_the_kind_of_ground():
    assert ground_strength.ground(collect(("water",)), "water", 10.0).kind == "fluid"
    loose = Choice.model_validate({"strength": "drucker_prager", "predamaged": True})
    sand = ground_strength.ground(collect(("basalt",), {"basalt": loose}), "basalt", 10.0)
    assert sand.kind == "sand" and sand.strength == 0.0
    whole = ground_strength.ground(
        collect(("basalt",)), "basalt", 0.1
    )  # von Mises at 3.5 GPa: its tension of 130 MPa is the better figure
    assert whole.kind == "rock" and whole.strength == pytest.approx(130e6)


def test_formation_times():
    """Weight alone: 0.8 sqrt(0.508 D / g); strength alone: 1.14 R sqrt(rho / Y); a point source: (R / a)^3 a / U."""
    assert formation_time.of_crater(1000.0, 9.81) == pytest.approx(
        0.8 * math.sqrt((math.pi / 24.0) ** (1 / 3) * 1000.0 / 9.81), rel=1e-12
    )
    assert formation_time.of_crater(14.0, 0.0, 2680.0, 8e6) == pytest.approx(
        1.14 * 7.0 * math.sqrt(2680.0 / 8e6), rel=5e-3
    )
    assert formation_time.of_crater(14.0, 0.0) == math.inf
    assert formation_time.of_growth(20.0, 1.0, 1e4) == pytest.approx(0.1, rel=1e-12)


def test_times_follow_the_crater():
    settings = stage.Settings(target=flat(), impact=IMPACT)
    T = durations.crater_time(settings.target, IMPACT, settings.chosen_materials(), True, True)
    assert T == pytest.approx(8.1, rel=0.02)
    assert (settings.end_time, settings.snapshot_interval) == (
        pytest.approx(2.0 * T, rel=0.05),
        pytest.approx(T / 15.0, rel=0.05),
    )
    assert settings.relaxation_time == 0.0 and settings.first_step < 0.011 * 100.0 / 12e3


def test_gravity_and_settling_of_a_body():
    """g = 4/3 pi G rho R, and 1.5 times 8 km at 3145 m/s."""
    settings = stage.Settings(target=BODY, impact=IMPACT)
    assert durations.surface_gravity(BODY, settings.chosen_materials()) == pytest.approx(
        4.0 / 3.0 * math.pi * 6.6743e-11 * 2700.0 * 8e3, rel=1e-3
    )
    assert settings.relaxation_time == pytest.approx(1.5 * 8e3 / 3145.0, rel=0.05)
    assert settings.damping * settings.relaxation_time == pytest.approx(10.0, rel=0.05)


def test_given_values_stay():
    settings = stage.Settings(
        target=flat(), impact=IMPACT, spacing_at_impact=80.0, end_time=5.0, snapshot_interval=0.5
    )
    assert (settings.spacing_at_impact, settings.spacing_far, settings.end_time) == (80.0, 320.0, 5.0)
    assert settings.snapshot_interval == 0.5 and settings.history_interval == 0.125


def late(gravity: float, end: float, **impact):
    """The late stage in loose basalt of ``gravity`` [m/s^2], of a copper ball of 3.76 cm at 2 km/s."""
    ball = {"material": "copper", "radius": 0.0376}
    hit = {"speed": 2e3, "angle_from_vertical": 0.0, "projectile": ball, "expected_transient_diameter": 14.5, **impact}
    layer = {"name": "ground", "material": "basalt", "thickness": 22.0}
    ground = Target.model_validate({"shape": "half_space", "gravity": gravity, "layers": [layer]})
    loose = {"basalt": Choice(porosity="p_alpha", strength="drucker_prager", drucker_prager={"cohesion": "0 Pa"})}
    shot, materials = Impact.model_validate(hit), collect(("basalt", "copper"), loose)
    crater = late_speeds.growth(ground, shot, materials, True, True)
    found = crater and late_speeds.late_stage(crater, 0.1, end)
    return found and stepping_late.Settings.model_validate(found)


def test_the_edge_of_a_crater_moves_as_its_radius_grows():
    """v is the derivative of R_T (t / T)^(1/3); 6.8 m/s in the shot at Ryugu after 15 ms."""
    radius, formation = 7.25, 198.0
    for t in (0.015, 1.0, 100.0):
        grows = (radius * ((t + 1e-6) / formation) ** (1 / 3) - radius * ((t - 1e-6) / formation) ** (1 / 3)) / 2e-6
        assert late_speeds.flow_speed(t, radius, formation) == pytest.approx(grows, rel=1e-4)
    assert late_speeds.flow_speed(0.015, radius, formation) == pytest.approx(6.8, rel=0.01)


def test_the_late_stage_of_a_small_body_follows_the_flow_as_it_slows_down():
    """Twenty times the edge's speed at every switch, to within the two digits, from a diameter's way of sound
    on; never so soft that the ground's own weight strains it by more than a twentieth."""
    found = late(1.2e-4, 400.0)
    formation = formation_time.of_growth(14.5, 0.0376, 2e3)  # 135 s; weight alone would take 198 s
    assert found.at == pytest.approx(14.5 / 3145.0, rel=0.05)
    lowest = math.sqrt(20.0 * 1.2e-4 * 14.5)
    assert len(found.slower) == pytest.approx(2.0 * math.log2(found.sound_speed / lowest), abs=1.0)
    for at, c in found.switches:
        assert c == pytest.approx(20.0 * late_speeds.flow_speed(at, 7.25, formation), rel=0.1)
        assert c**2 >= 20.0 * 1.2e-4 * 14.5
    assert found.switches[-1][0] < 400.0
    for end in np.geomspace(1.0, 400.0, 300):  # two digits may round up to the end
        assert late(1.2e-4, end).switches[-1][0] < end


def test_no_late_stage_without_weight_or_time_or_where_the_weight_is_stiff():
    """No gravity; a run that ends while the wave leaves. In ground so heavy that c would exceed half the speed of
    sound, and where the first switch would come late in the run, only the viscosity of the shock goes."""
    assert late(0.0, 400.0) is None
    assert late(1.2e-4, 0.0003) is None
    for gravity, end in ((1e5, 400.0), (1.2e-4, 0.006)):
        found = late(gravity, end)
        assert found.switches == () and 10.0 * 0.1 / 3145.0 < 1.05 * found.viscosity_time < 14.5 / 3145.0


@pytest.mark.parametrize("ground", ["loose", "flawed", "hard"])
def test_a_crater_that_cohesion_ends_has_it_in_loose_ground_alone(ground):
    """1.4 kPa in a shot of 12 cm: of the steps at the speed of sound, half a million, a thousand are left. Rock with
    flaws breaks by waves, whole rock bends by them."""
    made = {
        "loose": Choice(porosity="p_alpha", p_alpha={"alpha0": 1.7}, strength="drucker_prager", damage="none"),
        "flawed": Choice(porosity="p_alpha", p_alpha={"alpha0": 1.7}, strength="drucker_prager"),
        "hard": Choice(strength="drucker_prager", damage="none"),
    }[ground]
    choice = made.model_copy(update={"drucker_prager": {"cohesion": "1.4 kPa"}})
    ball = {"material": "copper", "radius": 0.003}
    hit = {"speed": 1.5e3, "angle_from_vertical": 0.0, "projectile": ball, "expected_transient_diameter": 0.12}
    layer = {"name": "ground", "material": "basalt", "thickness": 1.0}
    target = Target.model_validate({"shape": "half_space", "gravity": 9.81, "layers": [layer]})
    materials = collect(("basalt", "copper"), {"basalt": choice})
    crater = late_speeds.growth(target, Impact.model_validate(hit), materials, True, True)
    found = crater and late_speeds.late_stage(crater, 0.004, 0.03)
    assert (found is not None) == (ground == "loose")
    if found:
        speeds = [one["sound_speed"] for one in found["slower"]]
        assert speeds == sorted(speeds, reverse=True) and speeds[-1] < 0.02 * found["sound_speed"]
        assert speeds[-1] ** 2 > 20.0 * 1.4e3 / (2700.0 / 1.7)  # a twentieth of strain by what holds it


def test_a_slow_projectile_that_stays_whole_is_followed_too():
    """Twenty times the speed to which drag has slowed an iron ball of 100 m/s; at 1.5 km/s the ball becomes flow."""
    layer = {"name": "ground", "material": "regolith", "thickness": 4.0}
    target = Target.model_validate({"shape": "half_space", "gravity": 9.81, "layers": [layer]})
    materials = collect(("regolith", "iron"), {})
    ball = {"material": "iron", "radius": 0.05}
    hit = {"angle_from_vertical": 0.0, "projectile": ball, "expected_transient_diameter": 0.8}
    slow, fast = (Impact.model_validate({**hit, "speed": speed}) for speed in (100.0, 1500.0))
    ground = ground_strength.ground(materials, "regolith", 0.8)
    brakes = late_speeds.braking_time(slow, materials, ground, True)
    density = float(materials.bulk_density[materials.index("iron")])
    deceleration = 0.5 * ground.density * math.pi * 0.05**2 * 100.0**2 / (density * 4.0 / 3.0 * math.pi * 0.05**3)
    assert 100.0 / brakes == pytest.approx(deceleration)
    assert late_speeds.braking_time(fast, materials, ground, True) == 0.0
    crater = late_speeds.growth(target, slow, materials, True, True)
    found = crater and late_speeds.late_stage(crater, 0.03, 0.31)
    for one in found["slower"]:
        speed = 100.0 / (1.0 + one["at"] / brakes)
        assert one["sound_speed"] >= 0.93 * 20.0 * speed


def test_a_case_has_it_whether_or_not_it_gives_its_end():
    given = {"target": flat(), "impact": IMPACT, "particles": 8000}
    follows = stage.Settings.model_validate(given)
    assert follows.late is not None and follows.late.at < late_speeds.LATEST * follows.end_time
    sound = ground_strength.ground(follows.chosen_materials(), "granite", 2000.0, True, True).sound
    assert follows.late.viscosity_at < follows.late.at
    formation = durations.crater_time(follows.target, follows.impact, follows.chosen_materials(), True, True)
    # coarse: the wave has crossed the crater; it is ten spacings away; fine: the edge is slow against it
    assert follows.late.viscosity_at == pytest.approx(2000.0 / sound, rel=0.05)
    ten, fine = (
        stage.Settings.model_validate({**given, "spacing_at_impact": spacing}).late.viscosity_at
        for spacing in (100.0, 20.0)
    )
    assert ten == pytest.approx(10.0 * 100.0 / sound, rel=0.05)
    assert late_speeds.flow_speed(fine, 1000.0, formation) == pytest.approx(sound / 6.0, rel=0.05)
    assert stage.Settings.model_validate({**given, "end_time": follows.end_time}).late == follows.late
    assert stage.Settings.model_validate({**given, "late": None}).late is None
    own = {"at": "3 s", "sound_speed": "1 km/s"}
    for table, leaves in (
        (own, follows.late.viscosity_at),
        ({**own, "at": "0.2 s"}, 0.2),
        ({**own, "viscosity_at": "1 s"}, 1.0),
    ):
        assert stage.Settings.model_validate({**given, "late": table}).late.viscosity_at == leaves
    hard = {**given, "impact": IMPACT.model_copy(update={"expected_transient_diameter": 20.0})}
    assert stage.Settings.model_validate(hard).late is None  # strength holds it
