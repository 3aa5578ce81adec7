"""Starts of test particles: distributions, repeatability, and bad population files."""

import numpy as np
import pytest
from scipy.stats import ks_2samp

from matter.errors import InputError
from nbody.masses import system
from nbody.population import conditions

JOVIAN = system.jovian("callisto")


def batch(name, seed=1, chunk=0):
    return conditions.batch(JOVIAN, conditions.population(name), seed, chunk)


def test_a_particle_depends_on_seed_and_index_only():
    one, two = batch("literal"), batch("literal")
    assert np.array_equal(one.state, two.state)
    assert not np.array_equal(one.state, batch("literal", seed=2).state)
    assert batch("literal", chunk=3).first == 3 * conditions.CHUNK


def test_literal_shell_cone_and_box():
    some = batch("literal")
    x, v = some.state[:, :3] - some.start.position[1], some.state[:, 3:] - some.start.velocity[1]
    r = np.linalg.norm(x, axis=1) / JOVIAN.start_radius
    assert 0.95 <= r.min() and r.max() <= 1.0
    cosine = -np.einsum("ij,ij->i", x, v) / np.linalg.norm(x, axis=1) / np.linalg.norm(v, axis=1)
    assert cosine.min() >= np.cos(np.radians(15.0)) - 1e-12
    parts = np.abs(v @ conditions.triad(some.start).T)
    assert (parts <= [65.0, 670.0, 4534.0]).all()
    assert np.median(np.linalg.norm(v, axis=1)) < 500.0  # the cone leaves slow ones: most fall almost freely


def test_bounded_draw_is_the_plain_redraw():
    """Drawing inside the bounding box of cone and box gives the distribution of redrawing from the whole box."""
    rng = np.random.default_rng(8)
    aim = np.array([[0.05, 0.7, 0.7]]) / np.linalg.norm([0.05, 0.7, 0.7])
    fast = conditions.velocities_in_cone(np.repeat(aim, 4000, axis=0), conditions.LITERAL_SPEEDS, conditions.CONE, rng)
    plain = rng.uniform(-1, 1, (4_000_000, 3)) * conditions.LITERAL_SPEEDS
    plain = plain[plain @ aim[0] >= np.cos(conditions.CONE) * np.linalg.norm(plain, axis=1)]
    assert len(plain) > 100
    for k in range(3):
        assert ks_2samp(fast[:, k], plain[:, k]).pvalue > 1e-3


def test_corrected_orbits_fill_the_element_box_and_fly_inwards():
    some = batch("corrected")
    n = some.state[:, :3] - some.start.position[1]
    assert np.linalg.norm(n, axis=1) == pytest.approx(JOVIAN.start_radius)
    relative = some.state[:, 3:] - some.start.velocity[1]
    assert (np.einsum("ij,ij->i", n, relative) < 0).all()
    x, v = some.state[:, :3] - some.start.position[0], some.state[:, 3:] - some.start.velocity[0]
    h = np.cross(x, v)
    inclination = np.degrees(np.arccos(h[:, 2] / np.linalg.norm(h, axis=1)))
    e = np.linalg.norm(np.cross(v, h) / JOVIAN.sun.gm - x / np.linalg.norm(x, axis=1)[:, None], axis=1)
    assert inclination.max() < 10.0 + 1e-6 and e.max() < 0.1 + 1e-9
    assert inclination.min() < 1.0 and e.min() < 0.01
    assert 1e3 < np.median(np.linalg.norm(relative, axis=1)) < 2.5e3


def test_isotropic_beam_has_the_speed_at_infinity_and_reaches_the_moons():
    some = batch("isotropic")
    x, v = some.state[:, :3] - some.start.position[1], some.state[:, 3:] - some.start.velocity[1]
    infinity = np.sqrt(np.einsum("ij,ij->i", v, v) - 2.0 * JOVIAN.planet.gm / np.linalg.norm(x, axis=1))
    assert infinity == pytest.approx(conditions.ISOTROPIC_SPEED, rel=1e-9)
    momentum = np.linalg.norm(np.cross(x, v), axis=1)
    e = np.sqrt(1.0 + (momentum * conditions.ISOTROPIC_SPEED / JOVIAN.planet.gm) ** 2)
    pericentre = momentum**2 / JOVIAN.planet.gm / (1.0 + e)
    assert pericentre.max() < 1.2 * (JOVIAN.moons[-1].semi_major_axis + 3 * JOVIAN.hill_radii[-1])
    assert pericentre.max() > JOVIAN.moons[-1].semi_major_axis


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("speed_at_infinity_km_s,weight\n5,1\n", "lacks the column inclination_deg"),
        ("speed_at_infinity_km_s,inclination_deg,weight\n5,10,nan\n", "row 1: weight = nan"),
        ("speed_at_infinity_km_s,inclination_deg,weight\n5,10,1\n-5,10,1\n", "row 2: speed_at_infinity_km_s"),
        ("speed_at_infinity_km_s,inclination_deg,weight\n5,ten,1\n", "not a number"),
        ("speed_at_infinity_km_s,inclination_deg,weight\n", "no row with a positive weight"),
    ],
)
def test_bad_population_files(tmp_path, text, message):
    path = tmp_path / "comets.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        conditions.population(str(path))


def test_unknown_population():
    with pytest.raises(InputError, match="unknown population 'litteral'"):
        conditions.population("litteral")
