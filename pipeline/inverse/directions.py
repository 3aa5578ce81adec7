"""Which directions of the priors the data can tell apart at all, before anything is known of the answer.

    J = S^-1/2 d ln y / d x      (m, c)      x: coordinates of the parameters over their standard deviations
    <J^T J> = V diag(s^2) V^T    (c, c)      mean over the prior; s: singular values, V (c, c): directions, as columns

S is the variance of ln y that the posterior counts: observation, chain, emulator, discrepancy at its scale. Where
ln y is linear and the priors are normal, C = (1 + <J^T J>)^-1 is the covariance of the posterior, (1 + s_i^2)^(-1/2)
its width along direction i (Cui et al. 2014, Inverse Problems 30, 114015). Else s counts the steepest parts of the
prior most; C is therefore worked out as the mean covariance of posteriors of what may be seen, each of a truth drawn
from the prior: every draw of the prior is weighed by its likelihood. One of k "choices" counts as k - 1 coordinates,
contrasts of its values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.case.prior_table import Prior
from pipeline.inverse import posterior
from pipeline.inverse.posterior import IDENTIFIED, Observed, Predict

_SLOPES, _STEP, _POINTS, _SEEN = 512, 0.05, 1 << 14, 256
_FEW = 10
"""Effective points for each coordinate below which C follows from the slopes."""
NAMED, ALIKE = 0.4, 0.7
"""Weight of a parameter over the largest from which it is named in a direction; correlation of the posterior from
which two are not told apart."""


class Directions(NamedTuple):
    """``names`` (c,): the parameter of each coordinate; ``singular`` (c,): singular values, falling; ``vectors`` (c,
    c): directions as columns, the largest weight of each positive; ``covariance`` (c, c): C."""

    names: tuple[str, ...]
    singular: np.ndarray
    vectors: np.ndarray
    covariance: np.ndarray

    @property
    def widths(self) -> np.ndarray:
        """Posterior over prior along each direction (c,)."""
        return np.asarray(np.sqrt(np.diag(self.vectors.T @ self.covariance @ self.vectors)))

    @property
    def parameters(self) -> list[str]:
        """Each parameter once."""
        return list(dict.fromkeys(self.names))

    def width(self, name: str, others_known: bool = False) -> float:
        """Posterior over prior of a parameter; ``others_known``: if all others were known."""
        at = [k for k, one in enumerate(self.names) if one == name]
        covariance = self.covariance[np.ix_(at, at)]
        if others_known:
            covariance = np.linalg.inv(np.linalg.inv(self.covariance)[np.ix_(at, at)])
        return float(np.sqrt(np.trace(covariance) / len(at)))

    def correlation(self, one: str, other: str) -> float:
        """Correlation of two parameters in the posterior; of coordinates of "choices" the strongest."""
        sd = np.sqrt(np.diag(self.covariance))
        pairs = [(self.covariance / np.outer(sd, sd))[j, k] for j, first in enumerate(self.names) if first == one
                 for k, second in enumerate(self.names) if second == other]  # fmt: skip
        return float(max(pairs, key=abs))


def told_apart(
    priors: Mapping[str, Prior], predict: Predict, observed: Sequence[Observed], seed: int = 1
) -> Directions:
    """The directions of ``priors`` that a model tells apart by what is ``observed``."""
    theta = posterior.prior_draws(priors, _SLOPES, seed)
    sd = predict(theta)[1]
    known = np.array([one.error**2 + one.chain**2 + one.discrepancy**2 for one in observed])
    names: list[str] = []
    columns: list[np.ndarray] = []  # (n, m) each
    for k, (name, prior) in enumerate(priors.items()):
        slopes = _slopes(prior, theta, k, predict)
        names += [name] * len(slopes)
        columns += [slope / np.sqrt(known + sd**2) for slope in slopes]
    rows = np.stack(columns, axis=-1).reshape(-1, len(names)) / np.sqrt(_SLOPES)
    _, singular, vectors = np.linalg.svd(rows, full_matrices=False)
    largest = vectors[np.arange(len(vectors)), np.abs(vectors).argmax(axis=1)]
    vectors = (vectors * np.sign(largest)[:, None]).T
    covariance = _expected_covariance(priors, predict, known, seed)
    if covariance is None:
        covariance = vectors / (1.0 + singular**2) @ vectors.T
    return Directions(tuple(names), singular, vectors, covariance)


def _expected_covariance(
    priors: Mapping[str, Prior], predict: Predict, known: np.ndarray, seed: int
) -> np.ndarray | None:
    """C (c, c); None where too few draws of the prior are near what is seen."""
    theta = posterior.prior_draws(priors, _POINTS, seed)
    mean, sd = predict(theta)
    inner = np.concatenate([_standard(prior, theta[:, k]) for k, prior in enumerate(priors.values())], axis=1)
    rng = np.random.default_rng(seed)
    total, effective = np.zeros((inner.shape[1], inner.shape[1])), 0.0
    variance = known + sd**2
    for truth in range(_SEEN):  # evenly spread, as any first part of the draws
        seen = mean[truth] + np.sqrt(variance[truth]) * rng.standard_normal(len(known))
        logarithm = -0.5 * np.sum((seen - mean) ** 2 / variance + np.log(variance), axis=1)
        weight = np.exp(logarithm - logarithm.max())
        weight /= weight.sum()
        away = inner - weight @ inner
        total += (weight[:, None] * away).T @ away / _SEEN
        effective += 1.0 / np.sum(weight**2) / _SEEN
    return None if effective < _FEW * inner.shape[1] else total


def _standard(prior: Prior, values: np.ndarray) -> np.ndarray:
    """Coordinates (n, c) of a parameter of mean 0 and standard deviation 1 in the prior; of "choices" contrasts."""
    from scipy.linalg import helmert

    inner = posterior.coordinates(prior, values)
    if count := len(prior.values):
        return np.asarray(inner @ helmert(count).T * np.sqrt(count))
    return np.asarray((inner - inner.mean(axis=0)) / inner.std(axis=0))


def _slopes(prior: Prior, theta: np.ndarray, k: int, predict: Predict) -> list[np.ndarray]:
    """d ln y / d x (n, m) by each coordinate of parameter ``k``: central differences, or contrasts of values."""
    from scipy.linalg import helmert

    def moved(values: np.ndarray | float) -> np.ndarray:
        at = theta.copy()
        at[:, k] = values
        return predict(at)[0]

    if count := len(prior.values):
        results = np.stack([moved(float(number)) for number in range(count)])
        return [np.asarray(row) for row in np.tensordot(helmert(count), results, axes=1) / np.sqrt(count)]
    step = _STEP * posterior.prior_spread(prior)
    if prior.distribution == "log_uniform":
        ends = theta[:, k] * np.exp(step), theta[:, k] * np.exp(-step)
    else:
        ends = theta[:, k] + step, theta[:, k] - step
    return [(moved(ends[0]) - moved(ends[1])) / (2.0 * _STEP)]


def combination(found: Directions, number: int, name_of: Mapping[str, str]) -> str:
    """A direction in words: "cohesion", "speed × radius" (a rise of one looks like a rise of the other), "speed /
    density" (like a fall)."""
    weights = found.vectors[:, number]
    strongest: dict[str, float] = {}
    for name, weight in zip(found.names, weights):
        strongest[name] = max(strongest.get(name, 0.0), weight, key=abs)
    largest = max(map(abs, strongest.values()))
    named = [(name_of[name], weight) for name, weight in strongest.items() if abs(weight) >= NAMED * largest]
    named.sort(key=lambda one: one[1] < 0.0)
    above = " × ".join(name for name, weight in named if weight > 0.0)
    return " / ".join([above, *(name for name, weight in named if weight < 0.0)])


def sentences(found: Directions, measures: Sequence[str], name_of: Mapping[str, str]) -> list[str]:
    """What the ``measures`` (in words) fix, what they do not tell apart, and what they do not see."""
    fixed = [combination(found, k, name_of) for k, width in enumerate(found.widths) if width <= IDENTIFIED]
    if len(measures) > 1:
        subject = f"{', '.join(measures[:-1])} and {measures[-1]} together fix"
    else:
        subject = f"{measures[0]} fixes"
    said = [f"{subject[0].upper()}{subject[1:]} {len(fixed) or 'none'} of {len(found.names)} directions"
            f"{': ' if fixed else ''}{', '.join(fixed)}."]  # fmt: skip
    names = found.parameters
    seen = [name for name in names if found.width(name, True) <= IDENTIFIED]
    for k, one in enumerate(seen):
        for other in seen[k + 1 :]:
            if abs(found.correlation(one, other)) > ALIKE:
                said.append(f"{name_of[one]} and {name_of[other]} are not told apart.".capitalize())
    for name in seen:
        if found.width(name) > IDENTIFIED:
            said.append(f"{name_of[name]} would be told only if the others were known.".capitalize())
    if unseen := [name_of[name] for name in names if name not in seen]:
        said.append(f"Not told, for the data hardly depend on it: {', '.join(unseen)}.")
    return said
