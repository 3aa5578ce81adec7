"""A quantity against the particle spacing, extrapolated to none, with an error.

q(s) = q0 + a s^p is fitted with the errors of the values as weights (Richardson 1911; Roache 1994): with p = 1 (the
surface of a particle cloud is known to a share of a spacing), and with p free in [0.5, 3] where there are four
spacings or more. q0 of p = 1 is quoted; its error holds the fit's own (as if every departure from the law were
scatter) and the difference between the two orders.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from crater.drawing.figure import INK, figure, save
from matter.errors import InputError

ORDERS = (0.5, 3.0)


@dataclass(frozen=True)
class Extrapolation:
    """``value`` at zero spacing with its error ``sigma``; slope of the linear fit, scatter about it, value and order
    of the free fit (None: too few)."""

    value: float
    sigma: float
    slope: float
    scatter: float
    free_value: float | None
    free_order: float | None

    def at(self, spacing: np.ndarray) -> np.ndarray:
        """The linear fit at spacings [m]."""
        return self.value + self.slope * np.asarray(spacing)


def extrapolated(spacing: np.ndarray, values: np.ndarray, sigma: np.ndarray) -> Extrapolation:
    """Extrapolate ``values`` (n,) with errors ``sigma`` (n,) to zero ``spacing`` (n,) [m].

    Raises ``InputError`` for fewer than three different spacings, or errors that are not positive.
    """
    s, q, e = (np.asarray(x, dtype=float) for x in (spacing, values, sigma))
    good = np.isfinite(s) & np.isfinite(q) & np.isfinite(e)
    s, q, e = s[good], q[good], e[good]
    if len(np.unique(s)) < 3:
        raise InputError(f"an extrapolation needs three spacings, there are {len(np.unique(s))}")
    if (e <= 0.0).any():
        raise InputError("an extrapolation needs positive errors")
    (value, slope), covariance, chi2 = _line(s, q, e, 1.0)
    # where the law does not hold to within the errors, the errors grow until it does (Birge)
    spread = float(np.sqrt(covariance[0, 0]) * max(1.0, np.sqrt(chi2 / (len(s) - 2))))
    scatter = float(np.sqrt(np.mean((q - value - slope * s) ** 2)))
    free_value, order = None, None
    if len(np.unique(s)) >= 4:
        order = float(
            minimize_scalar(lambda p: _line(s, q, e, p)[2], bounds=ORDERS, method="bounded", options={"xatol": 1e-4}).x
        )
        free_value = float(_line(s, q, e, order)[0][0])
    both = 0.0 if free_value is None else abs(free_value - value)
    return Extrapolation(float(value), float(np.hypot(spread, both)), float(slope), scatter, free_value, order)


def _line(s: np.ndarray, q: np.ndarray, e: np.ndarray, order: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Weighted least squares of q = q0 + a s^order: (q0, a), their covariance, chi^2."""
    scale = float(s.max())
    matrix = np.column_stack([np.ones_like(s), (s / scale) ** order]) / e[:, None]
    covariance = np.linalg.inv(matrix.T @ matrix)
    coefficients = covariance @ (matrix.T @ (q / e))
    chi2 = float(((q / e - matrix @ coefficients) ** 2).sum())
    units = np.array([1.0, scale**-order])
    return coefficients * units, covariance * np.outer(units, units), chi2


def draw_convergence(
    rows: list[Mapping[str, float]],
    fits: Mapping[str, Extrapolation],
    path: Path,
    uniform: Mapping[str, float] | None = None,
) -> None:
    """Transient diameter and depth against spacing [km] with the extrapolation; ``uniform``: a run of one spacing,
    which takes no part in the fit."""
    fig = figure(9.0, 4.4)
    axes = fig.subplots(1, 2)
    for axis, name, label in zip(
        axes, ("diameter_apparent_m", "depth_m"), ("apparent diameter [km]", "depth below datum [km]")
    ):
        for choice, colour in (("depth", INK[0]), ("volume", INK[1])):
            key = f"{name}_at_{choice}"
            s = np.array([row["spacing_m"] for row in rows]) * 1e-3
            y, e = (np.array([row[column] for row in rows]) * 1e-3 for column in (key, f"{key}_sigma"))
            axis.errorbar(
                s, y, yerr=e, fmt="o", color=colour, markersize=4, capsize=3, label=f"graded, at maximum {choice}"
            )
            if uniform is not None:
                axis.errorbar([uniform["spacing_m"] * 1e-3], [uniform[key] * 1e-3],
                yerr=[uniform[f"{key}_sigma"] * 1e-3], fmt="s", color=colour,
                              markerfacecolor="white", markersize=6, capsize=3,
                              label=f"300,000 of one size, at maximum {choice}")  # fmt: skip
            if key in fits:
                fit = fits[key]
                line = np.linspace(0.0, s.max(), 50)
                axis.plot(line, fit.at(line * 1e3) * 1e-3, color=colour, linewidth=1.0, linestyle="--")
                axis.errorbar(
                    [0.0], [fit.value * 1e-3], yerr=[fit.sigma * 1e-3], fmt="*", color=colour, markersize=9, capsize=3
                )
        axis.set(xlabel="particle spacing at the impact [km]", ylabel=label, xlim=(-3.0, None))
        axis.grid(alpha=0.25, linewidth=0.6)
    axes[0].legend(frameon=False, fontsize=7)
    save(fig, path)
