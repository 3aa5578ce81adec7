"""Draws from priors: a scrambled Sobol sequence in the unit cube, through the inverse distribution of each quantity.

    x_k = F_k^-1(u_k)        u the n-th point of the sequence, F_k the distribution of quantity k

The first 2^m points have exactly one in each of 2^m intervals of every quantity, and any first part of the sequence
fills the space evenly. Point n does not depend on how many are drawn: a sweep with more members has the same first
ones. Another seed, number or order of quantities gives other draws.

Source: Owen 1998, J. Complexity 14, 466 (scrambling); ``scipy.stats`` (the sequence of Joe & Kuo 2008, and F^-1).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.case import quantity
from pipeline.case.prior_table import Number, Prior

_BITS = 30
"""Of a coordinate of the sequence."""
DIGITS = 6
"""Of a drawn amount as it is written: the member is what is written, and so is what is derived from it."""


def sobol(dimensions: int, count: int, seed: int) -> np.ndarray:
    """The first ``count`` points (count, dimensions) of a scrambled Sobol sequence, in [0, 1)."""
    from scipy.stats import qmc

    points = qmc.Sobol(d=dimensions, rng=seed).random_base2(max(0, (count - 1).bit_length()))
    return np.asarray(points[:count])


def drawn(priors: Mapping[str, Prior], count: int, seed: int) -> list[dict[str, Number]]:
    """``count`` draws: the value of each quantity by its name, amounts with ``DIGITS`` digits and their unit."""
    # in the middle of the sequence's cells: at 0 a normal distribution is infinitely low
    points = sobol(len(priors), count, seed) + 0.5**_BITS / 2.0
    columns = [written(prior, points[:, k]) for k, prior in enumerate(priors.values())]
    return [dict(zip(priors, row, strict=True)) for row in zip(*columns, strict=True)]


def written(prior: Prior, fraction: np.ndarray) -> list[Number]:
    """The values at the ``fraction`` (n,) of the distribution, as a case holds them."""
    if prior.values:
        return [prior.values[int(number)] for number in quantile(prior, fraction)]
    amounts = quantile(prior, fraction)
    if not prior.unit:
        return [float(f"{amount:.{DIGITS}g}") for amount in amounts]
    one = quantity.parse(f"1 {prior.unit}")
    return [f"{amount / one:.{DIGITS}g} {prior.unit}" for amount in amounts]


def quantile(prior: Prior, fraction: Any) -> np.ndarray:
    """The amounts [SI] (n,) below which the ``fraction`` (n,) of a distribution lies; of ``choices`` the number of the
    value, from 0."""
    from scipy import stats

    if prior.values:
        return np.floor(np.asarray(fraction) * len(prior.values)).clip(0, len(prior.values) - 1)

    low, high = prior.limits
    if prior.distribution == "normal":
        [(_, mean, sd)] = prior.normals
        return np.asarray(stats.truncnorm.ppf(fraction, (low - mean) / sd, (high - mean) / sd, loc=mean, scale=sd))
    if prior.distribution == "uniform":
        return np.asarray(stats.uniform.ppf(fraction, low, high - low))
    if prior.distribution == "log_uniform":
        return np.asarray(stats.loguniform.ppf(fraction, low, high))
    return _mixture(prior, fraction)


def _mixture(prior: Prior, fraction: Any) -> np.ndarray:
    """The root of F(x) = F(low) + u (F(high) - F(low)), F the sum of the components' distributions."""
    from scipy import optimize, special

    weight, mean, sd = np.array(prior.normals).T
    low, high = prior.limits

    def cdf(x: float) -> float:
        return float(weight @ special.ndtr((x - mean) / sd))

    below, above = cdf(low), cdf(high)
    # beyond these the distribution has no digit left
    ends = max(low, float(np.min(mean - 40.0 * sd))), min(high, float(np.max(mean + 40.0 * sd)))
    wanted = below + np.asarray(fraction) * (above - below)
    return np.array(
        [optimize.brentq(lambda x, u=u: cdf(x) - u, *ends, xtol=1e-12 * np.max(sd), rtol=1e-14) for u in wanted]
    )
