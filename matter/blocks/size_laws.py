"""Diameters of blocks, drawn as a whole before any is placed: sizes drawn while placing would favour the small ones
that still find room.

    power_law   N(>D) = (D^-a - D2^-a) / (D1^-a - D2^-a)                        D1 <= D <= D2
    weibull     N(>D) = (w(D) - w(D2)) / (w(D1) - w(D2)),   w = exp(-(D / scale)^shape)
    equal       D = D2

D1 ``smallest``, D2 ``largest``, a ``index``. A diameter is where N(>D) is a uniform random number u in (0, 1]. The
last block takes what is left of the volume where that is no less than the smallest; with a < 3 most of the volume is
in the few largest, and the draw decides more than the law.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from matter.case.block_tables import Blocks
from matter.errors import InputError

SOURCES = ("MichikamiHagermann2021",)
MOST = 200_000
"""Most blocks that are drawn."""
_AT_ONCE = 4096


def quantile(table: Blocks) -> Callable[[np.ndarray], np.ndarray]:
    """The function that gives diameters (n,) [m] from fractions N(>D) (n,) in (0, 1]."""
    assert table.largest is not None
    most = table.largest
    if table.law == "equal":
        return lambda u: np.full(len(u), most)
    assert table.smallest is not None
    least = table.smallest
    if table.law == "power_law":
        assert table.index is not None
        a, end = table.index, (least / most) ** table.index
        return lambda u: least * (end + u * (1.0 - end)) ** (-1.0 / a)
    assert table.scale is not None and table.shape is not None
    scale, shape = table.scale, table.shape
    first, last = math.exp(-((least / scale) ** shape)), math.exp(-((most / scale) ** shape))
    if first <= 0.0 or first == last:
        raise InputError(
            f"[target.blocks] scale: a Weibull law of {scale:.4g} m has no blocks between smallest and largest"
        )
    return lambda u: scale * (-np.log(last + u * (first - last))) ** (1.0 / shape)


def drawn(table: Blocks, volume: float, rng: np.random.Generator) -> np.ndarray:
    """Diameters (n,) [m], falling, of blocks of this ``volume`` [m^3] together, to half the smallest block.

    Raises ``InputError`` where that takes more than ``MOST`` blocks.
    """
    if table.law == "list" or volume <= 0.0:
        return np.zeros(0)
    of = quantile(table)
    found, sofar = np.zeros(0), 0.0
    while sofar < volume:
        more = of(1.0 - rng.random(_AT_ONCE))
        found, sofar = np.concatenate([found, more]), sofar + math.pi / 6.0 * float((more**3).sum())
        if len(found) > MOST + _AT_ONCE:
            raise InputError(
                f"[target.blocks] volume_fraction: it takes more than {MOST:,} blocks; make smallest larger, or the "
                "blocks lie within a shorter distance"
            )
    volumes = np.cumsum(math.pi / 6.0 * found**3)
    whole = int(np.searchsorted(volumes, volume, side="right"))  # these fit in as they are
    rest = volume - (float(volumes[whole - 1]) if whole else 0.0)
    sizes = found[:whole]
    diameter = (6.0 * rest / math.pi) ** (1.0 / 3.0)
    if table.law == "equal":
        if rest >= math.pi / 12.0 * float(found[0]) ** 3:
            sizes = found[: whole + 1]
    elif diameter >= float(table.smallest or 0.0):
        sizes = np.append(sizes, diameter)
    return np.sort(sizes)[::-1]
