"""Free flight of ejecta: against parabolas, against Kepler's ranges and against orbits integrated step by step."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from crater.ejecta import ejecta_flight
from crater.ground import datum as datums

R, G = 2.1e6, 1.28
MU = G * R**2
BODY, GROUND = datums.sphere(R), datums.plane()


def orbit(place, velocity, time):
    """Place and velocity after ``time``, integrated."""
    found = solve_ivp(
        lambda _, y: np.concatenate([y[3:], -MU * y[:3] / np.linalg.norm(y[:3]) ** 3]),
        (0.0, time),
        np.concatenate([place, velocity]),
        rtol=1e-11,
        atol=1e-6,
    )
    return found.y[:3, -1], found.y[3:, -1]


def launched(speed, angle, azimuth=0.3, at=(0.1, -0.2)):
    """A place on the body near the axis, and a velocity of ``speed`` at ``angle`` above the horizontal."""
    up = np.array([*at, 1.0]) / np.linalg.norm([*at, 1.0])
    east = np.cross([0.0, 1.0, 0.0], up) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], up))
    level = np.cos(azimuth) * east + np.sin(azimuth) * np.cross(up, east)
    return R * up, speed * (np.sin(angle) * up + np.cos(angle) * level)


@pytest.mark.parametrize("seen", [0.05, 0.3, 0.49])
@pytest.mark.parametrize("speed,angle", [(300.0, 0.8), (1200.0, 0.4), (2000.0, 1.2), (2150.0, 0.7)])
def test_an_orbit_seen_on_its_way_up_is_led_to_where_it_began_and_ends(speed, angle, seen):
    place, velocity = launched(speed, angle)
    whole = ejecta_flight.flight(BODY, G, 0.0, place[None], velocity[None])
    now = seen * whole.until[0]
    x, v = orbit(place, velocity, now)
    found = ejecta_flight.flight(BODY, G, 0.0, x[None], v[None])
    assert found.fate[0] == ejecta_flight.FALLS
    assert found.position[0] == pytest.approx(place, abs=1e-6 * R) and found.since[0] == pytest.approx(now, rel=1e-5)
    assert found.velocity[0] == pytest.approx(velocity, abs=1e-5 * speed)
    end, fall = orbit(x, v, found.until[0])
    assert found.landing[0] == pytest.approx(end, abs=1e-5 * R)
    assert np.linalg.norm(end) == pytest.approx(R, rel=1e-6) and fall @ end < 0.0


def test_ranges_are_keplers():
    """tan(phi / 2) = q sin a cos a / (1 - q cos^2 a), q = v^2 / (g R) (Melosh 1989, section 6.1)."""
    for speed, angle in ((200.0, 0.9), (900.0, np.pi / 4), (1500.0, 0.3)):
        place, velocity = launched(speed, angle)
        landing = ejecta_flight.flight(BODY, G, 0.0, place[None], velocity[None]).landing[0]
        q = speed**2 / (G * R)
        wanted = 2.0 * np.arctan(q * np.sin(angle) * np.cos(angle) / (1.0 - q * np.cos(angle) ** 2))
        assert np.arccos(place @ landing / R**2) == pytest.approx(wanted, rel=1e-6)


def test_what_is_faster_than_escape_escapes_and_what_never_meets_the_ground_circles():
    escape = np.sqrt(2.0 * G * R)
    place, velocity = launched(1.001 * escape, 0.7)
    x, v = orbit(place, velocity, 500.0)
    found = ejecta_flight.flight(BODY, G, 0.0, x[None], v[None])
    assert found.fate[0] == ejecta_flight.ESCAPES and np.isnan(found.landing).all() and np.isnan(found.until[0])
    assert found.position[0] == pytest.approx(place, abs=1e-5 * R) and found.since[0] == pytest.approx(500.0, rel=1e-4)
    assert (
        ejecta_flight.flight(BODY, G, 0.0, *(a[None] for a in launched(0.999 * escape, 0.7))).fate[0]
        == ejecta_flight.FALLS
    )
    high = np.array([[0.0, 0.0, 1.5 * R]])
    swift = np.array([[np.sqrt(MU / (1.5 * R)), 0.0, 1.0]])
    found = ejecta_flight.flight(BODY, G, 0.0, high, swift)
    assert (
        found.fate[0] == ejecta_flight.CIRCLES
        and found.position[0] == pytest.approx(high[0])
        and found.since[0] == 0.0
    )


def test_straight_up_comes_down_where_it_rose():
    place, velocity = np.array([0.0, 0.0, R]), np.array([0.0, 0.0, 800.0])
    found = ejecta_flight.flight(BODY, G, 0.0, place[None], velocity[None])
    assert found.landing[0] == pytest.approx(place, abs=10.0)
    end, fall = orbit(place, velocity, found.until[0])
    assert end == pytest.approx(place, abs=1e-5 * R) and fall == pytest.approx(-velocity, abs=0.01)


def test_on_flat_ground_it_is_a_parabola_and_a_body_is_flat_for_slow_ejecta():
    v, t = np.array([30.0, -40.0, 60.0]), 12.0
    x = np.array([5.0, 6.0, 0.0]) + v * t + np.array([0.0, 0.0, -0.5 * G * t**2])
    found = ejecta_flight.flight(GROUND, G, 0.0, x[None], (v - np.array([0.0, 0.0, G * t]))[None])
    assert found.position[0] == pytest.approx([5.0, 6.0, 0.0], abs=1e-9) and found.since[0] == pytest.approx(t)
    assert found.velocity[0] == pytest.approx(v) and found.until[0] == pytest.approx(120.0 / G - t)
    assert found.landing[0] == pytest.approx([5.0 + 30.0 * 120.0 / G, 6.0 - 40.0 * 120.0 / G, 0.0])
    assert ejecta_flight.flight(GROUND, G, 70.0, x[None], v[None]).fate[0] == ejecta_flight.ESCAPES
    round_ = ejecta_flight.flight(BODY, G, 0.0, np.array([[0.0, 0.0, R]]), v[None])
    assert round_.landing[0, :2] == pytest.approx(v[:2] * 120.0 / G, rel=5e-3)
