"""Grains that attract each other: the sum over pairs, the field of a sphere, orbits, a pull that is held while the
body turns, the energy and momenta of a falling cluster, a companion's tide, the turning frame."""

import math

import numpy as np
import pytest

from dem.contact.columns import IMPULSE
from dem.contact.settings import Contact, GrainLaw
from dem.grains import cached_gravity, tide, turning_frame
from dem.grains.assembly import BALLISTIC, Assembly, Extras
from dem.grains.self_gravity import FRACTION, SelfGravity, orbit_time
from dem.grains.tide import Tide
from matter.constants import G
from matter.points import packing
from tests.dem.scenes import cluster, grains

LAW = Contact(shell=GrainLaw(friction=0.5, shape=0.4), overlap_stop=1.5)


def test_it_is_the_sum_over_pairs():
    scene = cluster(8)
    x, m = scene.position, scene.mass
    d = x[None] - x[:, None]
    r = np.linalg.norm(d, axis=2)
    np.fill_diagonal(r, np.inf)
    exact = G * np.einsum("j,ijk->ik", m, d / r[..., None] ** 3)
    found = SelfGravity().acceleration(x, m, scene.radius)
    assert np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)) < 3e-3
    energy = -0.5 * G * np.sum(m[:, None] * m[None] / r)
    assert SelfGravity().energy(x, m, scene.radius) == pytest.approx(energy, rel=2e-3)


def test_two_grains_go_round_each_other():
    mass, apart = 1e9, 10.0
    speed = math.sqrt(G * mass / (2 * apart))
    scene = grains(
        [[0, 0, 0], [apart, 0, 0]],
        mass=[mass] * 2,
        stiffness=[1.0] * 2,
        velocity=np.array([[0, -speed, 0], [0, speed, 0]]),
    )
    period = math.pi * apart / speed
    pair = Assembly(scene, LAW, dt=period / 5_000, extras=Extras(self_gravity=SelfGravity(interval=0.0)))
    start = sum(pair.energies().values())
    for _ in range(5_000):
        pair.step()
    order = np.argsort(pair.identity)
    assert np.abs(pair.position[order] - scene.position).max() < 0.01 * apart
    assert sum(pair.energies().values()) == pytest.approx(start, rel=1e-4)


def test_a_cluster_falls_together_and_keeps_its_balances():
    scene = cluster(5, fall=0.0)
    scene["mass"] = 1e11 * scene.mass / scene.mass.mean()
    scene["velocity"] = 0.0 * scene.velocity
    scene["stiffness"] = 2e13 * scene.radius
    bed = Assembly(scene, LAW, extras=Extras(self_gravity=SelfGravity(interval=0.0245)))
    assert 4.0 * bed.dt < bed.pull_interval < 5.0 * bed.dt
    start = sum(bed.energies().values())
    p, l = bed.momentum(), bed.angular_momentum()
    for _ in range(1500):
        bed.step()
    moving = float(bed.mass @ np.linalg.norm(bed.velocity, axis=1))
    spent = float(bed.report[:4].sum())
    assert bed.contacts > 150 and spent > 0.0
    assert sum(bed.energies().values()) + spent == pytest.approx(start, abs=0.01 * spent + 2e-4 * abs(start))
    assert np.abs(bed.momentum() - p).max() < 1e-12 * moving
    arms = float(bed.mass @ np.linalg.norm(np.cross(bed.position, bed.velocity), axis=1))
    assert np.abs(bed.angular_momentum() - l).max() < 1e-12 * arms
    assert 0.0 < bed.pull_state[cached_gravity.WORST] < 1e-2


def ball(count: int, density: float = 2000.0):
    """Grains of a hexagonal packing that just do not touch, in a ball of radius 100 m, with its mean density."""
    apart = (4.0 / 3.0 * math.pi * 100.0**3 / count) ** (1.0 / 3.0)
    x = packing.hexagonal(apart, 100.0)
    x = x[np.linalg.norm(x, axis=1) < 100.0]
    mass = np.full(len(x), 4.0 / 3.0 * math.pi * 100.0**3 * density / len(x))
    return grains(x, 0.55 * apart, mass=mass, stiffness=np.full(len(x), 1e5))


def test_a_ball_of_grains_has_the_field_of_a_ball():
    scene = ball(4000)
    place, m = scene.position, scene.mass
    r = np.linalg.norm(place, axis=1)
    found = SelfGravity().acceleration(place, m, scene.radius)
    inwards = -np.einsum("ij,ij->i", found, place) / r
    exact = G * m.sum() * r / 100.0**3
    here = (r > 30.0) & (r < 95.0)
    assert inwards[here].mean() == pytest.approx(exact[here].mean(), rel=0.01)
    assert np.sqrt(np.mean((inwards - exact)[here] ** 2)) < 0.03 * exact[here].mean()
    whole = -0.6 * G * m.sum() ** 2 / 100.0
    # a grain's pull on itself, 3/5 G m^2 / r of a ball as large as its share of the volume, is not in the sum
    own = -0.6 * G * np.sum(m**2) / (100.0 * len(m) ** (-1.0 / 3.0))
    assert SelfGravity().energy(place, m, scene.radius) == pytest.approx(whole - own, rel=0.01)


def test_the_default_interval_is_that_of_an_orbit():
    scene = ball(300)
    bed = Assembly(scene, LAW, extras=Extras(self_gravity=SelfGravity()))
    grain = float(scene.mass[0] / (4.0 / 3.0 * math.pi * scene.radius[0] ** 3))
    assert bed.pull_interval == pytest.approx(orbit_time(grain) / FRACTION)
    # Kepler's third law at the surface of a sphere
    assert orbit_time(2000.0) == pytest.approx(2.0 * math.pi / math.sqrt(G * 4.0 / 3.0 * math.pi * 2000.0), rel=1e-12)


def test_a_pull_that_is_held_turns_with_the_body():
    """Two grains on a circle, the pull held over a 60th of it: lagging by 3 degrees on the mean, it would change their
    angular momentum by 0.05 in a radian; turned, they come back."""
    mass, apart = 1e9, 10.0
    speed = math.sqrt(G * mass / (2.0 * apart))
    velocity = np.array([[0.0, -speed, 0.0], [0.0, speed, 0.0]])
    scene = grains([[0, 0, 0], [apart, 0, 0]], mass=[mass] * 2, stiffness=[1.0] * 2, velocity=velocity)
    period = math.pi * apart / speed
    law = SelfGravity(interval=period / 60.0)
    pair = Assembly(scene, LAW, dt=period / 6000.0, extras=Extras(self_gravity=law))
    l = pair.angular_momentum()
    for _ in range(6000):
        pair.step()
    order = np.argsort(pair.identity)
    assert np.abs(pair.position[order] - scene.position).max() < 0.01 * apart
    assert np.abs(pair.angular_momentum() - l).max() < 1e-12 * np.abs(l).max()


def test_a_turning_ball_keeps_momentum_and_angular_momentum():
    scene = ball(600)
    spin = np.array([1e-4, -2e-4, 3e-4])
    scene["velocity"] = np.cross(spin, scene.position) + 0.01
    scene["angular_velocity"] = np.tile(spin, (len(scene), 1))
    bed = Assembly(scene, LAW, extras=Extras(self_gravity=SelfGravity()))
    p, l = bed.momentum(), bed.angular_momentum()
    assert np.abs(cached_gravity.angular_velocity(bed) - spin).max() < 1e-12
    for _ in range(1000):
        bed.step()
    assert bed.time > 20.0 * bed.pull_interval and bed.contacts > 500
    scale = float(bed.mass @ np.linalg.norm(bed.velocity, axis=1))
    assert np.abs(bed.momentum() - p).max() < 1e-12 * scale
    assert np.abs(bed.angular_momentum() - l).max() < 1e-12 * scale * 100.0
    assert bed.pull_state[cached_gravity.WORST] < 1e-4


def test_it_goes_on_bit_for_bit_from_what_was_saved():
    def started() -> Assembly:
        scene = ball(300)
        scene["velocity"] = np.cross([0.0, 0.0, 3e-4], scene.position)
        companion = Tide(5e11, np.array([1200.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.4e-4]))
        return Assembly(scene, LAW, extras=Extras(self_gravity=SelfGravity(), outer=(companion,)))

    bed, again = started(), started()
    for _ in range(137):
        bed.step()
    again.restore({name: np.copy(value) if isinstance(value, np.ndarray) else value
                   for name, value in bed.saved().items()})  # fmt: skip
    for _ in range(50):
        bed.step()
        again.step()
    for name in ("X", "W", "self_acceleration", "cached_acceleration", "pull_state"):
        assert np.array_equal(getattr(bed, name), getattr(again, name)), name


def test_a_companion_raises_its_tide():
    scene = ball(300)
    far = 5000.0
    pulled = Assembly(
        scene, LAW, extras=Extras(outer=(Tide(1e12, np.array([0.0, far, 0.0]), np.array([0.0, 0.0, 1e-4])),))
    )
    x, strength = pulled.position, G * 1e12 / far**3
    exact = strength * np.column_stack([-x[:, 0], 2.0 * x[:, 1], -x[:, 2]])
    # next comes the octupole, smaller by 3/2 r / d; the mean of all is taken out
    assert np.abs(pulled.self_acceleration - exact).max() < 2.0 * 100.0 / far * np.abs(exact).max()
    assert np.abs(pulled.mass @ pulled.self_acceleration).max() < 1e-12 * pulled.mass.sum() * np.abs(exact).max()


def test_what_flies_off_does_not_push_the_body_by_way_of_the_frame():
    scene = ball(300)
    scene["state"] = np.zeros(len(scene), dtype=np.int8)
    scene["state"][-1], scene.position[-1] = BALLISTIC, [0.0, 3000.0, 0.0]
    place = np.array([0.0, 5000.0, 0.0])
    bed = Assembly(scene, LAW, extras=Extras(outer=(Tide(1e12, place, np.array([0.0, 0.0, 1e-4])),)))
    body, flies = slice(0, bed.active), bed.active
    assert bed.active == len(scene) - 1
    near = G * 1e12 / 2000.0**2 - G * 1e12 / 5000.0**2
    assert bed.self_acceleration[flies] == pytest.approx([0.0, near, 0.0], abs=1e-3 * near)
    assert np.abs(bed.mass[body] @ bed.self_acceleration[body]).max() < 1e-12 * bed.mass.sum() * near
    before = bed.momentum()
    for _ in range(20):
        bed.step()
    gained = bed.momentum() - before
    assert gained[1] == pytest.approx(bed.mass[flies] * near * bed.time, rel=1e-3)
    assert gained == pytest.approx(bed.report[IMPULSE], abs=1e-10 * gained[1])


def test_a_companion_that_goes_round_does_the_work_that_is_booked():
    scene = ball(300)
    scene["velocity"] = np.cross([0.0, 0.0, 3e-4], scene.position)
    companion = Tide(1e14, np.array([800.0, 0.0, 0.0]), np.array([0.0, 0.0, 2e-3]))
    smooth = Contact(shell=GrainLaw(friction=0.0, shape=0.0, restitution=1.0), overlap_stop=1.5)
    bed = Assembly(scene, smooth, extras=Extras(self_gravity=SelfGravity(interval=0.0), outer=(companion,)))
    start, l = sum(bed.energies().values()), bed.angular_momentum()
    for _ in range(800):
        bed.step()
    work, now = bed.pull_state[cached_gravity.WORK], sum(bed.energies().values())
    assert abs(work) > 1e-3 * abs(start)
    assert now - work == pytest.approx(start, abs=0.03 * abs(work))
    turned = bed.angular_momentum() - l
    assert np.abs(turned - bed.report[7:10]).max() < 1e-10 * np.abs(turned).max()
    assert tide.rate(5.4e11, 4.5e9, 1200.0) == pytest.approx(2.0 * math.pi / (12.04 * 3600.0), rel=2e-3)


def test_there_and_back_between_the_turning_and_the_inertial_frame():
    rng = np.random.default_rng(1)
    x, v, w = (rng.normal(size=(5, 3)) for _ in range(3))
    omega = np.array([0.1, -0.2, 0.3])
    for known, found in zip(
        (x, v, w), turning_frame.turning(*turning_frame.inertial(x, v, w, omega, 7.0), omega, 7.0)
    ):
        assert found == pytest.approx(known, abs=1e-12)
    # a grain at rest in the turning frame moves on a circle in the inertial one
    one, two = (turning_frame.inertial(x, 0.0 * v, 0.0 * w, omega, t)[0] for t in (7.0, 7.0 + 1e-6))
    assert (two - one) / 1e-6 == pytest.approx(turning_frame.inertial(x, 0.0 * v, 0.0 * w, omega, 7.0)[1], abs=1e-5)


def test_the_centrifugal_force_points_away_from_an_axis_through_the_centre_of_mass():
    scene = ball(300)
    scene["position"] = scene.position + [7.0, 0.0, 0.0]
    omega = np.array([0.0, 0.0, 2e-3])
    bed = Assembly(scene, LAW, extras=Extras(outer=(turning_frame.Centrifugal(omega),)))
    centre = bed.mass @ bed.position / bed.mass.sum()
    assert bed.self_acceleration == pytest.approx(4e-6 * (bed.position - centre) * [1.0, 1.0, 0.0], abs=1e-15)
    fast = 2e-3 * np.linalg.norm((bed.position - centre)[:, :2], axis=1)
    assert bed.energies()["gravitational_J"] == pytest.approx(-0.5 * bed.mass @ fast**2, rel=1e-12)


def test_held_in_place_neither_falls_nor_tumbles():
    scene = ball(300)
    scene["position"] = scene.position * [1.0, 0.7, 1.0]
    skew = np.array([1e-3, 1e-3, 2e-3])
    bed = Assembly(scene, LAW, extras=Extras(outer=(turning_frame.Centrifugal(skew), turning_frame.Held())))
    loose = Assembly(scene, LAW, extras=Extras(outer=(turning_frame.Centrifugal(skew),)))
    torque = [np.abs(one.mass @ np.cross(one.position, one.self_acceleration)).max() for one in (bed, loose)]
    assert torque[0] < 1e-9 * torque[1]
