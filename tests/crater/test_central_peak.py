"""The central peak of a complex crater: height and width of profiles drawn with one, and of a cloud."""

import math

import numpy as np
import pytest

from crater.measures.central_peak import central_peak
from crater.measures.measure import measure
from fixtures import synthetic_craters as synthetic
from matter.particles import Particles

S = np.linspace(0.0, 40.0, 401)
"""Distances of rings [km]."""


def profile(peak, width=5.0, floor=-3.0, at=0.0):
    """A flat floor and a steep wall, with a Gaussian of the height ``peak`` about the distance ``at``."""
    wall = floor + 4.0 * np.clip((S - 20.0) / 10.0, 0.0, 1.0)
    return wall + peak * np.exp(-(((S - at) / width) ** 2))


@pytest.mark.parametrize("peak", [0.5, 1.5, 4.0])
def test_height_and_half_width_are_those_that_were_drawn(peak):
    """Also of a peak that rises above the datum."""
    found = central_peak(S, profile(peak), 25.0)
    assert found.height == pytest.approx(peak, rel=1e-3)
    assert found.radius == pytest.approx(5.0 * math.sqrt(math.log(2.0)), rel=1e-3)
    assert 10.0 < found.floor <= 20.0


def test_a_ring_of_hills_is_as_wide_as_its_outer_slope():
    found = central_peak(S, profile(1.0, width=2.0, at=9.0), 25.0)
    assert found.height == pytest.approx(1.0, rel=1e-3)
    assert found.radius == pytest.approx(9.0 + 2.0 * math.sqrt(math.log(2.0)), rel=1e-3)


def test_a_bowl_has_no_peak():
    found = central_peak(S, -3.0 + (S / 15.0) ** 2, 25.0)
    assert found.height == 0.0 and math.isnan(found.radius)


def test_what_lies_beyond_the_crater_is_no_peak():
    assert central_peak(S, profile(0.0) + 9.0 * (S > 35.0), 25.0).height == 0.0
    assert math.isnan(central_peak(S, profile(1.0), -1.0).height)


@pytest.mark.parametrize("peak", [0.4, 0.9])
def test_the_peak_of_a_cloud_of_particles_is_found(peak):
    """25 spacings to the rim; the taller one nearly fills the crater's depth."""
    shape = synthetic.Shape(synthetic.complex_crater(1000.0, 0.15, peak=peak), 1000.0, 3300.0)
    position = synthetic.cloud_on_plane(shape, 40.0, np.random.default_rng(5), "jitter")
    found = measure(Particles(synthetic.as_fields(position, 40.0)), "plane")
    height, width = found["central_peak_m"], found["central_peak_diameter_m"]
    assert height.value == pytest.approx(peak * 300.0, rel=0.15)
    assert width.value == pytest.approx(300.0 * math.sqrt(math.log(2.0)), rel=0.25)
    assert 0.0 < width.sigma < 0.5 * width.value
    bowl = synthetic.Shape(synthetic.bowl(1000.0), 1000.0, 3300.0)
    position = synthetic.cloud_on_plane(bowl, 50.0, np.random.default_rng(5), "jitter")
    assert measure(Particles(synthetic.as_fields(position, 50.0)), "plane")["central_peak_m"].value is None
