"""Stage 1: a census of encounters with the target, and the impact that the case takes from it.

Writes ``encounters.h5`` (every event with its units), ``impact.toml`` (the chosen impact and why),
``nbody_report.json`` (errors of the integration). When the case pins speed and angle in ``[impact]``, the pinned
values go into ``impact.toml``, and what the census found stands beside them under ``[source]``.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

from matter.errors import Unsound
from matter.files import archive, checkpoint
from nbody.census import census, integration_soundness
from nbody.integrators import cash_karp, moon_mode, rkck
from nbody.masses.system import GALILEAN, jovian
from nbody.population import conditions, encounters, rules
from nbody.settings import Settings

# us of one core per particle: Xeon at 2.x GHz, two cores shared, numba 0.68
COST_S = 75e-6
# entries into the Hill sphere per particle, population literal; others are within a factor of three
YIELD = {"io": 3e-4, "europa": 3e-4, "ganymede": 7e-4, "callisto": 1.5e-3}
BYTES_PER_ENTRY = 6.0 * 230.0
JACOBI_LIMIT = 1e-6

LATITUDE_WINDOW = math.radians(10.0)
"""Half width of the band about the crater's latitude (Winter 2017, section 2.3.5)."""


def idle_sources(settings: Settings) -> set[Path]:
    """Files of the integrator as published, which only a census takes: the bibliography of a run leaves them out."""
    return {Path(rkck.__file__), Path(cash_karp.__file__), Path(moon_mode.__file__)}


def predict(settings: Settings) -> dict[str, float]:
    """Wall time [s] with warm kernels on 2 cores, memory and disk [bytes]."""
    particles = (math.ceil(settings.encounters / YIELD[settings.body] / conditions.CHUNK) + 2) * conditions.CHUNK
    table = settings.encounters * BYTES_PER_ENTRY
    return {
        "wall_s": 1.5 + 0.5 * particles * COST_S,
        "memory_bytes": 3e8 + 6.0 * table,
        "disk_bytes": 5e4 + table,
        "checkpoint_bytes": table,
    }


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Run or resume the census into ``out``; ``inputs`` is not read (this is the first stage)."""
    request = settings.request
    system = jovian(settings.body)
    tally = census.collect(request, out)
    drift = integration_soundness.jacobi_drift(system, request.population, settings.seed)
    encounters.write(out / "encounters.h5", tally.table, _attributes(settings, tally))
    window = None
    if settings.latitude is not None:
        window = (max(0.0, abs(settings.latitude) - LATITUDE_WINDOW), abs(settings.latitude) + LATITUDE_WINDOW)
    choice = rules.apply(settings.rule, tally.table, system.moon(settings.body), window, settings.seed)
    archive.write_text(out / "impact.toml", impact_toml(settings, choice))
    report = _report(settings, tally, drift, choice)
    archive.write_json(out / "nbody_report.json", report)
    checkpoint.keep_last(out)
    if not drift["maximum"] < JACOBI_LIMIT:
        raise Unsound(f"nbody: the Jacobi constant changes by {drift['maximum']:.2g} of GM/a (limit {JACOBI_LIMIT:g})")


def _attributes(settings: Settings, tally: census.Tally) -> dict:
    return {
        "moons": ", ".join(moon.name for moon in jovian(settings.body).moons),
        "target": settings.body,
        "population": settings.population,
        "integrator": settings.request.integrator,
        "seed": settings.seed,
        "particles": tally.particles,
    }


def _report(settings: Settings, tally: census.Tally, drift: dict, choice: rules.Choice) -> dict:
    names = ("", "timed_out", "left", "hit_jupiter", "hit_moon")
    return {
        "target": settings.body,
        "population": settings.population,
        "population_notes": settings.request.population.notes,
        "integrator": settings.request.integrator,
        "particles": tally.particles,
        "steps_per_particle": tally.steps / max(tally.particles, 1),
        "flights": {name: int(n) for name, n in zip(names, tally.ends) if name},
        "events": {
            moon.name: {
                kind: int(((tally.table["moon"] == index) & (tally.table["event"] == number)).sum())
                for number, kind in encounters.KINDS.items()
            }
            for index, moon in enumerate(jovian(settings.body).moons)
        },
        "massive_bodies": {
            "energy_relative_error": tally.energy_error,
            "angular_momentum_relative_error": tally.angular_momentum_error,
        },
        "jacobi_drift_over_gm_over_a": {**drift, "limit": JACOBI_LIMIT},
        "choice": {"rule": settings.rule, "speed_m_s": choice.speed._asdict(), "angle_rad": choice.angle._asdict()},
        "wall_s": tally.wall_s,
    }


def impact_toml(settings: Settings, choice: rules.Choice) -> str:
    """Text of ``impact.toml``: what the shock stage reads, and where it comes from."""
    pinned = settings.pinned
    speed = settings.impact.speed if pinned else choice.speed.value
    angle = settings.impact.angle_from_vertical if pinned else choice.angle.value
    projectile = settings.impact.projectile
    lines = [
        f"speed = {_text(speed / 1e3, 'km/s')}",
        f"angle_from_vertical = {_text(math.degrees(angle), 'deg')}",
        "",
        "[projectile]",
        f'material = "{projectile.material}"',
        f"radius = {_text(projectile.radius / 1e3, 'km')}",
        "",
        "[source]",
        f"rule = {json.dumps(settings.rule)}",
        f"pinned = {str(pinned).lower()}",
        f"population = {json.dumps(settings.population)}",
        f'target = "{settings.body}"',
        f'integrator = "{settings.request.integrator}"',
        f"seed = {settings.seed}",
        *_found("speed", choice.speed, 1e-3, "km/s"),
        *_found("angle", choice.angle, math.degrees(1.0), "deg"),
    ]
    if pinned:
        lines.append(
            'note = "speed and angle are those that the case pins in [impact]; what the census found stands beside '
            'them"'
        )
    else:
        lines.append('note = "speed and angle are those that the rule finds in encounters.h5"')
    return "\n".join(lines) + "\n"


def _found(name: str, statistic: rules.Statistic, factor: float, unit: str) -> list[str]:
    lines = [f"found_{name} = {_text(statistic.value * factor, unit)}", f"found_{name}_count = {statistic.impacts}"]
    if math.isfinite(statistic.standard_error):
        lines.insert(1, f"found_{name}_standard_error = {_text(statistic.standard_error * factor, unit)}")
    return lines


def _text(value: float, unit: str) -> str:
    return f'"{value:.12g} {unit}"'


assert set(GALILEAN) == set(YIELD)
