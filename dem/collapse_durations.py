"""How long a collapse is followed and how often it is looked at when a case does not say it, in units of the crater's
formation time T (``matter.case.formation_time``; under gravity alone, since what strength holds is not followed with
loose grains).

    earliest end    5 T       walls have slumped and waves in the bed have died: at Valhalla's size an hour
    latest end      10 T
    still           5/6 T     a profile that stays that long stays
    snapshots       T / 6
    history         a twelfth of that
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from matter.case import at_rest, formation_time

END, LATEST, STILL, SNAPSHOT, HISTORY = 5.0, 10.0, 5.0 / 6.0, 1.0 / 6.0, 1.0 / 12.0
UNKNOWN = 720.0
"""T [s] where no impact is known: a stage that is used alone, from Python."""


def crater_times(given: Mapping[str, Any], factor: float) -> float:
    """``factor`` times T [s], from the validated ``target``, ``impact`` and ``densities`` of the settings."""
    target, impact = given.get("target"), given.get("impact")
    if target is None or impact is None:
        return factor * UNKNOWN
    gravity = at_rest.surface_gravity(target, given.get("densities", {}))
    time = formation_time.of_crater(impact.expected_transient_diameter, gravity)
    if not math.isfinite(time):  # told by the settings' own check: a default raises nothing
        return factor * UNKNOWN
    return float(f"{factor * time:.2g}")
