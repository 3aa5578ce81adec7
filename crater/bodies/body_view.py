"""A body of any shape that the reader turns, inside the page: its ground before or after the impact, coloured by the
change of height along the normals or by how deep it is resurfaced.

The numbers go into the page as a few arrays of bytes (some 20 per point), drawn by ``body_view.js`` in the reader's
browser (``crater.drawing.turning_view``).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from crater.bodies.body_findings import BodyStage
from crater.bodies.height_map import HeightMap
from crater.drawing import turning_view
from matter.solids.body_shape import Points
from matter.wording import drawing, readable

MOST_POINTS = 10_000
"""More points of the surface than these are thinned out, so that a page stays below half a megabyte."""
_STEPS, _CORNERS = 32_767, 65_535


def of_stage(stage: BodyStage, title: str) -> str:
    """The body after a ``stage``, called ``title``, as HTML; empty where matplotlib, whose colours it takes, is not
    installed, and for a mesh of more corners than two bytes count."""
    if not drawing.has():
        return ""
    chart = coarsened(stage)
    return html(data(stage, chart), title) if len(chart.points.position) <= _CORNERS else ""


def data(stage: BodyStage, chart: HeightMap) -> dict[str, Any]:
    """What the viewer draws of the map ``chart``, in the body's own frame.

    Corners ``before`` and ``after`` (n, 3) in 1 / 32767 of ``half`` [m], the body's largest distance from its centre,
    ``triangles`` (m, 3) of them; of each corner the byte of its ``change`` of height, from -``limit`` to ``limit``
    [m], and of the depth to which it is resurfaced (``resurfaced``), from 0 to ``deepest`` [m]. ``site`` (3,): where
    the impact was.
    """
    turn = stage.compared.shape.placed.turn
    ends = [chart.ground(after) @ turn for after in (False, True)]
    half = max(float(np.linalg.norm(end, axis=1).max()) for end in ends)
    limit = max(float(np.quantile(np.abs(chart.change), 0.998)), 1e-9)
    deepest = max(float(chart.deep.max()), float(chart.spacing.min()))
    top = turning_view.COLOURS - 1
    change = np.round(top * np.clip(0.5 + 0.5 * chart.change / limit, 0.0, 1.0)).astype(np.uint8)
    resurfaced = np.round(top * np.clip(chart.deep / deepest, 0.0, 1.0)).astype(np.uint8)
    counts = [np.round(_STEPS * end / half).astype("<i2") for end in ends]
    return {
        "half": half, "limit": limit, "deepest": deepest,
        "before": turning_view.text(counts[0]), "after": turning_view.text(counts[1]),
        "triangles": turning_view.text(chart.points.triangles.astype("<u2")),
        "change": turning_view.text(change), "anew": turning_view.text(resurfaced),
        "site": (np.array([0.0, 0.0, stage.compared.shape.placed.height]) @ turn / half).tolist(),
        "colours": {"change": turning_view.colours("RdBu_r"), "anew": turning_view.colours("YlOrBr")},
    }  # fmt: skip


def html(content: Mapping[str, Any], title: str) -> str:
    """The viewer with its data."""
    scale, unit = readable.length_unit(max(content["limit"], content["deepest"]))
    words = (
        f"{title}, in three dimensions, {readable.length(2.0 * content['half'])} from end to end. Black line: axis of "
        "the body's own frame, on which it turned before; red line: the site of the impact. Drag to turn, scroll or "
        "pinch to zoom, double-click to reset."
    )
    facts = {**content, "scale": scale, "unit": unit}
    return turning_view.render("crater/bodies/templates/body_view.html.j2", words, facts, Path(__file__))


def coarsened(stage: BodyStage) -> HeightMap:
    """The map, or what it says at fewer points."""
    chart = stage.compared.chart
    n = len(chart.points.position)
    if n <= MOST_POINTS:
        return chart
    near = cKDTree(chart.points.position)

    def spread_points(wider: float) -> Points:
        """Points that are this much further apart."""
        return stage.compared.shape.surface_points(lambda position: wider * chart.spacing[near.query(position)[1]])

    wider, fewer = np.sqrt(n / MOST_POINTS), chart.points
    for _ in range(6):  # a mesh of many facets has no fewer corners than these
        wider *= 1.2
        fewer = spread_points(wider)
        if len(fewer.position) <= MOST_POINTS:
            break
    _, here = near.query(fewer.position)
    return HeightMap(fewer, chart.spacing[here], chart.before[here], chart.after[here], chart.noise, chart.deep[here])
