"""Kernels: normalisation, gradients, and what every pair sum must keep with them."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from sph.kernels.dispatch import FAMILY
from tests.sph.test_rates import _Cloud, keeps_momentum_and_total_energy

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
def test_pairs_of_another_kernel_keep_momentum_and_total_energy():
    c = _Cloud(1000)
    r = c.evaluate(kernel="wendland")
    keeps_momentum_and_total_energy(c, r)
    assert np.abs(r.acceleration - c.evaluate().acceleration).max() > 1e-3 * np.abs(r.acceleration).max()
