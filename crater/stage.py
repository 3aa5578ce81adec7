"""Stage 6: from particles to a crater.

Reads ``2_sph`` (time series and transient crater, all-SPH late stage) and ``5_dem`` (final crater from settled grains), whichever exist;
leaves ``measures.json``, ``profile.csv``, ``profile_sph.csv``, ``time_series.csv``, ``compare.json``, ``heightmap.h5``, pictures and ``report.html``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from crater import against_published, ballistic, chain, choices, ejecta, launch, plot, report, rest, scaling, series, soundness, tables
from crater import datum as datums
from crater.chain import ChainError
from crater.choices import Choices
from crater.datum import Datum
from crater.findings import Findings, densities, strike
from crater.one_snapshot import measure_snapshot
from matter import archive, material, quantity, snapshot
from matter.body import Impact, Model, Target
from matter.errors import InputError
from matter.particles import Particles
from matter.progress import Progress
from matter.quantity import Speed

GRAVITATIONAL = 6.6743e-11
__all__ = ["Published", "Settings", "grain_datum", "measure_snapshot", "predict", "run"]

SECONDS_PER_SNAPSHOT = 0.42
"""Wall time per snapshot of 15,000 particles on one of 2 cores of a 2.1 GHz server; 2.4 s at 300,000 (168 s for 70 snapshots, pictures included)."""


class Published(Model):
    """A published number of the case, ``[[crater.reference]]``."""

    quantity: Literal["diameter_apparent_m", "diameter_rim_m", "depth_m", "depth_rim_to_floor_m", "rim_height_m", "volume_m3", "time_s"]
    """Which measure, named as in ``measures.json``."""
    of: Literal["transient", "final"] = "transient"
    """Of which crater."""
    at: Literal["volume", "depth", "diameter"] = "depth"
    """The transient crater is that at the first maximum of this."""
    value: str
    """With unit, ``"980 km"``."""
    plus: str
    """Upper error with unit."""
    minus: str
    """Lower error with unit."""
    source: str
    """The publication."""
    note: str = ""
    """A remark that stands beside the number."""

    @field_validator("value", "plus", "minus")
    @classmethod
    def _readable(cls, text: str) -> str:
        quantity.parse(text)
        return text


class Settings(Model):
    """How the crater is measured and what it is compared with."""

    target: Target
    """The body or ground that is hit, ``[target]``."""
    impact: Impact
    """How the projectile hits, ``[impact]``."""
    reference: tuple[Published, ...] = ()
    """Published numbers of the case with their errors."""
    sectors: Annotated[int, Field(ge=8, le=144)] = 24
    """Sectors in azimuth; their scatter is the azimuthal error."""
    rise_limit_over_diameter: Annotated[float, Field(gt=0, le=2)] = choices.RISE_LIMIT
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
    chain: ChainError | None = None
    """Chain errors of the measures; those of a shipped case come from its ``expected.toml``."""
    particles: Annotated[int, Field(gt=0)] = 15_000
    """Size of the shock stage's snapshots, for the prediction of ``--check`` only."""


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
    found.densities = densities(found, shots[0] if shots else None)
    _follow_shock(found, shots, lambda path: progress.update(next(heard), path.name))
    if grains.is_file():
        _measure_grains(found, settled, grains, lambda path: progress.update(next(heard), path.name))
    if found.final is None:
        found.final, found.final_time, found.final_from = found.late_sph, found.late_sph_time, "all-SPH late stage"
        found.final_path = found.late_path
        found.rest = rest.of_series([moment for moment in found.moments if moment.stage == "sph"])
    _let_fly(found)
    chain.enter(found)
    found.soundness = soundness.facts(found.inputs)
    against_published.compare(found)
    tables.write_tables(found, out)
    progress.update(progress.total - 2, "pictures", force=True)
    plot.draw_all(found, out)
    report.write(found, out)
    progress.update(progress.total, "done", force=True)


def _let_fly(found: Findings) -> None:
    """Free flight of what was handed over: an independent check of the crater's size on flat ground under gravity."""
    chosen = found.settings
    if not chosen.target.flat or not found.gravity > 0.0:
        return
    try:
        found.ballistic = ballistic.of_run(found.inputs, found.gravity, found.densities[1], chosen.impact.expected_transient_diameter, chosen.escape_speed)
    except InputError as reason:
        found.reasons["ballistic"] = str(reason)


def _target_facts(found: Findings) -> tuple[Datum, float]:
    path = found.inputs / "2_sph" / "target.json"
    if path.is_file():
        facts = archive.read_json(path)
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


def _choices(found: Findings, datum: Datum, before: Path | None, reach: float | None) -> Choices:
    """What the measuring of one stage stands on: lengths in expected transient diameters."""
    size, chosen = found.settings.impact.expected_transient_diameter, found.settings
    return Choices(
        datum, before, found.gravity, chosen.rise_limit_over_diameter * size, None if reach is None else reach * size, choices.WITHIN * size,
        chosen.sectors, chosen.seed,
    )  # fmt: skip


def _follow_shock(found: Findings, shots: list[Path], heard) -> None:
    datum, found.gravity = _target_facts(found)
    if not shots:
        found.reasons["transient"] = "no shock-stage snapshots in this run"
        return
    chosen = found.chosen["sph"] = _choices(found, datum, shots[0], choices.REACH)
    start = chosen.ground_before()
    found.moments = series.follow(shots[1:], "sph", chosen, start, heard)
    found.transient, grows = series.transient(found.moments)
    moving = rest.changes(found.moments)
    found.growing = [key for key in grows if moving is None or series.MAXIMA[key] in moving]
    measured: dict[Path, series.Moment] = {}
    for key, moment in found.transient.items():
        if moment.path not in measured:
            measured[moment.path] = series.again(moment, chosen, start)
        found.transient[key] = measured[moment.path]
    if "volume" not in found.transient:
        found.reasons["transient"] = "no snapshot of the shock stage shows a crater"
    _follow_ejecta(found, datum, shots)
    if not datum.is_sphere and found.gravity > 0.0:
        _follow_launches(found, shots)
    last = found.inputs / "2_sph" / f"last{snapshot.SUFFIX}"
    path = last if last.is_file() else shots[-1]
    particles = snapshot.read(path)
    if "velocity" in particles and "mass" in particles:
        bodies = particles.layer >= 0 if "layer" in particles else np.ones(len(particles), dtype=bool)
        impact = found.settings.impact
        momentum = strike(found).mass * np.asarray(impact.velocity)
        if datum.is_sphere:
            found.leaving = ejecta.leaving(particles, float(particles.mass[bodies].sum()), momentum)
        else:
            found.leaving = ejecta.leaving_ground(particles, datum, found.settings.escape_speed, momentum)
    found.late_path = path
    found.late_sph_time = float(particles.attributes.get("time", np.nan))
    try:
        found.late_sph = chosen.measured(particles, start, f"2_sph/{path.name}")
    except InputError as reason:
        found.reasons["late_sph"] = str(reason)


def _follow_ejecta(found: Findings, datum: Datum, shots: list[Path]) -> None:
    """M(>v) when the crater is deepest: later much has landed, earlier much is not yet thrown."""
    moment = found.transient.get("depth")
    if moment is None:
        return
    curve = ejecta.mass_above(snapshot.read(moment.path), datum, found.settings.impact.speed)
    if curve:
        shot = strike(found)
        laws = {name: [scaling.ejected_mass(shot, v, *constants) for v in curve["speed_m_s"]] for name, constants in scaling.EJECTA.items()}
        found.ejecta = {"time_s": moment.time, **curve, "housen_holsapple_2011_kg": laws}


def _follow_launches(found: Findings, shots: list[Path]) -> None:
    """Speed and angle of ejecta against where they left flat ground, with the law of dry sand."""
    moment = found.transient.get("volume")
    radius = 0.5 * moment.value("diameter_apparent_m") if moment else float("nan")
    if not radius > 0.0:
        return
    shot, spacing = strike(found), float(snapshot.attributes(shots[0]).get("spacing_at_impact_m", 0.0))
    try:
        thrown = launch.launched((snapshot.read(path) for path in shots[1:]), found.gravity, launch.ABOVE * spacing)
        fit = launch.fit(thrown, shot, radius)
    except InputError as reason:
        found.reasons["launch"] = str(reason)
        return
    place, speed, angle, number = fit.table.T
    found.launch = {
        "mu": {"value": fit.mu, "sigma": fit.mu_sigma}, "C1": {"value": fit.c1, "sigma": fit.c1_sigma}, "apparent_radius_m": radius,
        "x_over_a": place.tolist(), "v_over_U": speed.tolist(), "angle_deg": np.degrees(angle).tolist(), "particles": number.astype(int).tolist(),
        "sand_v_over_U": (scaling.launch_speed(shot, place * shot.radius, radius) / (shot.speed * np.cos(shot.angle))).tolist(),
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
    bed = found.inputs / "3_bed" / f"bed{snapshot.SUFFIX}"
    chosen = found.chosen["dem"] = _choices(found, datum, bed if bed.is_file() else None, None)
    before = chosen.ground_before()
    grains = series.follow(settled, "dem", chosen, before, heard)
    found.moments += grains
    found.final_path = last
    found.final_time = float(particles.attributes.get("time", np.nan))
    found.final_from = "settled grains"
    try:
        found.final = chosen.measured(particles, before, "5_dem/last.vtkhdf")
        found.rest = rest.of_grains(found.inputs / "5_dem" / "stage_report.json", grains)
        found.final_from = "settled grains" if found.rest.settled else "grains"
    except InputError as reason:
        found.reasons["final"] = str(reason)
