"""Whether a case makes physical sense, before it runs: what cannot be is an error, what is rarely meant a warning.

Settings are each valid by themselves here; this is about what they say together. A run refuses the same errors before
its first stage.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from crater.results import soundness
from dem.contact.settings import LIQUIDS
from dem.trials import angle_of_friction
from matter.case import at_rest, formation_time, quantity
from matter.case.body import Model
from matter.constants import G
from matter.errors import InputError
from matter.wording import readable
from pipeline.case import experimental, sizes
from pipeline.case.complaints import Complaint
from pipeline.settings import as_half_space

LOST = 0.05
"""Projectile radius over the finest spacing below which the projectile is nothing among its neighbours."""
PASSES, GRAZES = math.radians(88.0), math.radians(75.0)
WIDEST = 0.8
"""Radius of the expected crater over that of the bed: wider ones meet the damped layer."""
SINKING = 0.01
"""Depth, over the crater's diameter, by which ground may sink in a quiet layer unsaid."""
DISRUPTS = 0.1
"""Share of the energy that breaks a body in two, from which on its fragments are what a run is about."""
NEAR = 1.3
"""Least distance of the quiet layer over the expected crater's radius."""
ROUGH = 1.5
"""Spacings from the edge of flat ground within which its surface is rounded off: a bowl as wide as Ryugu's ground was
carved 0.4 m too deep there; two spacings away nothing was seen (``docs/results/sci_ryugu``, D6)."""


def judged(
    settings: Mapping[str, Model], outside: Mapping[str, Path], stages: tuple[str, ...]
) -> tuple[list[Complaint], list[str]]:
    """Errors and warnings about the settings of the ``stages`` of a case; ``outside`` are the stages whose result is
    given."""
    sph: Any = settings.get("sph") if "sph" not in outside else None
    if sph is None or not hasattr(sph, "zones"):
        return [], list(experimental.used(settings))
    errors = [
        *_impossible(sph),
        *_out_of_order(settings, sph),
        *_does_not_fit(settings, sph, outside),
        *_mirrored(sph),
        *_shaken_grains(settings, sph),
    ]
    return errors, [
        *_unlikely(sph),
        *_broken(sph),
        *_without_strength(sph),
        *_coarse(sph),
        *_sinking(sph),
        *_at_the_edge(settings, sph, outside),
        *_regime(settings, sph, stages),
        *_cohesion_once(settings, sph),
        *experimental.used(settings),
    ]


def _impossible(sph: Any) -> Iterator[Complaint]:
    target, impact = sph.target, sph.impact
    radius, finest = impact.projectile.radius, sph.zones.contact
    radius_key = ("impact", "projectile", "radius")
    if not target.flat and radius >= target.radius:
        yield Complaint(
            radius_key,
            f"the projectile ({readable.length(radius)}) is larger than the target ({readable.length(target.radius)})",
        )
    elif target.flat and radius >= min(target.radius, target.half_width):
        yield Complaint(
            radius_key,
            f"the projectile ({readable.length(radius)}) is larger than the ground, {readable.length(target.radius)} "
            f"deep",
        )
    elif radius < LOST * finest and not sph.control and (advice := as_half_space.advice(sph)):
        yield Complaint(
            radius_key,
            f"the projectile ({readable.length(radius)}) is lost among particles {readable.length(finest)} apart: "
            f"{advice}",
        )
    elif radius < LOST * finest and not sph.control:
        yield Complaint(
            radius_key,
            f"the projectile ({readable.length(radius)}) is lost among particles {readable.length(finest)} apart: "
            f"leave [sph] spacing_at_impact out, "
            f"or make it {readable.length(radius)} or less",
        )
    if impact.angle_from_vertical > PASSES:
        angle = math.degrees(impact.angle_from_vertical)
        yield Complaint(
            ("impact", "angle_from_vertical"),
            f"at {angle:.4g} deg from the vertical the projectile passes by the target",
        )


def _shaken_grains(settings: Mapping[str, Model], sph: Any) -> Iterator[Complaint]:
    """Other engines do not know the friction that shaking takes."""
    engine = getattr(settings.get("dem"), "engine", "native")
    if engine != "native" and sph.chosen_materials().vibrate:
        yield Complaint(
            ("dem", "engine"),
            f"{engine} has no friction that shaking takes (block_model of the shock stage): leave engine out, or take "
            'engine = "native"',
        )


def _out_of_order(settings: Mapping[str, Model], sph: Any) -> Iterator[Complaint]:
    handoff: Any = settings.get("handoff")
    time = getattr(handoff, "time", None)
    if isinstance(time, float):
        if time > sph.end_time:
            yield Complaint(
                ("handoff", "time"),
                f"{readable.clock(time)} is after the end of the shock stage, sph.end_time = "
                f"{readable.clock(sph.end_time)}",
            )
        end = getattr(settings.get("dem"), "end_time", math.inf)
        if sph.end_time >= time >= end:
            yield Complaint(
                ("dem", "end_time"), f"{readable.clock(end)} is not after the handoff at {readable.clock(time)}"
            )


def _does_not_fit(settings: Mapping[str, Model], sph: Any, outside: Mapping[str, Path]) -> Iterator[Complaint]:
    target, diameter = sph.target, sph.impact.expected_transient_diameter
    room = target.half_width if target.flat else target.radius
    if 0.5 * diameter > room or (target.flat and diameter / 3.0 > target.radius):
        what = (
            f"ground {readable.length(2.0 * target.half_width)} wide and {readable.length(target.radius)} deep"
            if target.flat
            else "the body"
        )
        yield Complaint(
            ("impact", "expected_transient_diameter"), f"a crater of {readable.length(diameter)} is larger than {what}"
        )
    bed: Any = settings.get("bed")
    if bed is None or "bed" in outside or not hasattr(bed, "arc_radius"):
        return
    # an ellipsoid or mesh that is filled as a whole has no such edge
    if (not target.solid or bed.on_patch) and 0.5 * diameter > WIDEST * bed.arc_radius:
        yield Complaint(
            ("bed", "arc_radius"),
            f"a crater of {readable.length(diameter)} fills more than {WIDEST:.0%} of a bed of "
            f"{readable.length(bed.arc_radius)} radius: make it at least "
            f"{readable.length(0.5 * diameter / WIDEST)}",
        )
    try:
        _fill_bed(bed, sph)
    except InputError as reason:
        yield Complaint(("bed",), str(reason).removeprefix("[bed] "))


def _mirrored(sph: Any) -> Iterator[Complaint]:
    """Fragments of a body that breaks are no mirror images of each other."""
    if sph.symmetry == "none" or sph.target.flat or not sph.strength:
        return
    energy_ratio = _disruption(sph)
    if energy_ratio > DISRUPTS:
        yield Complaint(
            ("sph", "symmetry"),
            f"the impact has {energy_ratio:.2g} of the energy that breaks the body in two (at most {DISRUPTS:g}): its "
            'fragments are no mirror images of each other, take "none"',
        )


def _fill_bed(bed: Any, sph: Any) -> None:
    """What the bed's stage would refuse once it sees the target. Raises ``InputError``."""
    from dem.beds import stage as bed_stage
    from sph import stage

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "target.json"
        path.write_text(json.dumps(stage.target_facts(sph)))
        try:
            bed_stage.maker(bed, path)
        except InputError as reason:
            raise InputError(str(reason).replace(f"{path}: ", "")) from None


def _unlikely(sph: Any) -> Iterator[str]:
    from sph.planning import durations

    target, impact = sph.target, sph.impact
    if not target.flat:
        escape = math.sqrt(2.0 * durations.surface_gravity(target, sph.chosen_materials()) * target.radius)
        if impact.speed < escape:
            yield (
                f"impact.speed = {impact.speed:.4g} m/s is below the escape speed of the target, {escape:.4g} m/s: "
                f"only what was thrown from it, "
                "or circles it, is that slow"
            )
        if advice := as_half_space.advice(sph):
            yield advice
        low = target.radius * (1.0 - math.sin(impact.angle_from_vertical))
        if low < impact.projectile.radius:
            yield (
                f"at {math.degrees(impact.angle_from_vertical):.3g} deg from the vertical part of the projectile "
                f"passes by the target"
            )
    if GRAZES < impact.angle_from_vertical <= PASSES:
        yield (
            f"{math.degrees(impact.angle_from_vertical):.3g} deg from the vertical is grazing: scaling laws, and what "
            f"is sized by them, do not hold"
        )


def _broken(sph: Any) -> Iterator[str]:
    """Cohesion that a case gives to ground that is broken from the start."""
    from sph.materials.settings import law_of

    for name, choice in sph.materials.items():
        law = law_of(name, "strength", "none", choice)
        given = (getattr(choice, law, None) or {}).get("cohesion", 0.0)
        cohesion = quantity.parse(given) if isinstance(given, str) else float(given)
        if sph.strength and choice.predamaged and cohesion > 0.0:
            yield (
                f"[sph.materials.{name}] cohesion = {given} counts for nothing: what is broken "
                f"from the start (predamaged) has none; with predamaged = false and [sph] damage = false it stays"
            )


def _coarse(sph: Any) -> Iterator[str]:
    from sph import cost_prediction

    target, zones = sph.target, sph.zones
    number = cost_prediction.per_radius(sph)
    if not soundness.resolved(number) and not sph.control:
        yield (
            f"{number:.2g} particles per projectile radius, fewer than {soundness.FEWEST_PER_RADIUS:g}: the result "
            f"will be NOT RESOLVED and without errors{_size_that_resolves(sph)}"
        )
    crater = 0.5 * sph.impact.expected_transient_diameter
    if crater < 5.0 * zones.fine:
        yield (
            f"{crater / zones.fine:.2g} particles per expected crater radius ({readable.length(crater)}): the "
            f"crater's shape is not resolved"
        )
    bottom = 0.0
    for layer, top in zip(target.layers, target.outer_radii):
        spacing = float(zones.spacing(np.array([target.radius - top]))[0])
        if top - bottom < spacing:
            yield (
                f"layer {layer.name!r} ({readable.length(top - bottom)}) is thinner than its particles, "
                f"{readable.length(spacing)}, even below the impact"
            )
        bottom = top
    for name, width in _layers(sph).items() if target.flat else ():
        room = min(target.half_width, target.radius) - width
        if room < NEAR * crater:
            yield (
                f"the {name} layer begins {readable.length(room)} from the impact, the expected crater reaches "
                f"{readable.length(crater)}: "
                "make the ground larger or [sph] edge_width smaller"
            )


def _size_that_resolves(sph: Any) -> str:
    """The ``--size`` whose contact has particles enough, in words; nothing where none has."""
    from sph.planning import resolution

    target, impact, radius = sph.target, sph.impact, sph.impact.projectile.radius
    for name, particles in sizes.SIZES.items():
        fine = resolution.fine_radius(impact)
        spacing = resolution.solved(target, impact, particles, fine, sph.growth, resolution.CONTACT * radius)
        number = radius * resolution.refinement(spacing, radius) / spacing
        if soundness.resolved(number):
            return f" (--size {name} has {number:.2g})"
    return ""


def _sinking(sph: Any) -> Iterator[str]:
    """Ground that begins without pressure goes down in a layer that gives way to it at the speed of its impedance,
    g L / c (L the depth of the ground, c the late sound speed): seconds do not show it, minutes do."""
    late, target = sph.late, sph.target
    if late is None or target.start != "literal" or not target.flat or not _layers(sph):
        return
    way = sum(target.gravity * target.radius * time / speed for _, time, speed in late.spans(sph.end_time))
    if way > SINKING * sph.impact.expected_transient_diameter:
        yield (
            f'ground with start = "literal" carries no weight and sinks into its {" and ".join(_layers(sph))} layer, '
            f"here by up to {readable.length(way)} (g L / c times the time at each late sound speed); "
            f'[target] start = "relaxed" rests on it'
        )


def _at_the_edge(settings: Mapping[str, Model], sph: Any, outside: Mapping[str, Path]) -> Iterator[str]:
    """A bed that reaches the edge of flat ground, where particles lack neighbours and round off its surface."""
    bed: Any = settings.get("bed")
    if bed is None or "bed" in outside or not sph.target.flat:
        return
    target, wide = sph.target, bed.arc_radius
    edge = target.radius if target.shape == "half_sphere" else target.half_width
    room = edge - ROUGH * float(sph.zones.spacing(np.array([edge]))[0])
    if wide > room:
        yield (
            f"[bed] arc_radius = {readable.length(wide)} reaches the edge of the ground, {readable.length(edge)} from "
            f"the impact, where the surface to carve is rounded off: take {readable.length(room)} or less, or make "
            "the ground wider"
        )


def _without_strength(sph: Any) -> Iterator[str]:
    """Solid layers whose material says nothing of its strength."""
    rows, materials = sph.chosen_materials().rows, sph.chosen_materials()
    for name in sph.target.materials if sph.strength else ():
        if name not in LIQUIDS and rows.shear[materials.index(name)] == 0.0:
            yield (
                f"{name} bears no shear and flows like a liquid: nothing is known of its strength here; give "
                f"[sph.materials.{name}] strength, its table, and elastic"
            )


def _cohesion_once(settings: Mapping[str, Model], sph: Any) -> Iterator[str]:
    """Cohesion of the loose ground in one stage alone: the other would flow where this one holds."""
    dem: Any = settings.get("dem")
    ground, materials = sph.target.layers[-1].material, sph.chosen_materials()
    if dem is None or not sph.strength or (soil := materials.loose(ground)) is None:
        return
    holds = soil.cohesion > 0.0 and not materials.predamaged(ground)
    if holds == (dem.contact.cohesion != "none"):
        return
    alone = (
        "the ground of the shock stage has cohesion and its grains none"
        if holds
        else "the grains have cohesion and the shock stage none"
    )
    yield (
        f'{alone}: with [dem.contact] cohesion = "zhang" shear keeps {angle_of_friction.COHESION_LEFT:.2%} of the '
        f"pull between grains, and ground that is broken from the start (predamaged) has none"
    )


def _layers(sph: Any) -> dict[str, float]:
    from sph.stepping import sides_and_floor

    return sides_and_floor.layers(sph)


def crater(sph: Any) -> Any:
    """The crater that the settings of the shock stage expect (``pipeline.case.expected_crater``)."""
    from pipeline.case import expected_crater

    diameter = sph.impact.expected_transient_diameter
    return expected_crater.of_case(sph.target, sph.impact, sph.chosen_materials(), sph.strength, sph.damage, diameter)


def _regime(settings: Mapping[str, Model], sph: Any, stages: tuple[str, ...]) -> Iterator[str]:
    from sph.planning import durations
    from sph.strength import dispatch as strengths

    expected = crater(sph)
    if expected.held and "dem" in stages:
        yield "strength holds this crater, and the case asks for a collapse of loose grains: they will let it slump"
    materials, ground = sph.chosen_materials(), expected.material
    i, rows = materials.index(ground), materials.rows
    rock = strengths.FAMILY.having("RUBS")[rows.strength[i]]  # metals are as strong at any size
    if expected.held and expected.ground.strength > 0.0 and rock and not (sph.damage and rows.flawed[i] > 0.0):
        yield (
            f"the strength of {ground} ({_pressure(expected.ground.strength)}) does not fall with size: no [weibull], "
            f"or damage is off; rock {readable.length(expected.diameter)} wide is weaker than a sample"
        )
    if "crater" in stages and not (sph.late and sph.late.switches):
        time = durations.crater_time(sph.target, sph.impact, sph.chosen_materials(), sph.strength, sph.damage)
        if sph.end_time < formation_time.ENOUGH * time:
            yield (
                f"the shock stage ends at {readable.clock(sph.end_time)}: the crater is expected to grow for "
                f"{readable.clock(time)}"
            )


def in_words(settings: Mapping[str, Model]) -> str:
    """What is expected of the crater, and whether weight or strength ends its growth; nothing where no shock stage of
    this project is in the case."""
    sph: Any = settings.get("sph")
    if not hasattr(sph, "zones"):
        return ""
    expected = crater(sph)
    if "crater" not in settings and (broken := _breaks(sph)):
        return broken
    weight, strength = expected.weight, expected.ground.strength
    compared = None if sph.target.solid else settings.get("crater")  # of an ellipsoid or mesh it is not filled in
    kind = getattr(compared, "ground", expected.ground.kind)
    size = readable.length(expected.diameter)
    text = f"expected transient crater: {size} in {expected.material}, by the scaling laws of {kind}"
    if weight <= 0.0:
        return (
            f"{text}; without gravity only strength ({_pressure(strength)}) ends its growth"
            if strength > 0.0
            else f"{text}; nothing ends its growth"
        )
    if expected.material in LIQUIDS:
        ends = "" if "dem" in settings else ": the chain ends with the shock stage"
        return f"{text}; waves close a cavity in a liquid, not grains{ends}"
    if strength <= 0.0:
        return f"{text}; the ground has no cohesion: gravity regime (rho g D = {_pressure(weight)})"
    collapses = "dem" in settings
    verdict = (
        "strength holds it" + ("" if collapses else ": the chain ends with the shock stage and the measuring")
        if expected.held
        else "gravity regime" + (": a collapse stage follows" if collapses else "")
    )
    return (
        f"{text}; its strength at this size is {_pressure(strength)}, {strength / weight:.2g} times rho g D = "
        f"{_pressure(weight)}: {verdict}"
    )


def _breaks(sph: Any) -> str:
    """What becomes of a body that breaks as a whole; nothing of any other."""
    from pipeline.case import expected_crater

    target = sph.target
    try:
        free = expected_crater.of_case(target, sph.impact, sph.chosen_materials(), sph.strength, sph.damage)
    except InputError:
        return ""
    if not free.breaks:
        return ""
    return (
        f"no crater is expected: by the scaling laws one would be more than {expected_crater.WHOLE:g} times as wide "
        f"as the body, which breaks as a whole ({_disruption(sph):.2g} of the energy that leaves half of its mass in "
        "one piece); the run ends with what stays bound and whole"
    )


def _disruption(sph: Any) -> float:
    """Energy of the impact over that after which the largest piece of the body has half of its mass."""
    from sph.outcome import disruption

    target, impact, materials = sph.target, sph.impact, sph.chosen_materials()
    whole = at_rest.surface_gravity(target, materials.at_rest) * target.radius**2 / G
    ball = float(materials.bulk_density[materials.index(impact.projectile.material)]) * impact.projectile.volume
    kind = "ice" if target.layers[-1].material.startswith("ice") else "rock"
    return disruption.energy_ratio(ball, impact.speed, whole, target.radius, kind)


def _pressure(value: float) -> str:
    for unit, scale in (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)):
        if value >= 0.9995 * scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value:.3g} Pa"
