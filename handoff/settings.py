"""Settings of the handoff: every key of ``[handoff]`` in a case file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from handoff.ledger import check_waivers
from handoff.source import cloud_surface
from handoff.transfer import control as controls
from matter.case import at_rest, formation_time
from matter.case.at_rest import Densities
from matter.case.body import Impact, Target
from matter.case.identity_fields import Follows, NotIdentity
from matter.case.quantity import PositiveTime

LATEST = 10.0
"""Formation times of the crater at which a collapse ends at the latest, by default."""


def _until(given: Mapping[str, Any]) -> float | None:
    """Default of ``until`` from the validated ``target``, ``impact`` and ``densities``; None but for an ellipsoid or
    mesh."""
    target, impact = given.get("target"), given.get("impact")
    if target is None or impact is None or not target.solid:
        return None
    gravity = at_rest.surface_gravity(target, given.get("densities", {}))
    return float(f"{LATEST * formation_time.of_crater(impact.expected_transient_diameter, gravity):.2g}")


class Settings(cloud_surface.Rules):
    """The handoff's own table ``[handoff]`` in a case file."""

    target: Annotated[Target | None, NotIdentity()] = None
    """The body or ground that is hit, ``[target]``: its surface, where that is neither plane nor round."""
    impact: Annotated[Impact | None, NotIdentity()] = None
    """How the projectile hits, ``[impact]``."""
    densities: Densities = Field(default_factory=dict)
    """Materials that the case makes denser or lighter than their files."""
    until: Annotated[PositiveTime | None, Follows()] = Field(default_factory=lambda given: _until(given))
    """On an ellipsoid or mesh: ejecta that come back later than this after the impact stay in the list, as those that
    escape; ``[dem] latest_time``, or its default of ten formation times."""

    time: PositiveTime | Literal["auto", "last"] = "auto"
    """``auto`` by the rule of ``handoff.source.handoff_time``; ``last`` snapshot; or a time after the impact (the
    nearest snapshot is taken)."""
    method: Literal["mapped", "direct"] = "mapped"
    """``mapped``: the settled bed takes over the flow; ``direct``: every SPH particle becomes a grain (see
    ``handoff.transfer.direct``). The report compares both."""
    control: controls.Kind = "none"
    """A control run instead: ``at_rest``, the carved bed without motion or ejecta; ``uncarved``, the bed carved at the
    datum (the ledger is the handoff's)."""
    waive: Mapping[str, str] = Field(default_factory=dict)
    """Ledger rows that do not bind this case, each with its reason."""
    particles: Annotated[int, Field(gt=0), NotIdentity(), Follows()] = 15_000
    """Size of the source, for the prediction of ``--check`` only."""
    grains: Annotated[int, Field(gt=0), NotIdentity(), Follows()] = 20_000
    """Size of the bed, for the prediction of ``--check`` only."""
    snapshots: Annotated[int, Field(gt=0), NotIdentity(), Follows()] = 61
    """Number of source snapshots, for the prediction of ``--check`` only."""

    @field_validator("waive")
    @classmethod
    def _waivable(cls, value: Mapping[str, str]) -> Mapping[str, str]:
        check_waivers(value)
        return value
