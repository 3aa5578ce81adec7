"""Every contact law against its analytic result for one pair."""

import math

import numpy as np
import pytest

from dem.contact.settings import Contact, GrainLaw
from dem.laws import normal_hooke, rolling_sds, tangential_spring, twisting_sds
from tests.dem.scenes import SMOOTH, assembly, grains

STIFFNESS = 1e4


def collide(restitution: float, steps: int, phase: float = 0.3, **contact):
    """Head-on collision of two unit masses; returns the measured restitution and the contact time over the analytic
    one."""
    dt = math.pi * math.sqrt(0.5 / STIFFNESS) / steps
    speed = 0.01
    scene = grains(
        [[0.0, 0.0, 0.0], [2.0 + phase * 2 * speed * dt, 0.0, 0.0]], velocity=np.array([[speed, 0, 0], [-speed, 0, 0]])
    )
    pair = assembly(scene, SMOOTH.model_copy(update={"restitution": restitution}), steps_per_contact=steps, **contact)
    overlap = lambda: 2.0 - abs(pair.position[1, 0] - pair.position[0, 0])  # noqa: E731
    before, begin, end = overlap(), None, None
    while end is None:
        pair.step()
        now = overlap()
        if begin is None and now > 0.0:
            begin = pair.time - dt * now / (now - before)
        elif begin is not None and now <= 0.0:
            end = pair.time - dt * now / (now - before)
        before = now
    bounce = (pair.velocity[1, 0] - pair.velocity[0, 0]) / (2 * speed)
    return bounce, (end - begin) / normal_hooke.contact_time(STIFFNESS, 0.5, restitution)


@pytest.mark.parametrize("restitution", [0.55, 0.8, 0.95])
@pytest.mark.parametrize("steps, tolerance", [(100, 0.005), (30, 0.01)])
def test_restitution_and_contact_time(restitution, steps, tolerance):
    for phase in np.linspace(0.0, 0.95, 6):
        bounce, duration = collide(restitution, steps, phase)
        assert bounce == pytest.approx(restitution, rel=tolerance)
        assert duration == pytest.approx(1.0, rel=tolerance)


def test_restitution_of_unequal_grains_is_the_same():
    steps = 100
    radius, mass = np.array([1.0, 0.5]), np.array([1.0, 0.125])
    scene = grains(
        [[0, 0, 0], [1.5001, 0, 0]],
        radius,
        mass=mass,
        velocity=np.array([[0.01, 0, 0], [-0.01, 0, 0]]),
        stiffness=np.array([1e4, 2e4]),
    )
    pair = assembly(scene, SMOOTH.model_copy(update={"restitution": 0.55}), steps_per_contact=steps)
    for _ in range(6 * steps):
        pair.step()
    order = np.argsort(pair.identity)
    assert (pair.velocity[order][1, 0] - pair.velocity[order][0, 0]) / 0.02 == pytest.approx(0.55, rel=0.01)


def test_a_sliding_spring_is_only_ever_shortened():
    beyond = dict(sx=1.0, sy=0.0, sz=0.0, ux=0.1, uy=0.0, uz=0.0, stiffness=10.0, damping=2.0, limit=4.0)
    fast = tangential_spring.force(*{**beyond, "ux": 10.0, "sx": 0.3}.values())
    assert fast == pytest.approx((4.0, 0, 0, 0.3, 0, 0))  # the dashpot reached the limit: the spring stays
    assert tangential_spring.force(*beyond.values()) == pytest.approx((4.0, 0, 0, 0.4, 0, 0))
    within = tangential_spring.force(0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 10.0, 2.0, 4.0)
    assert within == pytest.approx((1.2, 0, 0, 0.1, 0, 0))


def test_sliders_carry_exactly_their_limit():
    mx, my, mz, ax, ay, az = rolling_sds.moment(0.3, 0.4, 0.0, 0.0, 0.0, 0.0, 100.0, 1.0, 5.0)
    assert (mx, my, mz) == pytest.approx((3.0, 4.0, 0.0)) and (ax, ay, az) == pytest.approx((0.03, 0.04, 0.0))
    assert twisting_sds.moment(-1.0, 0.0, 10.0, 1.0, 4.0) == pytest.approx((-4.0, -0.4))


def test_the_weaker_partner_rules_a_mixed_contact():
    table = Contact(shell=GrainLaw(friction=0.5, restitution=0.7)).pair_table()
    assert np.array_equal(table[0, 1], table[1, 0]) and np.array_equal(table[0, 1], table[1, 1])
    assert table[0, 0, 2] == 0.5 and table[0, 1, 2] == 0.0


def test_the_stiffness_and_its_limit():
    contact = Contact()
    radius, bulk, sound = np.array([1000.0]), 9.47e9, math.sqrt(9.47e9 / 917.0)
    mass = 1500.0 * 4 / 3 * math.pi * radius**3
    assert contact.stiffness(radius, mass, "ice", 5e7)[0] == pytest.approx(2 * bulk * 1000.0)
    assert not contact.of_weight("ice", 5e7)
    # a bed of a small body: its weight asks for less than its solid would give, at overlaps of a thousandth
    assert contact.stiffness(radius, mass, "ice", 4.0)[0] == pytest.approx(4.0 * 1000.0 / (0.03 * 0.02))
    assert contact.of_weight("ice", 4.0)
    assert contact.stiffness(radius, mass, "ice", 5e8)[0] == pytest.approx(5e8 * 1000.0 / 0.02)
    stiff = contact.stiffness(radius, mass, "ice", 1e12)[0]
    assert 2 * 1000.0 * math.sqrt(stiff / mass[0]) == pytest.approx(2 * sound)


def test_a_solid_of_a_density_of_its_own_has_its_own_sound_speed():
    contact = Contact()
    radius = np.array([1000.0])
    mass = 1500.0 * 4 / 3 * math.pi * radius**3
    stiff = contact.stiffness(radius, mass, "ice", 1e12, 1400.0)[0]
    assert 2 * 1000.0 * math.sqrt(stiff / mass[0]) == pytest.approx(2 * math.sqrt(9.47e9 / 1400.0))
