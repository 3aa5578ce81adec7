"""A ladder of resolutions: what a measure would come to at a vanishing spacing, and how far a run is from that.

With h the spacing over that of the run (1, 1.26, 1.59) and y the measure, by least squares (Richardson 1911; Roache
1998, chapter 5):

    y(h) = y0 + c h^p,    size^2 = max(0, c^2 - s^2 sum(u^2)) + max(0, s_r^2 - s^2)

where c = sum(u y) is the distance of the run from ``y0``, s the scatter of one run over its random draws and s_r that
of the rungs about the law: what is subtracted is what the draws alone would give on average. The order p follows from
three rungs at equal ratios r,

    p = ln((y3 - y2) / (y2 - y1)) / ln r,

where they rise or fall throughout, and by more than twice the scatter of such a difference (2 sqrt(2) s); it is taken
within 1 and 2. Else there is no order, and p is 1, the cautious choice.

Two rungs extrapolate nothing: their ``size`` is their difference, size^2 = max(0, (y2 - y1)^2 - 2 s^2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

RATIO = 2.0 ** (1.0 / 3.0)
"""Spacing of a rung over that of the one before: half the particles and grains."""
ORDERS = (1.0, 2.0)
"""Between these an order is taken."""


@dataclass(frozen=True)
class Ladder:
    """``order`` of convergence (None: none that stands out of the scatter), the value ``extrapolated`` to a vanishing
    spacing (None: from two rungs), and the error ``size`` of the run itself, in the unit of the measure."""

    order: float | None
    extrapolated: float | None
    size: float


def climb(values: Sequence[float], scatter: float) -> Ladder | None:
    """The ladder of a measure: ``values`` at the spacings 1, r, r^2 (as many as there are, the run's own first),
    ``scatter`` of one run. None with fewer than two."""
    if len(values) < 2:
        return None
    y = np.asarray(values, dtype=float)
    if len(y) < 3:
        return Ladder(None, None, math.sqrt(max(0.0, float(y[1] - y[0]) ** 2 - 2.0 * scatter**2)))
    order = _order(y, scatter)
    h = RATIO ** np.arange(len(y))
    design = np.stack([np.ones(len(y)), h ** (ORDERS[0] if order is None else order)], axis=1)
    weights = np.linalg.pinv(design)
    origin, rise = weights @ (y - y[0])
    noise = scatter**2 * float(np.sum(weights[1] ** 2))
    rest = float(np.sum((y - y[0] - design @ (origin, rise)) ** 2)) / (len(y) - 2)
    size = max(0.0, float(rise) ** 2 - noise) + max(0.0, rest - scatter**2)
    return Ladder(order, float(y[0] + origin), math.sqrt(size))


def _order(y: np.ndarray, scatter: float) -> float | None:
    first, second = y[1] - y[0], y[2] - y[1]
    if first * second <= 0.0 or abs(y[2] - y[0]) <= 2.0 * math.sqrt(2.0) * scatter:
        return None
    return float(np.clip(math.log(second / first) / math.log(RATIO), *ORDERS))
