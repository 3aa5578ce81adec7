"""What the shock stage's snapshots say beyond the shape of the crater: matter in the air, damage about the crater, and
what lies under it.

Heights are over the sphere of ``target.json``; the undisturbed places of particles are the snapshots' own
``initial_position``.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from crater.ground import datum as datums
from crater.ground.datum import Datum
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.particles import Particles

AIRBORNE = 2.0
"""Matter higher than this many spacings (one smoothing length) over the datum counts as ejecta in the air."""
FEWEST = 12
"""Particles in a bin of distance, at least."""
FILE = "interior.json"
TOP = 0.4
"""Share of the shell, from the surface down, that counts as surface ice."""


def follow(run: Path, radius: float, heard: Callable[[Path], None] | None = None) -> list[dict[str, float]]:
    """One row of plain numbers per snapshot of a run: ``airborne``, ``projectile_depth`` and ``interface`` together.

    ``radius`` [m] is the apparent radius of the transient crater, within which the ocean's surface is followed. Raises
    ``InputError`` when the run has no shock stage.
    """
    facts = target_facts(run)
    ground = datums.sphere(facts["radius_m"], source="radius of the target")
    rows = []
    for path in snapshot.series(Path(run) / "2_sph"):
        particles = snapshot.read(path)
        spacing = float(particles.attributes["spacing_at_impact_m"])
        rows.append(
            {
                "time_s": float(particles.attributes["time"]),
                **airborne(particles, ground, AIRBORNE * spacing),
                **projectile_depth(particles, ground, facts["shell_m"]),
                **interface(particles, ground, facts["shell_m"], radius, spacing),
            }
        )
        if heard is not None:
            heard(path)
    if not rows:
        raise InputError(f"{run} holds no snapshots of the shock stage")
    return rows


def write(run: Path, radius: float, time: float, out: Path, heard: Callable[[Path], None] | None = None) -> None:
    """Write ``interior.json``: the rows of ``follow``, and damage against distance at the snapshot nearest to ``time``
    [s], if one is within 30 s of it."""
    rows = follow(run, radius, heard)
    facts = target_facts(run)
    times = np.array([row["time_s"] for row in rows])
    nearest = int(np.argmin(np.abs(times - time)))
    damage: dict[str, Any] | None = None
    if abs(times[nearest] - time) <= 30.0:
        particles = snapshot.read(snapshot.series(Path(run) / "2_sph")[nearest])
        s, mean = damage_by_distance(particles, datums.sphere(facts["radius_m"]), facts["shell_m"])
        damage = {
            "time_s": float(times[nearest]),
            "distance_m": s.tolist(),
            "mean": mean.tolist(),
            "annulus_m": undamaged_annulus(s, mean),
        }
    plain = [{name: value if np.isfinite(value) else None for name, value in row.items()} for row in rows]
    archive.write_text(Path(out) / FILE, json.dumps({"radius_m": radius, "rows": plain, "damage": damage}, indent=1))


def target_facts(run: Path) -> dict[str, float]:
    """``radius_m`` and ``shell_m`` (thickness of the outermost layer as it starts) from ``target.json``."""
    path = Path(run) / "2_sph" / "target.json"
    if not path.is_file():
        raise InputError(f"{path} is missing: run the shock stage first")
    content: dict[str, Any] = archive.read_json(path)
    outer = content["layers"][-1]
    return {
        "radius_m": float(content["radius_m"]),
        "shell_m": float(outer["outer_radius_m"] - outer["inner_radius_m"]),
    }


def airborne(particles: Particles, ground: Datum, above: float) -> dict[str, float]:
    """Number and mass [kg] of particles more than ``above`` [m] over the datum, target and projectile apart."""
    _, _, height = ground.polar(particles.position)
    up, foreign = height > above, particles.layer < 0
    return {
        "airborne_target": float((up & ~foreign).sum()),
        "airborne_projectile": float((up & foreign).sum()),
        "airborne_target_kg": float(particles.mass[up & ~foreign].sum()),
        "airborne_projectile_kg": float(particles.mass[up & foreign].sum()),
    }


def projectile_depth(particles: Particles, ground: Datum, shell: float) -> dict[str, float]:
    """Depth of the deepest projectile particle [m] and the share of the projectile's mass deeper than ``shell`` [m];
    NaN without a projectile."""
    foreign = particles.layer < 0
    if not foreign.any():
        return {"projectile_deepest_m": float("nan"), "projectile_below_shell": float("nan")}
    _, _, height = ground.polar(particles.position[foreign])
    mass = particles.mass[foreign]
    return {
        "projectile_deepest_m": float(-height.min()),
        "projectile_below_shell": float(mass[height < -shell].sum() / mass.sum()),
    }


def interface(particles: Particles, ground: Datum, shell: float, radius: float, spacing: float) -> dict[str, float]:
    """How the base of the shell has moved, and what of the layer below it has come up.

    ``interface_down_m``: mean sinking of the particles that started within one spacing of the base (on either side)
    and within half of ``radius`` of the axis, less that of the ones beyond three radii (the body as a whole rings).
    ``interface_down_most_m``: the largest of them (particles that are now above the datum left out).
    ``below_risen_kg``: mass of the layer below that stands, within ``radius`` of the axis, more than half a spacing
    over where that layer began.
    """
    _, _, height = ground.polar(particles.position)
    before_distance, _, before_height = ground.polar(particles.initial_position)
    distance, _, _ = ground.polar(particles.position)
    outer = int(particles.layer.max())
    sunk = before_height - height
    # how thick a particle is where it lies: graded clouds are coarser far away
    size = np.cbrt(particles.mass / particles.density)
    near_base = (np.abs(before_height + shell) < np.maximum(size, spacing)) & (particles.layer >= outer - 1)
    under = near_base & (before_distance < 0.5 * radius) & (height < 0.0)
    far = near_base & (before_distance > 3.0 * radius)
    ringing = float(np.average(sunk[far], weights=particles.mass[far])) if far.any() else 0.0
    risen = (particles.layer == outer - 1) & (distance < radius) & (height + ringing > -shell + 0.5 * spacing)
    return {
        "interface_down_m": float(np.average(sunk[under], weights=particles.mass[under])) - ringing
        if under.any()
        else float("nan"),
        "interface_down_most_m": float(sunk[under].max()) - ringing if under.any() else float("nan"),
        "below_risen_kg": float(particles.mass[risen].sum()),
    }


def damage_by_distance(particles: Particles, ground: Datum, shell: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean distance [m] and mass-weighted mean damage of the surface ice, in rings of ``FEWEST`` particles or more
    about the impact point.

    Surface ice started in the upper ``TOP`` of the shell; distance is where it is now, along the datum. All azimuths
    are in one ring.
    """
    particles.need("damage", "initial_position", "layer", "mass")
    _, _, before = ground.polar(particles.initial_position)
    chosen = (particles.layer == particles.layer.max()) & (before > -TOP * shell)
    distance, _, _ = ground.polar(particles.position[chosen])
    return ring_means(
        distance,
        particles.damage[chosen],
        particles.mass[chosen],
        1.5 * float(particles.attributes["spacing_at_impact_m"]),
    )


def ring_means(
    distance: np.ndarray, values: np.ndarray, weight: np.ndarray, width: float
) -> tuple[np.ndarray, np.ndarray]:
    """Means of ``distance`` and ``values`` (n,) over rings from the axis outwards, each at least ``width`` wide and of
    at least ``FEWEST`` members."""
    order = np.argsort(distance, kind="stable")
    s, v, w = distance[order], values[order], weight[order]
    middles, means, first = [], [], 0
    while len(s) - first >= FEWEST:
        last = max(first + FEWEST, int(np.searchsorted(s, s[first] + width)))
        if len(s) - last < FEWEST:
            last = len(s)
        middles.append(float(np.average(s[first:last], weights=w[first:last])))
        means.append(float(np.average(v[first:last], weights=w[first:last])))
        first = last
    return np.array(middles), np.array(means)


def undamaged_annulus(
    distance: np.ndarray, damage: np.ndarray, sound: float = 0.5, broken: float = 0.9
) -> tuple[float, float] | None:
    """Inner and outer distance [m] of the widest annulus with damage below ``sound`` between two zones above
    ``broken``; None where there is none."""
    inside = np.flatnonzero(damage > broken)
    if len(inside) < 2:
        return None
    best: tuple[float, float] | None = None
    for a, b in itertools.pairwise(inside):
        whole = np.flatnonzero(damage[a + 1 : b] < sound) + a + 1
        if len(whole) and (best is None or distance[whole[-1]] - distance[whole[0]] > best[1] - best[0]):
            best = (float(distance[whole[0]]), float(distance[whole[-1]]))
    return best
