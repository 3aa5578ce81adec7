"""Plastic flow in the integrator: stress stays on the yield surface from step to step, and turns with the strain."""

import numpy as np
import pytest

from fixtures import columns
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.materials.rows import collect
from sph.materials.settings import Choice

Y, G, RATE = 1e6, 22.7e9, 10.0


def ball():
    """A disordered ball of weak metal, 3 m across, turned and sheared: v_x = RATE z. So slow that waves do not
    matter."""
    materials = collect(("basalt",), {"basalt": Choice(damage="none", von_mises={"Y0": "1 MPa"})})
    rng = np.random.default_rng(5)
    place = np.stack(np.meshgrid(*(np.arange(-5, 6),) * 3, indexing="ij"), axis=-1).reshape(-1, 3) + rng.uniform(
        -0.1, 0.1, (11**3, 3)
    )
    place = place[np.linalg.norm(place, axis=1) < 5.0] * 0.3
    n = len(place)
    body = Body(
        place,
        np.full(n, 2700 * 0.027),
        np.full(n, 2700.0),
        np.full(n, 0.7),
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.ones(n),
    )
    i = columns.integrator(Cloud.from_bodies(body), materials, 2.0, alpha=0.0, beta=0.0)
    i.switches.damage = False
    i.cloud.velocity[:, 0] = RATE * i.cloud.position[:, 2]
    i.start()
    return i


def test_yielded_stress_stays_on_the_surface_and_turns_with_the_strain():
    """Sheared by 20 yield strains and back by 4: the shear stress is k = Y / sqrt(3) along the strain, then -k, never
    more."""
    i = ball()
    k = Y / np.sqrt(3.0)
    yielding, step = k / G / RATE, 0.25 * k / G / RATE
    middle = np.argsort(np.linalg.norm(i.cloud.initial_position, axis=1))[:30]
    named = i.cloud.identity[middle]

    def shear():
        c = i.cloud
        here = np.isin(c.identity, named)
        S = c.stress
        J2 = S[:, 0] ** 2 + S[:, 3] ** 2 + S[:, 0] * S[:, 3] + S[:, 1] ** 2 + S[:, 2] ** 2 + S[:, 4] ** 2
        assert np.sqrt(3.0 * J2.max()) < 1.01 * Y
        return S[here, 2].mean()

    for _ in range(80):
        i.step(step)
        forth = shear()
    assert i.time == pytest.approx(20.0 * yielding) and forth == pytest.approx(k, rel=0.02)
    i.cloud.velocity[:] *= -1.0
    i.start()
    for _ in range(16):
        i.step(step)
        back = shear()
    assert back == pytest.approx(-k, rel=0.02)
