"""The time step depends on the fraction of the neighbours that the artificial viscosity brakes."""

import numpy as np
import pytest

from fixtures import columns
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.materials.rows import collect
from sph.stepping import timestep

BASALT = collect(("basalt",))


def ball(numerics="reconstructed", **more):
    """900 disordered particles of basalt at rest, one metre apart."""
    rng = np.random.default_rng(3)
    lattice = np.stack(np.meshgrid(*(np.arange(-6, 7),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    position = lattice + rng.uniform(-0.1, 0.1, (13**3, 3))
    position = position[np.linalg.norm(position, axis=1) < 6.0]
    n = len(position)
    body = Body(
        position, np.full(n, 2700.0), np.full(n, 2700.0), np.full(n, 2.6), np.zeros(n, np.int32), np.zeros(n, np.int32)
    )
    i = columns.integrator(Cloud.from_bodies(body), BASALT, 6.0, numerics=numerics, **more)
    i.switches.strength = i.switches.damage = False
    return i


def fraction(i, velocity):
    """Of the inner particles; the slopes of the velocity lag one evaluation."""
    i.cloud.velocity[:] = velocity
    i.start()
    i.evaluate()
    return i.forces.rates.approaching[np.linalg.norm(i.cloud.position, axis=1) < 5.0]


def test_what_expands_is_not_braked_and_what_meets_is():
    i = ball()
    outwards = 100.0 * i.cloud.position
    random = np.random.default_rng(1).normal(0.0, 10.0, outwards.shape)
    assert fraction(i, outwards).max() == 0.0
    assert fraction(i, random).mean() == pytest.approx(0.5, abs=0.05)
    # two halves that meet: every pair across the middle approaches, none of the others
    halves = -100.0 * np.sign(i.cloud.position[:, 2:]) * [0.0, 0.0, 1.0]
    across = fraction(i, halves)
    height = np.abs(i.cloud.position[np.linalg.norm(i.cloud.position, axis=1) < 5.0, 2])
    assert across[height > 2.7].max() == 0.0 and across[height < 0.5].min() > 0.25


def test_all_neighbours_count_with_monaghans_viscosity():
    i = ball("monaghan")
    assert (fraction(i, 100.0 * i.cloud.position) == 1.0).all()


@pytest.mark.parametrize("numerics", ["monaghan", "reconstructed"])
def test_the_step_of_matter_that_only_carries_sound_and_of_matter_that_is_braked(numerics):
    """C (h/2) / (c (1 + a alpha f) + b beta max(-mu)), term by term."""
    i = ball(numerics, courant=0.3)
    i.start()
    forces, c = i.forces, i.cloud
    half, wave = 0.5 * c.support_radius, forces.evaluated.wave
    a, b = i.forces.numerics.signal

    def limit(f, mu):
        forces.rates.approaching[:], forces.rates.approach[:] = f, mu
        return timestep.steps(c, forces.rates, forces.evaluated, i.damping, 0.3, i.forces.numerics.signal)[0]

    alpha, beta = i.damping.alpha, i.damping.beta
    assert limit(0.0, 0.0) == pytest.approx(0.3 * half / wave)
    assert limit(0.7, 0.0) == pytest.approx(0.3 * half / (wave * (1.0 + 0.7 * a * alpha)))
    assert limit(0.7, 9.0) == pytest.approx(0.3 * half / (wave * (1.0 + 0.7 * a * alpha) + 9.0 * b * beta))
