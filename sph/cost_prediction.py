"""What the shock stage will cost, before it runs, and what that follows from.

Steps: the Courant limit of the finest particles at rest, C (support / 2) d / ((1 + a alpha f) c_l), layer by layer
(``sph.stepping.timestep``; f = 0.45 with reconstructed jumps); fast ejecta and the impact itself ask for a fifth more.
Measured: 1,866 steps where this gives 1,952 (Valhalla, quick), 5,227 where it gives 5,497 (Ryugu's shot, before its
late stage); 0.74 to 0.83 us per particle and step of one thread on a busy machine, with supports of 2 spacings and
Monaghan's viscosity. In a late stage the same with its sound speed and alpha: 3,017 steps where this gives 3,074
(Ryugu's shot, quick). The cost of a step grows with the neighbours, as the cube of the support; slopes and the terms
of the supports make a visit 1.6 times as long (24 ns for 12.5, ``benchmarks/sph_rates.py --compare``, less what does
not go by pairs).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np

from matter.blocks import placing
from matter.constants import G
from matter.wording import readable
from sph.bodies import projectile, rubble, seeding, symmetry
from sph.damage import grady_kipp
from sph.planning import durations, ground_strength, resolution
from sph.settings import Settings
from sph.stepping import fine_particles, history

# of one thread, warm: seconds per particle and step, per particle of one gravity evaluation, per pair of the direct
# sum, per particle written, per particle of a fine and a wide tree's energy
_PER_STEP, _PER_GRAVITY, _PER_PAIR, _PER_OUTPUT = 8.0e-7, 1.8e-6, 7.0e-10, 8.0e-6
_PER_FINE, _PER_WIDE = 1e-5, 6e-6
_RECONSTRUCTED = 1.6
_MORE_STEPS = 1.18
_APPROACHING = 0.45
_HELD = 1.25
_EFFICIENCY = 0.85
"""Threads count as their number to this power."""


def step(settings: Settings) -> float:
    """The step of target and projectile at rest [s]."""
    return _limit(settings).step


class _Limit(NamedTuple):
    """A step [s] of matter at rest, what it follows from, and how many times as many the impact asks for."""

    step: float
    what: str
    more: float = _MORE_STEPS


def _limit(settings: Settings, late: float | None = None) -> _Limit:
    """That step; with the sound speed ``late`` [m/s] that of a late stage."""
    zones, shortest = settings.zones, np.inf
    inner = (0.0, *settings.target.outer_radii)
    for layer, top in zip(settings.target.layers, inner[1:]):
        depth = settings.target.radius - top  # the layer's nearest point to the impact lies this deep
        shortest = min(shortest, _courant(settings, float(zones.spacing(np.array([depth]))[0]), layer.material, late))
    what = f"the finest spacing, {readable.length(zones.contact)}"
    finest, copies = _finest(settings), symmetry.copies(settings.symmetry)
    # one alone leaves its neighbours within half a millisecond; with its images it stays where its support, that of
    # its own size, reaches well past the ground's particles when their pores are crushed (Ryugu: 1.43 of their spacing
    # holds it, 1.08 does not)
    rest = settings.chosen_materials().at_rest[settings.target.layers[-1].material]
    crushed = zones.contact * (rest.bulk / rest.solid) ** (1.0 / 3.0)
    held = copies > 1 and settings.reconstructed and settings.support * finest > _HELD * crushed and late is None
    if held or projectile_particles(settings) > copies:
        own = _courant(settings, finest, settings.impact.projectile.material, late)
        if own < shortest:
            # one that is held is finer than what is thrown out: no more steps than its own
            more = 1.0 if projectile_particles(settings) <= copies else _MORE_STEPS
            return _Limit(own, f"the projectile's spacing, {readable.length(finest)}", more)
    return _Limit(shortest, what)


def _finest(settings: Settings) -> float:
    """Spacing of the projectile's particles [m], of parts the least that a support goes by; a ball that mirrors cut
    has more particles than are asked for."""
    if not settings.impact.projectile.parts:
        count = max(projectile_particles(settings), 1.0)
        return min(settings.projectile_spacing, float((settings.impact.projectile.volume / count) ** (1.0 / 3.0)))
    found = projectile.sizes(settings.impact.projectile, settings.projectile_spacing, settings.chosen_materials())
    return min(width for _, width in found)


def _courant(settings: Settings, spacing: float, material: str, late: float | None) -> float:
    """The step [s] of particles ``spacing`` [m] apart at rest; with the sound speed ``late`` [m/s] that of the late
    stage: shear goes down with it."""
    ground = ground_strength.ground(settings.chosen_materials(), material, 1.0, settings.strength)
    wave, alpha = ground.wave, settings.alpha
    if late is not None and settings.late is not None:
        wave, alpha = wave * min(late / ground.sound, 1.0), settings.late.alpha
        spacing = min(spacing / fine_particles.SOFTEST, max(spacing, settings.spacing_at_impact))
    fraction = _APPROACHING if settings.reconstructed else 1.0
    signal = (1.0 + settings.signal.linear * alpha * fraction) * wave
    return settings.courant * 0.5 * settings.support * spacing / signal


def steps(settings: Settings) -> tuple[float, float]:
    """Steps of the relaxation and of the impact."""
    limit = _limit(settings)
    number = limit.more * _begins(settings)[0] / limit.step + 200.0 + sum(_late_steps(settings))
    return settings.relaxation_time / limit.step if settings.relaxes else 0.0, number


def _late_steps(settings: Settings) -> list[float]:
    """Steps of each part of the late stage; matter that keeps its sound speed keeps its step, since what is crushed by
    then takes what the lower viscosity would give. Every row of the history cuts a step."""
    spans, every = settings.late.spans(settings.end_time) if settings.late else [], settings.history_interval
    return [
        time / _limit(settings, None if speed == np.inf else speed).step + time // every for _, time, speed in spans
    ]


def _begins(settings: Settings) -> list[float]:
    """When the parts of the late stage begin, and the end [s]."""
    late = settings.late
    return [*((at for at, _, _ in late.spans(settings.end_time)) if late else ()), settings.end_time]


def work(settings: Settings) -> Callable[[float], float]:
    """Steps [predicted] up to a time [s] that counts the relaxation first: what is done, for a progress that goes by
    work: the steps of a late stage are hundreds of times as long as those before it."""
    relax, impact = steps(settings)
    before = settings.relaxation_time if settings.relaxes else 0.0
    limit = _limit(settings)
    marks = _begins(settings)
    parts = np.cumsum([limit.more * marks[0] / limit.step + 200.0, *_late_steps(settings)])
    times = (0.0, before, *(before + at for at in marks))
    return lambda time: float(np.interp(time, times, (0.0, relax, *(relax + parts / parts[-1] * impact))))


def per_step(settings: Settings) -> float:
    """Seconds per particle and step of one thread."""
    return _PER_STEP * (0.5 * settings.support) ** 3 * (_RECONSTRUCTED if settings.reconstructed else 1.0)


def projectile_particles(settings: Settings) -> float:
    """How many particles the projectile has."""
    if settings.control:
        return 0.0
    ball, spacing = settings.impact.projectile, settings.projectile_spacing
    return float(projectile.count(ball, spacing, settings.chosen_materials(), settings.symmetry))


def per_radius(settings: Settings) -> float:
    """Particles per projectile radius: radius over the edge of a particle's cube."""
    ball = settings.impact.projectile
    return float(ball.radius / (ball.volume / max(projectile_particles(settings), 1.0)) ** (1.0 / 3.0))


def predict(settings: Settings) -> dict[str, float]:
    """Wall time [s] with warm kernels, memory and disk [bytes], ``particles``, ``snapshots``."""
    whole = resolution.count(settings.target, settings.zones) + projectile_particles(settings)
    parts = symmetry.copies(settings.symmetry)
    n = whole / parts
    relax, number = steps(settings)
    attracts = float(settings.target.attracts and not settings.target.flat)
    evaluations = (number + relax) * (1.0 if settings.gravity_shift == 0 else 0.15) * attracts
    rows = settings.end_time / settings.history_interval
    energies = _per_row(settings, n) * attracts
    snapshots = settings.end_time / settings.snapshot_interval + 2.0
    work = n * (per_step(settings) * (number + relax) + _PER_GRAVITY * evaluations) + rows * energies
    wall = work / numba.get_num_threads() ** _EFFICIENCY + _PER_OUTPUT * n * snapshots + 3.0
    flaws = expected_flaws(settings)
    return {
        "wall_s": wall,
        "memory_bytes": 3e8 + 2800.0 * n + 12.0 * flaws,
        "disk_bytes": snapshots * 190.0 * whole,
        "checkpoint_bytes": 640.0 * n + 4.0 * flaws,
        "particles": whole,
        "snapshots": snapshots,
    }


def _per_row(settings: Settings, n: float) -> float:
    """Seconds of one thread that a row of the history takes: the energy of the body's own gravity, 0.6 G M^2 / R."""
    materials, ball, R = settings.chosen_materials(), settings.impact.projectile, settings.target.radius
    own = 0.6 * durations.surface_gravity(settings.target, materials) ** 2 * R**3 / G
    mass = float(materials.bulk_density[materials.index(ball.material)]) * ball.volume
    if history.weak(own, 0.0 if settings.control else 0.5 * mass * settings.impact.speed**2):
        return _PER_WIDE * n
    return _PER_PAIR * n**2 if n <= history.DIRECT else _PER_FINE * n


def expected_flaws(settings: Settings) -> float:
    """About how many flaws the target gets (``sph.bodies.seeding``): most of a checkpoint where grading is strong."""
    materials = settings.chosen_materials()
    layers = [materials.names.index(layer.material) for layer in settings.target.layers]
    if not any(materials.rows.flawed[index] and not materials.predamaged(materials.names[index]) for index in layers):
        return 0.0
    distance, number = resolution.cumulative_number(settings.target, settings.zones)
    spacing = settings.zones.spacing(0.5 * (distance[1:] + distance[:-1]))
    each = np.diff(number)
    dealt = grady_kipp.expected_among(spacing**3, each)
    return dealt if dealt <= seeding.MOST else float(number[-1]) * grady_kipp.KEPT


def explain(settings: Settings) -> list[str]:
    """Particles, resolution, and which keys the cost follows from."""
    target, zones, ball = settings.target, settings.zones, settings.impact.projectile
    distance, number = resolution.cumulative_number(target, zones)
    total, crater = number[-1], 0.5 * settings.impact.expected_transient_diameter
    inside = [
        float(np.interp(at, distance, number)) / total
        for at in (zones.contact_radius, max(zones.fine_radius, zones.contact_radius))
    ]
    parts = {
        f"contact_radius = {readable.length(zones.contact_radius)} at {readable.length(zones.contact)}": inside[0],
        f"fine_radius = {readable.length(zones.fine_radius)} at spacing_at_impact = "
        f"{readable.length(zones.fine)}": inside[1] - inside[0],
        f"spacing_far = {readable.length(zones.coarse)} and growth = {zones.growth:g}": 1.0 - inside[1],
    }
    relax, impact = steps(settings)
    most = max(parts, key=lambda key: parts[key])
    lines = [
        f"{total:,.0f} particles in the target, {projectile_particles(settings):,.0f} in the projectile: "
        f"{per_radius(settings):.2g} per projectile radius "
        f"({readable.length(ball.radius)}), {crater / zones.fine:.2g} per crater radius ({readable.length(crater)})",
        f"{parts[most]:.0%} of the target's particles follow from {most}",
        f"{impact:,.0f} steps of {readable.clock(step(settings))} to end_time = {readable.clock(settings.end_time)}"
        + (f", and {relax:,.0f} for relaxation_time = {readable.clock(settings.relaxation_time)}" if relax else "")
        + f": the step follows from {_limit(settings).what}",
    ]
    if settings.late and not settings.late.switches:
        lines.append(f"from {readable.clock(settings.late.viscosity_time)} on without the viscosity of the shock")
    elif settings.late:
        (first, speed), (last, slowest) = settings.late.switches[0], settings.late.switches[-1]
        softer = sum(_late_steps(settings)[-len(settings.late.switches) :])
        lines.append(
            f"from {readable.clock(first)} on a sound speed of {speed:g} m/s"
            + (f", falling to {slowest:g} m/s at {readable.clock(last)}" if settings.late.slower else "")
            + f": {softer:,.0f} of the steps (late stage, [sph.late])"
        )
    if (found := placing.of_target(target)) is not None:
        lines.append(rubble.worded(found, settings.chosen_materials(), target, zones))
    return lines
