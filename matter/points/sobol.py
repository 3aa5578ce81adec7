"""Low-discrepancy points: the scrambled sequence of Sobol.

Source: Joe & Kuo 2008, SIAM J. Sci. Comput. 30, 2635 (directions); Owen 1998, J. Complexity 14, 466 (scrambling).
"""

from __future__ import annotations

from typing import Any


def stream(seed: int) -> Any:
    """A ``scipy.stats.qmc.Sobol`` of points in the unit cube, scrambled by ``seed``."""
    from scipy.stats import qmc  # here, not above: half a second of every command, and few draw

    return qmc.Sobol(3, scramble=True, rng=seed)
