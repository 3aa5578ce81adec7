"""Measured crush curve alpha_m(P_m) as a table (Benz & Jutzi 2007, section 3.1), linear between its points.

    (alpha - 1) / (alpha_s - 1) = (alpha_m(P) - 1) / (alpha_m(P_1) - 1)

Pressures ascend, distentions descend and end at 1: crushing starts at the first pressure and is complete at the last.
"""

from typing import NamedTuple

from matter.case.quantity import PositivePressure
from matter.compilation.jit import law

MOST = 32  # points


SOURCES = ("BenzJutzi2007",)
Row = None
WIDTH = 1 + 2 * MOST


class Parameters(NamedTuple):
    """``pressures`` [Pa] and ``distentions``, equally many, 2 to 32."""

    pressures: tuple[PositivePressure, ...]
    distentions: tuple[float, ...]


EXAMPLE = Parameters((1e6, 5e6, 2e7, 1e8), (1.8, 1.5, 1.2, 1.0))


def fault(p: Parameters) -> str:
    """What is wrong with the values together, or nothing."""
    count = len(p.pressures)
    if count != len(p.distentions) or not 2 <= count <= MOST:
        return (
            f"pressures and distentions must be lists of one length, 2 to {MOST}; they have {count} and "
            f"{len(p.distentions)}"
        )
    if any(b <= a for a, b in zip(p.pressures, p.pressures[1:])):
        return "pressures must ascend"
    if any(b >= a for a, b in zip(p.distentions, p.distentions[1:])) or p.distentions[-1] != 1.0:
        return "distentions must descend and end at 1"
    return ""


def row(p: Parameters) -> list[float]:
    """Count, pressures (32 values), openness (32 values): what the compiled laws read."""
    pad = [0.0] * (MOST - len(p.pressures))
    scale = p.distentions[0] - 1.0
    return [float(len(p.pressures)), *p.pressures, *pad, *((a - 1.0) / scale for a in p.distentions), *pad]


@law
def _interval(P, t):
    """Index of the last point at or below P."""
    low, high = 0, int(t[0]) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if t[1 + middle] <= P:
            low = middle
        else:
            high = middle
    return low


@law
def onset(t):
    """The pressure [Pa] at which crushing starts."""
    return t[1]


@law
def openness(P, t):
    """(alpha - 1) / (alpha_s - 1) at pressure P [Pa]; ``t`` as ``row`` makes it."""
    last = int(t[0]) - 1
    if P <= t[1]:
        return 1.0
    if P >= t[1 + last]:
        return 0.0
    i = _interval(P, t)
    fraction = (P - t[1 + i]) / (t[2 + i] - t[1 + i])
    return (1.0 - fraction) * t[1 + MOST + i] + fraction * t[2 + MOST + i]


@law
def slope(P, t):
    """Its derivative with P [1/Pa], <= 0; at a point that of the piece above."""
    last = int(t[0]) - 1
    if P < t[1] or P >= t[1 + last]:
        return 0.0
    i = _interval(P, t)
    return (t[2 + MOST + i] - t[1 + MOST + i]) / (t[2 + i] - t[1 + i])
