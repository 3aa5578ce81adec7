"""Do the error bars cover? 200 random craters of four families, off centre, on tilted planes, at 5 to 10 particles per
radius.

The resolution's part of the errors is what noiseless profiles miss (test_resolution.py); nothing was set on these
craters.
"""

from __future__ import annotations

import numpy as np
import pytest

from crater.measures.measure import measure
from fixtures import synthetic_craters as synthetic
from matter.particles import Particles

NAMES = ("depth_m", "diameter_apparent_m", "diameter_rim_m", "rim_height_m", "volume_m3")


def random_shape(number: int, rng) -> synthetic.Shape:
    """One of four families with random proportions; rim radius 1."""
    u = rng.uniform
    height = (
        lambda: synthetic.bowl(1.0, u(0.15, 0.3), u(0.03, 0.06), u(2.5, 3.5), u(1.7, 2.5)),
        lambda: synthetic.exponential(1.0, u(0.15, 0.3), u(0.03, 0.06), u(0.25, 0.5)),
        lambda: synthetic.rounded(1.0, u(0.12, 0.25), u(0.03, 0.07), u(0.2, 0.35)),
        lambda: synthetic.complex_crater(1.0, u(0.08, 0.15), u(0.03, 0.05), u(0.4, 0.6), u(0.0, 0.4)),
    )[number % 4]()
    return synthetic.Shape(height, 1.0, 3.6)


def trial(seed: int):
    """(measured, sigma, true) of every measure of one random crater; NaN where it was not stated."""
    rng = np.random.default_rng(seed)
    shape = random_shape(seed, rng)
    spacing = 1.0 / rng.uniform(5.0, 10.0)
    kind = ("lattice", "jitter")[rng.integers(2)]
    position = synthetic.cloud_on_plane(
        shape, spacing, rng, kind, centre=rng.uniform(-0.2, 0.2, 2), tilt=rng.uniform(0.0, 0.03)
    )
    found = measure(Particles(synthetic.as_fields(position, spacing)), "plane")
    truth = (shape.depth, 2 * shape.apparent, 2 * shape.rim_found, shape.rim_height, shape.volume)
    values = [(found[name].value, found[name].sigma, true) for name, true in zip(NAMES, truth)]
    return [(np.nan, np.nan, true) if value is None else (value, sigma, true) for value, sigma, true in values]


@pytest.mark.validation
def test_error_bars_cover():
    table = np.array([trial(70000 + k) for k in range(200)])
    for column, name in enumerate(NAMES):
        value, sigma, true = table[:, column].T
        stated = np.isfinite(value)
        assert stated.mean() > 0.9, name
        off = np.abs(value - true)[stated] / sigma[stated]
        assert np.mean(off < 1.0) == pytest.approx(0.68, abs=0.12), name
        assert np.mean(off < 1.96) > 0.90, name
        relative = ((value - true) / true)[stated]
        assert np.median((sigma / true)[stated]) < 1.5 * np.sqrt(np.mean(relative**2)), name


def test_a_few_random_craters_lie_within_four_sigma():
    for seed in (41, 42, 43, 44):
        for name, (value, sigma, true) in zip(NAMES, trial(seed)):
            assert abs(value - true) < 4.0 * sigma, (seed, name, value, sigma, true)
