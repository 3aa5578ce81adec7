"""The bed of a solid body: the whole of it as grains, without walls, with its report.

``bed.vtkhdf`` holds the grains in the inertial frame of the run at the moment of the impact: they move with the body's
rotation, v = omega x x, as the particles of the shock stage do; in the turning frame they rest.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from dem.beds import bed_files, bed_measures, slopes, solid_packing
from dem.beds.blocks import block_grains, body_settling
from dem.beds.blocks.block_grains import BlockGrains
from dem.beds.blocks.body_settling import BodyBlockSettling
from dem.beds.finishing import finish
from dem.beds.settings import Settings
from dem.beds.solid_body import SolidBody
from dem.beds.solid_settling import SolidSettling
from dem.contact.columns import RADIUS
from dem.contact.settings import SPECIES
from dem.grains.assembly import Assembly
from dem.trials import friction_angle
from matter.blocks import block_file
from matter.errors import InputError
from matter.particles import Particles


def maker(settings: Settings, target: Path) -> Callable[[Path], None]:
    """Check the settings against the body; what is returned makes the bed in a folder."""
    if settings.shape not in ("auto", "whole"):
        raise InputError(
            f'[bed] shape = "{settings.shape}" is for spheres; of an ellipsoid or mesh the "whole" is filled, or a '
            f"bowl, box or cylinder of its ground that is laid flat"
        )
    if settings.packing not in ("rcp", "loose") or settings.largest_speed is not None:
        raise InputError(
            f'[bed] packing = "{settings.packing}" and largest_speed are for flat ground (bowl, box, cylinder)'
        )
    if not settings.contact.linear:
        raise InputError(
            f"[bed] a whole body is settled with springs of constant stiffness: normal = "
            f'"{settings.contact.normal}" is not for it'
        )
    body = SolidBody.read(target, settings.target)
    if SPECIES[settings.contact.species_of(body.material)] == "ocean":
        raise InputError(f"[bed] a body of {body.material} has no friction that could hold its shape")
    if body.spin_over_shedding >= 1.0:
        raise InputError(
            f"[target] spin_period: the body turns at {body.spin_over_shedding:.3g} of the rate at which its equator "
            f"would weigh nothing; loose grains leave it"
        )
    return lambda out: _make(settings, body, out, block_file.of_target(target))


def _settling(
    settings: Settings, body: SolidBody, blocks: Particles | None
) -> tuple[SolidSettling, BlockGrains | None]:
    """How the body settles, and which of its ``blocks`` are grains; None where it has none."""
    seeds = np.random.SeedSequence(settings.seed).spawn(2)
    radius = solid_packing.radii(settings.count, settings.radius_spread, body.solid, seeds[0])
    sinks = 0.0
    if settings.packing == "loose":
        fraction = friction_angle.measure(settings.contact)["fraction"]
        radius, sinks = solid_packing.loosely(radius, body.solid, fraction)
    law = body, settings.contact, bed_files.RESIDUAL_SPEED, sinks
    large = None
    if blocks is not None:
        large = block_grains.of_body(blocks, block_file.digest(blocks), body.distance, float(radius.mean()))
    if large is not None and len(large.number):
        lifted = body_settling.lifted(large)
        radius = body_settling.between(radius, body, lifted)
        points = solid_packing.centres(radius, body.solid, body.distance, seeds[1], lifted.keeps_out)
        return BodyBlockSettling(points, radius, *law, lifted), large
    points = solid_packing.centres(radius, body.solid, body.distance, seeds[1])
    return SolidSettling(points, radius, *law), large


def _make(settings: Settings, body: SolidBody, out: Path, blocks: Particles | None) -> None:
    work, large = _settling(settings, body, blocks)
    bed, facts = finish(work, out)
    slope = slopes.surface_slopes(body, bed.mean_radius)
    report = report_of(bed, work, settings, slope) | facts
    names, of_blocks = [body.material], {}
    fields: dict[str, np.ndarray] = {}
    if large is not None:
        of_blocks = {block_file.DIGEST: large.digest}
        fields = with_blocks(bed, body, large, report)
        names = body_settling.materials(body, large) if fields else names

    def picture(path: Path) -> None:
        from dem.beds import bed_pictures

        bed_pictures.whole_body(bed, body, slope, report, path)

    def where() -> str:
        most = report["moved_most"]
        return (
            f"; moved most: {most['radii']:.3g} radii at latitude {most['latitude_deg']:.3g} deg, longitude "
            f"{most['longitude_deg']:.3g} deg. {report['slopes_in_words']}"
        )

    bed_files.leave(
        bed,
        settings,
        report,
        out,
        picture,
        where,
        fields,
        frame="solid",
        materials=names,
        domain={"shape": "whole", "radius_m": body.solid.radius, "angular_velocity_1_s": body.omega.tolist()},
        **of_blocks,
    )


def with_blocks(bed: Assembly, body: SolidBody, large: BlockGrains, report: dict[str, Any]) -> dict[str, np.ndarray]:
    """The field ``block`` of the grains in the order of their identities (none where no block is a grain), and what
    the ``report`` says of blocks; its solid fraction is that of the grains between them."""
    grains = bed.particles({}, tables=False)
    grains["block"] = np.full(len(grains), -1)
    grains["block"][len(grains) - len(large.number) :] = large.number
    report["blocks"] = block_grains.facts(large, grains, report["mass_kg"])
    if len(large.number) == 0:
        return {}
    x, r, block = grains.position, grains.radius, grains.block
    mean = float(r[block < 0].mean())
    bulk = body.distance.at(x)[0] > solid_packing.BULK_DEPTH * mean
    report["packing_fraction"] = block_grains.packing_fraction(x, r, bulk, block)
    return {"block": block}


def axes_of_inertia(mass: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Full axes (3,) [m], the longest first, of the even ellipsoid with the mass and the second moments of points."""
    away = position - (mass @ position) / mass.sum()
    moments = np.linalg.eigvalsh(np.einsum("i,ij,ik->jk", mass, away, away) / mass.sum())
    return np.asarray(2.0 * np.sqrt(5.0 * moments[::-1]))


def in_words(slope: dict[str, Any]) -> str:
    """What the slopes say of the shape, in a sentence."""
    where = (
        f"{slope['largest_deg']:.3g} deg at latitude {slope['largest_at_latitude_deg']:.3g} deg, longitude "
        f"{slope['largest_at_longitude_deg']:.3g} deg"
    )
    fraction, angle = slope["share_above_friction_angle"], slope["friction_angle_deg"]
    if fraction == 0.0:
        return f"No slope of the body is steeper than its grains' {angle:.3g} deg; the steepest: {where}."
    return (
        f"{fraction:.2g} of the body's surface is steeper than its grains' {angle:.3g} deg (the steepest: {where}): "
        f"there friction alone does not hold it."
    )


def report_of(bed: Assembly, work: SolidSettling, settings: Settings, surface: slopes.Slopes) -> dict[str, Any]:
    """Everything that says how good the bed is."""
    body = work.ground
    angle = friction_angle.measure(settings.contact)["angle_deg"]
    slope = surface.against(angle, body)
    z, rattlers = bed_measures.coordination(bed, np.ones(len(bed.X), dtype=bool))
    axes, wanted = axes_of_inertia(bed.mass, bed.position), _axes_of(body)
    moved = work.moved(bed) / bed.mean_radius
    most = int(np.argmax(moved))
    latitude, longitude = body.latitude_longitude(bed.position[most : most + 1])
    turning = np.array(body.solid.inertia * body.density @ body.omega)
    speed = work.moving(bed)
    return {
        "grains": len(bed.X),
        "mean_radius_m": bed.mean_radius,
        "packing_fraction": solid_packing.bulk_fraction(bed.position, bed.X[:, RADIUS], body.distance),
        "grain_volume_over_body": float(np.sum(4.0 / 3.0 * np.pi * bed.X[:, RADIUS] ** 3) / body.solid.volume),
        "coordination_number": z,
        "rattler_share": rattlers,
        "residual_speed_over_sqrt_g_r": {key: speed[key] for key in ("rms", "max", "unit_m_s")},
        "mass_kg": float(bed.mass.sum()),
        "mass_error": float(bed.mass.sum() / body.mass - 1.0),
        "mass_correction_max": work.correction,
        "centre_of_mass_m": (bed.mass @ bed.position / bed.mass.sum()).tolist(),
        "axes_of_inertia_m": axes.tolist(),
        "axes_of_inertia_target_m": wanted.tolist(),
        "axes_error_max": float(np.abs(axes / wanted - 1.0).max()),
        "momentum_kg_m_s": bed.momentum().tolist(),
        "angular_momentum_kg_m2_s": bed.angular_momentum().tolist(),
        "angular_momentum_target_kg_m2_s": turning.tolist(),
        "spin_over_shedding": body.spin_over_shedding,
        "slopes": slope,
        "slopes_in_words": in_words(slope),
        "moved_most": {
            "radii": float(moved[most]),
            "rms_radii": float(np.sqrt(np.mean(moved**2))),
            "latitude_deg": float(latitude[0]),
            "longitude_deg": float(longitude[0]),
        },
        "pull_interval_s": bed.pull_interval,
        "pull_removed_over_weight": work.most_removed,
        "overlap": bed_measures.overlaps(bed),
        "time_step_s": bed.dt,
    }


def _axes_of(body: SolidBody) -> np.ndarray:
    """Those of the body itself, at uniform density."""
    moments = np.linalg.eigvalsh(0.5 * np.trace(body.solid.inertia) * np.eye(3) - body.solid.inertia)
    return np.asarray(2.0 * np.sqrt(5.0 * moments[::-1] / body.solid.volume))
