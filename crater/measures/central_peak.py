"""The central peak of a complex crater, read off its mean profile.

    floor       the lowest ring inside the apparent radius
    peak        the highest ring inside the floor
    height      of the peak over the floor
    radius      where the profile, from the peak outwards, has come down to half of that height: half of the peak's
                width, which its foot in a rough floor does not decide

A profile that falls from its middle to the floor has its peak on the axis; a ring of hills has it off the axis, and
the radius is then that of its outer slope.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class CentralPeak(NamedTuple):
    """Height over the floor, radius at half of it, and distance of the floor from the axis [m]; height 0 and radius
    NaN of a floor without any."""

    height: float
    radius: float
    floor: float


def central_peak(s: np.ndarray, h: np.ndarray, apparent: float) -> CentralPeak:
    """The peak of the heights ``h`` (rings,) over the datum at the distances ``s`` from the axis [m], inside the
    ``apparent`` radius [m]; NaNs where no ring lies inside."""
    inside = np.flatnonzero((s < apparent) & np.isfinite(h))
    if len(inside) == 0:
        return CentralPeak(float("nan"), float("nan"), float("nan"))
    floor = inside[int(np.argmin(h[inside]))]
    within = inside[inside <= floor]
    top = within[int(np.argmax(h[within]))]
    height = float(h[top] - h[floor])
    if height <= 0.0:
        return CentralPeak(0.0, float("nan"), float(s[floor]))
    slope = within[within >= top]
    level = float(h[floor]) + 0.5 * height
    last = int(np.flatnonzero(h[slope] >= level)[-1])
    a, b = slope[last], slope[last + 1]
    radius = s[a] + (s[b] - s[a]) * (h[a] - level) / (h[a] - h[b])
    return CentralPeak(height, float(radius), float(s[floor]))
