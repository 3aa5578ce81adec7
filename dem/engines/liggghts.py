"""LIGGGHTS as the engine: the deck that says what ``dem`` means, as far as LIGGGHTS can.

=========================  ============================================================================================
here                       there
=========================  ============================================================================================
normal_hooke       ``hooke/stiffness``: kn and gamman per pair of types (matrices), gamman = C_n / m_red of the classes
tangential_spring          ``tangential history``: kt, gammat likewise; the Coulomb test there is on the spring alone
rolling_sds                ``rolling_friction epsd3``: coefficientRollingFriction = mu_r beta, rollingStiffness =
                           1/mu_r^2 (one number for all), coefficientRollingViscousDamping = C_r / (2 sqrt(I_r k_r)),
                           I_r = 7/5 of the reduced m r^2
twisting_sds               absent (``no_twist``)
walls                      planes along the axes as primitives, bowls and cones as triangle meshes, each with a type of
                           its own; a core as a force by formula (``core_by_formula``)
central gravity, damping   atom-style variables in ``fix addforce``
=========================  ============================================================================================

mu_r above 1 asks for a rollingStiffness below 1, which the program refuses under ``units si``: the deck says ``units
lj``, whose constants are all 1, so that every number stays in SI. Source: LIGGGHTS 3.8 documentation,
gran_model_hooke_stiffness, gran_rolling_friction_epsd3, fix wall/gran.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from dem.contact.walls import PLANE, SPHERE_OUTSIDE, Wall
from dem.engines import body_forces, core_by_formula, wall_meshes
from dem.engines.grain_classes import PairNumbers
from dem.engines.scene import DATA, Plan, Scene, write_deck

SOURCES = ("Kloss2012",)

NAME = "liggghts"
MOST_BINS = 128
CLEAR_EVERY = 5
"""Dumps between two removals of grains beside the domain, and between two looks at which grains are near the core."""
SMOOTH_ANGLE = 10
"""Largest angle between facets of one smooth wall [deg]."""


def matrices(scene: Scene) -> dict[str, np.ndarray]:
    """Every ``peratomtypepair`` property by its keyword; types are the classes and then the walls."""
    classes, contact = scene.classes, scene.contact
    n, total = len(classes), len(classes) + len(scene.walls)
    names = (
        "kn",
        "kt",
        "gamman",
        "gammat",
        "coefficientFriction",
        "coefficientRollingFriction",
        "coefficientRollingViscousDamping",
    )
    out = {name: np.zeros((total, total)) for name in names}
    for a in range(n):
        for b in range(total):
            wall = b >= n
            pair = classes.wall(contact, a, scene.walls[b - n].species) if wall else classes.pair(contact, a, b)
            if wall:
                inertia = 1.4 * float(classes.mass[a] * classes.radius[a] ** 2)
            else:
                one, two = (float(classes.mass[k] * classes.radius[k] ** 2) for k in (a, b))
                inertia = 1.4 * one * two / (one + two)
            for name, value in _values(pair, inertia).items():
                out[name][a, b] = out[name][b, a] = value
    for name in ("kn", "kt"):  # walls never touch walls, but a stiffness of zero is refused
        out[name][n:, n:] = out[name][0, 0]
    return out


def _values(pair: PairNumbers, inertia: float) -> dict[str, float]:
    rolls = pair.rough and pair.arm > 0.0 and pair.rolling > 0.0
    k_r = pair.k_n * pair.arm**2
    return {
        "kn": pair.k_n,
        "kt": pair.k_t,
        "gamman": pair.c_n / pair.reduced,
        "gammat": pair.c_t / pair.reduced if pair.rough else 0.0,
        "coefficientFriction": pair.friction,
        "coefficientRollingFriction": pair.rolling * pair.shape if rolls else 0.0,
        "coefficientRollingViscousDamping": pair.c_n * pair.arm**2 / (2.0 * math.sqrt(inertia * k_r))
        if rolls
        else 0.0,
    }


def rolling_numbers(scene: Scene) -> set[float]:
    """The different mu_r of all contacts that resist rolling: the program takes one number for all."""
    classes, contact = scene.classes, scene.contact
    first = {int(s): a for a, s in reversed(list(enumerate(classes.species)))}.values()
    pairs = [classes.pair(contact, a, b) for a in first for b in first]
    pairs += [classes.wall(contact, a, wall.species) for a in first for wall in scene.walls]
    return {pair.rolling for pair in pairs if pair.rough and pair.shape > 0.0 and pair.rolling > 0.0}


def write(scene: Scene, plan: Plan, folder: Path, deck: str) -> None:
    """Write the data file and wall meshes (on a fresh start) and the deck ``deck`` into ``folder``."""
    reach, count = scene.reach, len(scene.classes)
    total = count + len(scene.walls)
    if plan.resume is None:
        scene.write_data(folder, len(scene.walls))
    cut = 2.0 * float(scene.grains.radius.max()) + scene.skin_length
    box = f"{-reach:.17g} {reach:.17g}"
    lines = [
        "units lj", "atom_style granular", "boundary f f f", "newton off", "communicate single vel yes",
        "atom_modify map array", "processors * * 1",
        f"read_data {DATA}" if plan.resume is None else f"read_restart restart.{plan.resume}",
        f"change_box all x final {box} y final {box} z final {box} units box" if plan.resume is None else "",
        f"neighbor {scene.skin_length:.17g} bin", "neigh_modify every 1 delay 0 check yes",
        f"neigh_modify binsize {max(0.5 * cut, 2.0 * reach / MOST_BINS):.17g}",
        # read by the program whatever the law; they enter no force here
        f"fix youngsModulus all property/global youngsModulus peratomtype {' '.join(['5.e6'] * total)}",
        f"fix poissonsRatio all property/global poissonsRatio peratomtype {' '.join(['0.3'] * total)}",
    ]  # fmt: skip
    rolling = rolling_numbers(scene)
    for name, values in matrices(scene).items():
        lines.append(
            f"fix {name} all property/global {name} peratomtypepair {total} "
            f"{' '.join(f'{v:.17g}' for v in values.reshape(-1))}"
        )
    lines.append(
        f"fix rollingStiffness all property/global rollingStiffness scalar {1.0 / max(rolling, default=1.0) ** 2:.17g}"
    )
    model = "hooke/stiffness tangential history" + (" rolling_friction epsd3" if rolling else "")
    lines += [f"pair_style gran model {model}", "pair_coeff * *"]
    walls, forces = _walls(scene, plan, folder, model)
    lines += walls
    if any("store/state" in line for line in forces):
        lines.append("run 0")  # fix store/state reads a list that the program makes at its first run
    lines += forces
    tasks = ['"delete_atoms region aside compress no"'] if scene.domain is not None else []
    tasks += [core_by_formula.REGROUP] if any(wall.kind == SPHERE_OUTSIDE for wall in scene.walls) else []
    lines += [
        "fix move all nve/sphere" if plan.integrate else "",
        f"timestep {scene.dt:.17g}", "thermo_style custom step atoms ke", f"thermo {plan.dump_every}",
        "thermo_modify lost ignore flush yes norm no",
        f"dump out all custom {plan.dump_every} dump.*.bin {' '.join(plan.columns)}" if plan.dumps else "",
        f"restart {plan.restart_every} restart.*" if plan.restart_every else "",
        *(body_forces.aside(scene.domain) if scene.domain is not None else []),
        f"run {plan.settle} upto" if plan.settle else "",
        f"run {plan.steps} upto" + (f" every {CLEAR_EVERY * plan.dump_every} {' '.join(tasks)}" if tasks else ""),
    ]  # fmt: skip
    write_deck(lines, folder / deck)


def _walls(scene: Scene, plan: Plan, folder: Path, model: str) -> tuple[list[str], list[str]]:
    """Lines of the walls, and those of all forces on the bodies; writes the meshes on a fresh start."""
    reach, count = scene.reach, len(scene.classes)
    lines: list[str] = []
    meshes, forces = [], body_forces.force_commands(scene)
    for w, wall in enumerate(scene.walls):
        where = _primitive(wall, count + w + 1)
        if where is not None:
            lines.append(f"fix w{w} all wall/gran model {model} {where}")
            continue
        if wall.kind == SPHERE_OUTSIDE:
            if plan.resume is None:
                core_by_formula.write_constants(scene, wall, folder)
            forces += core_by_formula.core_commands(scene, wall)
            continue
        meshes.append(f"mesh{w}")
        if plan.resume is None:
            wall_meshes.write(
                wall, float(scene.grains.radius.mean()), folder / f"wall{w}.stl", reach, 0.95 * scene.lower
            )
        # facets within this angle count as one smooth surface: their common edges push nothing
        lines.append(f"fix mesh{w} all mesh/surface file wall{w}.stl type {count + w + 1} curvature {SMOOTH_ANGLE}")
    if meshes:  # the program takes one fix for all of them
        lines.append(f"fix meshes all wall/gran model {model} mesh n_meshes {len(meshes)} meshes {' '.join(meshes)}")
    return lines, forces


def _primitive(wall: Wall, kind: int) -> str | None:
    """A plane along an axis, or None."""
    n = np.asarray(wall.direction, dtype=float)
    if wall.kind != PLANE or np.count_nonzero(n) != 1 or np.isfinite(wall.top):
        return None
    axis = int(np.flatnonzero(n)[0])
    return f"primitive type {kind} {'xyz'[axis]}plane {wall.point[axis]:.17g}"
