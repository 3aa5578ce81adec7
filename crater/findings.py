"""What the stage has found so far, and the impact behind it as the scaling laws take it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from crater import heads, scaling, series
from crater.ballistic import Ballistic
from crater.choices import Choices
from crater.measure import Measures, Quantity
from crater.rest import UNKNOWN, Rest
from matter import archive, material, snapshot

if TYPE_CHECKING:
    from crater.stage import Settings


@dataclass
class Findings:
    """What the stage found, for the files, pictures and the page."""

    settings: Settings
    inputs: Path
    moments: list[series.Moment] = field(default_factory=list)
    transient: dict[str, series.Moment] = field(default_factory=dict)
    late_sph: Measures | None = None
    late_sph_time: float = float("nan")
    final: Measures | None = None
    final_time: float = float("nan")
    final_from: str = ""
    final_path: Path = Path()
    late_path: Path = Path()
    rest: Rest = UNKNOWN
    chosen: dict[str, Choices] = field(default_factory=dict)
    """What the measuring of each stage (sph, dem) stands on."""
    leaving: dict[str, float] = field(default_factory=dict)
    ejecta: dict[str, Any] = field(default_factory=dict)
    launch: dict[str, Any] = field(default_factory=dict)
    growing: list[str] = field(default_factory=list)
    gravity: float = float("nan")
    densities: tuple[float, float] = (float("nan"), float("nan"))
    """Of the projectile and of the ground at its surface [kg/m^3]."""
    reasons: dict[str, str] = field(default_factory=dict)
    soundness: dict[str, Any] = field(default_factory=dict)
    """Resolution, pressures and cautions (``crater.soundness.facts``)."""
    scaling: dict[str, Any] = field(default_factory=dict)
    reference: list[dict[str, Any]] = field(default_factory=list)
    late_difference: dict[str, Any] | None = None
    ballistic: Ballistic | None = None
    """Free flight of what was handed over, on flat ground under gravity."""


def densities(found: Findings, first: Path | None) -> tuple[float, float]:
    """Densities of projectile and ground [kg/m^3] as the shock stage began with them (pores, changed materials); of their materials where it left none."""
    ball = material.reference_density(found.settings.impact.projectile.material)
    ground = material.reference_density(found.settings.target.layers[-1].material)
    path = found.inputs / "2_sph" / "target.json"
    if path.is_file():
        ground = archive.read_json(path).get("profile", {}).get("density_kg_m3", [ground])[-1]
    if first is not None:
        begun = snapshot.read(first)
        mine = begun.layer < 0 if {"layer", "density", "mass"} <= set(begun) else np.zeros(0, dtype=bool)
        if mine.any():
            ball = float(begun.mass[mine].sum() / (begun.mass[mine] / begun.density[mine]).sum())
    return ball, float(ground)


def strike(found: Findings) -> scaling.Strike:
    """The impact as the scaling laws take it; ``found`` has its densities and its gravity."""
    impact = found.settings.impact
    return scaling.Strike(impact.projectile.radius, impact.speed, impact.angle_from_vertical, found.gravity, *found.densities)


def time_of(found: Findings, moment: series.Moment) -> Quantity:
    """Time of a moment, with half the interval between snapshots as its error."""
    times = np.array([m.time for m in found.moments if m.stage == moment.stage])
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return Quantity(moment.time, 0.5 * step, "s", parts={"interval between snapshots": 0.5 * step})


def final_entry(found: Findings) -> dict[str, Any]:
    """When and from what the last column is, and whether its crater is at rest, as ``measures.json`` says it."""
    return {"time_s": Quantity(found.final_time, 0.0, "s").as_dict(), "from": found.final_from, **found.rest.as_dict()}


def columns(found: Findings, moments: tuple[str, ...] = heads.MOMENTS) -> list[tuple[heads.Head, Measures]]:
    """Every crater that was measured under its head: transient, the shock stage's own end, final."""
    # after the collapse a wide trough may look widest: measured closely it has no diameter, and no maximum of it
    seen = [(key, found.transient[key]) for key in moments if key in found.transient and found.transient[key].value(series.MAXIMA[key]) > 0.0]
    shots = [heads.Moment(key, m.time, m.stage, key in found.growing, m.measures) for key, m in seen if m.measures is not None]
    result = heads.arranged(shots, found.final_time if found.final is not None else None)
    if found.late_sph is not None and found.late_sph is not found.final:
        result.append((heads.Head("late_sph", "final", "all-SPH late stage", heads.when(found.late_sph_time, "SPH")), found.late_sph))
    if found.final is not None:
        result.append((heads.final(final_entry(found)), found.final))
    return result
