"""What a run of grains that are a whole body takes besides: their own pull, the companion's tide, how the body turns.

The run is in the inertial frame that falls with the body's centre of mass (``dem.grains.turning_frame``); profiles are
looked at where the body rests (``dem.beds.whole_body_bed.PoseTracker``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from dem.beds.solid_bed import axes_of_inertia
from dem.beds.solid_body import SolidBody
from dem.beds.whole_body_bed import PoseTracker, WholeBody
from dem.collapse import escaping_grains
from dem.collapse.origins import Origins
from dem.grains import cached_gravity
from dem.grains.assembly import Assembly
from dem.grains.cached_gravity import ExternalForce
from dem.grains.self_gravity import SelfGravity
from dem.settings import Settings
from matter.errors import InputError

Region = TypeVar("Region")


def check(settings: Settings) -> None:
    """Raise ``InputError`` for what needs gravity of a known field."""
    if settings.engine != "native":
        raise InputError(
            f'[dem] engine = "{settings.engine}" knows no grains that attract each other: a whole body needs "native"'
        )
    if settings.stiffness != "fixed":
        raise InputError(
            'stiffness = "following" goes by the weight of a bed on a floor: leave it out on an ellipsoid or mesh'
        )


def forces(body: object, settings: Settings) -> tuple[SelfGravity | None, tuple[ExternalForce, ...]]:
    """The pull of the grains on each other and what acts besides; nothing on other ground."""
    if not isinstance(body, SolidBody):
        return None, ()
    check(settings)
    tide = body.tide(turning=False)
    return SelfGravity(), () if tide is None else (tide,)


def with_hill_sphere(domain: Region, body: object) -> Region:
    """The ``domain`` of a whole body, given the Hill radius of the ``body``; any other as it is."""
    if isinstance(domain, WholeBody) and isinstance(body, SolidBody):
        return replace(domain, hill_radius=body.hill_radius)
    return domain


def leaving_of(
    bed: Assembly, tracker: PoseTracker | None, shot: Mapping[str, Any] | None, origins: Origins
) -> dict[str, Any]:
    """What leaves a whole body, as it stands (``dem.collapse.escaping_grains``); nothing of other ground."""
    return {} if tracker is None else escaping_grains.report(bed, shot, origins.blocks(bed.identity))


def report(
    bed: Assembly, tracker: PoseTracker | None, shot: Mapping[str, Any] | None, origins: Origins, begun: dict[str, Any]
) -> dict[str, Any]:
    """What stands in the report of a whole body: its rotation, its axes, what was taken out of the pull, and what
    leaves it; ``shot`` as the start has it, ``origins`` of the grains, ``begun`` what left it then
    (``dem.collapse.escaping_grains``)."""
    if tracker is None:
        return {}
    k, escaping = slice(0, bed.active), leaving_of(bed, tracker, shot, origins)
    if bed.active < 4:  # it has come apart
        return {
            "pull_removed_over_weight": float(bed.pull_state[cached_gravity.WORST]),
            "escaping": escaping,
            "escaping_at_start": begun,
        }
    return {
        "angular_velocity_1_s": cached_gravity.angular_velocity(bed).tolist(),
        "axes_of_inertia_m": axes_of_inertia(bed.mass[k], bed.position[k]).tolist(),
        "turned": tracker.now(bed)[1].tolist(),
        "pull_interval_s": bed.pull_interval,
        "pull_removed_over_weight": float(bed.pull_state[cached_gravity.WORST]),
        "work_of_companion_J": float(bed.pull_state[cached_gravity.WORK]),
        "escaping": escaping,
        "escaping_at_start": begun,
    }
