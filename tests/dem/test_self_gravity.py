"""Grains that attract each other: the sum over pairs, orbits, the energy and momenta of a falling cluster."""

import math

import numpy as np
import pytest

from dem.assembly import Assembly, Extras
from dem.contact_settings import Contact, GrainLaw
from dem.self_gravity import SelfGravity
from matter.constants import G
from tests.dem.scenes import cluster, grains

LAW = Contact(shell=GrainLaw(friction=0.5, shape=0.4), sliding="cap", overlap_stop=1.5)


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
    pair = Assembly(scene, LAW, dt=period / 20_000, extras=Extras(self_gravity=SelfGravity(every=1)))
    start = sum(pair.energies().values())
    for _ in range(20_000):
        pair.step()
    order = np.argsort(pair.identity)
    assert np.abs(pair.position[order] - scene.position).max() < 0.01 * apart
    assert sum(pair.energies().values()) == pytest.approx(start, rel=1e-4)


def test_a_cluster_falls_together_and_keeps_its_balances():
    scene = cluster(5, fall=0.0)
    scene["mass"] = 1e11 * scene.mass / scene.mass.mean()
    scene["velocity"] = 0.0 * scene.velocity
    scene["stiffness"] = 2e13 * scene.radius
    bed = Assembly(scene, LAW, extras=Extras(self_gravity=SelfGravity(every=5)))
    start = sum(bed.energies().values())
    p, l = bed.momentum(), bed.angular_momentum()
    for _ in range(1500):
        bed.step()
    moving = float(bed.mass @ np.linalg.norm(bed.velocity, axis=1))
    spent = float(bed.report[:4].sum())
    assert bed.contacts > 150 and spent > 0.0
    assert sum(bed.energies().values()) + spent == pytest.approx(start, abs=0.01 * spent + 2e-4 * abs(start))
    assert np.abs(bed.momentum() - p).max() < 1e-10 * max(moving, spent)
    assert np.abs(bed.momentum() - bed.report[4:7] - p).max() < 1e-11 * max(moving, spent)
    assert np.abs(bed.angular_momentum() - bed.report[7:10] - l).max() < 1e-10 * max(moving, spent)
