"""A whole body of grains, without walls: it settles under its own pull, its rotation and a companion's tide, keeps its
shape, its balances and its place in the turning frame; slopes against closed forms; what is refused."""

import json
import math

import numpy as np
import pytest
from scipy.integrate import quad

from crater.bodies import body_state
from dem import stage
from dem.beds import slopes, solid_bed, solid_masses
from dem.beds import stage as bed_stage
from dem.beds.solid_body import SolidBody
from dem.beds.solid_settling import SolidSettling
from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.grains import cached_gravity, turning_frame
from dem.grains.assembly import BALLISTIC, LEFT, Assembly, Extras
from dem.grains.self_gravity import SelfGravity
from dem.settings import Settings as DemSettings
from dem.trials import friction_angle
from matter.case.body import Impact, Target
from matter.constants import G
from matter.errors import InputError, Unsound
from matter.files import snapshot
from matter.geometry.rotation import rotation
from sph.bodies import solid_target
from tests.dem.stops import interrupted, same_grains

pytestmark = pytest.mark.usefixtures("known_friction_angle")

pytestmark = pytest.mark.validation

DENSITY = 2400.0
HERTZ = Contact(normal="hertz", shell=GrainLaw(elastic_modulus=1e7, poisson_ratio=0.3))
DIMORPHOS = {
    "shape": "ellipsoid", "axes": [177.0, 174.0, 116.0], "spin_period": 11.92 * 3600.0, "latitude": -0.154,
    "longitude": 4.61, "layers": [{"name": "body", "material": "basalt"}],
    "companion": {"mass": 5.4e11, "distance": 1200.0},
}  # fmt: skip


def settings_of(target: dict, **changes) -> bed_stage.Settings:
    impact = {
        "speed": 6000.0, "angle_from_vertical": 0.1, "projectile": {"material": "aluminum", "radius": 0.4},
        "expected_transient_diameter": 30.0,
    }  # fmt: skip
    return bed_stage.Settings(
        target=Target.model_validate(target),
        impact=Impact.model_validate(impact),
        count=400,
        **{"packing": "rcp", **changes},
    )


def written(run, target: Target) -> None:
    (run / "2_sph").mkdir(parents=True)
    (run / "3_bed").mkdir()
    (run / "2_sph" / "target.json").write_text(json.dumps(solid_target.target_json(target, DENSITY)))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    run = tmp_path_factory.mktemp("dimorphos")
    settings = settings_of(DIMORPHOS)
    written(run, settings.target)
    bed_stage.run(settings, run, run / "3_bed")
    return run, settings


@pytest.fixture(scope="module")
def report(made):
    return json.loads((made[0] / "3_bed" / "bed_report.json").read_text())


@pytest.fixture(scope="module")
def body(made):
    return SolidBody.read(made[0] / "2_sph" / "target.json", made[1].target)


def test_it_rests_as_the_body_that_was_asked_for(made, report, body):
    assert report["residual_speed_over_sqrt_g_r"]["rms"] < 1e-4
    assert report["free_run_speed_over_sqrt_g_r"] < 1e-3
    assert abs(report["mass_error"]) < 1e-12
    assert np.abs(report["centre_of_mass_m"]).max() < 1e-9 * body.solid.radius
    assert report["axes_error_max"] < 0.02
    wanted = np.array(report["angular_momentum_target_kg_m2_s"])
    assert report["angular_momentum_kg_m2_s"] == pytest.approx(wanted, abs=0.03 * np.linalg.norm(wanted))
    assert report["mass_correction_max"] < 0.05
    # frictional spheres at rest carry each other from four contacts on; random close packing is the other end
    assert 0.56 < report["packing_fraction"] < 0.66 and 4.0 < report["coordination_number"] < 6.0
    assert 0.0 < report["pull_removed_over_weight"] < 1e-4
    assert report["slopes"]["share_above_friction_angle"] == 0.0
    assert "No slope of the body is steeper" in report["slopes_in_words"]


def test_a_loose_packing_is_as_loose_as_steady_shear_and_rests(tmp_path, made, report, body):
    """It settles by a fraction of a grain, onto contacts that friction holds: fewer than in the close one."""
    settings = settings_of(DIMORPHOS, packing="loose")
    written(tmp_path, settings.target)
    bed_stage.run(settings, tmp_path, tmp_path / "3_bed")
    loose = json.loads((tmp_path / "3_bed" / "bed_report.json").read_text())
    assert loose["packing_fraction"] == pytest.approx(0.58, abs=0.012)
    assert loose["packing_fraction"] < report["packing_fraction"] - 0.02
    assert loose["coordination_number"] < report["coordination_number"]
    assert loose["free_run_speed_over_sqrt_g_r"] < 1e-3 and abs(loose["mass_error"]) < 1e-12
    assert loose["axes_error_max"] < 0.03 and loose["moved_most"]["rms_radii"] < 1.0


def test_its_grains_move_with_the_rotation(made, body):
    bed = snapshot.read(made[0] / "3_bed" / "bed.vtkhdf")
    assert bed.attributes["frame"] == "solid"
    wanted = np.cross(body.omega, bed.position)
    assert np.abs(bed.velocity - wanted).max() < 1e-3 * np.abs(wanted).max()
    assert np.abs(bed.angular_velocity - body.omega).max() < 0.01 * np.linalg.norm(body.omega)


def assembled(run, body: SolidBody, companion: bool, interval: float | None = None) -> Assembly:
    """The settled bed, in the inertial frame."""
    bed = snapshot.read(run / "3_bed" / "bed.vtkhdf")
    tide = body.tide(turning=False)
    return Assembly(
        bed, Contact(), gravity=Field.constant((0.0, 0.0, 0.0)),
        extras=Extras(self_gravity=SelfGravity(interval=interval), outer=(tide,) if companion and tide else ()),
    )  # fmt: skip


def drift(bed: Assembly, start: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """How far the grains have come in the turning frame, over their mean radius."""
    order = np.argsort(bed.identity)
    now, _, _ = turning_frame.turning(bed.X[order, :3], bed.W[order, :3], bed.W[order, 3:], omega, bed.time)
    return np.linalg.norm(now - start, axis=1) / bed.mean_radius


def held_for(time: float, bed: Assembly, omega: np.ndarray) -> None:
    """Run for ``time`` [s]: the grains stay where they are in the turning frame, and the balances close."""
    start = bed.particles({}).position
    p, l, e = bed.momentum(), bed.angular_momentum(), sum(bed.energies().values())
    while bed.time < time:
        bed.step()
    assert drift(bed, start, omega).max() < 0.05
    scale = float(bed.mass @ np.linalg.norm(bed.velocity, axis=1))
    assert np.abs(bed.momentum() - p).max() < 1e-12 * scale
    free = len(bed.outer) == 0
    # without a companion angular momentum itself is kept; with one, what its tide has given is booked
    turned = bed.angular_momentum() - l - (0.0 if free else bed.report[7:10])
    assert np.abs(turned).max() < 1e-10 * np.abs(l).max()
    kinetic = bed.energies()["kinetic_J"]
    total = sum(bed.energies().values()) + bed.report[:4].sum() - bed.pull_state[cached_gravity.WORK]
    assert total == pytest.approx(e, abs=1e-3 * kinetic)
    assert bed.pull_state[cached_gravity.WORST] < 1e-4


def test_it_stays_where_it_is_in_the_turning_frame(made, body):
    held_for(1200.0, assembled(made[0], body, companion=False), body.omega)


def test_under_a_companion_too(made, body):
    bed = assembled(made[0], body, companion=True)
    held_for(600.0, bed, body.omega)
    assert np.linalg.norm(bed.report[7:10]) > 1e-7 * np.linalg.norm(bed.angular_momentum())


@pytest.mark.validation
def test_two_thousand_grains_stay_for_two_hours(tmp_path):
    settings = settings_of({**DIMORPHOS, "companion": None}).model_copy(update={"count": 2000})
    written(tmp_path, settings.target)
    bed_stage.run(settings, tmp_path, tmp_path / "3_bed")
    whole = SolidBody.read(tmp_path / "2_sph" / "target.json", settings.target)
    held_for(7200.0, assembled(tmp_path, whole, companion=False), whole.omega)


# -- the collapse on a body


def started(run, made, change=None, companion=True, **settings) -> DemSettings:
    """A run folder whose start is the settled bed, and the settings of a collapse of 900 s."""
    from shutil import copy

    for name in ("2_sph", "4_handoff", "5_dem"):
        (run / name).mkdir(parents=True)
    copy(made[0] / "2_sph" / "target.json", run / "2_sph")
    if not companion:
        facts = json.loads((run / "2_sph" / "target.json").read_text())
        (run / "2_sph" / "target.json").write_text(json.dumps({**facts, "companion": None}))
    bed = snapshot.read(made[0] / "3_bed" / "bed.vtkhdf")
    bed["state"] = np.zeros(len(bed), dtype=np.int8)
    if change:
        change(bed)
    snapshot.write(bed, run / "4_handoff" / "start.vtkhdf")
    times = {"end_time": 900.0, "latest_time": 900.0, "snapshot_interval": 450.0, "still_interval": 300.0}
    return DemSettings(target=made[1].target, impact=made[1].impact, **times | settings)


def test_the_collapse_leaves_a_body_at_rest_as_it_is(tmp_path, made, body):
    settings = started(tmp_path, made)
    stage.run(settings, tmp_path, tmp_path / "5_dem")
    found = json.loads((tmp_path / "5_dem" / "stage_report.json").read_text())
    assert found["momentum_error"] < 1e-12 and found["angular_momentum_error"] < 1e-10
    assert abs(found["energy_error"]) < 1e-3
    assert found["pull_removed_over_weight"] < 1e-4
    assert found["profile_change_radii"] < 0.01 and found["still"]
    assert found["angular_velocity_1_s"] == pytest.approx(body.omega, abs=1e-3 * np.linalg.norm(body.omega))
    turn = rotation(body.omega * found["time_s"])
    assert np.array(found["turned"]) == pytest.approx(turn, abs=1e-3)


def test_what_is_thrown_off_a_body_is_booked_with_its_energy(tmp_path, made, body):
    def kick(bed):
        high = np.argsort(bed.position[:, 2])[-2:]
        bed.velocity[high] += [0.0, 0.0, 0.4]  # the speed of escape is 0.09 m/s
        bed.position[high] += [0.0, 0.0, 20.0]
        bed["state"][high] = BALLISTIC
        # a grain that the handoff has put into its list, and one in it that is bound
        bed["state"][high[0] + 1 - 2 * (high[0] + 1 == high[1])] = LEFT
        thrown.extend((float(m), v.copy()) for m, v in zip(bed.mass[high], bed.velocity[high]))
        bed.attributes["shot"] = {"momentum_kg_m_s": [0.0, 0.0, -1e6], "normal": [0.0, 0.0, 1.0]}

    thrown: list = []
    settings = started(tmp_path, made, kick, end_time=2000.0, latest_time=2000.0)
    stage.run(settings, tmp_path, tmp_path / "5_dem")
    found = json.loads((tmp_path / "5_dem" / "stage_report.json").read_text())
    assert found["booked"]["escaped"]["grains"] == 2 and found["left"] == 3
    assert found["momentum_error"] < 1e-12 and found["angular_momentum_error"] < 1e-10
    # against the energy of the body's rotation; what goes away takes ten times as much along
    assert abs(found["energy_error"]) < 0.01
    assert found["booked"]["escaped"]["energy_J"] > 8.0 * found["kinetic_handed_J"]
    begun, end = found["escaping_at_start"], found["escaping"]
    lost = sum(m * v for m, v in thrown)
    assert begun["grains"] == end["grains"] == 2  # and not the one that is in the list but bound
    assert begun["mass_kg"] == end["mass_kg"] == pytest.approx(sum(m for m, _ in thrown))
    assert begun["momentum_kg_m_s"] == pytest.approx(lost.tolist(), rel=1e-6)
    assert begun["beta"] == pytest.approx(1.0 + lost[2] / 1e6)
    # the body holds them back on their way: less is lost in the end
    assert 1.0 < end["beta"] < begun["beta"]


@pytest.mark.parametrize("speed,companion,leaves", [(0.07, True, True), (0.07, False, False), (0.05, True, False)])
def test_what_escapes_counts_as_it_was_at_the_hill_sphere(tmp_path, made, body, speed, companion, leaves):
    """m / M of 1/120: the sphere has 169 m, and a grain at 164 m escapes from 0.06 m/s on."""
    place, up = np.array([0.0, 0.0, 164.0]), np.array([0.0, 0.0, speed])
    assert body.hill_radius == pytest.approx(1200.0 * (body.mass / (3.0 * 5.4e11)) ** (1.0 / 3.0))
    assert 164.0 < body.hill_radius < 172.0

    def kick(bed):
        high = int(np.argmax(bed.position[:, 2]))
        bed.velocity[high], bed.position[high] = up, place
        bed["state"][high] = BALLISTIC
        bed.attributes["shot"] = {"momentum_kg_m_s": [0.0, 0.0, -1e6], "normal": [0.0, 0.0, 1.0]}

    settings = started(tmp_path, made, kick, companion=companion)
    stage.run(settings, tmp_path, tmp_path / "5_dem")
    found = json.loads((tmp_path / "5_dem" / "stage_report.json").read_text())
    last = snapshot.read(tmp_path / "5_dem" / "last.vtkhdf")
    assert found["momentum_error"] < 1e-12 and abs(found["energy_error"]) < 0.01
    escapes = int(speed > 0.06)
    assert found["escaping_at_start"]["grains"] == found["escaping"]["grains"] == escapes
    assert found["left"] == int(leaves)
    assert body_state.bound(last, body_state.depth_of_well(last)).sum() == len(last) - escapes
    if escapes:
        counted = found["escaping"]["momentum_kg_m_s"][2] / found["escaping"]["mass_kg"]
        assert (counted > 0.065) == companion and counted > 0.03


def test_a_body_that_comes_apart_is_booked_to_the_last_grain(tmp_path, made):
    def burst(bed):
        bed.velocity[:] += 0.05 * bed.position  # Hubble's way: up to 4 m/s
        bed.position[:] *= 1.3

    stage.run(started(tmp_path, made, burst, companion=False), tmp_path, tmp_path / "5_dem")
    found = json.loads((tmp_path / "5_dem" / "stage_report.json").read_text())
    assert found["booked"]["escaped"]["grains"] == found["left"] > 390
    assert found["momentum_error"] < 1e-12 and found["angular_momentum_error"] < 1e-10


def test_what_is_thrown_too_slowly_comes_back(tmp_path, made, body):
    def kick(bed):
        high = np.argsort(bed.position[:, 2])[-1:]
        bed.velocity[high] += [0.0, 0.0, 0.02]

    stage.run(started(tmp_path, made, kick), tmp_path, tmp_path / "5_dem")
    last = snapshot.read(tmp_path / "5_dem" / "last.vtkhdf")
    found = json.loads((tmp_path / "5_dem" / "stage_report.json").read_text())
    assert found["left"] == 0 and (last.state == 0).all()


def test_a_stopped_collapse_resumes_bit_for_bit(tmp_path, made, monkeypatch):
    files = []
    for name, stops in (("whole", ()), ("resumed", (2, 151))):
        run = tmp_path / name
        settings = started(run, made, end_time=200.0, latest_time=200.0)
        interrupted(monkeypatch, stops, lambda run=run, settings=settings: stage.run(settings, run, run / "5_dem"))
        files.append(snapshot.read(run / "5_dem" / "last.vtkhdf"))
    same_grains(*files)


@pytest.mark.parametrize("change", [{"stiffness": "following"}, {"engine": "lammps"}])
def test_a_collapse_refuses_what_goes_by_a_fixed_field(tmp_path, made, change):
    settings = started(tmp_path, made, **change)
    with pytest.raises(InputError, match=r"attract each other|leave it out on an ellipsoid"):
        stage.run(settings, tmp_path, tmp_path / "5_dem")


@pytest.mark.validation
def test_a_stopped_bed_resumes_bit_for_bit(tmp_path, monkeypatch):
    settings = settings_of(DIMORPHOS).model_copy(update={"count": 200})
    files = []
    for name, stops in (("whole", ()), ("resumed", (3, 700, 1200, 4300))):
        run = tmp_path / name
        written(run, settings.target)
        interrupted(monkeypatch, stops, lambda run=run: bed_stage.run(settings, run, run / "3_bed"))
        files.append(snapshot.read(run / "3_bed" / "bed.vtkhdf"))
    same_grains(*files)


def test_a_shape_that_friction_does_not_hold_is_said_with_the_place(tmp_path, monkeypatch):
    monkeypatch.setattr(SolidSettling, "rest_limit", 1)  # it slumps for as long as it is let
    monkeypatch.setattr(friction_angle, "measure", lambda contact: {"angle_deg": 15.0})
    slick = Contact(shell=GrainLaw(friction=0.05, shape=0.1))
    settings = settings_of({"shape": "ellipsoid", "axes": [300.0, 120.0, 90.0], "layers": DIMORPHOS["layers"]},
                           contact=slick)  # fmt: skip
    written(tmp_path, settings.target)
    with pytest.raises(Unsound, match=r"moved most: .* at latitude .* is steeper than its grains' 15 deg"):
        bed_stage.run(settings, tmp_path, tmp_path / "3_bed")
    found = json.loads((tmp_path / "3_bed" / "bed_report.json").read_text())
    assert found["axes_of_inertia_m"][0] < 0.97 * found["axes_of_inertia_target_m"][0]
    assert found["moved_most"]["radii"] > 0.5 and abs(found["slopes"]["largest_at_latitude_deg"]) < 30.0
    # it is the long ends that come in
    assert min(abs(found["moved_most"]["longitude_deg"]), 180.0 - abs(found["moved_most"]["longitude_deg"])) < 60.0


def test_masses_give_the_body_its_mass_centre_and_axes(body):
    rng = np.random.default_rng(3)
    x = rng.normal(size=(500, 3)) * [40.0, 40.0, 25.0] + [1.0, -2.0, 1.0]
    r = rng.uniform(3.0, 4.0, 500)
    mass, correction = solid_masses.matched(x, r, body)
    assert mass.sum() == pytest.approx(body.mass, rel=1e-12)
    assert np.abs(mass @ x).max() < 1e-10 * body.mass * 40.0
    axes = np.linalg.eigh(body.solid.inertia)[1]
    moments = np.einsum("i,ij,ik->jk", mass, x @ axes, x @ axes)
    assert np.abs(moments - np.diag(np.diag(moments))).max() < 1e-10 * moments.max()
    assert correction > 0.01


# -- slopes


def figure(axes, spin_rate: float) -> SolidBody:
    """An ellipsoid that turns about z of its own frame, with the site at its pole: both frames agree but for a turn
    about z."""
    period = {"spin_period": 2.0 * math.pi / spin_rate} if spin_rate else {}
    target = Target.model_validate(
        {"shape": "ellipsoid", "axes": axes, "latitude": 0.5 * math.pi, "layers": DIMORPHOS["layers"], **period}
    )
    facts = solid_target.target_json(target, DENSITY)
    omega = np.array(facts["angular_velocity_1_s"])
    return SolidBody(target.placed, facts["mass_kg"], "basalt", omega, None)


@pytest.mark.validation
def test_a_maclaurin_spheroid_is_level():
    e = 0.6
    rate = math.sqrt(
        math.pi * G * DENSITY
        * (2.0 * math.sqrt(1.0 - e**2) / e**3 * (3.0 - 2.0 * e**2) * math.asin(e) - 6.0 * (1.0 - e**2) / e**2)
    )  # fmt: skip
    level = slopes.surface_slopes(figure([200.0, 200.0, 160.0], rate), 4.0)
    assert level.slope.max() < 2.0 and level.slope.mean() < 0.7
    assert slopes.surface_slopes(figure([200.0, 200.0, 160.0], 0.0), 4.0).slope.max() > 5.0


def test_slopes_of_a_resting_ellipsoid_are_those_of_its_closed_form():
    axes = np.array([200.0, 160.0, 100.0])
    body = figure(axes.tolist(), 0.0)
    found = slopes.surface_slopes(body, 1.0)
    half = 0.5 * axes
    # g_i = -2 pi G rho A_i x_i,  A_i = a b c int_0^inf du / ((a_i^2 + u) Delta(u))  (Chandrasekhar 1969)
    parts = [
        np.prod(half) * quad(lambda u, a=a: 1.0 / ((a**2 + u) * np.sqrt(np.prod(half**2 + u))), 0.0, np.inf)[0]
        for a in half
    ]
    own = found.position @ body.placed.turn
    g, normal = -own * parts, own / half**2
    cosine = -np.einsum("ij,ij->i", g, normal) / np.linalg.norm(g, axis=1) / np.linalg.norm(normal, axis=1)
    exact = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    assert exact.max() > 15.0
    assert np.abs(found.slope - exact).max() < 2.5 and np.abs(found.slope - exact).mean() < 0.6
    steep = found.against(10.0, body)
    # half a degree, the mean error, moves this share by 0.03
    assert steep["share_above_friction_angle"] == pytest.approx(np.mean(exact > 10.0), abs=0.04)
    assert f"{steep['share_above_friction_angle']:.2g} of the body's surface is steeper" in solid_bed.in_words(steep)


# -- what is refused


@pytest.mark.parametrize(
    ("target", "bed", "words"),
    [
        ({}, {"shape": "cap"}, 'the "whole" is filled'),
        ({}, {"packing": "hcp"}, "are for flat ground"),
        ({}, {"contact": HERTZ}, "springs of constant stiffness"),
        ({"spin_period": 6000.0}, {}, "loose grains leave it"),
        ({"layers": [{"name": "body", "material": "water"}]}, {}, "no friction that could hold its shape"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, target, bed, words):
    settings = settings_of({**DIMORPHOS, **target}, **bed)
    written(tmp_path, settings.target)
    with pytest.raises(InputError, match=words):
        bed_stage.run(settings, tmp_path, tmp_path / "3_bed")


def test_two_bodies_and_a_companion_inside_are_refused(tmp_path):
    settings = settings_of(DIMORPHOS)
    written(tmp_path, settings_of({**DIMORPHOS, "axes": [177.0, 174.0, 117.0]}).target)
    with pytest.raises(InputError, match="they are two"):
        bed_stage.run(settings, tmp_path, tmp_path / "3_bed")
    with pytest.raises(ValueError, match="lies inside the body"):
        Target.model_validate({**DIMORPHOS, "companion": {"mass": 1e10, "distance": 80.0}})
    with pytest.raises(ValueError, match="companion: of an ellipsoid or mesh only"):
        Target.model_validate({"layers": [{"name": "a", "material": "basalt", "thickness": 1e3}],
                               "companion": {"mass": 1e10, "distance": 1e5}})  # fmt: skip
