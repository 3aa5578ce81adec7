"""Kernels and the artificial stress: normalisation, gradients, and what every pair sum must keep with them."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from matter.geometry import neighbours
from sph.kernels.dispatch import FAMILY
from sph.pairs import artificial_stress, rates, scheme
from sph.pairs.row import RHO_INVERSE, SUPPORT, VOLUME, WIDTH, XX, YY, ZZ
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


def evaluated(c, kernel="cubic_spline", artificial_stress=0.0, alpha=1.0, beta=2.0):
    return c.evaluate(alpha, beta, kernel=kernel, artificial_stress=artificial_stress)


@pytest.mark.parametrize(
    "kernel,stress",
    [("wendland", 0.0), *(pytest.param(k, 0.3, marks=pytest.mark.validation) for k in ("cubic_spline", "wendland"))],
)
def test_pairs_keep_momentum_and_total_energy(kernel, stress):
    c = _Cloud(1000)
    r = evaluated(c, kernel, stress)
    force = c.mass[:, None] * r.acceleration
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    work = (force * c.velocity).sum() + c.mass @ r.energy
    assert abs(work) < 1e-12 * np.abs(force * c.velocity).sum()
    assert np.abs(r.acceleration - evaluated(c).acceleration).max() > 1e-3 * np.abs(r.acceleration).max()


def test_artificial_stress_pushes_apart_in_tension_only_and_along_the_line():
    c = _Cloud(1000)
    c.stress[:] = 0.0
    c.pressure[:] = 1e9
    with_it, without = evaluated(c, "cubic_spline", 0.3, 0.0, 0.0), evaluated(c, "cubic_spline", 0.0, 0.0, 0.0)
    np.testing.assert_allclose(
        with_it.acceleration, without.acceleration, rtol=1e-11, atol=1e-11 * np.abs(without.acceleration).max()
    )
    c.pressure[:] = -1e9
    extra = (
        evaluated(c, "cubic_spline", 0.3, 0.0, 0.0).acceleration
        - evaluated(c, "cubic_spline", 0.0, 0.0, 0.0).acceleration
    )
    torque = c.mass[:, None] * np.cross(c.position, extra)
    assert np.abs(extra).max() > 0.0 and np.abs(torque.sum(axis=0)).max() < 1e-11 * np.abs(torque).sum()


def test_artificial_stress_has_its_full_strength_at_the_spacing_and_fades():
    h, tension = 2.0, 1e6
    assert artificial_stress.pressure(tension, 1.0, 1.0, h, 0.3) == pytest.approx(0.3e6, rel=1e-9)
    assert artificial_stress.pressure(tension, 4.0, 1.0, h, 0.3) == pytest.approx(256 * 0.3e6, rel=1e-9)
    assert artificial_stress.pressure(-tension, 1.0, 1.0, h, 0.3) == 0.0


@pytest.mark.parametrize("kernel,support", [("cubic_spline", 2.0), ("cubic_spline", 2.6), ("wendland", 2.6)])
def test_the_artificial_stress_of_a_pair_at_its_spacing_is_eps_of_the_tension(kernel, support):
    """Whatever kernel and support: with h / 2 taken for the spacing it was 10.8 times that at 2.6."""
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    found = neighbours.build(place, np.full(2, support), neighbours.sort(place, np.full(2, support))[1])
    row = np.zeros((2, WIDTH))
    row[:, :3], row[:, VOLUME], row[:, RHO_INVERSE], row[:, SUPPORT] = place, 1.0, 1.0, support
    row[:, XX] = row[:, YY] = row[:, ZZ] = 0.5e6  # pull of both together: 1 MPa
    matter = rates.Matter(np.zeros(2, np.int32), np.zeros(1), np.ones((2, 2)), np.zeros((2, 5)), False)
    force = []
    for eps in (0.3, 0.0):
        out = rates.Rates(2)
        chosen = scheme.Scheme(kernel=FAMILY.kind(kernel), artificial_stress=True)
        rates.compute(chosen, scheme.rows(row), found, matter, rates.Damping(0.0, 0.0, eps, 1.0 / support), out)
        force.append(out.acceleration[0, 0])
    assert (force[1] - force[0]) / force[1] == pytest.approx(0.3, rel=1e-9)


def test_linear_flow_is_exact_with_wendland_too():
    c = _Cloud(1000)
    L = np.array([[1.0, 0.4, -0.3], [0.2, -0.5, 0.7], [0.1, 0.6, 0.3]]) * 1e-3
    c.velocity = c.position @ L.T
    c.stress[:] = 0
    r = evaluated(c, "wendland", 0.0, 0.0, 0.0)
    eps = 0.5 * (L + L.T)
    eps -= np.eye(3) * np.trace(eps) / 3
    wanted = 2 * SHEAR[0] * np.array([eps[0, 0], eps[0, 1], eps[0, 2], eps[1, 1], eps[1, 2]])
    inner = ((c.position > 2.5e3) & (c.position < 6.5e3)).all(axis=1)
    assert np.abs(r.stress[inner] - wanted).max() < 1e-9 * np.abs(wanted).max()
