"""Errors from the scatter over sectors: neighbours that see the same particles, few independent parts, extremes."""

import numpy as np
import pytest

from crater.measures.measure import BOOTSTRAPS, _pairs_of_sectors
from crater.measures.uncertainty import deviation, few_draws


def test_the_error_holds_where_neighbours_see_the_same_particles():
    """Heights of which neighbours correlate by 0.25: 24 sectors hold some 16 independent ones. Their error holds 92 %
    of the means; drawn one by one 90 %, and taken for 24 besides 87 %."""
    rng = np.random.default_rng(3)
    sectors, side, trials = 24, 0.268, 1000
    held = 0
    for _ in range(trials):
        white = rng.standard_normal(sectors)
        heights = white + side * np.roll(white, 1)
        error = few_draws(16.0) * heights[_pairs_of_sectors(rng, sectors)].mean(axis=1).std()
        held += abs(heights.mean()) < 1.96 * error
    assert 0.91 < held / trials < 0.96


def test_every_sector_is_drawn_as_often_as_any_other():
    drawn = np.bincount(_pairs_of_sectors(np.random.default_rng(1), 24).ravel(), minlength=24)
    assert drawn.sum() == 24 * BOOTSTRAPS and drawn.min() > 0.7 * BOOTSTRAPS and drawn.max() < 1.3 * BOOTSTRAPS
    assert _pairs_of_sectors(np.random.default_rng(1), 23).shape == (BOOTSTRAPS, 23)


@pytest.mark.parametrize("number", [4, 12, 24])
def test_the_error_over_few_parts_holds_19_of_20_means(number):
    rng = np.random.default_rng(number)
    parts = rng.standard_normal((20_000, number))
    error = few_draws(number) * parts.std(axis=1) / np.sqrt(number)
    assert np.mean(np.abs(parts.mean(axis=1)) < 1.96 * error) == pytest.approx(0.95, abs=0.006)


def test_trials_that_all_lie_to_one_side_of_the_value_count_by_their_distance():
    trials = np.array([[1.0, np.nan], [3.0, np.nan], [1.0, 2.0], [3.0, np.nan]])
    assert deviation(trials, np.array([0.0, 0.0]))[0] == pytest.approx(np.sqrt(5.0))
    assert np.isnan(deviation(trials, np.zeros(2))[1])
