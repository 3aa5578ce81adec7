"""Stage 4, handoff: from the shock-physics cloud to the granular bed that goes on.

Reads ``2_sph/snap_*.vtkhdf``, ``2_sph/target.json`` and ``3_bed/bed.vtkhdf``; writes ``start.vtkhdf``,
``surface.ply``, ``ledger.json``, ``handoff.json`` (choice of time, sizes, residuals, mapped against direct),
``report.html`` and its pictures.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from handoff import away
from handoff.domains import domain as domains
from handoff.domains import turning
from handoff.ledger import Ledger
from handoff.ledger_rows import account, field_rows, shock_rows, whole_body_rows
from handoff.pages import handoff_report
from handoff.settings import Settings
from handoff.source import cloud_surface, flattening, grain_size, handoff_time, hydrostatic
from handoff.transfer import block_joining, compare_clouds, direct, transfer
from handoff.transfer import control as controls
from handoff.transfer.blocks import block_room
from handoff.transfer.handed import Handoff
from matter.case.body import Impact, Target
from matter.errors import InputError, Unsound
from matter.files import archive, snapshot
from matter.particles import Particles
from matter.progress import Progress
from matter.solids import pose_tracker
from matter.solids.placed import PATCH
from matter.wording import readable

# measured on one core of the 2-core build machine (AVX-512): see benchmarks/handoff.py
_S_PER_PARTICLE, _S_PER_GRAIN, _S_PER_SNAPSHOT_PARTICLE, _S_FIXED = 6e-5, 1.5e-4, 4e-6, 3.0
_S_BODY, _S_PER_BODY_PARTICLE = 24.0, 3.2e-4
"""What a whole body takes more: its surface and depths. Measured on two threads: 39.6 s for 27,617 particles and
12,000 grains, 73.4 s for 117,976 and 30,000 (Dimorphos)."""
_LOOKED_AT = 0.3
"""Fraction of the snapshots up to a little after the greatest depth, in the shipped cases."""
_BYTES_PER_PARTICLE, _BYTES_PER_GRAIN, _BYTES_FIXED = 4000.0, 3500.0, 3e8


def idle_sources(settings: Settings) -> set[Path]:
    """Files that this run does not take: its bibliography leaves out what only they cite."""
    return {Path(str(pose_tracker.__file__))} if settings.target is None or not settings.target.solid else set()


def predict(settings: Settings) -> dict[str, float]:
    """Wall time, memory and disk of this stage."""
    looked_at = _LOOKED_AT * settings.snapshots
    whole = settings.target is not None and settings.target.solid
    body = _S_BODY + _S_PER_BODY_PARTICLE * settings.particles if whole else 0.0
    diagnosis = looked_at * (0.05 + _S_PER_SNAPSHOT_PARTICLE * settings.particles) if settings.time == "auto" else 0.0
    return {
        "wall_s": _S_FIXED + _S_PER_PARTICLE * settings.particles + _S_PER_GRAIN * settings.grains + diagnosis + body,
        "memory_bytes": _BYTES_FIXED + _BYTES_PER_PARTICLE * settings.particles + _BYTES_PER_GRAIN * settings.grains,
        "disk_bytes": 1.5e6 + 120.0 * settings.grains + 60.0 * settings.particles,
    }


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Hand over. Raises ``InputError`` for inputs that cannot be, ``Unsound`` (all outputs written) when an unwaived
    limit fails."""
    bed = snapshot.read(inputs / "3_bed" / f"bed{snapshot.SUFFIX}")
    if settings.method == "direct" and "stiffness" not in bed:
        _needed(None)  # said before the work, not after it
    region = domains.read(bed.attributes, settings.target)
    patch = flattening.of_bed(bed, settings.target, inputs / "2_sph")
    column = patch.column if patch else column_for(inputs, region)
    rules = cloud_surface.Rules(**{name: getattr(settings, name) for name in cloud_surface.Rules.model_fields})
    progress = Progress("handoff", 1.0)
    choice, as_it_is = chosen_source(settings, rules, inputs / "2_sph", bed, region, column, progress, patch)
    source = flattening.to_bed(as_it_is, region, patch)
    progress.update(0.6, "surface and transfer", force=True)
    settled = bed
    bed, handoff = _handed(source, settled, rules, column, region, settings.until or math.inf)
    if handoff.blocks is not None and settings.method == "direct":
        raise InputError('[handoff] method = "direct" makes no grains of blocks: method must be "mapped"')
    mapped = account.ledger_of(handoff, source, bed, column, settings.waive)
    straight = direct.hand_over(handoff, source, bed, column) if "stiffness" in bed else None
    table = direct.compare(handoff, straight, mapped, bed) if straight else None
    ledger = mapped
    if settings.method == "direct":
        ledger = account.ledger_of_direct(_needed(straight), handoff, source, bed, column, settings.waive)
    shock_rows.time_row(ledger, handoff, float(source.attributes.get("time", 0.0)), choice, column)
    start = _needed(straight).start if settings.method == "direct" else handoff.start
    if settings.control != "none":
        start = controls.start(settings.control, handoff, settled)
    start = turning.to_run(start, region)
    if settings.method == "mapped":
        whole_body_rows.enter(ledger, handoff, as_it_is, turning.to_run(handoff.start, region))
    ledger.complete()
    progress.update(0.85, "writing", force=True)
    start.attributes |= _measuring(source, region, patch, settings.impact)
    named = start.attributes.get("materials", [])
    start.attributes["reference_densities_kg_m3"] = cloud_surface.solid_densities(source, named)
    start.attributes |= away.leave(settings, handoff, as_it_is, inputs, out)
    snapshot.write(start, out / f"start{snapshot.SUFFIX}")
    if patch is not None:
        snapshot.write(source, out / flattening.FILE)
    with archive.replacing(out / "surface.ply") as temporary:
        handoff.carving.solid.mesh.export(str(temporary), file_type="ply")
    ledger.write(out / "ledger.json")
    record = _record(handoff, source, bed, choice, settings) | {
        "method": settings.method,
        "methods": table,
        "control": settings.control,
    }
    if settings.method == "direct":
        count = _needed(straight).compact
        record["grains"] = {"bed": len(bed), "kept": count, "ejecta": len(start) - count}
    archive.write_json(out / "handoff.json", record)
    _write_residuals(handoff, source, bed, out / "residuals.h5")
    handoff_report.write(inputs, out)
    progress.update(1.0, "done", force=True)
    if ledger.failures:
        raise Unsound(f"handoff: {', '.join(ledger.failures)} beyond the limit; see {out / 'report.html'}")


def hand_over(
    source: Particles,
    bed: Particles,
    rules: cloud_surface.Rules | None = None,
    column: hydrostatic.Column | None = None,
    waive: dict | None = None,
    target: Target | None = None,
    until: float = math.inf,
) -> tuple[Particles, Ledger]:
    """Hand a shock-physics snapshot over to a settled bed.

    Parameters
    ----------
    source : SPH particles with position, velocity, mass, density, material; attributes ``time``, ``materials``.
    bed : settled grains with identity, position, mass, radius, material; attributes ``domain``, ``frame``,
        ``materials``.
    rules : how ejecta are told from compact material and how the surface is drawn; the defaults when None.
    column : undisturbed pressure and gravity against height; from the source's field ``gravity`` when None.
    waive : limit -> reason.
    target : the body, where that is an ellipsoid or mesh (``source`` and what is returned are in the inertial frame).
    until : when the collapse ends at the latest [s after the impact]: about such a body what comes back later stays in
        the list, as what escapes.

    Returns the bed that the granular stage starts from, and the ledger. Raises ``InputError`` for inputs that cannot
    be handed over.
    """
    rules, region = rules or cloud_surface.Rules(), domains.read(bed.attributes, target)
    if PATCH in bed.attributes and source.attributes.get("frame") == "solid":
        raise InputError(
            "the bed is a patch of a body laid flat: lay the source flat before (handoff.source.flattening)"
        )
    column = column or column_of(source, region)
    as_it_is, source = source, turning.to_bed(source, region)
    bed, handoff = _handed(source, bed, rules, column, region, until)
    start = turning.to_run(handoff.start, region)
    ledger = account.ledger_of(handoff, source, bed, column, waive or {})
    shock_rows.time_row(ledger, handoff, float(source.attributes.get("time", 0.0)), None, column)
    whole_body_rows.enter(ledger, handoff, as_it_is, start)
    ledger.complete()
    return start, ledger


def _handed(
    source: Particles,
    settled: Particles,
    rules: cloud_surface.Rules,
    column: hydrostatic.Column,
    region: domains.Domain,
    until: float,
) -> tuple[Particles, Handoff]:
    """The bed that takes the source over, which is the ``settled`` one without its blocks, and the transfer."""
    bed, blocks = block_room.set_apart(source, settled, region, column)
    handoff = transfer.hand_over(source, bed, rules, column, region, until, blocks)
    if blocks is None:
        return bed, handoff
    return bed, replace(handoff, start=block_joining.joined(handoff.start, blocks, source, settled, region))


def column_of(source: Particles, region: domains.Domain) -> hydrostatic.Column:
    """A column of the gravity found in the source near the datum and of no pressure. Raises ``InputError`` without the
    field ``gravity``."""
    if "gravity" not in source:
        raise InputError("no profile of the undisturbed target was given and the source carries no field 'gravity'")
    near = np.abs(region.frame.height(source.position)) < 0.1 * region.arc
    g = float(np.median(np.linalg.norm(source.gravity[near], axis=1))) if near.any() else 0.0
    if not g > 0.0:
        raise InputError("the source's field 'gravity' is zero near the datum")
    height = np.array([region.span[0], 0.0])
    radius = float("inf") if isinstance(region, domains.Upright) else region.datum
    return hydrostatic.Column(height, np.zeros(2), np.full(2, g), radius, g)


def _measuring(
    source: Particles, region: domains.Domain, patch: flattening.Patch | None = None, impact: Impact | None = None
) -> dict[str, Any]:
    """How a crater in the grains is measured (``crater.results.measurement_config``): as in the shock stage, over the
    bed's datum and against the settled bed."""
    carried = source.attributes.get("measuring")
    if patch is not None and impact is not None:
        carried = patch.measuring(impact.expected_transient_diameter)
    if not isinstance(carried, dict):
        return {}
    datum = carried["datum"]
    if isinstance(region, domains.Cone):
        datum = {
            "kind": "sphere",
            "radius_m": region.datum,
            "centre_m": [0.0, 0.0, 0.0],
            "source": "datum of the granular bed",
        }
    return {"measuring": {**carried, "datum": datum, "before": f"../3_bed/bed{snapshot.SUFFIX}"}}


def _needed(straight: direct.Direct | None) -> direct.Direct:
    if straight is None:
        raise InputError(
            "[handoff] method = \"direct\" needs a bed with the field 'stiffness': contact stiffness per radius is "
            "taken from it"
        )
    return straight


def column_for(inputs: Path, region: domains.Domain) -> hydrostatic.Column:
    """The undisturbed column of the run's target about the bed's datum."""
    datum = 0.0 if isinstance(region, domains.Upright) else region.datum
    return hydrostatic.read(inputs / "2_sph" / "target.json", datum)


def chosen_source(
    settings: Settings,
    rules: cloud_surface.Rules,
    folder: Path,
    bed: Particles,
    region: domains.Domain,
    column: hydrostatic.Column,
    progress: Progress | None = None,
    patch: flattening.Patch | None = None,
) -> tuple[handoff_time.Choice | None, Particles]:
    """The snapshot to hand over, by ``settings.time``, and how it was chosen (None when it was given)."""
    paths = handoff_time.files(folder)
    if settings.time == "last":
        return None, snapshot.read(paths[-1])
    if settings.time != "auto":
        times = np.array([snapshot_time(path) for path in paths])
        nearest = int(np.argmin(np.abs(times - settings.time)))
        gap = float(np.max(np.diff(times))) if len(times) > 1 else np.inf
        if abs(times[nearest] - settings.time) > gap:
            raise InputError(
                f"no snapshot near {readable.clock(settings.time)}: the series runs from {readable.clock(times[0])} "
                f"to {readable.clock(times[-1])}"
            )
        return None, snapshot.read(paths[nearest])
    series, earlier = [], None
    for number, (path, as_it_is) in enumerate(zip(paths, _read_ahead(paths))):
        source = flattening.to_bed(as_it_is, region, patch)
        series.append(handoff_time.diagnose(source, earlier, path.name, region, column, rules))
        earlier = source
        if progress:
            progress.update(0.6 * (number + 1) / len(paths), f"looking at {path.name}")
        if handoff_time.decided(series):
            break
    choice = handoff_time.choose(series, grain_size.at_impact(bed), column.surface_gravity)
    return choice, snapshot.read(paths[choice.index])


def _read_ahead(paths: list[Path]) -> Iterator[Particles]:
    """What a diagnosis needs of each snapshot, read while the one before it is looked at."""
    with ThreadPoolExecutor(1) as reader:
        coming = reader.submit(snapshot.read, paths[0], handoff_time.FIELDS)
        for following in [*paths[1:], None]:
            ready = coming.result()
            if following is not None:
                coming = reader.submit(snapshot.read, following, handoff_time.FIELDS)
            yield ready


def snapshot_time(path: Path) -> float:
    """Time of a snapshot [s]."""
    return float(snapshot.attributes(path).get("time", 0.0))


def _record(
    handoff: Handoff, source: Particles, bed: Particles, choice: handoff_time.Choice | None, settings: Settings
) -> dict:
    region = handoff.region
    return {
        "time_s": float(source.attributes.get("time", 0.0)),
        "snapshot": choice.series[choice.index].file if choice else None,
        "choice": choice.as_table() if choice else {"reason": "as set in the case"},
        "speed_limit_m_s": handoff.split.speed_limit,
        "alpha_spacings": settings.alpha,
        "offset_spacings": handoff.carving.offset,
        "particles": handoff.split.counts(),
        "grains": {"bed": len(bed), "kept": int(handoff.carving.stays.sum()), "ejecta": len(handoff.ejecta.mass)},
        "cavity": {
            "radius_m": handoff.carving.size.radius,
            "depth_m": handoff.carving.size.depth,
            "volume_m3": handoff.carving.size.volume,
            "rim_height_m": handoff.carving.size.rim_height,
            "centre_m": handoff.carving.size.centre.tolist(),
        },
        "local_momentum": [
            {"region": name, "relative": value, "share": fraction}
            for name, value, fraction in compare_clouds.local_momentum(handoff.mapped.fields, region)
        ],
        "ejecta_mass_kg": dict(handoff.ejecta.mass_by_state()),
        "ejecta_fates_kg": dict(handoff.ejecta.mass_by_fate()),
        **({} if handoff.blocks is None else {"blocks": handoff.blocks.as_table()}),
    }


def _write_residuals(handoff: Handoff, source: Particles, bed: Particles, path: Path) -> None:
    """What the report draws: the split, surface heights of both clouds, and the fields cell by cell."""
    number, size = field_rows.comparison_cells(handoff, source, grain_size.at_impact(bed))
    cells = compare_clouds.field_difference(field_rows.corrected_fields(handoff, source, bed), number, size)
    foot, distance, height, carved = handoff.carving.columns
    archive.write(
        path,
        {
            "source/reason": handoff.split.reason,
            "bed/stays": handoff.carving.stays,
            "columns/foot": (foot, "m", "point on the datum"),
            "columns/distance": (distance, "m", "distance along the datum from the axis"),
            "columns/height_source": (height, "m", "surface of the source above the datum"),
            "columns/height_bed": (carved, "m", "surface of the carved bed above the datum"),
            "cells/centre": (cells.centre, "m", "centre of a comparison cell"),
            "cells/mass": (cells.mass, "kg", "mass of the source in it"),
            "cells/before": (cells.before, "m/s", "mean velocity of the source"),
            "cells/after": (cells.after, "m/s", "mean velocity of the grains"),
            "correction/velocity": (
                handoff.mapped.change,
                "m/s",
                "change of velocity of each kept grain by the correction",
            ),
        },
    )
