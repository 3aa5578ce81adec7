"""What leaves a body, and the momentum that stays with it."""

import numpy as np
import pytest

from matter.constants import G
from matter.geometry import tree
from matter.points import packing
from sph.outcome import escaping


def ball(speeds, up=1.0):
    """A ball of 100 m with stones just above its pole that rise with ``speeds``."""
    points = packing.hexagonal(12.0, 100.0)
    body = np.full(len(points), 2e9 / len(points))
    stones = np.array([[3.0 * k, 0.0, 101.0] for k in range(len(speeds))])
    position = np.concatenate([points, stones])
    velocity = np.zeros_like(position)
    velocity[len(points) :, 2] = up * np.asarray(speeds)
    mass = np.concatenate([body, np.full(len(speeds), 10.0)])
    return position, velocity, mass, np.full(len(mass), 1.0)


ESCAPE = (2.0 * G * 2e9 / 101.0) ** 0.5


def test_what_is_faster_than_escape_leaves():
    found = escaping.escaped_momentum(
        *ball([0.5 * ESCAPE, 0.97 * ESCAPE, 1.03 * ESCAPE, 30.0]),
        np.array([0.0, 0.0, -500.0]),
        np.array([0.0, 0.0, 1.0]),
    )
    assert found["mass_kg"] == pytest.approx(20.0)
    assert found["momentum_kg_m_s"] == pytest.approx([0.0, 0.0, 10.0 * (30.0 + 1.03 * ESCAPE)], rel=1e-6)
    assert found["beta"] == pytest.approx(1.0 + 10.0 * (30.0 + 1.03 * ESCAPE) / 500.0)


def test_what_has_parted_is_said_by_itself():
    """Of two stones that leave one is still dense ground; a parted one that falls back counts nowhere."""
    set_up = ball([0.5 * ESCAPE, 1.2 * ESCAPE, 30.0])
    separated = np.zeros(len(set_up[2]), dtype=bool)
    separated[[-3, -1]] = True
    shot = np.array([0.0, 0.0, -500.0]), np.array([0.0, 0.0, 1.0])
    found = escaping.escaped_momentum(*set_up, *shot, separated)
    assert found["parted"]["mass_kg"] == pytest.approx(10.0) and found["mass_kg"] == pytest.approx(20.0)
    assert found["parted"]["beta"] == pytest.approx(1.0 + 10.0 * 30.0 / 500.0)
    assert "parted" not in escaping.escaped_momentum(*set_up, *shot)


def test_what_leaves_with_blocks_has_number_mass_and_momentum():
    """Block 0 flies off whole, of block 1 one stone of three; what escapes of the ground is not counted with them."""
    fast = 1.5 * ESCAPE
    set_up = ball([fast, fast, fast, 0.1 * ESCAPE, 0.1 * ESCAPE, fast])
    block = np.full(len(set_up[2]), -1)
    block[-6:] = [0, 0, 1, 1, 1, -1]
    shot = np.array([0.0, 0.0, -500.0]), np.array([0.0, 0.0, 1.0])
    found = escaping.escaped_momentum(*set_up, *shot, block=block)
    assert found["mass_kg"] == pytest.approx(40.0)
    assert found["blocks"]["number"] == 1 and found["blocks"]["mass_kg"] == pytest.approx(30.0)
    assert found["blocks"]["momentum_kg_m_s"] == pytest.approx([0.0, 0.0, 30.0 * fast], rel=1e-9)
    assert "blocks" not in escaping.escaped_momentum(*set_up, *shot)


def test_what_comes_in_does_not_leave():
    found = escaping.escaped_momentum(*ball([30.0], up=-1.0), np.array([0.0, 0.0, -500.0]), np.array([0.0, 0.0, 1.0]))
    assert found["mass_kg"] == 0.0 and found["beta"] == 1.0


def test_beta_goes_by_the_normal():
    """A slanted shot whose ejecta leave along the normal: only the part along it is multiplied."""
    normal = np.array([0.6, 0.0, 0.8])
    position, velocity, mass, softening = ball([0.0])
    velocity[-1] = 50.0 * normal
    momentum = np.array([300.0, 0.0, -400.0])
    found = escaping.escaped_momentum(position, velocity, mass, softening, momentum, normal)
    assert found["beta"] == pytest.approx(1.0 + 500.0 / -(momentum @ normal))
    assert found["beta_vector"] == pytest.approx((momentum - 500.0 * normal) / 500.0)


def test_wells_are_those_of_the_direct_sum():
    position, _, mass, softening = ball([0.0])
    found = tree.minus_potential(position, mass, softening, 0.3)
    some = [0, len(mass) // 2, len(mass) - 1]
    for i in some:
        r = np.sqrt(((position - position[i]) ** 2).sum(axis=1) + 1.0)
        wanted = G * (np.delete(mass, i) / np.delete(r, i)).sum()
        assert found[i] == pytest.approx(wanted, rel=2e-3)
