"""Gradients that are exact in an undisturbed lattice, with the production kernels."""

import numpy as np
import pytest

from fixtures import solutions
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.pairs import lattice_gradients
from sph.stage import Settings
from sph.stepping.numerics import SETS

ROCK = {"basalt": Choice(**solutions.TOUGH)}


def test_distances_are_those_of_a_hexagonal_packing():
    """12, 6, 2, 18 and 12 neighbours at 1, sqrt 2, sqrt(8/3), sqrt 3 and sqrt(11/3) of the nearest."""
    near, count = np.unique(np.round(lattice_gradients.hexagonal_distances(2.2) / 2 ** (1 / 6), 9), return_counts=True)
    assert near == pytest.approx(np.sqrt([1, 2, 8 / 3, 3, 11 / 3]))
    assert count.tolist() == [12, 6, 2, 18, 12]


@pytest.mark.parametrize(("numerics", "plain"), [("monaghan", 0.9713), ("reconstructed", 0.9942)])
@pytest.mark.validation
def test_a_linear_flow_has_its_divergence(numerics, plain):
    """Inside a ball of lattice that expands as v = x the divergence is 3; plain sums fall short by what the constant
    says."""
    materials = collect(("basalt",), ROCK)
    found = []
    for sums in ("plain", "normalised"):
        place = solutions.closest_packing(lambda x: np.linalg.norm(x, axis=1) < 7.0, 7.0)
        i = solutions.body(place, materials, 7.0, gradients=sums, numerics=numerics)
        i.cloud.support_radius[:] = SETS[numerics]["support"]
        i.neighbourhood.rebuild(i.cloud, 0.0)
        i.cloud.velocity[:] = i.cloud.position
        i.start()
        inside = np.linalg.norm(i.cloud.position, axis=1) < 3.5
        found.append(i.forces.rates.divergence[inside] / 3.0)
        power = i.cloud.mass @ (
            i.forces.rates.energy + np.einsum("ij,ij->i", i.cloud.velocity, i.forces.rates.acceleration)
        )
        assert abs(power) < 1e-9 * np.abs(i.cloud.mass * i.forces.rates.energy).sum() + 1e-12
    assert found[0] == pytest.approx(plain, abs=1e-4)
    assert found[1] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.validation
def test_elastic_waves_gain_the_speed_that_the_sums_had_lost():
    """A pressure wave in basalt: less than 0.8 % off instead of 1 %."""
    plain, better = (solutions.elastic_speed("basalt", False, gradients=sums) for sums in ("plain", "normalised"))
    assert better > plain and better == pytest.approx(1.0, abs=0.008)


def test_the_stage_offers_it():
    assert "normalised" in Settings.model_fields["gradients"].annotation.__args__
