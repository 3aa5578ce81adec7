"""Massive bodies: published radii and speeds, and the shared ephemeris against REBOUND's IAS15."""

import numpy as np
import pytest

from matter.errors import InputError
from nbody.masses import ephemeris, system

AU = 1.495978707e11


def test_hill_radii_are_the_published_ones():
    """Winter 2017, eq. 7 and figure 10: 0.338 AU, about 1600 and 1000 times those of Ganymede and Callisto."""
    jovian = system.jovian("callisto")
    assert jovian.start_radius / AU == pytest.approx(0.338, rel=3e-3)
    assert jovian.start_radius / jovian.hill_radii == pytest.approx([1594.0, 1008.0], rel=2e-3)


def test_unknown_body_names_the_nearest():
    with pytest.raises(InputError, match="did you mean 'callisto'"):
        system.load("calisto")
    with pytest.raises(InputError, match="not a moon of Jupiter"):
        system.jovian("sun")


def test_start_is_barycentric_and_on_the_ellipse():
    jovian = system.jovian("europa")
    begin = system.start(jovian, 1.0, np.array([0.1, 2.0, 4.0]))
    weights = jovian.gm[1:]
    assert np.abs(weights @ begin.position[1:] / weights.sum()).max() < 1e-3
    mu, a = jovian.gm.sum(), jovian.planet.semi_major_axis
    r, v = np.linalg.norm(begin.position[0]), np.linalg.norm(begin.velocity[0])
    assert v**2 == pytest.approx(mu * (2.0 / r - 1.0 / a), rel=1e-12)


def test_ephemeris_against_ias15():
    rebound = pytest.importorskip("rebound", reason="oracle of the [test] extra")
    jovian, duration = system.jovian("callisto"), 1.4 * 365.25 * 86400.0
    begin = system.start(jovian, np.radians(60.0), np.array([1.0, 2.0]))
    orbits = ephemeris.compute(jovian, begin, duration)
    assert orbits.energy_error < 1e-12 and orbits.angular_momentum_error < 1e-12
    sim = rebound.Simulation()
    for gm, x, v in zip(jovian.gm, begin.position, begin.velocity):
        sim.add(m=gm, x=x[0], y=x[1], z=x[2], vx=v[0], vy=v[1], vz=v[2])
    for t in np.array([0.31, 0.77, 0.999]) * duration:
        sim.integrate(t)
        x = np.array([p.xyz for p in sim.particles])
        x -= jovian.gm[1:] @ x[1:] / jovian.gm[1:].sum()
        for body in range(4):
            assert np.linalg.norm(orbits.state(body, t)[0] - x[body]) < 5.0  # m, of 2e9 and 8e11
