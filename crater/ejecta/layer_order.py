"""Whether the layers at a crater's rim are turned over: the order of first heights against heights now.

Of what lies above the undisturbed ground between 1 and 1.5 R, in rings of equal width, the ranks within each ring of
the height before the impact and of the height now are correlated (Spearman): -1 where what lay deepest lies on top
(the overturned flap of Melosh 1989, section 5.3), +1 where the layers kept their order. The error is that of leaving
out one sector in azimuth after the other (jackknife): neighbours are no independent witnesses, so that the p of single
particles is too good.

    turned over:  p < 0.01, r < -0.2 and r < -2 sigma;  upright: the same of the other sign;  else undecided
"""

from __future__ import annotations

from typing import Any

import numpy as np

SOURCES = ("Melosh1989",)
RIM, RINGS = 1.5, 3
FEWEST = 30
"""Fewest particles at the rim that say whether layers are turned over."""
CLEAR = 0.2
"""Least rank correlation that says so."""
SECTORS = 12


def order(first: np.ndarray, height: np.ndarray, away: np.ndarray, azimuth: np.ndarray) -> dict[str, Any]:
    """``order`` (``turned over``, ``upright``, ``undecided``), the rank ``correlation`` with its ``sigma`` and ``p``,
    and how many ``particles`` say so.

    ``first``, ``height`` [m] before and now, ``away`` in R, ``azimuth`` [rad], of each particle at the rim.
    """
    if len(first) < FEWEST:
        return {"order": "undecided", "reason": "too few particles at the rim", "particles": len(first)}
    ring = np.clip(((away - 1.0) / (RIM - 1.0) * RINGS).astype(int), 0, RINGS - 1)
    sector = np.floor((azimuth / (2.0 * np.pi) % 1.0) * SECTORS).astype(int)
    value, p = _correlation(first, height, ring)
    less = [
        _correlation(*(part[sector != k] for part in (first, height, ring)))[0]
        for k in range(SECTORS)
        if 1 < np.count_nonzero(sector != k) < len(sector)
    ]
    spread = np.array(less) - np.mean(less) if less else np.array([np.inf])
    sigma = float(np.sqrt((len(spread) - 1) / len(spread) * np.sum(spread**2))) if len(spread) > 1 else float("nan")
    clear = p < 0.01 and abs(value) > max(CLEAR, 2.0 * sigma)  # false where the error is not known
    word = "undecided" if not clear else "turned over" if value < 0.0 else "upright"
    return {"order": word, "correlation": value, "sigma": sigma, "p": p, "particles": len(first)}


def _correlation(first: np.ndarray, height: np.ndarray, ring: np.ndarray) -> tuple[float, float]:
    from scipy.stats import spearmanr  # half a second of every command, and few rank

    pairs = [(_ranks(first[ring == k]), _ranks(height[ring == k])) for k in range(RINGS)]
    outcome = spearmanr(*(np.concatenate(column) for column in zip(*pairs)))
    return float(outcome.statistic), float(outcome.pvalue)


def _ranks(values: np.ndarray) -> np.ndarray:
    """Places in the order of the values, between 0 and 1."""
    return (np.argsort(np.argsort(values)) + 0.5) / max(len(values), 1)
