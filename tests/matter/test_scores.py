"""Scores of draws against closed forms."""

import math

import numpy as np
import pytest
from scipy import stats

from matter import scores

X = stats.norm.ppf((np.arange(4000) + 0.5) / 4000)


def test_crps_of_a_normal_law():
    """sigma (z (2 Phi(z) - 1) + 2 phi(z) - 1 / sqrt(pi)) (Gneiting & Raftery 2007, 4.2, with the sign turned)."""
    for y in (-1.5, 0.0, 0.4, 3.0):
        exact = y * (2 * stats.norm.cdf(y) - 1) + 2 * stats.norm.pdf(y) - 1 / math.sqrt(math.pi)
        assert scores.crps(X, y) == pytest.approx(exact, abs=6e-4)
        assert scores.crps(5.0 + 3.0 * X, 5.0 + 3.0 * y) == pytest.approx(3.0 * scores.crps(X, y))


def test_few_draws_are_scored_as_many():
    """The mean over sets of five draws is the score of the law itself; that of the plain estimate is 0.11 above it."""
    rng = np.random.default_rng(4)
    found = [scores.crps(rng.normal(size=5), 0.4) for _ in range(20000)]
    assert np.mean(found) == pytest.approx(scores.crps(X, 0.4), abs=4.0 * np.std(found) / math.sqrt(len(found)))


def test_by_hand():
    draws = np.array([1.0, 2.0, 4.0])
    assert scores.crps(draws, 3.0) == pytest.approx(4 / 3 - (1 + 3 + 2) / 6)
    assert scores.pit(draws, 2.0) == 0.5
    assert scores.interval(np.linspace(0.0, 1.0, 101), 1.1, 0.9) == pytest.approx(0.9 + 20.0 * 0.15)
    chances = {"a": 0.7, "b": 0.2, "c": 0.1}
    assert scores.brier(chances, "b") == pytest.approx(0.49 + 0.64 + 0.01)
    assert scores.log_score(chances, "a") == pytest.approx(-math.log(0.7))
    assert scores.log_score({"a": 1.0, "b": 0.0}, "b") == math.inf


def test_the_error_of_what_is_observed_widens_the_draws():
    wide = scores.blurred(X, 0.75)
    assert np.std(wide) == pytest.approx(1.25, rel=0.02)
    assert np.mean(wide) == pytest.approx(0.0, abs=1e-9)
    assert np.array_equal(scores.blurred(X, 0.0), X)


def test_the_energy_score_of_one_quantity_is_its_crps_in_standard_deviations():
    draws = np.random.default_rng(2).gamma(2.0, 3.0, 500)
    assert scores.energy(draws[:, None], np.array([4.0])) == pytest.approx(scores.crps(draws, 4.0) / draws.std())


def test_the_energy_score_rewards_what_hangs_together():
    """Two quantities that move together, seen many times: a forecast with their correlation scores better than one
    with the same draws of each and none; by hand for two draws."""
    rng = np.random.default_rng(3)
    cover = [[1.0, 0.95], [0.95, 1.0]]
    joint = rng.multivariate_normal([0.0, 0.0], cover, 600)
    alone = np.column_stack([joint[:, 0], rng.permutation(joint[:, 1])])
    seen = rng.multivariate_normal([0.0, 0.0], cover, 300)
    better = np.array([scores.energy(alone, y) - scores.energy(joint, y) for y in seen])
    assert better.mean() > 3.0 * better.std() / math.sqrt(len(better))
    assert scores.energy(np.array([[0.0, 0.0], [2.0, 2.0]]), np.array([2.0, 0.0])) == pytest.approx(2.0 - 2.0**0.5)
    assert math.isnan(scores.energy(np.array([[0.0, 1.0], [0.0, 2.0]]), np.array([0.0, 1.0])))
