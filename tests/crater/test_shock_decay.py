"""The isobaric core and the decay of the shock: drawn pressures of known core, radius and exponent."""

from __future__ import annotations

import numpy as np
import pytest

from crater.ground import datum as datums
from crater.pages import report_matter
from crater.shock import decay
from matter.errors import InputError
from matter.particles import Particles
from matter.wording import readable

CORE, RADIUS, N = 80e9, 60.0, 2.2


def ground(noise=0.1, count=60_000, centre=(0.0, 0.0, 0.0), seed=4):
    """Half a ball of 600 m, finer towards its centre; pressures of the law, a third of it near the surface; a
    projectile above, a second layer below, and the first layer again far behind it."""
    rng = np.random.default_rng(seed)
    place = rng.normal(size=(count, 3))
    place *= (10.0 * 60.0 ** rng.uniform(0.0, 1.0, count) / np.linalg.norm(place, axis=1))[:, None]
    place[:, 2] = -np.abs(place[:, 2])
    away = np.linalg.norm(place, axis=1)
    peak = CORE * np.minimum(1.0, (away / RADIUS) ** -N) * np.exp(noise * rng.normal(size=count))
    peak[-place[:, 2] < 0.62 * away] *= 0.3
    layer = np.where(place[:, 2] < -500.0, 0, 1)
    peak[layer == 0] *= 5.0
    layer[:30], peak[:30] = -1, 1e12
    layer[30:60], place[30:60], peak[30:60] = 1, (0.0, 0.0, -5e4), CORE
    fields = {"position": place, "initial_position": place + np.asarray(centre), "peak_pressure": peak, "layer": layer}
    return Particles(fields)


def test_core_radius_and_exponent_of_a_drawn_shock_are_found():
    found = decay.facts(ground(), datums.plane(), 30.0)
    assert found["core_pressure_Pa"]["value"] == pytest.approx(CORE, rel=0.05)
    assert found["core_radius_m"]["value"] == pytest.approx(RADIUS, rel=0.05)
    assert found["core_radius_over_projectile"] == pytest.approx(2.0, rel=0.05)
    assert found["exponent"]["value"] == pytest.approx(N, abs=0.05)
    assert 0.0 < found["exponent"]["sigma"] < 0.1
    P = np.array(found["shells"]["pressure_Pa"])
    assert P[-1] > decay.LEAST * P.max() and found["to_m"] == found["shells"]["radius_m"][-1] < 1e3  # not the far side


def test_on_a_body_the_point_of_contact_is_on_its_surface():
    body = datums.sphere(2e6)
    found = decay.facts(ground(centre=(0.0, 0.0, 2e6)), body, 30.0)
    assert found["exponent"]["value"] == pytest.approx(N, abs=0.05)
    assert found["core_radius_m"]["value"] == pytest.approx(RADIUS, rel=0.05)


def test_the_errors_are_those_of_the_draw():
    """Of eight draws with few particles and much noise the exponents scatter as their errors say, within a factor of
    2.5."""
    found = [decay.facts(ground(0.8, 6000, seed=k), datums.plane(), 30.0)["exponent"] for k in range(8)]
    scatter = np.std([one["value"] for one in found])
    assert scatter / 2.5 < np.median([one["sigma"] for one in found]) < 2.5 * scatter


def test_a_ground_of_few_particles_is_told():
    with pytest.raises(InputError, match="fewer than 5 shells"):
        decay.facts(ground(count=60), datums.plane(), 30.0)


def test_the_page_says_it():
    found = decay.facts(ground(), datums.plane(), 30.0)
    text = report_matter.decay(found, 2.0 * found["core_pressure_Pa"]["value"])
    power = readable.measured(found["exponent"]["value"], found["exponent"]["sigma"])
    assert f"P ~ r^-n</td><td class='word'>{power}" in text and power.startswith(("2.1", "2.2"))
    assert "projectile radii" in text and "0.5 of the planar limit" in text
    assert "planar limit" not in report_matter.decay(found) and report_matter.decay({}) == ""
