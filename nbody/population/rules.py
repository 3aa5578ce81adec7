"""From a census to one impact: the rule that a case names.

``"mean of retrograde impacts"``      mean speed and mean angle (``prograde``, ``all`` likewise)
``"maximum of retrograde impacts"``   fastest one (``minimum`` likewise), mean angle
``"quantile 0.9 of all impacts"``     quantile of the speed, mean angle
``"draw one"``                        one impact drawn by weight, speed and angle of that one
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from nbody.population import encounters
from nbody.population.encounters import COLLISION

_RULE = re.compile(
    r"(mean|maximum|minimum|quantile (?P<q>0?\.\d+|[01])) of (?P<subset>retrograde|prograde|all) impacts"
)


class Statistic(NamedTuple):
    """A number found: value, standard error, how many impacts stand behind it."""

    value: float
    standard_error: float
    impacts: int


class Choice(NamedTuple):
    """Speed [m/s] and angle from the vertical [rad] that a rule gives."""

    speed: Statistic
    angle: Statistic


def check(rule: str) -> str:
    """The rule itself if it can be read; raises ``ValueError`` saying what is known."""
    if rule != "draw one" and not _RULE.fullmatch(rule):
        raise ValueError(
            f"unknown rule {rule!r}: write '<mean|maximum|minimum|quantile 0.9> of <retrograde|prograde|all> impacts' "
            f"or 'draw one'"
        )
    return rule


def weighted_mean(values: np.ndarray, weights: np.ndarray) -> Statistic:
    """Mean with weights; standard error sqrt(sum w^2 (x - mean)^2) / sum w (ordinary one, n/(n-1) included, for equal
    weights)."""
    n = len(values)
    if n == 0:
        return Statistic(float("nan"), float("nan"), 0)
    total = weights.sum()
    mean = float((weights * values).sum() / total)
    if n == 1:
        return Statistic(mean, float("nan"), 1)
    error = np.sqrt((weights**2 * (values - mean) ** 2).sum() * n / (n - 1)) / total
    return Statistic(mean, float(error), n)


def weighted_quantile(values: np.ndarray, weights: np.ndarray, q: float) -> Statistic:
    """Quantile of a weighted sample; the standard error is half the spread of the quantiles q +- sqrt(q (1 - q) /
    n_effective)."""
    order = np.argsort(values, kind="stable")
    x, w = values[order], weights[order]
    cumulated = (np.cumsum(w) - 0.5 * w) / w.sum()
    effective = w.sum() ** 2 / (w**2).sum()
    width = np.sqrt(q * (1.0 - q) / effective)
    low, middle, high = np.interp([q - width, q, q + width], cumulated, x)
    return Statistic(float(middle), float(0.5 * (high - low)), len(x))


def apply(rule: str, table: dict[str, np.ndarray], moon: int, window: tuple[float, float] | None, seed: int) -> Choice:
    """Speed and angle by ``rule`` from the constructed collisions with ``moon``.

    ``window``: only impacts at |latitude| within it [rad] give the angle (the mean angle depends on the latitude,
    Winter 2017, table 7). Raises ``InputError`` when no impact is left.
    """
    check(rule)
    hits = encounters.select(table, (table["event"] == COLLISION) & (table["moon"] == moon) & (table["direct"] == 0))
    match = _RULE.fullmatch(rule)
    subset = match["subset"] if match else "all"
    if subset != "all":
        hits = encounters.select(hits, hits["retrograde"] == (subset == "retrograde"))
    inside = np.ones(len(hits["speed"]), bool)
    if window is not None:
        latitude = np.abs(encounters.latitude(hits))
        inside = (latitude >= window[0]) & (latitude <= window[1])
    if not inside.any():
        raise InputError(f"the rule {rule!r} finds no impact among {len(inside)}: ask for more encounters")
    speed, weight = hits["speed"], hits["weight"]
    if match is None:  # draw one
        fraction = weight[inside] / weight[inside].sum()
        row = np.flatnonzero(inside)[
            np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2,))).choice(inside.sum(), p=fraction)
        ]
        return Choice(
            Statistic(float(speed[row]), float("nan"), 1), Statistic(float(hits["angle"][row]), float("nan"), 1)
        )
    angle = weighted_mean(hits["angle"][inside], weight[inside])
    if match[1] == "mean":
        return Choice(weighted_mean(speed, weight), angle)
    if match["q"] is not None:
        return Choice(weighted_quantile(speed, weight, float(match["q"])), angle)
    extreme = speed.max() if match[1] == "maximum" else speed.min()
    return Choice(Statistic(float(extreme), float("nan"), len(speed)), angle)
