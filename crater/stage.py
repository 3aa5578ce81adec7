"""Stage 6: from particles to a crater.

Reads ``2_sph`` (time series and transient crater, all-SPH late stage) and ``5_dem`` (final crater from settled
grains), whichever exist; leaves ``measures.json``, ``profile.csv``, ``profile_sph.csv``, ``time_series.csv``,
``compare.json``, ``heightmap.h5``, ``ejecta.h5``, pictures and ``report.html``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from crater.comparison import against_published
from crater.ejecta import ballistic, ejecta_flight, launch
from crater.ground import datum as datums
from crater.ground.datum import Datum
from crater.measures import blanket
from crater.pages import report
from crater.pages.one_snapshot import measure_snapshot
from crater.pictures import plot
from crater.results import handover, measurement_config, on_bodies, rest, series, soundness, tables, thrown_out
from crater.results.findings import (
    LATE_SHOCK,
    Ejected,
    Findings,
    GrainFindings,
    LastCrater,
    Setting,
    ShockFindings,
    densities,
    judged,
    with_chain_errors,
)
from crater.results.measurement_config import MeasurementConfig
from crater.scaling import crater_size as scaling
from crater.scaling import melt as melt_scaling
from crater.settings import RISE_LIMIT, Published, Settings
from crater.shock import decay as shock_decay
from crater.shock import phases, release, settled_matter
from matter.case import at_rest
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.geometry import tree
from matter.particles import Particles
from matter.progress import Progress
from matter.solids import pose_tracker
from matter.solids.placed import PATCH
from matter.solids.pose_tracker import PoseTracker
from matter.solids.tangent_map import TangentMap
from matter.wording import drawing
from matter.wording.crater_measures import MAXIMA

__all__ = ["Published", "Settings", "grain_datum", "measure_snapshot", "predict", "run"]

SECONDS_PER_SNAPSHOT = 0.42
"""Wall time per snapshot of 15,000 particles on one of 2 cores of a 2.1 GHz server; 2.4 s at 300,000."""


def idle_sources(settings: Settings) -> set[Path]:
    """Files that this run does not take: its bibliography leaves out what only they cite."""
    idle = {Path(str(launch.__file__))} if not settings.target.flat else set()
    if not settings.target.solid:
        idle |= {
            *(Path(__file__).parent / "bodies").glob("*.py"),
            *(Path(str(m.__file__)) for m in (tree, pose_tracker)),
        }
    weightless = {Path(str(module.__file__)) for module in (scaling, ejecta_flight)}
    return idle | (weightless if not settings.target.weighs else set())


def predict(settings: Settings) -> dict[str, float]:
    """Wall time, memory and disk: some 65 snapshots measured, a few pictures."""
    count, growth = 65, (settings.particles / 15_000) ** 0.58
    return {"wall_s": SECONDS_PER_SNAPSHOT * growth * count + 6.0, "memory_bytes": 6e8, "disk_bytes": 5e6}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Measure what the earlier stages left in ``inputs`` and write the result to ``out``.

    Raises ``InputError`` when neither ``2_sph`` nor ``5_dem`` holds a snapshot.
    """
    inputs = Path(inputs)
    shots = snapshot.series(inputs / "2_sph")
    grains = inputs / "5_dem" / f"last{snapshot.SUFFIX}"
    if not shots and not grains.is_file():
        file = snapshot.SUFFIX
        raise InputError(f"nothing to measure: {inputs} holds neither 2_sph/snap_0000{file} nor 5_dem/last{file}")
    settled = snapshot.series(inputs / "5_dem")
    progress = Progress("crater", total=float(len(shots) + len(settled) + 4))
    count = iter(range(1, len(shots) + len(settled) + 2))

    def heard(path: Path) -> None:
        progress.update(next(count), path.name)

    setting = Setting(
        settings, inputs, *_ground(settings, inputs), densities(settings, inputs, shots[0] if shots else None)
    )
    shape = on_bodies.shape_of(settings) if settings.target.solid else None
    setting = replace(setting, shape=shape, patch=_patch(inputs))
    shock = _follow_shock(setting, shots, heard) if shots else None
    findings = Findings(setting, shock, _measure_grains(setting, settled, grains, heard) if grains.is_file() else None)
    findings = on_bodies.with_body(with_chain_errors(_flown(_with_origins(findings)), settings.chain))
    findings = judged(findings, soundness.facts(inputs, _bed_radii(findings)))
    findings = replace(findings, compared=against_published.compared(findings))
    tables.write_tables(findings, out)
    progress.update(progress.total - 2, "pictures", force=True)
    if drawing.possible("the crater"):
        plot.draw_all(findings, out)
    progress.update(progress.total - 1, "page", force=True)
    report.write(findings, out)
    progress.update(progress.total, "done", force=True)


def _bed_radii(findings: Findings) -> float | None:
    """How many radii of the crater in the last grains their bed reaches; None where there is none to say."""
    last = findings.settled_grains
    wide = last.measures["diameter_apparent_m"].value if last else None
    return soundness.bed_radii(snapshot.attributes(last.path), wide) if last and wide else None


def _with_origins(findings: Findings) -> Findings:
    """With what the last grains say of where their matter came from."""
    last, volume = findings.settled_grains, findings.transient.get("volume")
    if findings.grains is None or last is None:
        return findings
    transient = volume.measures if volume is not None and volume.stage == "sph" else None
    seen = findings.grains.config.seen(snapshot.read(last.path))
    origin = settled_matter.facts(seen, last.measures, transient, findings.setting.event.mass)
    if findings.setting.shape is not None and findings.setting.patch is None:  # the far side is not laid flat
        origin.pop("over_projectile_mass", None)
    return replace(findings, grains=replace(findings.grains, matter=origin))


def _flown(findings: Findings) -> Findings:
    """With the free flight of what was handed over: an independent check of the crater's size on flat ground under
    gravity."""
    chosen, setting = findings.settings, findings.setting
    if not chosen.target.flat or not setting.gravity > 0.0:
        return findings
    size = chosen.impact.expected_transient_diameter
    try:
        return replace(
            findings,
            ballistic=ballistic.of_run(
                findings.inputs, setting.gravity, setting.densities[1], size, chosen.escape_speed
            ),
        )
    except InputError as reason:
        return replace(findings, flight_reasons={"ballistic": str(reason)})


def _ground(settings: Settings, inputs: Path) -> tuple[Datum, float]:
    """The datum of the undisturbed ground, and gravity there [m/s^2]: as the shock stage states them, else of the
    case's layers."""
    path = inputs / "2_sph" / "target.json"
    if path.is_file():
        facts = archive.read_json(path)
        if facts.get("frame") == "solid":
            gravity = float((_patch(inputs) or {}).get("gravity_m_s2", facts["surface_gravity_m_s2"]))
            return datums.plane(source="surface of the body before the impact, laid flat about the site"), gravity
        if facts.get("frame") == "plane":
            return datums.plane(source="undisturbed ground"), float(facts["surface_gravity_m_s2"])
        radius, gravity = float(facts["radius_m"]), float(facts["surface_gravity_m_s2"])
        return datums.sphere(
            radius, facts.get("centre", (0.0, 0.0, 0.0)), source="radius of the relaxed target"
        ), gravity
    if settings.target.solid:
        raise InputError(f"{path} is missing: it says how the body turned and where its companion stood")
    if settings.target.flat:
        return datums.plane(source="flat ground of the case"), settings.target.gravity
    gravity = at_rest.surface_gravity(settings.target, {})  # no shock stage, so nothing that a case says of materials
    return datums.sphere(settings.target.radius, source="uniform layers of the case"), gravity


def _patch(inputs: Path) -> Mapping[str, Any] | None:
    """What the bed says of the patch of a body's ground that it is; None of any other bed."""
    bed = inputs / "3_bed" / f"bed{snapshot.SUFFIX}"
    facts: Mapping[str, Any] | None = snapshot.attributes(bed).get(PATCH) if bed.is_file() else None
    return facts


def _config(
    setting: Setting, datum: Datum, before: Path | None, reach: float | None, ground: TangentMap | None
) -> MeasurementConfig:
    """The measurement configuration of one stage; its lengths are in expected transient diameters."""
    size = setting.settings.impact.expected_transient_diameter
    return MeasurementConfig(
        datum, before, setting.gravity, RISE_LIMIT * size,
        None if reach is None else reach * size, measurement_config.WITHIN * size, ground=ground,
    )  # fmt: skip


def _tangent_map(setting: Setting, before: Path | None) -> TangentMap | None:
    if setting.shape is None:
        return None
    if before is None:
        raise InputError(
            f"{setting.inputs / '3_bed'} holds no bed: grains of an ellipsoid or mesh are measured against it"
        )
    return TangentMap(
        setting.shape, PoseTracker(snapshot.read(before, ("identity", "position", "mass", "layer", "state")))
    )


def _follow_shock(setting: Setting, shots: Sequence[Path], heard: Callable[[Path], None]) -> ShockFindings:
    """Every snapshot of the shock stage measured, the transient crater and the last snapshot once more by all methods,
    and the ejecta."""
    reasons: dict[str, str] = {}
    chosen = _config(setting, setting.datum, shots[0], measurement_config.REACH, _tangent_map(setting, shots[0]))
    start = chosen.ground_before()
    moments = series.follow(shots[1:], "sph", chosen, start, heard)
    largest, grows = series.transient(moments)
    moving = rest.changes(moments)
    growing = tuple(key for key in grows if moving is None or MAXIMA[key] in moving)
    closely = {
        moment.path: series.again(moment, chosen, start) for moment in {m.path: m for m in largest.values()}.values()
    }
    transient = {key: closely[moment.path] for key, moment in largest.items()}
    if "volume" not in transient:
        reasons["transient"] = "no snapshot of the shock stage shows a crater"
    faster_than = {} if setting.shape else _faster_than(setting, transient.get("depth"))
    launched: dict[str, Any] = {}
    if setting.settings.target.flat and setting.gravity > 0.0:
        try:
            launched = _launches(setting, transient.get("volume"), shots)
        except InputError as reason:
            reasons["launch"] = str(reason)
    end = setting.inputs / "2_sph" / f"last{snapshot.SUFFIX}"
    path = end if end.is_file() else shots[-1]
    particles = snapshot.read(path)
    ejected = Ejected(_leaving(setting, particles), faster_than, launched)
    if "volume" in transient and setting.gravity > 0.0 and setting.shape is None:
        ejected, missing = thrown_out.of_run(
            setting, ejected, transient["volume"], "volume" in growing, shots[1:], particles
        )
        reasons |= missing
    time, last = float(particles.attributes.get("time", np.nan)), None
    try:
        measures = chosen.measured(particles, start, f"2_sph/{path.name}")
        state = rest.of_shock(setting.inputs / "2_sph" / "stage_report.json", moments)
        last = LastCrater(measures, time, LATE_SHOCK, path, state)
    except InputError as reason:
        reasons["late_sph"] = str(reason)
    molten, decay = phases.masses(particles, setting.event.mass), {}
    try:
        decay = shock_decay.facts(
            chosen.seen(particles), setting.datum, setting.settings.impact.projectile.radius
        )  # fmt: skip
    except InputError as reason:
        reasons["shock_decay"] = str(reason)
    heat = release.masses(particles, setting.event.mass)
    melt = melt_scaling.facts(setting.event, setting.settings.target.layers[-1].material)
    handed = handover.closely(handover.shock_snapshot(setting.inputs, shots[1:]), "sph", chosen, start)
    return ShockFindings(
        tuple(moments), transient, growing, time, path, last, ejected, chosen, reasons, molten, decay, heat, melt,
        handed,
    )  # fmt: skip


def _leaving(setting: Setting, particles: Particles) -> dict[str, float]:
    """Mass and momentum that leave at the end of the shock stage; empty where the snapshot does not say, or nobody
    knows the escape speed."""
    if "velocity" not in particles or "mass" not in particles or not setting.escape_known:
        return {}
    if setting.shape is not None:  # crater.bodies.exchange
        return {}
    bodies = particles.layer >= 0 if "layer" in particles else np.ones(len(particles), dtype=bool)
    momentum = setting.event.mass * np.asarray(setting.settings.impact.velocity)
    if setting.datum.is_sphere:
        return blanket.leaving(particles, float(particles.mass[bodies].sum()), momentum)
    return blanket.leaving_ground(particles, setting.datum, setting.settings.escape_speed, momentum)


def _faster_than(setting: Setting, moment: series.Moment | None) -> dict[str, Any]:
    """M(>v) when the crater is deepest: later much has landed, earlier much is not yet thrown."""
    curve = (
        blanket.mass_above(snapshot.read(moment.path), setting.datum, setting.settings.impact.speed)
        if moment is not None
        else {}
    )
    if moment is None or not curve:
        return {}
    laws = {
        name: [scaling.ejected_mass(setting.event, v, *constants) for v in curve["speed_m_s"]]
        for name, constants in scaling.EJECTA.items()
    }
    return {"time_s": moment.time, **curve, "housen_holsapple_2011_kg": laws}


def _launches(setting: Setting, moment: series.Moment | None, shots: Sequence[Path]) -> dict[str, Any]:
    """Speed and angle of ejecta against where they left flat ground, with the law of dry sand; empty without a crater.
    Raises ``InputError``."""
    radius = 0.5 * moment.value("diameter_apparent_m") if moment else float("nan")
    if not radius > 0.0:
        return {}
    event, spacing = setting.event, float(snapshot.attributes(shots[0]).get("spacing_at_impact_m", 0.0))
    launched = launch.launched((snapshot.read(path) for path in shots[1:]), setting.gravity, launch.ABOVE * spacing)
    fit = launch.fit(launched, event, radius)
    distance, speed, angle, number = fit.table.T
    sand = scaling.launch_speed(event, distance * event.radius, radius)
    return {
        "mu": {"value": fit.mu, "sigma": fit.mu_sigma}, "C1": {"value": fit.c1, "sigma": fit.c1_sigma},
        "apparent_radius_m": radius,
        "x_over_a": distance.tolist(), "v_over_U": speed.tolist(), "angle_deg": np.degrees(angle).tolist(),
        "particles": number.astype(int).tolist(),
        "sand_v_over_U": (sand / (event.speed * np.cos(event.angle))).tolist(),
    }  # fmt: skip


def grain_datum(grains: Particles, fallback: Datum) -> Datum:
    """The datum of a granular bed: ``datum_radius_m`` of its domain."""
    domain = grains.attributes.get("domain")
    if isinstance(domain, dict) and "datum_radius_m" in domain:
        return datums.sphere(float(domain["datum_radius_m"]), source="datum of the granular bed")
    return fallback


def _measure_grains(
    setting: Setting, settled: Sequence[Path], last: Path, heard: Callable[[Path], None]
) -> GrainFindings:
    """Every snapshot of the grains measured, and the last one by all methods."""
    particles = snapshot.read(last)
    bed = setting.inputs / "3_bed" / f"bed{snapshot.SUFFIX}"
    before = bed if bed.is_file() else None
    # the grains of a patch lie in flat ground already
    whole = setting.shape is not None and setting.patch is None
    ground, reach = (_tangent_map(setting, before), measurement_config.REACH) if whole else (None, None)
    chosen = _config(setting, grain_datum(particles, setting.datum), before, reach, ground)
    start = chosen.ground_before()
    moments = tuple(series.follow(settled, "dem", chosen, start, heard))
    reasons: dict[str, str] = {}
    crater = None
    try:
        measures = chosen.measured(particles, start, "5_dem/last.vtkhdf")
        state = rest.of_grains(setting.inputs / "5_dem" / "stage_report.json", moments)
        time = float(particles.attributes.get("time", np.nan))
        crater = LastCrater(measures, time, "settled grains" if state.settled else "grains", last, state)
    except InputError as reason:
        reasons["final"] = str(reason)
    began = handover.closely(setting.inputs / handover.START, "dem", chosen, start)
    return GrainFindings(moments, crater, chosen, reasons, began=began)
