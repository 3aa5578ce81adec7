"""The posterior of what was drawn, from its priors and what was observed.

    ln y_obs ~ N(m(theta), s_obs^2 + s_emulator(theta)^2 + s_chain^2 + tau^2),      tau ~ half-normal(scale)

for each measure: y_obs its observed value, m and s_emulator the model's mean and standard deviation of ln y, s_chain
the scatter of the chain of stages, tau the discrepancy between any run and nature (Kennedy & O'Hagan 2001, J. R.
Stat. Soc. B 63, 425), whose prior is integrated over. Without it a posterior is too narrow by construction.

Where the errors of an observation are unequal, the truth lies about it by a split normal distribution of standard
deviation s_- below and s_+ above (Wallis 2014, Stat. Sci. 29, 106). With s^2 the sum of all other variances and d = m
- ln y_obs the likelihood is its integral against N(m, s^2), in closed form:

    L = sum over + and - of 2 s_+- / (s_- + s_+) N(d; 0, s_+-^2 + s^2) Phi(+- d s_+- / (s (s_+-^2 + s^2)^(1/2)))

Up to ``MOST`` parameters are sampled by importance: points of a Sobol sequence through the priors, each weighted by
its likelihood, until there are ``ENOUGH`` effective ones. More parameters, or data that leave too few points, are
sampled by emcee (Foreman-Mackey et al. 2013, Publ. Astron. Soc. Pac. 125, 306) in normal scores of the priors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtr, ndtri

from pipeline.case.prior_table import Prior
from pipeline.sweeps import draws

Predict = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Mean and standard deviation (n, m) of ln y of m measures at the parameters (n, d) [SI]."""
MOST, FIRST, LAST, ENOUGH = 4, 1 << 13, 1 << 18, 2000
IDENTIFIED = 0.9
"""Width of posterior over prior above which a parameter is not identified."""
_LEAST_VARIANCE = 1e-18
"""Of all but the observation, where the model is exact."""
_NODES = ndtri(0.5 + 0.5 * (np.arange(32) + 0.5) / 32)
"""tau over its scale, evenly by chance."""
_SCORES = np.linspace(-6.0, 6.0, 4001)
"""Where emcee's walkers know a prior's quantiles; between them they interpolate."""
_WALKERS, _BURN, _STEPS, _EVERY = 64, 400, 2400, 8


class Observed(NamedTuple):
    """A measure as it was observed: ``value`` and standard errors ``minus`` and ``plus`` [SI]; ``chain``: scatter of
    ln y by the model's own chain; ``discrepancy``: scale of the model's."""

    name: str
    unit: str
    value: float
    minus: float
    plus: float
    chain: float
    discrepancy: float

    @property
    def error(self) -> float:
        """Mean standard error of ln y."""
        return 0.5 * (self.minus + self.plus) / self.value


class Posterior(NamedTuple):
    """Points ``theta`` (n, d) [SI] with their ``weight`` (n,), which add up to 1; ``evidence``: ln of the mean
    likelihood over the prior, NaN from emcee; ``effective``: number of independent points; ``sampler``."""

    names: tuple[str, ...]
    theta: np.ndarray
    weight: np.ndarray
    evidence: float
    effective: float
    sampler: str

    def quantile(self, name: str, level: float | Sequence[float]) -> np.ndarray:
        """The values of a parameter below which the fractions ``level`` of the posterior lie."""
        values = self.theta[:, self.names.index(name)]
        return np.quantile(values, level, weights=self.weight, method="inverted_cdf")

    def drawn(self, count: int, seed: int = 1) -> np.ndarray:
        """``count`` rows (count, d), each as likely as any other."""
        chosen = np.random.default_rng(seed).choice(len(self.theta), size=count, p=self.weight)
        return np.asarray(self.theta[chosen])


class Told(NamedTuple):
    """What the data say of one parameter: ``mean``, ``sd`` and quantiles at 2.5, 5, 16, 50, 84, 95 and 97.5 %;
    ``width``: standard deviation over that of the prior (of the logarithm where it is drawn evenly in that; of one of
    several values, of the columns of ``coordinates``); ``bound``: "" or the side on which the prior's limit leaves it
    open, "below" or "above" what is excluded; ``chances`` of each of the values of "choices", which have no mean, else
    empty."""

    mean: float
    sd: float
    quantiles: np.ndarray
    width: float
    bound: str
    chances: tuple[float, ...] = ()

    @property
    def identified(self) -> bool:
        """Whether the data narrow it."""
        return self.width <= IDENTIFIED


LEVELS = (0.025, 0.05, 0.16, 0.5, 0.84, 0.95, 0.975)


def coordinates(prior: Prior, values: np.ndarray) -> np.ndarray:
    """Values (n,) of a parameter as they are emulated and their width is measured, (n, c): their logarithm where that
    is drawn evenly; of "choices" a column of 0 and 1 for each value."""
    if prior.values:
        return np.asarray(values[:, None] == np.arange(len(prior.values)), dtype=float)
    return np.asarray(np.log(values) if prior.distribution == "log_uniform" else values)[:, None]


def all_coordinates(priors: Mapping[str, Prior], theta: np.ndarray) -> np.ndarray:
    """The ``coordinates`` of all parameters ``theta`` (n, d) side by side."""
    return np.concatenate([coordinates(prior, theta[:, k]) for k, prior in enumerate(priors.values())], axis=1)


def theta_of(priors: Mapping[str, Prior], fraction: np.ndarray) -> np.ndarray:
    """Parameters (n, d) [SI] at the fractions (n, d) of their priors; of "choices" the number of the value, from 0."""
    return np.stack([draws.quantile(prior, fraction[:, k]) for k, prior in enumerate(priors.values())], axis=1)


def prior_draws(priors: Mapping[str, Prior], count: int, seed: int) -> np.ndarray:
    """``count`` points (count, d) [SI] of the priors, evenly spread."""
    return theta_of(priors, draws.sobol(len(priors), count, seed) + 0.5 / 2**30)


def log_likelihood(observed: Sequence[Observed], mean: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """ln of the likelihood (n,) at the model's ``mean`` and ``sd`` (n, m) of ln y."""
    total = np.zeros(len(mean))
    for k, one in enumerate(observed):
        scale = one.discrepancy * (_NODES if one.discrepancy else np.zeros(1))
        others = np.maximum(one.chain**2 + sd[:, k, None] ** 2 + scale**2, _LEAST_VARIANCE)
        away = mean[:, k, None] - np.log(one.value)
        lower, upper = one.minus / one.value, one.plus / one.value
        if lower == upper:
            density = _log_normal(away, lower**2 + others)
        else:
            density = np.logaddexp(_half(-away, lower, others), _half(away, upper, others)) - np.log(lower + upper)
        total += logsumexp(density, axis=1) - np.log(density.shape[1])
    return total


def _log_normal(away: np.ndarray, variance: np.ndarray) -> np.ndarray:
    return np.asarray(-0.5 * (away**2 / variance + np.log(2.0 * np.pi * variance)))


def _half(away: np.ndarray, error: float, others: np.ndarray) -> np.ndarray:
    """ln of one half of a split normal against a normal distribution, times the sum of both errors."""
    variance = error**2 + others
    side = log_ndtr(away * error / np.sqrt(others * variance))
    return np.asarray(np.log(2.0 * error) + _log_normal(away, variance) + side)


def sampled(priors: Mapping[str, Prior], predict: Predict, observed: Sequence[Observed], seed: int = 1) -> Posterior:
    """The posterior of the parameters of ``priors``."""
    if len(priors) <= MOST:
        count = FIRST
        while True:
            theta = prior_draws(priors, count, seed)
            logarithm = log_likelihood(observed, *predict(theta))
            found = weighted(tuple(priors), theta, logarithm)
            if found.effective >= ENOUGH:
                return found
            if count >= LAST:
                break
            count *= 4
    return _by_emcee(priors, predict, observed, seed)


def weighted(names: tuple[str, ...], theta: np.ndarray, logarithm: np.ndarray) -> Posterior:
    """The posterior by points ``theta`` (n, d) of the prior and ln of their likelihood (n,)."""
    total = logsumexp(logarithm)
    weight = np.exp(logarithm - total)
    weight /= weight.sum()
    effective = float(1.0 / np.sum(weight**2))
    return Posterior(names, theta, weight, float(total - np.log(len(theta))), effective, "importance sampling")


def _by_emcee(priors: Mapping[str, Prior], predict: Predict, observed: Sequence[Observed], seed: int) -> Posterior:
    """The posterior by an ensemble of walkers in normal scores, where the prior is a standard normal distribution."""
    import emcee

    table = theta_of(priors, np.repeat(ndtr(_SCORES)[:, None], len(priors), axis=1))

    def at(scores: np.ndarray) -> np.ndarray:
        columns = [np.interp(scores[:, k], _SCORES, table[:, k]) for k in range(len(priors))]
        return np.stack(
            [np.round(one) if prior.values else one for one, prior in zip(columns, priors.values())], axis=1
        )

    def logarithm(scores: np.ndarray) -> np.ndarray:
        return -0.5 * np.sum(scores**2, axis=1) + log_likelihood(observed, *predict(at(scores)))

    rng = np.random.default_rng(seed)
    tried = rng.standard_normal((FIRST, len(priors)))
    start = tried[np.argsort(logarithm(tried))[-_WALKERS:]]
    sampler = emcee.EnsembleSampler(_WALKERS, len(priors), logarithm, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(start, _BURN + _STEPS)
    chain = sampler.get_chain(discard=_BURN)[::_EVERY].reshape(-1, len(priors))
    length = float(np.max(sampler.get_autocorr_time(discard=_BURN, quiet=True)))
    theta = at(chain)
    even = np.full(len(theta), 1.0 / len(theta))
    return Posterior(tuple(priors), theta, even, float("nan"), _WALKERS * _STEPS / length, "emcee")


def told(priors: Mapping[str, Prior], found: Posterior) -> dict[str, Told]:
    """What the posterior says of each parameter."""
    answer = {}
    for k, (name, prior) in enumerate(priors.items()):
        values = found.theta[:, k]
        width = float(spread(prior, values, found.weight)) / prior_spread(prior)
        if prior.values:
            chances = found.weight @ coordinates(prior, values)
            none = np.full(len(LEVELS), np.nan)
            answer[name] = Told(np.nan, np.nan, none, width, "", tuple(map(float, chances)))
            continue
        mean = float(found.weight @ values)
        sd = float(np.sqrt(found.weight @ (values - mean) ** 2))
        answer[name] = Told(mean, sd, found.quantile(name, LEVELS), width, _bound(prior, found, k))
    return answer


def spread(prior: Prior, values: np.ndarray, weight: np.ndarray | None = None) -> np.ndarray:
    """Standard deviation (...) of a parameter's ``values`` (n,) in its ``coordinates``, each as likely as any other or
    by ``weight`` (..., n)."""
    inner = coordinates(prior, values)
    held = np.full(len(inner), 1.0 / len(inner)) if weight is None else weight
    inner = inner - inner.mean(axis=0)
    variance = np.sum(held @ inner**2 - (held @ inner) ** 2, axis=-1)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def prior_spread(prior: Prior) -> float:
    """``spread`` of a prior: of its values at even fractions."""
    return float(spread(prior, draws.quantile(prior, (np.arange(FIRST) + 0.5) / FIRST)))


def _bound(prior: Prior, found: Posterior, k: int) -> str:
    """Which side of a limited prior the data exclude: at the other end the posterior is as likely as the prior, or
    nearly so."""
    if prior.distribution not in ("uniform", "log_uniform"):
        return ""
    ends = draws.quantile(prior, np.array([0.1, 0.9]))
    low = float(found.weight @ (found.theta[:, k] < ends[0])) > 0.05
    high = float(found.weight @ (found.theta[:, k] > ends[1])) > 0.05
    return "" if low == high else "below" if low else "above"
