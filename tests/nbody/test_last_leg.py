"""The two-body hyperbola from the Hill sphere to the surface, and moon mode on it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import kstest

from nbody.masses import bplane, system

CALLISTO = system.load("callisto")
HILL = system.hill_radius(CALLISTO)


def test_fall_keeps_energy_and_angular_momentum_and_agrees_with_integration():
    rng = np.random.default_rng(3)
    for _ in range(5):
        speed = rng.uniform(3e3, 2e4)
        velocity = np.array([0.0, 0.0, -speed])
        b = 0.9 * bplane.capture_parameter(CALLISTO.radius, CALLISTO.gm, HILL, speed) * rng.random()
        place = np.array([b, 0.0, np.sqrt(HILL**2 - b**2)])
        hit = bplane.fall(place[None], velocity[None], CALLISTO.radius, CALLISTO.gm)

        def rhs(t, y):
            return np.concatenate([y[3:], -CALLISTO.gm * y[:3] / np.linalg.norm(y[:3]) ** 3])

        path = solve_ivp(rhs, (0, hit.flight_time[0]), np.concatenate([place, velocity]), rtol=1e-12, atol=1e-6)
        assert np.linalg.norm(path.y[:3, -1] - hit.position[0]) < 1.0
        assert np.linalg.norm(path.y[3:, -1] - hit.velocity[0]) < 1e-3
        up = hit.position[0] / CALLISTO.radius
        assert np.degrees(hit.angle[0]) == pytest.approx(
            np.degrees(np.arccos(-up @ hit.velocity[0] / np.linalg.norm(hit.velocity[0]))), abs=1e-6
        )


def test_slow_bound_fall_takes_the_elliptic_time():
    place, velocity = np.array([[HILL, 0.0, 0.0]]), np.array([[-10.0, 2.0, 0.0]])
    hit = bplane.fall(place, velocity, CALLISTO.radius, CALLISTO.gm)

    def rhs(t, y):
        return np.concatenate([y[3:], -CALLISTO.gm * y[:3] / np.linalg.norm(y[:3]) ** 3])

    path = solve_ivp(rhs, (0, hit.flight_time[0]), np.concatenate([place[0], velocity[0]]), rtol=1e-12, atol=1e-6)
    assert np.linalg.norm(path.y[:3, -1]) == pytest.approx(CALLISTO.radius, rel=1e-6)


def test_moon_mode_angles_follow_gilberts_law():
    """Impact angles of a wide beam are distributed as sin 2 gamma (Gilbert 1893): mean 45 deg."""
    rng = np.random.default_rng(5)
    velocity, entry = np.array([0.0, 0.0, -1.2e4]), np.array([0.6, 0.0, 0.8]) * HILL
    places, _ = bplane.resample(
        np.tile(entry, (3000, 1)), np.tile(velocity, (3000, 1)), CALLISTO.radius, CALLISTO.gm, rng
    )
    assert (places @ entry > 0).all()
    hit = bplane.fall(places, np.tile(velocity, (3000, 1)), CALLISTO.radius, CALLISTO.gm)
    assert kstest(hit.angle, lambda x: np.sin(x) ** 2).pvalue > 1e-3
    assert np.degrees(hit.angle.mean()) == pytest.approx(45.0, abs=3 * 19.6 / np.sqrt(3000))


def test_draws_match_the_solid_angle():
    rng = np.random.default_rng(6)
    velocity, entry = np.array([0.0, 0.0, -1.8e4]), np.array([0.0, 0.0, HILL])
    _, draws = bplane.resample(
        np.tile(entry, (2000, 1)), np.tile(velocity, (2000, 1)), CALLISTO.radius, CALLISTO.gm, rng
    )
    sine = bplane.capture_parameter(CALLISTO.radius, CALLISTO.gm, HILL, 1.8e4) / HILL
    expected = 1.0 / (1.0 - np.sqrt(1.0 - sine**2))
    assert draws.mean() == pytest.approx(expected, rel=4 / np.sqrt(2000))


def test_pericentre_of_a_hyperbola():
    v, b = 6e3, 1e7
    place, velocity = np.array([[b, 0.0, np.sqrt(HILL**2 - b**2)]]), np.array([[0.0, 0.0, -v]])
    nearest, speed, time = bplane.pericentre(place, velocity, CALLISTO.gm)
    energy, momentum = 0.5 * v**2 - CALLISTO.gm / HILL, b * v
    assert nearest * speed == pytest.approx(momentum)
    assert 0.5 * speed**2 - CALLISTO.gm / nearest == pytest.approx(energy)
    assert time == pytest.approx(HILL / v, rel=0.05)
