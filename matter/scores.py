"""Scores of a forecast given as draws x_1 .. x_N of equal weight, against what was observed, y. Less is better.

    CRPS        mean |x_i - y| - sum_ij |x_i - x_j| / (2 N (N - 1))                      fair: as of endless draws
    interval    u - l + (2 / alpha) max(l - y, 0) + (2 / alpha) max(y - u, 0)             [l, u] holds 1 - alpha
    Brier       sum_k (p_k - o_k)^2, o_k = 1 for the class that is found and 0 for the others
    log         -ln p of the class that is found
    energy      the CRPS with |.| the length of a vector: of several quantities jointly, each over the standard
                deviation of its draws
    PIT         part of the draws below y: even over [0, 1] where forecasts are honest

Gneiting & Raftery 2007, J. Am. Stat. Assoc. 102, 359 (4.2, 4.3, 6.2); the fair CRPS: Ferro 2014, Q. J. R. Meteorol.
Soc. 140, 1917. An error sigma of y is added to the draws, as normal scores in an order that is always the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.spatial.distance import pdist
from scipy.special import ndtri

SOURCES = ("GneitingRaftery2007", "Ferro2014")


def crps(draws: np.ndarray, observed: float) -> float:
    """The fair CRPS, in the unit of the draws."""
    x = np.sort(np.asarray(draws, dtype=float))
    count = len(x)
    spread = (2.0 * np.arange(1, count + 1) - count - 1.0) @ x / (count * (count - 1.0))
    return float(np.mean(np.abs(x - observed)) - spread)


def energy(draws: np.ndarray, observed: np.ndarray, size: np.ndarray | None = None) -> float:
    """The fair energy score of joint draws (n, d) against what was observed (d,), with no unit: lengths over ``size``
    (d,), the standard deviation of the draws where left out; NaN where one of these is 0."""
    x = np.asarray(draws, dtype=float)
    size = x.std(axis=0) if size is None else np.asarray(size)
    if not np.all(size > 0.0):
        return math.nan
    away = np.linalg.norm((x - observed) / size, axis=1)
    return float(away.mean() - 0.5 * pdist(x / size).mean())


def interval(draws: np.ndarray, observed: float, level: float = 0.95) -> float:
    """The score of the central interval that holds ``level`` of the draws, in their unit."""
    low, high = np.quantile(np.asarray(draws, dtype=float), (0.5 - 0.5 * level, 0.5 + 0.5 * level))
    return float(high - low + 2.0 / (1.0 - level) * (max(low - observed, 0.0) + max(observed - high, 0.0)))


def pit(draws: np.ndarray, observed: float) -> float:
    """The part of the draws below what was observed; a draw that equals it counts half."""
    x = np.asarray(draws, dtype=float)
    return float(np.mean(x < observed) + 0.5 * np.mean(x == observed))


def brier(chances: Mapping[str, float], found: str) -> float:
    """From 0 (certain and right) to 2 (certain and wrong)."""
    return sum((chance - (name == found)) ** 2 for name, chance in chances.items())


def log_score(chances: Mapping[str, float], found: str) -> float:
    """In nats; infinite for what was called impossible."""
    return -math.log(chances[found]) if chances[found] > 0.0 else math.inf


def blurred(draws: np.ndarray, sigma: float) -> np.ndarray:
    """The draws with an error of observation added to each."""
    x = np.asarray(draws, dtype=float)
    ranks = (np.arange(len(x)) + 0.5) / len(x)
    return x + sigma * ndtri(np.random.default_rng(1).permutation(ranks))
