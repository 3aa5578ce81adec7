"""``[target] arrival``: the direction in which the projectile flies, in the frame of an ellipsoid or mesh, instead of
``azimuth``, ``[impact] angle_from_vertical`` and, where they are left out too, ``latitude`` and ``longitude``.

What follows from it is filled in, so that a document that has been completed once says the same again.
"""

from __future__ import annotations

import math
from typing import Any

from pydantic import ValidationError

from matter.case import quantity
from matter.case.body import SOLIDS, Target
from matter.case.quantity import REQUIRED
from matter.errors import InputError
from matter.solids import arrival_geometry
from pipeline.case.complaints import Complaint

SAME = math.radians(1e-6)
"""Angles [rad] that differ by less are the same."""


def filled(document: dict[str, Any]) -> tuple[dict[str, Any], list[Complaint]]:
    """The document with the site and the angles of its ``arrival``, and what speaks against them. One without, or
    with mistakes that others tell, is left as it is."""
    target, impact = document["target"], document["impact"]
    if "arrival" not in target or target.get("shape") not in SOLIDS:
        return document, []
    site = [key for key in ("latitude", "longitude") if key in target]
    if len(site) == 1:
        return document, [Complaint(("target", site[0]), "with an arrival give both, latitude and longitude, or none")]
    try:
        body = Target.model_validate(
            {key: value for key, value in target.items() if key != "azimuth"}, context=REQUIRED
        )
        own = body.model_copy(update={"latitude": 0.0, "longitude": 0.0}).placed
        solid = own.solid.turned(own.turn.T)
        assert body.arrival is not None
        found = arrival_geometry.arrival(
            solid, body.arrival, *((body.latitude, body.longitude) if site else (None, None))
        )
    except InputError as reason:
        return document, [Complaint(("target", "arrival"), str(reason))]
    except (ValidationError, TypeError, AttributeError, KeyError, AssertionError):
        return document, []
    complaints: list[Complaint] = []
    for table, key in (("target", "azimuth"), ("impact", "angle_from_vertical")):
        given, angle = document[table].get(key), getattr(found, key)
        if given is not None and not _same(given, angle):
            complaints.append(
                Complaint(
                    (table, key), f"{math.degrees(angle):.6g} deg follows from [target] arrival: leave one of them out"
                )
            )
    filled_in = {key: f"{math.degrees(getattr(found, key))!r} deg" for key in ("latitude", "longitude", "azimuth")}
    return {
        **document,
        "target": {**filled_in, **target},
        "impact": {"angle_from_vertical": f"{math.degrees(found.angle_from_vertical)!r} deg", **impact},
    }, complaints


def _same(given: Any, angle: float) -> bool:
    try:
        value = quantity.parse(given) if isinstance(given, str) else float(given)
    except (ValueError, TypeError):
        return True  # told as a mistake of its own
    return abs(math.remainder(value - angle, 2.0 * math.pi)) < SAME
