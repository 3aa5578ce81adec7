"""How much narrower a posterior would be if a measure were observed too: the mean over what may be seen.

    gain_k = < sd(theta_k | y, y') > / sd(theta_k | y),      y' ~ N(m(theta), v) for theta drawn from the posterior

y: what is observed; y' = ln of the further measure with the variance v of its error, emulator, chain and discrepancy
(at its scale). Each y' weighs other draws of the posterior by its likelihood. A measure that is observed already is
taken out of what is known first, and comes back with half its error e, from looking again: chain and discrepancy are
those of before. What is then seen has to agree with the first look, y = y' + N(0, 3 e^2 / 4), and therefore

    y' ~ N((B m + v y) / (v + B), v B / (v + B)),    B = 3 e^2 / 4

Expected posterior width: Chaloner & Verdinelli 1995, Stat. Sci. 10, 273.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from matter.wording import body_measures, crater_measures
from pipeline.case.prior_table import Prior
from pipeline.inverse import posterior
from pipeline.inverse.design import LEAST_EACH
from pipeline.inverse.inversion import Inversion
from pipeline.inverse.posterior import Observed

ERROR = 0.1
"""Standard error of a further measure, as a fraction, where none is stated."""
_POINTS, _SEEN = 2048, 256
_CANDIDATES = (*crater_measures.COMPARED, *body_measures.BY_NAME)


class Gain(NamedTuple):
    """``widths``: expected standard deviation of each parameter over that of now, with the ``measure`` observed to the
    fraction ``error``; ``again``: it is observed already."""

    measure: str
    error: float
    again: bool
    widths: dict[str, float]

    @property
    def rank(self) -> float:
        """Product of the widths: the less, the more it helps."""
        return float(np.prod(list(self.widths.values())))


def candidates(found: Inversion) -> list[str]:
    """The measures that most members have, of the final crater or body, those observed first."""
    least = LEAST_EACH * len(found.priors)
    known = [name for name in _CANDIDATES if name in found.design.columns]
    known = [
        name for name in known if found.design.members_with(name).sum() >= max(least, len(found.design.theta) // 2)
    ]
    return [
        *(one.name for one in found.observed),
        *(n for n in known if n not in {one.name for one in found.observed}),
    ]


def of_every(found: Inversion, error: float = ERROR) -> list[Gain]:
    """The gain of every candidate, the most helpful first. Raises ``InputError`` where ``error`` is not above 0."""
    return sorted((of_measure(found, name, error) for name in candidates(found)), key=lambda one: one.rank)


def of_measure(found: Inversion, measure: str, error: float = ERROR) -> Gain:
    """The gain of a ``measure`` observed to the fraction ``error``; of one that is observed already, to half its
    error. Raises ``InputError`` where too few members have it, or ``error`` is not above 0."""
    if not error > 0.0:
        raise InputError(f"the error of a further measure must be greater than 0, as a fraction (given: {error:g})")
    name = found.known(measure)
    truths = found.posterior.drawn(_SEEN, found.seed + 1)
    known = next((one for one in found.observed if one.name == name), None)
    if known is None:
        points, scale = found.posterior.drawn(_POINTS, found.seed), found.table.scale(name)
    else:
        points, scale = _without(found, [one for one in found.observed if one.name != name]), known.discrepancy
        error = 0.5 * known.error
    variance = error**2 + found.chains.get(name, 0.0) ** 2 + scale**2
    (mean, sd), (true, true_sd) = (
        (column[:, 0] for column in found.predict(theta, [name])) for theta in (points, truths)
    )
    seen = looked(true, variance + true_sd**2, known, found.seed)
    then = widths(found.priors, points, mean, variance + sd**2, seen)
    return Gain(name, error, known is not None, {one: then[one] / told.width for one, told in found.told.items()})


def looked(mean: np.ndarray, variance: np.ndarray, known: Observed | None, seed: int) -> np.ndarray:
    """What may be seen (s,): ln of a measure of mean and variance (s,) at the truths; of one that is ``known``, with
    half its error in the variance, what agrees with the first look."""
    if known is not None:
        rest = 0.75 * known.error**2
        mean = (rest * mean + variance * np.log(known.value)) / (variance + rest)
        variance = variance * rest / (variance + rest)
    return np.asarray(mean + np.sqrt(variance) * np.random.default_rng(seed).standard_normal(len(mean)))


def _without(found: Inversion, others: list[Observed]) -> np.ndarray:
    """Draws (n, d) of what is known by the ``others`` alone."""
    if not others:
        return posterior.prior_draws(found.priors, _POINTS, found.seed)

    def predict(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return found.predict(theta, [one.name for one in others])

    return posterior.sampled(found.priors, predict, others, found.seed).drawn(_POINTS, found.seed)


def widths(
    priors: Mapping[str, Prior], points: np.ndarray, mean: np.ndarray, variance: np.ndarray, seen: np.ndarray
) -> dict[str, float]:
    """Expected width over the prior's of each parameter: of ``points`` (n, d), each as likely as any other, at which
    the model gives ``mean`` and ``variance`` (n,) of ln of a measure, after it was ``seen`` (s,)."""
    logarithm = -0.5 * ((seen[:, None] - mean) ** 2 / variance + np.log(variance))
    weight = np.exp(logarithm - logarithm.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    return {
        name: float(np.mean(posterior.spread(prior, points[:, k], weight))) / posterior.prior_spread(prior)
        for k, (name, prior) in enumerate(priors.items())
    }
