"""Friction, rolling and twisting on a plane, and the invariants of many contacts."""

import math

import numpy as np
import pytest

from dem.contact.gravity import Field
from dem.contact.kinematics import Ball, grain_kinematics
from dem.contact.settings import Contact, GrainLaw
from dem.contact.walls import PLANE, Wall
from dem.grains.assembly import ACTIVE, BALLISTIC, Assembly, Extras
from matter.errors import InputError, UnphysicalState
from tests.dem.scenes import assembly, cluster, grains

FLOOR = Wall(PLANE, species=0)
G = 1.0


def on_floor(law: GrainLaw, angle: float = 0.0, **fields) -> Assembly:
    """A sphere in equilibrium on a plane, gravity tilted by ``angle`` towards +x."""
    k, m = 1e4, 1.0
    sink = m * G * math.cos(angle) / k
    scene = grains([[0.0, 0.0, 1.0 - sink]], mass=[m], stiffness=[k], **fields)
    return assembly(scene, law, [FLOOR], (G * math.sin(angle), 0.0, -G * math.cos(angle)))


def test_a_sliding_sphere_begins_to_roll_at_five_sevenths():
    mu, v0 = 0.3, 2.0
    ball = on_floor(GrainLaw(friction=mu, shape=0.0), velocity=np.array([[v0, 0.0, 0.0]]))
    slip, begins = v0, None
    while ball.time < 3.0:
        ball.step()
        slip = ball.W[0, 0] - ball.W[0, 4] * 1.0
        if begins is None and slip < 1e-3 * v0:
            begins = ball.time
    assert begins == pytest.approx(2 * v0 / (7 * mu * G), rel=0.01)
    assert ball.W[0, 0] == pytest.approx(5 / 7 * v0, rel=0.005)
    assert ball.W[0, 4] == pytest.approx(5 / 7 * v0, rel=0.005)


@pytest.mark.parametrize("angle, rolls", [(20.0, False), (26.0, True)])
def test_rolling_starts_where_the_slope_reaches_beta_mu_r(angle, rolls):
    # tan(22.78 deg) = 0.42 = beta mu_r
    ball = on_floor(GrainLaw(friction=0.9, shape=0.4, rolling=1.05), math.radians(angle))
    for _ in range(4000):
        ball.step()
    assert (ball.W[0, 0] > 0.05) == rolls


@pytest.mark.parametrize("tangent, expected", [(0.5, 5 / 7 * 0.5), (1.4, 1.4 - 0.2)])
def test_acceleration_down_an_incline(tangent, expected):
    # a sphere rolls while tan th < 3.5 mu (a = 5/7 g sin th), else it slides (a = g (sin th - mu cos th))
    angle = math.atan(tangent)
    ball = on_floor(GrainLaw(friction=0.2, shape=0.0), angle)
    for _ in range(3000):
        ball.step()
    assert ball.W[0, 0] / ball.time == pytest.approx(expected * math.cos(angle), rel=0.01)


def test_a_twisting_top_stops_linearly_in_its_time():
    law = GrainLaw(friction=0.5, shape=0.4, twisting=1.3)
    w0 = 1.0
    top = on_floor(law, angular_velocity=np.array([[0.0, 0.0, w0]]))
    stop = 0.4 * w0 / (1.3 * 0.5 * 0.4 * 1.0 * G)
    while top.time < 0.5 * stop:
        top.step()
    assert top.W[0, 5] == pytest.approx(0.5 * w0, rel=0.02)
    while top.time < 1.2 * stop:
        top.step()
    assert abs(top.W[0, 5]) < 0.02 * w0


def test_gross_sliding_impact_obeys_rigid_body_impulses():
    # beyond th ~ 35 deg: v_t'/v_t = 1 - mu (1 + e) cot th, w' = 5 mu (1 + e) v cos th / (2 R) (Chung & Ooi 2011, test
    # 4)
    mu, e, speed, angle = 0.092, 0.98, 3.9, math.radians(60.0)
    law = GrainLaw(friction=mu, restitution=e, restitution_tangential=e, shape=0.0)
    scene = grains(
        [[0, 0, 1.001]], velocity=speed * np.array([[math.sin(angle), 0, -math.cos(angle)]]), stiffness=[1e7]
    )
    ball = assembly(scene, law, [FLOOR], steps_per_contact=100)
    for _ in range(400):
        ball.step()
    assert ball.W[0, 0] / (speed * math.sin(angle)) == pytest.approx(1 - mu * (1 + e) / math.tan(angle), rel=0.01)
    assert ball.W[0, 4] == pytest.approx(5 * mu * (1 + e) * speed * math.cos(angle) / 2, rel=0.01)


def test_an_isolated_cluster_keeps_momentum_and_angular_momentum():
    bed = assembly(cluster(), overlap_stop=1.5)
    p, l = bed.momentum(), bed.angular_momentum()
    scale_p = float(np.sum(bed.mass * np.linalg.norm(bed.velocity, axis=1)))
    scale_l = float(bed.mass @ np.linalg.norm(np.cross(bed.position, bed.velocity), axis=1))
    for _ in range(400):
        bed.step()
    assert bed.contacts > 50 and bed.builds > 3
    assert np.abs(bed.momentum() - p).max() < 1e-12 * scale_p
    assert np.abs(bed.angular_momentum() - l).max() < 1e-12 * scale_l


def test_energy_is_accounted_for():
    bed = assembly(cluster(fall=0.1), overlap_stop=1.5)
    start, spent = sum(bed.energies().values()), 0.0
    for _ in range(400):
        bed.step()
        assert bed.report[0] >= spent - 1e-6 * start
        spent = bed.report[0]
    left = sum(bed.energies().values())
    assert spent > 0.3 * start
    assert left + spent == pytest.approx(start, rel=0.01)


def test_energy_never_grows():
    """All grains frictional (springs loaded to the whole limit in slip gain up to 1e-3 of the energy in single steps
    here)."""
    law = GrainLaw(friction=0.5, shape=0.5, restitution=0.5)
    bed = assembly(cluster(fall=0.1), law, ocean=law, overlap_stop=1.5)
    start, spent = sum(bed.energies().values()), 0.0
    for _ in range(500):
        bed.step()
        assert bed.report[0] >= spent - 1e-9 * start
        spent = bed.report[0]
    assert spent > 0.5 * start
    assert sum(bed.energies().values()) + spent == pytest.approx(start, rel=0.004)


def test_a_small_grain_deep_in_a_large_one_rolls_at_a_bounded_rate():
    """Bagi & Kuhn's rate of rolling: with the distances of the centres from the plane of contact in the place of the
    radii it had no bound where the small grain's centre passes that plane (d^2 = r1^2 - r2^2)."""
    large, small, sliding = 1.0, 0.1, 0.3
    for distance in np.append(np.linspace(0.97, 1.1, 400), math.sqrt(large**2 - small**2)):
        one, two = Ball(large, 0.0, 0.0, 0.0), Ball(small, 0.0, 0.5, 0.0)
        meeting, l1, l2 = grain_kinematics((distance, 0.0, 0.0), (0.0, 0.0, sliding), one, two, 0.0)
        assert l1 + l2 == pytest.approx(distance, rel=1e-14)
        slip = sliding + 0.5 * l2  # of the second grain's surface: v_z + (w x -l2 n)_z
        assert meeting.uz == pytest.approx(slip, rel=1e-12)
        lean = 0.5 * (1.0 / large - 1.0 / small)
        assert (meeting.rx, meeting.rz) == (0.0, 0.0)
        assert meeting.ry == pytest.approx(0.5 - lean * slip, rel=1e-12)


@pytest.mark.validation
def test_energy_is_accounted_for_where_a_small_grain_goes_through_a_large_one():
    """An ejected grain that is taken back into the search inside another, with an overlap that counts for none: its
    centre is driven through the plane of contact."""
    law = GrainLaw(friction=0.5, shape=0.5, restitution=0.5)
    depth = math.sqrt(1.0 - 0.1**2)
    start = grains(
        [[0.0, 0.0, 0.0], [depth + 0.001, 0.0, 0.0]], [1.0, 0.1], mass=[1.0, 1e-3], stiffness=[1e4, 20.0],
        velocity=[[0.0, 0.0, 0.0], [-0.3, 0.0, 0.2]], state=np.array([ACTIVE, BALLISTIC], dtype=np.int8),
    )  # fmt: skip
    bed = Assembly(start, Contact(shell=law), (), Field.constant((0.0, 0.0, 0.0)), dt=1e-4, extras=Extras(offset=True))
    bed.change_states(bed.identity == 1, ACTIVE)
    energy, gap = sum(bed.energies().values()), []
    for _ in range(600):
        bed.step()
        gap.append(np.linalg.norm(bed.X[0, :3] - bed.X[1, :3]))
        assert sum(bed.energies().values()) + bed.report[0] == pytest.approx(energy, rel=0.01)
    assert min(gap) < depth < max(gap)


def test_history_survives_rebuilds():
    seldom, always = (assembly(cluster(5, fall=0.1), overlap_stop=1.5) for _ in range(2))
    seldom.skin = 0.5
    seldom._rebuild()
    for step in range(200):
        seldom.step()
        if step % 2:
            always._rebuild()
        always.step()
    assert always.builds > 2 * seldom.builds
    pair = [bed.particles({}) for bed in (seldom, always)]
    assert np.array_equal(pair[0].tables["contacts/pair"], pair[1].tables["contacts/pair"])
    history = [p.tables["contacts/history"] for p in pair]
    assert np.abs(history[0]).max() > 1e-4
    assert np.abs(history[0] - history[1]).max() < 1e-6 * np.abs(history[0]).max()
    assert np.allclose(pair[0].position, pair[1].position, rtol=0, atol=1e-9)


def test_history_survives_a_snapshot():
    whole = assembly(cluster(5, fall=0.1), overlap_stop=1.5)
    for _ in range(150):
        whole.step()
    again = assembly(whole.particles({}), overlap_stop=1.5, dt=whole.dt)
    first, second = whole.particles({}).tables, again.particles({}).tables
    assert np.array_equal(first["contacts/pair"], second["contacts/pair"])
    assert np.allclose(first["contacts/history"], second["contacts/history"], rtol=1e-9, atol=1e-15)


def test_threads_and_order_change_only_the_last_bits():
    scene = cluster(5, fall=0.1)
    shuffled = scene.select(np.random.default_rng(3).permutation(len(scene)))
    beds = [
        assembly(scene, overlap_stop=1.5),
        assembly(scene, overlap_stop=1.5, threads=3),
        assembly(shuffled, overlap_stop=1.5),
    ]
    for bed in beds:
        for _ in range(100):
            bed.step()
    first, *others = [bed.particles({}) for bed in beds]
    for other in others:
        assert np.allclose(first.position, other.position, rtol=0, atol=1e-10)
        assert np.allclose(first.angular_velocity, other.angular_velocity, rtol=0, atol=1e-8)
    again = assembly(scene, overlap_stop=1.5, threads=3)
    for _ in range(100):
        again.step()
    assert np.array_equal(again.particles({}).velocity, beds[1].particles({}).velocity)


def test_too_deep_an_overlap_stops_with_grain_place_and_values():
    scene = grains(
        [[0, 0, 0], [2.1, 0, 0]],
        velocity=np.array([[60.0, 0, 0], [-60.0, 0, 0]]),
        identity=[11, 42],
        stiffness=np.full(2, 1e3),
    )
    pair = assembly(scene)
    with pytest.raises(UnphysicalState, match=r"grains (11|42) and (11|42) overlap by .*position.*k_n"):
        for _ in range(100):
            pair.step()


def test_a_returning_grain_is_stopped_softly_and_booked():
    def run(returned):
        scene = grains([[0, 0, 0], [2.1, 0, 0]], velocity=np.array([[0.0, 0, 0], [-150.0, 0, 0]]))
        pair = Assembly(scene, Contact(overlap_stop=1.9), overlap_limit=np.inf)
        pair.returned[:] = returned
        deepest = 0.0
        for _ in range(120):
            pair.step()
            deepest = max(deepest, 2.0 - abs(pair.position[1, 0] - pair.position[0, 0]))
        return pair, deepest

    hard, deep = run([0, 0])
    soft, shallow = run([0, 1])
    assert shallow < 0.75 * deep and soft.report[1] > 0.0 and hard.report[1] == 0.0
    assert soft.momentum() == pytest.approx([-150.0, 0, 0], rel=1e-12)


def test_bad_grains_are_refused():
    with pytest.raises(InputError, match="mass of grain 1"):
        Assembly(grains([[0, 0, 0], [3, 0, 0]], mass=[1.0, 0.0]), Contact())
    with pytest.raises(InputError, match="share an identity"):
        Assembly(grains([[0, 0, 0], [3, 0, 0]], identity=[1, 1]), Contact())
    with pytest.raises(InputError, match="velocity of grain 0 is not finite"):
        Assembly(grains([[0, 0, 0]], velocity=[[np.nan, 0, 0]]), Contact())


def test_central_gravity_keeps_a_kepler_orbit():
    # a table of one body's own field; a circular orbit in its vacuum, where g = g_R (R/r)^2
    radius = np.linspace(1.0, 1e6, 300)
    field = Field.of_target({"radius_m": radius, "gravity_m_s2": 1.2 * radius / 1e6})
    r = 2e6
    speed = math.sqrt(1.2 * 1e12 / r)
    flyer = Assembly(grains([[r, 0, 0]], velocity=[[0, speed, 0]], stiffness=[1.0]), Contact(), gravity=field, dt=2.0)
    energy = flyer.energies()["kinetic_J"] + flyer.energies()["gravitational_J"]
    period = 2 * math.pi * r / speed
    for _ in range(int(period / 2.0)):
        flyer.step()
    assert np.linalg.norm(flyer.position[0] - [r, 0, 0]) < 0.003 * r
    assert flyer.energies()["kinetic_J"] + flyer.energies()["gravitational_J"] == pytest.approx(energy, rel=1e-6)
