"""Kernels: normalisation, gradients, and what every pair sum must keep with them."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from sph.kernels.dispatch import FAMILY
from tests.sph.test_rates import SHEAR, _Cloud

KERNELS = FAMILY.laws


@pytest.mark.parametrize("one", KERNELS, ids=lambda k: k.__name__)
@pytest.mark.parametrize("h", [1.0, 3.7])
def test_kernel_is_normalised_and_its_gradient_is_its_derivative(one, h):
    total = quad(lambda r: 4.0 * math.pi * r * r * one.kernel(r, h), 0.0, h, points=[0.5 * h])[0]
    assert total == pytest.approx(1.0, rel=1e-9)
    for r in np.linspace(0.02, 0.98, 30) * h:
        slope = (one.kernel(r + 1e-6 * h, h) - one.kernel(r - 1e-6 * h, h)) / (2e-6 * h)
        assert r * one.gradient_factor(r, h) == pytest.approx(slope, rel=1e-6, abs=1e-8 / h**4)
    assert one.kernel(h, h) == one.kernel(2 * h, h) == one.gradient_factor(1.5 * h, h) == 0.0
    assert abs(one.gradient_factor(h, h)) < 1e-30


@pytest.mark.validation
def test_pairs_keep_momentum_and_total_energy():
    c = _Cloud(1000)
    r = c.evaluate(kernel="wendland")
    force = c.mass[:, None] * r.acceleration
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    work = (force * c.velocity).sum() + c.mass @ r.energy
    assert abs(work) < 1e-12 * np.abs(force * c.velocity).sum()
    assert np.abs(r.acceleration - c.evaluate().acceleration).max() > 1e-3 * np.abs(r.acceleration).max()


def test_linear_flow_is_exact_with_wendland_too():
    c = _Cloud(1000)
    L = np.array([[1.0, 0.4, -0.3], [0.2, -0.5, 0.7], [0.1, 0.6, 0.3]]) * 1e-3
    c.velocity = c.position @ L.T
    c.stress[:] = 0
    r = c.evaluate(0.0, 0.0, kernel="wendland")
    eps = 0.5 * (L + L.T)
    eps -= np.eye(3) * np.trace(eps) / 3
    wanted = 2 * SHEAR[0] * np.array([eps[0, 0], eps[0, 1], eps[0, 2], eps[1, 1], eps[1, 2]])
    inner = ((c.position > 2.5e3) & (c.position < 6.5e3)).all(axis=1)
    assert np.abs(r.stress[inner] - wanted).max() < 1e-9 * np.abs(wanted).max()
