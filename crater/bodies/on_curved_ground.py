"""A crater that was measured in ground laid flat (``matter.solids.tangent_map``), as it is on the body.

What lies at the height h over its foot is (1 + h k)^2 of what flat ground holds there, with k the mean curvature of
the surface, so that a column of height h holds

    h (1 + h k + (h k)^2 / 3)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from crater.measures.measure import Measures
from matter.solids.tangent_map import TangentMap


def on_body(ground: TangentMap, measures: Measures) -> Measures:
    """The measures of a crater in flat ground with the volume that it has on the body."""
    volume, size = measures["volume_m3"], measures["diameter_apparent_m"].value
    if volume.value is None or volume.sigma is None or size is None:
        return measures
    columns, h = measures.ground.columns, measures.ground.rays
    ring = columns.ring
    area = (np.diff(columns.edges)[ring] * columns.distance[ring]) / columns.count[ring]
    below = np.isfinite(h) & (h < 0.0) & (columns.distance[ring] < 0.5 * size)
    h, area = h[below], area[below]
    if not len(h):
        return measures
    bent = h * ground.curvature(0.5 * size)
    factor = float((area @ (h * (1.0 + bent + bent**2 / 3.0))) / (area @ h))
    parts = {name: factor * part for name, part in volume.parts.items()}
    told = replace(volume, value=factor * volume.value, sigma=factor * volume.sigma, parts=parts)
    return replace(measures, quantities={**measures.quantities, "volume_m3": told})
