"""Tree gravity against the direct sum."""

import numpy as np
import pytest

from matter.geometry import tree


@pytest.fixture(scope="module")
def cloud():
    rng = np.random.default_rng(1)
    n = 3000
    x = rng.normal(size=(n, 3))
    x *= (2.1e6 * rng.random(n) ** (1 / 3) / np.linalg.norm(x, axis=1))[:, None]
    x[:40] = np.array([0, 0, 2.2e6]) + rng.normal(size=(40, 3)) * 2e4  # a tight cluster on a wide body
    x[40] = (6e7, 0, 0)  # and one that has flown off
    return x, rng.uniform(0.1, 2.0, n) * 8.5e22 / n, rng.uniform(1e4, 4e4, n)


def direct(x, m, eps):
    g, phi = np.zeros_like(x), np.zeros(len(x))
    for i in range(len(x)):
        d = x - x[i]
        s2 = (d**2).sum(axis=1) + 0.5 * (eps**2 + eps[i] ** 2)
        pull = tree.G * m / s2**1.5
        pull[i] = 0.0
        g[i] = pull @ d
        phi[i] = -(tree.G * m / np.sqrt(s2))[np.arange(len(x)) != i].sum()
    return g, 0.5 * m @ phi


def test_tree_against_direct_sum(cloud):
    x, m, eps = cloud
    exact, energy = direct(x, m, eps)
    size = np.sqrt((exact**2).sum(axis=1).mean())
    errors = [
        np.sqrt(((tree.gravity(x, m, eps, theta) - exact) ** 2).sum(axis=1).mean()) / size for theta in (0.9, 0.5, 0.2)
    ]
    assert errors[1] < 5e-4
    assert errors[0] > errors[1] > errors[2]
    assert tree.gravity(x, m, eps, 1e-6) == pytest.approx(exact, rel=1e-9, abs=1e-12 * size)
    assert tree.potential_energy(x, m, eps) == pytest.approx(energy, rel=1e-12)


def test_net_force_and_torque_are_removed(cloud):
    x, m, eps = cloud
    field, size = tree.remove_net_force(tree.gravity(x, m, eps), x, m)
    force, torque = m[:, None] * field, m[:, None] * np.cross(x, field)
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
    assert np.abs(torque.sum(axis=0)).max() < 1e-13 * np.abs(torque).sum()
    assert 0.0 < size < 1e-2


def test_order_of_particles_changes_nothing_but_rounding(cloud):
    x, m, eps = cloud
    turn = np.random.default_rng(5).permutation(len(m))
    assert tree.gravity(x[turn], m[turn], eps[turn]) == pytest.approx(
        tree.gravity(x, m, eps)[turn], rel=1e-9, abs=1e-15
    )


def test_coincident_particles_end():
    x = np.zeros((50, 3))
    g = tree.gravity(x, np.ones(50), np.ones(50))
    assert np.array_equal(g, np.zeros((50, 3)))
