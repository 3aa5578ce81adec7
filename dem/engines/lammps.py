"""LAMMPS (granular package) as the engine: the deck that says what ``dem`` means.

=========================  ============================================================================================
here                       there
=========================  ============================================================================================
normal_hooke        ``hooke k_n e_n`` with ``damping coeff_restitution``: the dashpot of every pair from its own masses
tangential_spring          ``tangential linear_history k_t C_t/C_n mu``
rolling_sds                ``rolling sds``: k = k_n beta^2, gamma = C_n beta^2, mu = mu_r beta (scaled by R there)
twisting_sds   ``twisting sds``: k = 2 k_t (beta R)^2, gamma = 2 C_t (beta R)^2, mu = mu_t mu beta R (not scaled there)
walls                      ``fix wall/gran/region`` with the same law, one for each wall and group of like classes
central gravity, damping   atom-style variables in ``fix addforce``
=========================  ============================================================================================

Rolling and twisting dashpots, k_twist and mu_twist are those of the classes' mean mass and radius. Source: LAMMPS
documentation, pair_style granular and fix wall/gran/region (version 22 July 2025).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from dem.contact.walls import CONE, PLANE, REVOLVED, SPHERE_INSIDE, SPHERE_OUTSIDE, Wall
from dem.engines import body_forces
from dem.engines.grain_classes import PairNumbers
from dem.engines.scene import DATA, Plan, Scene, write_deck
from matter.errors import InputError

SOURCES = ("Thompson2022",)

NAME = "lammps"
ROUGH_GROUPS, SMOOTH_GROUPS = 8, 3
"""Groups of grains that have a law of their own at rough and at smooth walls: each costs a pass over all grains, and
the program knows 32 groups."""
MOST_BINS = 128
"""Bins of the neighbour search along an edge of the box, at most: few grains in a wide sky must not ask for
gigabytes."""


def law(pair: PairNumbers) -> str:
    """One contact in the syntax of ``pair_coeff`` and of wall fixes."""
    text = f"hooke {pair.k_n:.17g} {pair.restitution:.17g}"
    if pair.rough:
        text += (
            f" tangential linear_history {pair.k_t:.17g} {pair.c_t / pair.c_n if pair.c_n else 0.0:.17g} "
            f"{pair.friction:.17g}"
        )
    else:
        text += " tangential linear_nohistory 0.0 0.0"
    square = pair.shape**2
    if pair.rough and pair.shape > 0.0 and pair.rolling > 0.0:
        text += f" rolling sds {pair.k_n * square:.17g} {pair.c_n * square:.17g} {pair.rolling * pair.shape:.17g}"
    if pair.rough and pair.arm > 0.0 and pair.twisting > 0.0:
        arm2 = pair.arm**2
        text += (
            f" twisting sds {2.0 * pair.k_t * arm2:.17g} {2.0 * pair.c_t * arm2:.17g} "
            f"{pair.twisting * pair.friction * pair.arm:.17g}"
        )
    return text + " damping coeff_restitution"


def region(wall: Wall, name: str, reach: float) -> str:
    """A wall as the surface of a region; what lies in the region is the side on which the grains are."""
    x, y, z = wall.point
    if wall.kind == PLANE and not np.isfinite(wall.top):
        n = np.asarray(wall.direction, dtype=float)
        return f"region {name} plane {x:.17g} {y:.17g} {z:.17g} {n[0]:.17g} {n[1]:.17g} {n[2]:.17g} side in"
    if wall.kind == PLANE and np.count_nonzero(wall.direction) == 1 and not wall.direction[2]:
        return _upright(wall, name)
    if wall.kind == REVOLVED and (sides := wall.cylinder()):
        radius, low, high = sides
        return (
            f"region {name} cylinder z {x:.17g} {y:.17g} {radius:.17g} {z + low:.17g} {z + high:.17g} side in open 1 "
            f"open 2"
        )
    if wall.kind == SPHERE_INSIDE and np.isfinite(wall.top):
        # joined with all that is above the top: of the sphere's surface only the part below counts, of the plane only
        # what lies outside
        return "\n".join(
            [
                f"region {name}ball sphere {x:.17g} {y:.17g} {z:.17g} {wall.radius:.17g} side in",
                f"region {name}above block INF INF INF INF {z + wall.top:.17g} INF side in",
                f"region {name} union 2 {name}ball {name}above",
            ]
        )
    if wall.kind in (SPHERE_OUTSIDE, SPHERE_INSIDE):
        return (
            f"region {name} sphere {x:.17g} {y:.17g} {z:.17g} {wall.radius:.17g} side "
            f"{'out' if wall.kind == SPHERE_OUTSIDE else 'in'}"
        )
    if wall.kind == CONE and np.allclose(wall.direction, (0.0, 0.0, 1.0)):
        top = wall.top * math.cos(wall.half_angle) if np.isfinite(wall.top) else 2.0 * reach
        low = 1e-3 * top
        width = math.tan(wall.half_angle)
        # open at both ends: only the side is a wall
        return (
            f"region {name} cone z {x:.17g} {y:.17g} {width * low:.17g} {width * top:.17g} {z + low:.17g} "
            f"{z + top:.17g} side in open 1 open 2"
        )
    raise InputError(f"[dem] engine = {NAME!r} has no wall of this kind ({wall})")


def _upright(wall: Wall, name: str) -> str:
    """A plane across x or y up to its top: one face of a block whose others are open."""
    axis = int(np.flatnonzero(wall.direction)[0])
    face = 0 if wall.direction[axis] > 0 else 1
    bounds = ["INF"] * 6
    bounds[2 * axis + face] = f"{wall.point[axis]:.17g}"
    bounds[-1] = f"{wall.point[2] + wall.top:.17g}"
    opened = " ".join(f"open {k + 1}" for k in range(6) if k != 2 * axis + face)
    return f"region {name} block {' '.join(bounds)} side in {opened}"


def flat(wall: Wall) -> bool:
    """Whether a wall is a plane along an axis that ends nowhere."""
    return wall.kind == PLANE and np.count_nonzero(wall.direction) == 1 and not np.isfinite(wall.top)


def planes(walls: Sequence[Wall]) -> list[tuple[int, str, str, str]]:
    """Planes along the axes as species, axis, lower and upper position: one fix of the program holds a pair of
    them."""
    out: list[tuple[int, str, str, str]] = []
    for axis in range(3):
        sides: dict[int, tuple[list[str], list[str]]] = {}
        for wall in walls:
            if flat(wall) and wall.direction[axis]:
                sides.setdefault(wall.species, ([], []))[0 if wall.direction[axis] > 0 else 1].append(
                    f"{wall.point[axis]:.17g}"
                )
        for species, (low, high) in sides.items():
            out += [(species, "xyz"[axis], one, two) for one, two in zip_longest(low, high, fillvalue="NULL")]
    return out


def write(scene: Scene, plan: Plan, folder: Path, deck: str) -> None:
    """Write the data file (on a fresh start) and the deck ``deck`` into ``folder``."""
    classes, contact = scene.classes, scene.contact
    reach = scene.reach
    if plan.resume is None:
        scene.write_data(folder)
    cut = 2.0 * float(scene.grains.radius.max()) + scene.skin_length
    lines = [
        "units si", "atom_style sphere", "boundary f f f", "newton off", "comm_modify mode single vel yes",
        "atom_modify map array", "processors * * 1",
        f"read_data {DATA}" if plan.resume is None else f"read_restart restart.{plan.resume}",
        f"change_box all x final {-reach:.17g} {reach:.17g} y final {-reach:.17g} {reach:.17g} z final {-reach:.17g} "
        f"{reach:.17g}"
        if plan.resume is None else "",
        f"neighbor {scene.skin_length:.17g} bin", "neigh_modify every 1 delay 0 check yes",
        f"neigh_modify binsize {max(0.5 * cut, 2.0 * reach / MOST_BINS):.17g}",
        "pair_style granular",
    ]  # fmt: skip
    for a in range(len(classes)):
        lines += [f"pair_coeff {a + 1} {b + 1} {law(classes.pair(contact, a, b))}" for b in range(a, len(classes))]
    pairs = planes(scene.walls)
    lines += [region(wall, f"wall{w}", reach) for w, wall in enumerate(scene.walls) if not flat(wall)]
    for rough in (True, False):
        chosen = [(w, wall) for w, wall in enumerate(scene.walls) if (wall.species >= 0) == rough]
        if not chosen:
            continue
        wide, parts = classes.merged(ROUGH_GROUPS if rough else SMOOTH_GROUPS)
        name = "rough" if rough else "smooth"
        lines += [f"group {name}{a} type {' '.join(str(k + 1) for k in part)}" for a, part in enumerate(parts)]
        for a in range(len(wide)):
            for w, wall in chosen:
                text = law(wide.wall(contact, a, wall.species))
                if not flat(wall):
                    lines.append(f"fix w{w}c{a} {name}{a} wall/gran/region granular {text} region wall{w}")
            for p, (species, axis, low, high) in enumerate(pairs):
                if (species >= 0) == rough:
                    text = law(wide.wall(contact, a, species))
                    lines.append(f"fix p{p}c{a} {name}{a} wall/gran granular {text} {axis}plane {low} {high}")
    lines += body_forces.force_commands(scene)
    if plan.integrate:
        lines.append("fix move all nve/sphere")
    if scene.domain is not None:
        lines += [*body_forces.aside(scene.domain), "fix aside all evaporate 10 100000 aside 1"]
    lines += [
        f"timestep {scene.dt:.17g}", "balance 1.05 shift xy 10 1.02" if len(scene.grains) > 5000 else "",
        "thermo_style custom step atoms ke", f"thermo {plan.dump_every}",
        "thermo_modify lost ignore flush yes norm no",
        f"dump out all custom {plan.dump_every} dump.*.bin {' '.join(plan.columns)}" if plan.dumps else "",
        f"restart {plan.restart_every} restart.*" if plan.restart_every else "",
        f"run {plan.settle} upto" if plan.settle else "",
        f"run {plan.steps} upto" + (f" every {plan.restart_every} NULL" if plan.restart_every else ""),
    ]  # fmt: skip
    write_deck(lines, folder / deck)
