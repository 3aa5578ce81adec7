"""Stage 6: from particles to a crater.

Reads ``2_sph`` (time series and transient crater, all-SPH late stage) and ``5_dem`` (final crater from settled grains), whichever exist;
leaves ``measures.json``, ``profile.csv``, ``profile_sph.csv``, ``time_series.csv``, ``compare.json``, ``heightmap.h5``, pictures and ``report.html``.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator

from crater import datum as datums
from crater import ejecta, launch, locate, plot, radial_profile, report, scaling, series
from crater.compare import profile_difference
from crater.datum import Datum
from crater.measure import Measures, Quantity, measure
from matter import archive, material, quantity, snapshot
from matter.body import Impact, Model, Target
from matter.errors import InputError
from matter.particles import Particles
from matter.progress import Progress
from matter.quantity import Speed

GRAVITATIONAL = 6.6743e-11
REACH = 2.5
"""Columns of the shock stage end at this many expected transient diameters: the far field of the crater, not the far side of the body."""
SECONDS_PER_SNAPSHOT = 0.42
"""Wall time per snapshot of 15,000 particles on one of 2 cores of a 2.1 GHz server; 2.4 s at 300,000 (168 s for 70 snapshots, pictures included)."""


class Published(Model):
    """A published number of the case: ``quantity`` as in ``measures.json``, of the ``transient`` or ``final`` crater, at the first maximum of ``at``."""

    quantity: Literal["diameter_apparent_m", "diameter_rim_m", "depth_m", "depth_rim_to_floor_m", "rim_height_m", "volume_m3", "time_s"]
    of: Literal["transient", "final"] = "transient"
    at: Literal["volume", "depth", "diameter"] = "depth"
    value: str
    """With unit, ``"980 km"``."""
    plus: str
    """Upper error with unit."""
    minus: str
    """Lower error with unit."""
    source: str
    note: str = ""

    @field_validator("value", "plus", "minus")
    @classmethod
    def _readable(cls, text: str) -> str:
        quantity.parse(text)
        return text


class Settings(Model):
    """How the crater is measured and what it is compared with."""

    target: Target
    impact: Impact
    reference: tuple[Published, ...] = ()
    """Published numbers of the case with their errors."""
    sectors: Annotated[int, Field(ge=8, le=144)] = 24
    """Sectors in azimuth; their scatter is the azimuthal error."""
    rise_limit_over_diameter: Annotated[float, Field(gt=0, le=2)] = 0.15
    """What would rise above this many expected transient diameters is in flight and takes no part in heights."""
    every: Annotated[int, Field(ge=1)] = 1
    """Measure every n-th snapshot of the shock stage."""
    escape_speed: Annotated[Speed, Field(ge=0)] = 0.0
    """Flat ground: what rises faster than this leaves the body that the ground stands for."""
    ground: Literal["fluid", "rock", "sand"] = "fluid"
    """Kind of ground whose scaling laws the crater is compared with; ``fluid`` for weak ground without friction."""
    simple_to_complex: str = "2.5 km"
    """Transition diameter between simple and complex craters on this body."""
    seed: int = 1
    """Seed of the bootstrap over azimuth."""
    particles: Annotated[int, Field(gt=0)] = 15_000
    """Size of the shock stage's snapshots, for the prediction of ``--check`` only."""


@dataclass
class Findings:
    """What the stage found, for the files, pictures and the page."""

    settings: Settings
    inputs: Path
    moments: list[series.Moment] = field(default_factory=list)
    transient: dict[str, series.Moment] = field(default_factory=dict)
    late_sph: Measures | None = None
    late_sph_time: float = float("nan")
    final: Measures | None = None
    final_time: float = float("nan")
    final_from: str = ""
    leaving: dict[str, float] = field(default_factory=dict)
    ejecta: dict[str, Any] = field(default_factory=dict)
    launch: dict[str, Any] = field(default_factory=dict)
    growing: list[str] = field(default_factory=list)
    gravity: float = float("nan")
    densities: tuple[float, float] = (float("nan"), float("nan"))
    """Of the projectile and of the ground at its surface [kg/m^3]."""
    reasons: dict[str, str] = field(default_factory=dict)
    scaling: dict[str, Any] = field(default_factory=dict)
    reference: list[dict[str, Any]] = field(default_factory=list)
    late_difference: dict[str, Any] | None = None


def predict(settings: Settings) -> dict[str, float]:
    """Wall time, memory and disk: some 65 snapshots measured, a few pictures."""
    count, growth = 65 / settings.every, (settings.particles / 15_000) ** 0.58
    return {"wall_s": SECONDS_PER_SNAPSHOT * growth * count + 6.0, "memory_bytes": 6e8, "disk_bytes": 5e6}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Measure what the earlier stages left in ``inputs`` and write the result to ``out``.

    Raises ``InputError`` when neither ``2_sph`` nor ``5_dem`` holds a snapshot.
    """
    found = Findings(settings, Path(inputs))
    shots = snapshot.series(found.inputs / "2_sph")[:: settings.every]
    grains = found.inputs / "5_dem" / f"last{snapshot.SUFFIX}"
    if not shots and not grains.is_file():
        raise InputError(f"nothing to measure: {found.inputs} holds neither 2_sph/snap_0000{snapshot.SUFFIX} nor 5_dem/last{snapshot.SUFFIX}")
    settled = snapshot.series(found.inputs / "5_dem")
    progress = Progress("crater", total=float(len(shots) + len(settled) + 4))
    heard = iter(range(1, len(shots) + len(settled) + 2))
    found.densities = _densities(found, shots[0] if shots else None)
    _follow_shock(found, shots, lambda path: progress.update(next(heard), path.name))
    if grains.is_file():
        _measure_grains(found, settled, grains, lambda path: progress.update(next(heard), path.name))
    if found.final is None:
        found.final, found.final_time, found.final_from = found.late_sph, found.late_sph_time, "all-SPH late stage"
    _compare_with_published(found)
    _write_tables(found, out)
    progress.update(progress.total - 2, "pictures", force=True)
    plot.draw_all(found, out)
    report.write(found, out)
    progress.update(progress.total, "done", force=True)


def _target_facts(found: Findings) -> tuple[Datum, float]:
    path = found.inputs / "2_sph" / "target.json"
    if path.is_file():
        facts = json.loads(path.read_text())
        if facts.get("frame") == "plane":
            return datums.plane(source="undisturbed ground"), float(facts["surface_gravity_m_s2"])
        radius, gravity = float(facts["radius_m"]), float(facts["surface_gravity_m_s2"])
        return datums.sphere(radius, facts.get("centre", (0.0, 0.0, 0.0)), source="radius of the relaxed target"), gravity
    if found.settings.target.flat:
        return datums.plane(source="flat ground of the case"), found.settings.target.gravity
    mass, inner = 0.0, 0.0
    for layer, outer in zip(found.settings.target.layers, found.settings.target.outer_radii):
        mass += 4.0 / 3.0 * np.pi * (outer**3 - inner**3) * material.reference_density(layer.material)
        inner = outer
    radius = found.settings.target.radius
    return datums.sphere(radius, source="uniform layers of the case"), GRAVITATIONAL * mass / radius**2


def _follow_shock(found: Findings, shots: list[Path], heard) -> None:
    datum, found.gravity = _target_facts(found)
    if not shots:
        found.reasons["transient"] = "no shock-stage snapshots in this run"
        return
    reach = REACH * found.settings.impact.expected_transient_diameter
    within = 0.5 * found.settings.impact.expected_transient_diameter
    start = locate.ground_before(snapshot.read(shots[0]), datum, reach, found.settings.sectors)
    rise = found.settings.rise_limit_over_diameter * found.settings.impact.expected_transient_diameter
    found.moments = series.follow(shots[1:], "sph", datum, start, found.gravity, rise, found.settings.seed, reach, heard, within=within)
    found.transient, found.growing = series.transient(found.moments)
    measured: dict[Path, series.Moment] = {}
    for key, moment in found.transient.items():
        if moment.path not in measured:
            measured[moment.path] = series.again(moment, datum, start, found.gravity, rise, found.settings.seed, reach, within)
        found.transient[key] = measured[moment.path]
    if "volume" not in found.transient:
        found.reasons["transient"] = "no snapshot of the shock stage shows a hollow"
    _follow_ejecta(found, datum, shots)
    if not datum.is_sphere and found.gravity > 0.0:
        _follow_launches(found, shots)
    last = found.inputs / "2_sph" / f"last{snapshot.SUFFIX}"
    path = last if last.is_file() else shots[-1]
    particles = snapshot.read(path)
    if "velocity" in particles and "mass" in particles:
        bodies = particles.layer >= 0 if "layer" in particles else np.ones(len(particles), dtype=bool)
        impact = found.settings.impact
        momentum = _strike(found).mass * np.asarray(impact.velocity)
        if datum.is_sphere:
            found.leaving = ejecta.leaving(particles, float(particles.mass[bodies].sum()), momentum)
        else:
            found.leaving = ejecta.leaving_ground(particles, datum, found.settings.escape_speed, momentum)
    found.late_sph_time = float(particles.attributes.get("time", np.nan))
    try:
        found.late_sph = measure(
            particles,
            datum,
            start,
            gravity=found.gravity,
            rise_limit=rise,
            reach=reach,
            seed=found.settings.seed,
            what=f"2_sph/{path.name}",
        )
    except InputError as reason:
        found.reasons["late_sph"] = str(reason)


def _follow_ejecta(found: Findings, datum: Datum, shots: list[Path]) -> None:
    """M(>v) when the crater is deepest: later much has landed, earlier much is not yet thrown."""
    moment = found.transient.get("depth")
    if moment is None:
        return
    curve = ejecta.mass_above(snapshot.read(moment.path), datum, found.settings.impact.speed)
    if curve:
        strike = _strike(found)
        laws = {name: [scaling.ejected_mass(strike, v, *constants) for v in curve["speed_m_s"]] for name, constants in scaling.EJECTA.items()}
        found.ejecta = {"time_s": moment.time, **curve, "housen_holsapple_2011_kg": laws}


def _follow_launches(found: Findings, shots: list[Path]) -> None:
    """Speed and angle of ejecta against where they left flat ground, with the law of dry sand."""
    moment = found.transient.get("volume")
    radius = 0.5 * moment.value("diameter_apparent_m") if moment else float("nan")
    if not radius > 0.0:
        return
    strike, spacing = _strike(found), float(snapshot.attributes(shots[0]).get("spacing_at_impact_m", 0.0))
    try:
        thrown = launch.launched((snapshot.read(path) for path in shots[1:]), found.gravity, launch.ABOVE * spacing)
        fit = launch.fit(thrown, strike, radius)
    except InputError as reason:
        found.reasons["launch"] = str(reason)
        return
    place, speed, angle, number = fit.table.T
    found.launch = {
        "mu": {"value": fit.mu, "sigma": fit.mu_sigma}, "C1": {"value": fit.c1, "sigma": fit.c1_sigma}, "apparent_radius_m": radius,
        "x_over_a": place.tolist(), "v_over_U": speed.tolist(), "angle_deg": np.degrees(angle).tolist(), "particles": number.astype(int).tolist(),
        "sand_v_over_U": (scaling.launch_speed(strike, place * strike.radius, radius) / (strike.speed * np.cos(strike.angle))).tolist(),
    }  # fmt: skip


def grain_datum(grains: Particles, fallback: Datum) -> Datum:
    """The datum of a granular bed: ``datum_radius_m`` of its domain."""
    domain = grains.attributes.get("domain")
    if isinstance(domain, dict) and "datum_radius_m" in domain:
        return datums.sphere(float(domain["datum_radius_m"]), source="datum of the granular bed")
    return fallback


def _measure_grains(found: Findings, settled: list[Path], last: Path, heard) -> None:
    fallback, _ = _target_facts(found)
    particles = snapshot.read(last)
    datum = grain_datum(particles, fallback)
    before = None
    bed = found.inputs / "3_bed" / f"bed{snapshot.SUFFIX}"
    if bed.is_file():
        grains_before = snapshot.read(bed)
        if "headroom" in grains_before:
            grains_before = grains_before.select(grains_before.headroom == 0)
        before = locate.ground_before(grains_before, datum, None, found.settings.sectors)
    rise = found.settings.rise_limit_over_diameter * found.settings.impact.expected_transient_diameter
    within = 0.5 * found.settings.impact.expected_transient_diameter
    found.moments += series.follow(settled, "dem", datum, before, found.gravity, rise, found.settings.seed, None, heard, within=within)
    found.final_time = float(particles.attributes.get("time", np.nan))
    found.final_from = "settled grains"
    try:
        found.final = measure(
            particles,
            datum,
            before,
            gravity=found.gravity,
            rise_limit=rise,
            seed=found.settings.seed,
            within=within,
            what="5_dem/last.vtkhdf",
        )
    except InputError as reason:
        found.reasons["final"] = str(reason)


def _densities(found: Findings, first: Path | None) -> tuple[float, float]:
    """Densities of projectile and ground [kg/m^3] as the shock stage began with them (pores, changed materials); of their materials where it left none."""
    ball = material.reference_density(found.settings.impact.projectile.material)
    ground = material.reference_density(found.settings.target.layers[-1].material)
    path = found.inputs / "2_sph" / "target.json"
    if path.is_file():
        ground = json.loads(path.read_text()).get("profile", {}).get("density_kg_m3", [ground])[-1]
    if first is not None:
        begun = snapshot.read(first)
        mine = begun.layer < 0 if {"layer", "density", "mass"} <= set(begun) else np.zeros(0, dtype=bool)
        if mine.any():
            ball = float(begun.mass[mine].sum() / (begun.mass[mine] / begun.density[mine]).sum())
    return ball, float(ground)


def _strike(found: Findings) -> scaling.Strike:
    impact = found.settings.impact
    return scaling.Strike(impact.projectile.radius, impact.speed, impact.angle_from_vertical, found.gravity, *found.densities)


def _compare_with_published(found: Findings) -> None:
    if found.gravity > 0.0:
        strike, laws = _strike(found), scaling.GROUNDS[found.settings.ground]
        sizes = scaling.diameters(strike)
        usual = [sizes[name] for name in laws]
        complex_above = quantity.parse(found.settings.simple_to_complex, "m")
        found.scaling = {
            "diameter_m": sizes,
            "range_m": [min(usual), max(usual)],
            "range_of": list(laws),
            "final_rim_diameter_m": {name: scaling.final_from_transient(sizes[name], complex_above) for name in laws},
            "formation_time_s": scaling.formation_time(scaling.holsapple_volume(strike, *scaling.VOLUMES[found.settings.ground]), found.gravity),
        }
    else:
        found.reasons["scaling"] = "the scaling laws here are those of the gravity regime, and this run has no gravity"
    for published in found.settings.reference:
        found.reference.append(_verdict(found, published))
    if found.late_sph is not None and found.final is not None and found.final is not found.late_sph:
        found.late_difference = profile_difference(found.late_sph.profile, found.final.profile, _depth_scale(found))


def _depth_scale(found: Findings) -> float | None:
    moment = found.transient.get("depth")
    return moment.value("depth_m") if moment else None


def _verdict(found: Findings, published: Published) -> dict[str, Any]:
    """Ours beside a published number; met when they agree within both errors (published and ours) in quadrature."""
    value, plus, minus = (quantity.parse(text) for text in (published.value, published.plus, published.minus))
    ours = _ours(found, published)
    row: dict[str, Any] = {
        "name": f"{published.of} {published.quantity}",
        "at": f"first maximum of {published.at}" if published.of == "transient" else "end",
        "value": value,
        "plus": plus,
        "minus": minus,
        "unit": ours.unit,
        "source": published.source,
        "note": published.note,
        "ours": ours.as_dict(),
    }
    if ours.value is None:
        return {**row, "met": None, "why": ours.reason}
    apart = ours.value - value
    allowed = float(np.hypot(plus if apart > 0 else minus, ours.sigma or 0.0))
    return {**row, "met": bool(abs(apart) <= allowed), "difference_over_error": apart / allowed if allowed > 0 else None}


def _ours(found: Findings, published: Published) -> Quantity:
    missing = {"time_s": "s", "volume_m3": "m^3"}.get(published.quantity, "m")
    if published.of == "final":
        if published.quantity == "time_s":
            return Quantity(found.final_time, 0.0, "s")
        measures = found.final
        return measures[published.quantity] if measures else Quantity(None, None, missing, found.reasons.get("final", "not measured"))
    moment = found.transient.get(published.at)
    if moment is None or moment.measures is None:
        return Quantity(None, None, missing, found.reasons.get("transient", f"no maximum of {published.at} in the series"))
    return _time_of(found, moment) if published.quantity == "time_s" else moment.measures[published.quantity]


def _time_of(found: Findings, moment: series.Moment) -> Quantity:
    times = np.array([m.time for m in found.moments if m.stage == moment.stage])
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return Quantity(moment.time, 0.5 * step, "s", parts={"interval between snapshots": 0.5 * step})


def measures_json(found: Findings) -> dict[str, Any]:
    """The content of ``measures.json``."""
    transient: dict[str, Any] = {}
    for key in ("volume", "depth", "diameter"):
        moment = found.transient.get(key)
        if moment is not None and moment.measures is not None:
            transient[f"at_maximum_{key}"] = {
                **moment.measures.as_dict(),
                "time_s": _time_of(found, moment).as_dict(),
                "stage": moment.stage,
            }
    default = transient.get("at_maximum_volume", {"reason": found.reasons.get("transient", "not measured")})
    final: dict[str, Any] = {"reason": found.reasons.get("final", "not measured")}
    if found.final is not None:
        final = {**found.final.as_dict(), "time_s": Quantity(found.final_time, 0.0, "s").as_dict(), "from": found.final_from}
    content: dict[str, Any] = {"transient": {**default, **transient}, "final": final, "reference": found.reference}
    if engine := _engine_of(found.inputs / "5_dem" / "stage_report.json"):
        content["engine"] = engine
    if found.leaving:
        content["leaving"] = found.leaving
    if found.ejecta:
        content["ejecta"] = found.ejecta
    if found.launch:
        content["launch"] = found.launch
    if found.late_sph is not None:
        content["late_sph"] = {**found.late_sph.as_dict(), "time_s": Quantity(found.late_sph_time, 0.0, "s").as_dict()}
    return content


def _engine_of(report: Path) -> dict[str, Any]:
    """Which program stepped the grains, and the deviations that the case accepted from it; empty for this project's own stepping."""
    if not report.is_file():
        return {}
    engine = json.loads(report.read_text()).get("engine", {})
    return {name: engine[name] for name in ("name", "deviations") if name in engine}


def _write_tables(found: Findings, out: Path) -> None:
    write_json(out / "measures.json", measures_json(found))
    write_json(
        out / "compare.json",
        {"scaling": found.scaling, "published": found.reference, "late_stage_sph_against_dem": found.late_difference},
    )
    if found.moments:
        series.write_csv(found.moments, out / "time_series.csv")
    if found.late_sph is not None:
        radial_profile.write_csv(_headed(found.late_sph, found.late_sph_time, "all-SPH late stage"), out / "profile_sph.csv")
    moment = found.transient.get("volume")
    if moment is not None and moment.measures is not None:
        radial_profile.write_csv(_headed(moment.measures, moment.time, "transient, maximum volume"), out / "profile_transient.csv")
    if found.final is not None:
        radial_profile.write_csv(_headed(found.final, found.final_time, found.final_from), out / "profile.csv")
        write_heightmap(found.final, out / "heightmap.h5")


def _headed(measures: Measures, time: float, what: str) -> radial_profile.Profile:
    old = measures.profile
    return radial_profile.Profile(old.radius, old.height, old.p16, old.p84, old.count, {"of": what, "time_s": f"{time:.6g}", **old.header})


def write_heightmap(measures: Measures, path: Path) -> None:
    """Heights on (distance, azimuth) cells and on the single columns, with their places in the frame of the snapshot."""
    ground = measures.ground
    columns = ground.columns
    ring = columns.ring
    azimuth = (np.arange(columns.sectors) + 0.5) * 2.0 * np.pi / columns.sectors
    arrays = {
        "distance": (columns.distance, "m", "distance from the crater's axis along the datum"),
        "azimuth": (azimuth, "rad", "azimuth of the sectors, 0 along +x"),
        "columns/distance": (columns.distance[ring], "m", "distance of the single columns"),
        "columns/azimuth": (columns.azimuth, "rad", "azimuth of the single columns"),
        "columns/height": (ground.rays, "m", "height of the colour field's half level"),
    }
    for name, cells in ground.methods.items():
        arrays[f"height/{name}"] = (cells, "m", f"height by the method '{name}' (rings, sectors)")
    attributes = {"datum": ground.datum.kind, "datum_radius_m": ground.datum.radius, "datum_centre_m": np.asarray(ground.datum.centre)}
    archive.write(path, arrays, {**attributes, "axes": np.asarray(ground.datum.axes)})


def write_json(path: Path, content: Any) -> None:
    """Write JSON with plain numbers; what is not finite becomes null."""
    archive.write_text(path, json.dumps(_plain(content), indent=1))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(entry) for entry in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value


def measure_snapshot(
    path: Path,
    datum: str | None = None,
    datum_radius: float | None = None,
    centre: tuple[float, float, float] | None = None,
    out: Path | None = None,
) -> int:
    """Measure one snapshot of any origin (the command ``measure_crater``): prints the measures, writes them and pictures to ``out``.

    ``datum`` is ``plane``, ``sphere`` or None (what the snapshot's ``frame`` says, else a plane). A sphere keeps the ``centre`` [m] and the
    ``datum_radius`` [m] that are given and fits the rest to the far field; a snapshot of the frame ``sphere`` has its centre at the origin.
    """
    path = Path(path)
    particles = snapshot.read(path)
    kind = datum or ("sphere" if datum_radius or centre or particles.attributes.get("frame") == "sphere" else "plane")
    if kind not in ("plane", "sphere"):
        raise InputError(f"--datum {kind!r} is not known: take plane or sphere")
    if kind == "sphere" and centre is None and particles.attributes.get("frame") == "sphere":
        centre = (0.0, 0.0, 0.0)
    measures = measure(particles, kind, centre=centre, datum_radius=datum_radius, what=str(path))
    folder = Path(out) if out is not None else path.with_name(f"{path.stem}_crater")
    folder.mkdir(parents=True, exist_ok=True)
    time = float(particles.attributes.get("time", 0.0))
    content = {"final": {**measures.as_dict(), "time_s": Quantity(time, 0.0, "s").as_dict()}, "transient": {}, "reference": []}
    write_json(folder / "measures.json", content)
    radial_profile.write_csv(_headed(measures, time, path.name), folder / "profile.csv")
    write_heightmap(measures, folder / "heightmap.h5")
    plot.draw_one(measures, path.name, folder)
    print(report.as_text(measures))
    print(f"written to {folder}")
    return 0
