"""Stage 3, the bed: a settled random packing of grains that stands for the outer layers of the body without
projectile.

Random points in the domain are brought apart and come down onto each other with friction, as loose as steady shear
leaves them (``dem.beds.loose_packing``); or, packed closely, they are relaxed without friction or gravity and loaded
with the body's own gravity. The grains above the datum (the *headroom*, from which a crater's rim can later be carved)
are away while the bed comes to rest, so that carving them leaves its stress as it is. Masses are set from the
measured packing fraction so that the bulk density is that of the body.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dem import used_contact_laws
from dem.beds import (
    bed_files,
    bed_measures,
    expected_grains,
    extent,
    flat_bed,
    flat_ground,
    grain_packing,
    patch,
    settling,
    solid_bed,
)
from dem.beds.blocks import block_grains
from dem.beds.finishing import finish
from dem.beds.layered_body import LayeredBody
from dem.beds.loose_packing import LooseBed
from dem.beds.settings import Settings
from dem.beds.solid_body import SolidBody, is_solid
from dem.contact.columns import RADIUS
from dem.grains.assembly import Assembly
from dem.trials import friction_angle
from matter.blocks import placing
from matter.case.body import Target
from matter.errors import InputError
from matter.geometry.ground_region import Cone
from matter.wording import readable

STEPS = 3600
"""Steps to settle a bed of 20,000 grains, from random points to rest (8640 for 100,000: as the number's root, see
docs/results)."""
GRAIN_STEPS_PER_S = 2.4e6
"""Grain steps per second of one core while settling, lists and measures included (measured on an AVX-512 core: 3.0e6
at 20,000 grains, 1.9e6 at 100,000)."""
FLAT_STEPS, FLAT_GROWTH, HEXAGONAL_FRACTION = 32_000, 0.5, 0.54
"""Steps to settle 20,000 grains in flat ground, how they grow with the number, and the fraction of a hexagonal
packing. Measured: 24,900 at 20,000 grains in a cylinder; 21,500 at 5,000 and 51,700 at 14,000 in bowls, 27,700 of
these in a hexagonal packing."""

BODY_STEPS, BODY_GROWTH = 21_500, 0.36
"""Steps to settle a whole body of 20,000 grains, and how they grow with the number. Measured: 17,870 at 12,000 grains,
24,797 at 30,000 (Dimorphos)."""


idle_sources = used_contact_laws.of_bed


def domain_of(settings: Settings, body: LayeredBody) -> Cone:
    """The domain that the settings ask for; ``InputError`` when the body cannot hold it."""
    if settings.depth is not None:
        core = body.radius - settings.depth
        if core <= 0.0:
            raise InputError(
                f"[bed] depth = {settings.depth:.6g} m reaches the body's centre (radius {body.radius:.6g} m)"
            )
    else:
        inner = float(body.outer[0]) if len(body.outer) > 1 else 0.1 * body.radius
        core = max(inner, body.radius - extent.DEPTH * settings.impact.expected_transient_diameter)
    angle = settings.arc_radius / body.radius
    if angle >= 0.5 * math.pi:
        limit = 0.5 * math.pi * body.radius
        raise InputError(
            f"[bed] arc_radius = {settings.arc_radius:.6g} m must be below a quarter of the circumference, "
            f"{limit:.6g} m"
        )
    top = body.radius + settings.headroom_fraction * settings.impact.expected_transient_diameter
    floor_layer = int(body.layer_of(np.array([core]))[0])
    species = settings.contact.species_of(body.materials[floor_layer])
    return Cone(core, body.radius, top, angle, 0.0, 0.0, species)


def _damped(domain: Cone, settings: Settings, mean_radius: float, wave_speed: float) -> Cone:
    """The domain with its damped layer: an outgoing wave is down to 5 % when it has come back from the cone."""
    width = bed_files.DAMPED_LAYERS * 2.0 * mean_radius
    rate = 4.5 * wave_speed / width if width > 0.0 else 0.0
    return replace(domain, damped_width=width, damping_rate=rate)


def steps(settings: Settings) -> float:
    """Expected number of steps from random points to rest."""
    n, target = settings.count, patch.target_of(settings)
    if target.solid:
        return BODY_STEPS * (n / 20_000) ** BODY_GROWTH
    if not target.flat and not expected_grains.hard(settings):
        return STEPS * math.sqrt(n / 20_000)
    kind = FLAT_STEPS * (HEXAGONAL_FRACTION if settings.packing.startswith("hcp") else 1.0)
    return kind * (n / 20_000) ** FLAT_GROWTH


def predict(settings: Settings) -> dict[str, float]:
    """Wall time with warm kernels [s], memory and disk [bytes], the grains' number below the datum and their time
    step."""
    n = settings.count
    threads = settling.threads_for(n)
    grains = expected_grains.expected(settings)
    wall = 3.0 + n * steps(settings) / (GRAIN_STEPS_PER_S * threads)
    return {
        "wall_s": wall,
        "memory_bytes": 2.5e8 + 2500.0 * n,
        "disk_bytes": 230.0 * n,
        "checkpoint_bytes": 950.0 * n,
        "bed_grains": grains.below,
        "bed_step": grains.step,
        "bed_radius": grains.radius,
    }


def explain(settings: Settings) -> list[str]:
    """What the grains are, and what the cost follows from, in words."""
    grains, crater = expected_grains.expected(settings), 0.5 * settings.impact.expected_transient_diameter
    found = placing.of_target(settings.target)
    if settings.target.solid and not settings.on_patch:
        return [
            f"{settings.count:,} grains (count) of {readable.length(grains.radius)} fill the body: "
            f"{crater / grains.radius:.2g} per crater radius ({readable.length(crater)})",
            f"{steps(settings):,.0f} steps to rest; a contact law's first bed also measures its friction angle "
            f"(a minute or two, kept)",
            *([] if found is None else [_blocks_of_body(found, settings, grains.radius)]),
        ]
    wide, target = settings.arc_radius, patch.target_of(settings)
    size = readable.length(grains.radius)
    if target.flat:
        edge = float(expected_grains.of_flat(settings, target)[1].at(np.array([wide]))[0])
        size += f", growing to {readable.length(edge)} at the edge," if edge > grains.radius else ""
    blocks = []
    if found is not None:
        container, sizes, _ = expected_grains.of_flat(settings, target)
        blocks = [block_grains.worded(found, lambda x, r: block_grains.fits(x, r, container, sizes))]
    return [
        f"{settings.count:,} grains (count) of {size} in a bed of {readable.length(wide)} radius: "
        f"{crater / grains.radius:.2g} per crater radius ({readable.length(crater)})",
        f"its radius is {wide / extent.settled_radius(settings.impact):.2g} times that of the widest settled crater "
        f"expected ({readable.length(extent.settled_radius(settings.impact))})",
        f"{steps(settings):,.0f} steps to rest",
        *blocks,
    ]


def _blocks_of_body(found: placing.Placing, settings: Settings, radius: float) -> str:
    distance = SolidBody.expected(settings.target, settings.densities).distance
    return block_grains.worded(found, lambda x, r: block_grains.fits_body(x, r, distance, radius))


def ground(settings: Settings) -> Target:
    """The target as the stages of grains see it: flat ground where the bed is a patch of a body's."""
    return patch.target_of(settings)


def threads(settings: Settings) -> int:
    """Threads that the bits of a settled bed depend on."""
    return settling.threads_for(settings.count)


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Make the bed: ``bed.vtkhdf``, ``bed_report.json``, ``bed.png`` in ``out``.

    Raises ``InputError`` when ``2_sph/target.json`` is missing or the domain does not fit, ``Unsound`` when the bed
    did not come to rest.
    """
    settings = settings.model_copy(update={"contact": friction_angle.resolved(settings.contact)})
    maker(settings, Path(inputs) / "2_sph" / "target.json")(out)


def maker(settings: Settings, target: Path) -> Callable[[Path], None]:
    """What makes the bed; ``InputError`` when settings and ground do not fit each other."""
    if flat_ground.is_flat(target):
        return flat_bed.maker(settings, flat_ground.FlatGround.read(target), target=target)
    if settings.on_patch and is_solid(target):
        found = patch.read(settings, target)
        return flat_bed.maker(settings, patch.ground_of(found.facts), found.facts)
    if is_solid(target):
        return solid_bed.maker(settings, target)
    body = LayeredBody.read(target)
    if settings.shape not in ("auto", "cap"):
        raise InputError(
            f'[bed] shape = "{settings.shape}" is for flat ground; a spherical target is filled as a "cap"'
        )
    if settings.packing not in ("rcp", "loose") or settings.largest_speed is not None:
        raise InputError(
            f'[bed] packing = "{settings.packing}" and largest_speed are for flat ground (bowl, box, cylinder)'
        )
    domain = domain_of(settings, body)
    return lambda out: _make(settings, body, domain, out)


def _make(settings: Settings, body: LayeredBody, domain: Cone, out: Path) -> None:
    seeds = np.random.SeedSequence(settings.seed).spawn(2)
    radius, loose = grain_packing.radii(settings.count, settings.radius_spread, domain, seeds[0]), None
    if settings.packing == "loose":
        loose = LooseBed.of_law(body, domain, settings.contact)
        radius = loose.radii(radius)
        points = loose.centres(radius, loose.raised(radius), grain_packing.random_points, seeds[1])
    else:
        points = grain_packing.random_points(radius, domain, seeds[1])
    work = settling.Settling(points, radius, body, domain, settings.contact, bed_files.RESIDUAL_SPEED, loose)
    bed, facts = finish(work, out)
    domain = _damped(domain, settings, bed.mean_radius, bed_files.wave_speed(bed))
    report = _report(bed, body, domain, facts)
    bed_files.leave(
        bed,
        settings,
        report,
        out,
        lambda path: _picture(bed, domain, report, path),
        frame="sphere",
        materials=list(dict.fromkeys(body.materials)),
        domain=domain.as_attribute(),
    )


def _report(bed: Assembly, body: LayeredBody, domain: Cone, facts: dict[str, float]) -> dict[str, Any]:
    """Everything that says how good the bed is."""
    g = float(body.gravity().strength(np.array(body.radius)))
    distance = np.linalg.norm(bed.position, axis=1)
    below = bed.headroom == 0
    shells = bed_measures.Shells(bed.position, bed.X[:, RADIUS], domain, 0.25 * bed.mean_radius, domain.datum)
    window = 5.0 * bed.mean_radius
    volume = 4.0 / 3.0 * np.pi * bed.X[:, RADIUS] ** 3
    phi = shells.smooth(np.asarray(shells.grain_volume.sum(axis=0)).ravel(), window)
    density = shells.smooth(shells.grain_volume.T @ (bed.mass / volume), window)
    wanted = shells.smooth(body.density(shells.middle) * shells.volume, window)
    radial, tangential = bed_measures.radial_stress(bed, shells, window)
    pressure = shells.smooth(body.pressure(shells.middle) * shells.volume, window)
    z, rattlers = bed_measures.coordination(bed, below)
    mass = body.mass_between(domain.floor, domain.datum, domain.solid_angle)
    area = domain.solid_angle * domain.floor**2
    return {
        "grains": len(bed.X),
        "grains_headroom": int((~below).sum()),
        "mean_radius_m": bed.mean_radius,
        "headroom_height_m": float(np.percentile(distance + bed.X[:, RADIUS], 99.0) - domain.datum),
        "packing_fraction": float(np.average(phi, weights=shells.volume)),
        "coordination_number": z,
        "rattler_share": rattlers,
        "residual_speed_over_sqrt_g_r": bed_measures.residual(bed, g),
        "mass_kg": float(bed.mass[below].sum()),
        "mass_error": float(bed.mass[below].sum() / mass - 1.0),
        "density_error_max": float(np.abs(density / wanted - 1.0).max()),
        "floor_pressure_Pa": bed_measures.floor_force(bed) / area,
        "floor_pressure_target_Pa": float(body.pressure(np.array(domain.floor))),
        "overlap": bed_measures.overlaps(bed),
        "time_step_s": bed.dt,
        **facts,
        "domain": domain.as_attribute(),
        "profile": {
            "radius_m": shells.middle.tolist(),
            "packing_fraction": phi.tolist(),
            "density_kg_m3": density.tolist(),
            "density_target_kg_m3": wanted.tolist(),
            "radial_stress_Pa": radial.tolist(),
            "tangential_stress_Pa": tangential.tolist(),
            "pressure_target_Pa": pressure.tolist(),
        },
    }


def _picture(bed: Assembly, domain: Cone, report: dict[str, Any], path: Path) -> None:
    from dem.beds import bed_pictures

    bed_pictures.bed(bed, domain, report, path)
