"""When to hand over: a diagnosis of every source snapshot, and the rule that picks one.

Measured at each snapshot, over the compact matter in the bed's domain: radius, depth and volume of the cavity; excess
pressure over bulk modulus (the shock that is left); kinetic energy; damaged and ejected mass; and the *drive*: the
mean acceleration between this snapshot and the one before, over gravity, weighted by m |v|. In hydrostatic balance the
pressure gradient carries the weight and nothing accelerates, so the acceleration itself measures every force beyond
that balance: far above 1 g the flow is driven by the shock, at 1 g and below it is a flow under gravity, which is what
grains can take over.

The rule, first that holds:

1. the window ``shock has left (99 % of the domain below 1e-3 K) ... 0.1 T``, with T = 0.8 sqrt(V^(1/3) / g) and V the
   largest cavity volume, holds a snapshot whose cavity is resolved (a radius of 5 grain radii, a depth of more than 2:
   ``cavity.resolved``): the first such. (On small bodies the window is wide.)
2. the first snapshot with a resolved cavity whose drive, and that of all later snapshots up to the first maximum of
   depth, is at most ``DRIVE``.
3. the first maximum of depth.

Never after the first maximum of depth: from there on the cavity collapses, and collapse is the grains' part. Snapshots
are looked at until three have followed it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from handoff.domains.domain import Domain
from handoff.source import cavity, cloud_surface, shock
from handoff.source.hydrostatic import Column
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from matter.wording import readable

DRIVE = 1.0
QUIET = 1e-3
EARLY = 0.1
_LATER = 3

FIELDS = (
    "identity", "position", "velocity", "mass", "density", "material", "layer", "smoothing_length", "neighbours",
    "distention", "damage", "pressure",
    "deviatoric_stress", "sound_speed",
)  # fmt: skip
"""What a diagnosis reads of a snapshot, as far as it is there."""


@dataclass(frozen=True)
class Diagnosis:
    """One snapshot: lengths in m, volume in m^3, time in s, energy in J, mass in kg; ``drive`` in g (NaN at the first
    snapshot)."""

    file: str
    time: float
    radius: float
    depth: float
    volume: float
    rim_height: float
    excess_pressure: float
    excess_pressure_most: float
    kinetic: float
    elastic: float
    ejected: float
    damaged: float
    drive: float


@dataclass(frozen=True)
class Choice:
    """The snapshot taken, why, what the window of rule 1 was (start and end [s]; empty when start > end), and the
    first maximum of depth."""

    index: int
    reason: str
    window: tuple[float, float]
    series: tuple[Diagnosis, ...]
    deepest: int

    @property
    def window_is_empty(self) -> bool:
        """Whether no snapshot with a resolved cavity lies in the window of rule 1."""
        return not self.window[0] <= self.series[self.index].time <= self.window[1]

    def as_table(self) -> dict:
        """Plain numbers for ``handoff.json``."""
        names = list(Diagnosis.__dataclass_fields__)
        rows = [asdict(row) for row in self.series]
        return {
            "chosen": self.series[self.index].file,
            "time_s": self.series[self.index].time,
            "reason": self.reason,
            "window_s": list(self.window),
            "first_maximum_of_depth_s": self.series[self.deepest].time,
            "series": {name: [row[name] for row in rows] for name in names},
        }


def diagnose(
    source: Particles, earlier: Particles | None, file: str, domain: Domain, column: Column, rules: cloud_surface.Rules
) -> Diagnosis:
    """Measure one snapshot; ``earlier`` is the snapshot before it."""
    split = cloud_surface.by_motion(source, domain, column, rules)
    compact = np.flatnonzero(split.compact)
    here = compact[domain.depth_inside(source.position[compact]) > 0.0]
    time = float(source.attributes.get("time", 0.0))
    if len(compact) < 4 or len(here) == 0:
        nothing = float("nan")
        return Diagnosis(
            file, time, 0.0, 0.0, 0.0, 0.0, nothing, nothing, 0.0, 0.0, float(source.mass.sum()), 0.0, nothing
        )
    size = cavity.of_particles(source.position[compact], split.spacing[compact], domain)
    inside = source.select(here)
    left = shock.residual(inside, domain, column)
    excess = left.pressure if left is not None else np.array([np.nan])
    ejecta, flow = ~split.compact, domain.flow(inside.position, inside.velocity)
    return Diagnosis(
        file,
        time,
        size.radius,
        size.depth,
        size.volume,
        size.rim_height,
        float(np.percentile(excess, 99)),
        float(np.max(excess)),
        0.5 * float(np.sum(inside.mass * np.einsum("ij,ij->i", flow, flow))),
        float(np.sum(left.elastic)) if left is not None else float("nan"),
        float(source.mass[ejecta].sum()),
        float(np.sum(inside.mass * inside.damage)) if "damage" in inside else float("nan"),
        _drive(source, here, earlier, domain, column),
    )


def _drive(source: Particles, here: np.ndarray, earlier: Particles | None, domain: Domain, column: Column) -> float:
    if earlier is None or "identity" not in source or "identity" not in earlier:
        return float("nan")
    step = float(source.attributes.get("time", 0.0)) - float(earlier.attributes.get("time", 0.0))
    order = np.argsort(earlier.identity)
    index = np.searchsorted(earlier.identity[order], source.identity[here])
    index = order[np.minimum(index, len(order) - 1)]
    same = earlier.identity[index] == source.identity[here]
    if step <= 0.0 or not same.any():
        return float("nan")
    mine, then = here[same], index[same]
    acceleration = np.linalg.norm(source.velocity[mine] - earlier.velocity[then], axis=1) / step
    weight = source.mass[mine] * np.linalg.norm(source.velocity[mine], axis=1)
    gravity = column.gravity_at(domain.frame.height(source.position[mine]))
    return float(np.sum(weight * acceleration) / np.sum(weight * gravity)) if weight.sum() > 0.0 else 0.0


def first_maximum(values: Sequence[float]) -> int:
    """Index of the first value above 0 that none of the next three exceeds (the last one when the values rise to the
    end)."""
    for k, value in enumerate(values):
        if value > 0.0 and value >= max(values[k + 1 : k + 1 + _LATER], default=value):
            return k
    return len(values) - 1


def decided(series: Sequence[Diagnosis]) -> bool:
    """Whether the first maximum of depth is known: no later snapshot can change the choice."""
    return first_maximum([row.depth for row in series]) + _LATER < len(series)


def choose(series: Sequence[Diagnosis], grain_radius: float, gravity: float) -> Choice:
    """Apply the rule to the diagnoses in order of time. Raises ``InputError`` when no snapshot has a cavity that
    grains resolve."""
    deepest = first_maximum([row.depth for row in series])
    volume = max(row.volume for row in series[: deepest + 1])
    crater_time = 0.8 * math.sqrt(volume ** (1.0 / 3.0) / gravity)
    # the shock enters, then leaves: quiet means quiet from then on
    loud = [k for k, row in enumerate(series[: deepest + 1]) if not row.excess_pressure <= QUIET]
    start = 0 if not loud else loud[-1] + 1
    window = (series[start].time if start < len(series) else math.inf, EARLY * crater_time)
    resolved = [k for k in range(deepest + 1) if cavity.resolved(series[k].radius, series[k].depth, grain_radius)]
    if not resolved:
        radius, depth = max(row.radius for row in series), max(row.depth for row in series)
        raise InputError(
            f"no snapshot up to the greatest depth has a cavity of {cavity.RESOLVED_RADIUS:.0f} grain radii that is "
            f"deeper than "
            f"{cavity.RESOLVED_DEPTH:.0f} (widest {readable.length(radius)}, deepest {readable.length(depth)}, grains "
            f"{readable.length(grain_radius)}): "
            "no crater, or grains too coarse"
        )
    shock = (
        f"the shock {'has left after' if start <= deepest else 'has not left by'} "
        f"{readable.clock(series[min(start, deepest)].time)}"
    )
    for k in resolved:
        if window[0] <= series[k].time <= window[1]:
            return Choice(
                k, f"window: {shock}, and 0.1 T = {readable.clock(window[1])}", window, tuple(series), deepest
            )
    empty = f"the window of valid times is empty ({shock}, 0.1 T = {readable.clock(window[1])})"
    for k in resolved:
        if all(row.drive <= DRIVE for row in series[k : deepest + 1]):
            return Choice(
                k,
                f"{empty}; from here on the flow is under gravity: drive {series[k].drive:.3g} g",
                window,
                tuple(series),
                deepest,
            )
    return Choice(
        deepest, f"{empty}, the flow is driven up to the first maximum of depth", window, tuple(series), deepest
    )


def files(folder: Path) -> list[Path]:
    """Source snapshots in order of time: the numbered ones, or ``last.vtkhdf`` alone. Raises ``InputError`` when there
    are none."""
    paths = snapshot.series(folder)
    if not paths and (folder / f"last{snapshot.SUFFIX}").is_file():
        paths = [folder / f"last{snapshot.SUFFIX}"]
    if not paths:
        raise InputError(f"no snapshots of the shock stage in {folder}")
    return paths
