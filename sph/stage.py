"""Stage 2: the impact as shock physics, from a layered body in balance to the end of the simulated time.

Phases: ``relax`` (no strength, damped, energy held: the particles settle on the hydrostatic profile), then ``impact`` (everything on). Leaves ``target.json``,
snapshots with a series index, ``history.csv``, ``last.vtkhdf`` and ``stage_report.json``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from matter import archive, checkpoint, progress, regions
from matter.body import Impact, Target
from matter.quantity import PositiveLength, PositiveTime, Time
from sph import ground as grounds
from sph import late as late_stage
from sph import materials as material_rows
from sph import target as bodies
from sph import used_laws, viscosity_switch
from sph.boundary import surroundings
from sph.history import DIRECT
from sph.kernels import dispatch as kernels
from sph.material_settings import Choice
from sph.numerics import Numerics
from sph.simulation import Simulation

# warm, 2 cores of a Zen 5 machine: seconds per particle and step of the hydrodynamics, per particle of one gravity evaluation, per pair of the direct sum
_SECONDS_PER_STEP, _SECONDS_PER_GRAVITY, _SECONDS_PER_PAIR = 4.0e-7, 1.1e-6, 4.0e-10


class Settings(Numerics):
    """Settings of the shock stage. Equal spacings and no refinement give a uniform hexagonal lattice."""

    target: Target
    """The body or ground that is hit, ``[target]``."""
    impact: Impact
    """How the projectile hits, ``[impact]``."""
    spacing_at_impact: PositiveLength = 52e3
    """Particle spacing within ``fine_radius`` of the impact point."""
    spacing_far: PositiveLength = 200e3
    """Particle spacing far away from the impact point; at least ``spacing_at_impact``."""
    fine_radius: PositiveLength = 650e3
    """Radius about the impact point inside which the spacing is ``spacing_at_impact``."""
    growth: Annotated[float, Field(gt=0, le=0.3)] = 0.1
    """How fast the spacing grows outside ``fine_radius``: change of spacing over distance."""
    contact_refinement: Annotated[float, Field(ge=1, le=10)] = 2.0
    """Within ``contact_radius`` the spacing is finer by this factor (1: no refinement)."""
    contact_radius: PositiveLength = 120e3
    """Radius about the impact point of the refined contact zone."""
    projectile_particles: Annotated[int, Field(ge=1, le=100_000)] | None = None
    """About how many particles the projectile has (1 is a single heavy particle). By default its particles weigh what the target's at the contact weigh:
    light particles thrown at heavy ones bounce off one by one, with peak pressures three times the planar limit."""
    end_time: PositiveTime = 3600.0
    """Simulated time after the impact."""
    snapshot_interval: PositiveTime = 60.0
    """Simulated time between snapshots."""
    history_interval: PositiveTime = 30.0
    """Simulated time between rows of ``history.csv``."""
    first_step: PositiveTime = 0.05
    """Length of the first time step; later ones follow from ``courant``."""
    relaxation_time: Time = 1000.0
    """Length of the damped settling before the impact (0: none)."""
    damping: Annotated[float, Field(ge=0)] = 0.01
    """Damping rate of the settling [1/s]."""
    strength: bool = True
    """Whether solids have shear strength."""
    damage: bool = True
    """Whether solids break."""
    sides: Literal["free", "fixed", "quiet", "wall", "periodic"] | None = None
    """What ends flat ground sideways: ``free``; ``fixed``, a rim that never moves; ``quiet``, a layer that absorbs waves in front of such a rim; ``wall``, a
    smooth mirror (block only); ``periodic`` (block only). By default ``quiet`` for a half-space and under gravity, ``free`` otherwise."""
    floor: Literal["free", "fixed", "quiet", "wall"] | None = None
    """What ends flat ground below, as ``sides``; a half-sphere has sides only."""
    edge_width: PositiveLength | None = None
    """Width of the quiet layer; by default six times ``spacing_far``."""
    late: late_stage.Settings | None = None
    """``[sph.late]``: a softened late stage for long times at small scale (``sph.late``); none by default."""
    materials: dict[str, Choice] = Field(default_factory=dict)
    """Changes to single materials, ``[sph.materials.ice]`` for example (``sph.material_settings``)."""
    control: bool = False
    """A control run without projectile."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the particles' first positions and of the flaws."""

    @model_validator(mode="after")
    def _sizes(self) -> Settings:
        if self.spacing_at_impact > 0.5 * self.target.radius:
            raise ValueError("spacing_at_impact must be below half the target's radius")
        if self.spacing_far < self.spacing_at_impact:
            raise ValueError("spacing_far must be at least spacing_at_impact")
        if self.length_terms and not (self.volumes == "start" and self.smoothing == "density"):
            raise ValueError('length_terms needs volumes = "start" and smoothing = "density"')
        if self.rim == "stressed" and not {"fixed", "quiet"} & set(surroundings.chosen(self.target, self.sides, self.floor)):
            raise ValueError('rim = "stressed" needs sides or a floor that are fixed or quiet')
        if self.late is not None and self.late.at >= self.end_time:
            raise ValueError("late.at must be before end_time")
        if self.late is not None and self.late.viscosity_time >= self.end_time:
            raise ValueError("late.viscosity_at must be before end_time")
        if fault := surroundings.fault(self.target, self.sides, self.floor, self.width_of_edge):
            raise ValueError(fault)
        self.chosen_materials()
        return self

    def chosen_materials(self) -> material_rows.Materials:
        """The materials of target and projectile with the laws that the case chooses; raises ``InputError``."""
        return material_rows.collect(tuple(dict.fromkeys([*self.target.materials, self.impact.projectile.material])), self.materials)

    @property
    def zones(self) -> bodies.Zones:
        """Where the particles are how fine."""
        contact = self.spacing_at_impact / self.contact_refinement
        return bodies.Zones(contact, self.contact_radius, self.spacing_at_impact, self.fine_radius, self.spacing_far, self.growth, self.support)

    @property
    def width_of_edge(self) -> float:
        """Width of the quiet layer [m]."""
        return self.edge_width if self.edge_width is not None else 6.0 * self.spacing_far

    @property
    def relaxes(self) -> bool:
        """Whether the target settles before the impact: there is weight to settle under."""
        return self.target.start == "relaxed" and self.target.weighs and self.relaxation_time > 0.0


def idle_sources(settings: Settings) -> set[Path]:
    """Law files that this run does not take: its bibliography leaves out what only they cite."""
    chosen = {
        "smoothing": settings.smoothing == "density", "start_volumes": settings.volumes == "start", "late": settings.late is not None,
        "runge_kutta": settings.integrator == "rk3", **{f"kernels/{name}": settings.kernel == name for name in kernels.FAMILY.names},
        "artificial_stress": settings.artificial_stress > 0.0, "gradients": settings.gradients == "corrected",
        "lattice_gradients": settings.gradients == "normalised",
        "length_terms": settings.length_terms, "boundary/stressed_rim": settings.rim == "stressed",
        "viscosity_reconstructed": settings.viscosity == "reconstructed",
        **{f"viscosity_{name}": settings.viscosity_switch == name for name in viscosity_switch.LAWS},
    }  # fmt: skip
    return used_laws.idle_sources(settings.chosen_materials()) | {used_laws.ROOM / f"{name}.py" for name, taken in chosen.items() if not taken}


def idle_sections(settings: Settings) -> set[tuple[str, str]]:
    """Sections (material, title) of material files that this run does not take."""
    return used_laws.idle_sections(settings.chosen_materials())


def _count(settings: Settings) -> int:
    """Expected number of target particles."""
    rng = np.random.default_rng(1)
    spacing = bodies.spacing_law(settings.target, settings.zones)
    pieces = grounds.slabs_of(settings.target) if settings.target.flat else [regions.Shell(0.0, settings.target.radius)]
    return int(sum(piece.volume * (spacing(piece.draw(rng, 20_000)) ** -3.0).mean() for piece in pieces))


def predict(settings: Settings) -> dict[str, float]:
    """Wall time [s] (warm, 2 cores), memory and disk [bytes] of this stage, and the sizes that the stages after it go by."""
    n = _count(settings)
    quiet = settings.courant * settings.zones.contact / (1.6 * 3800.0)  # the shell's longitudinal wave
    stiff = min(settings.late.at, settings.end_time) if settings.late else settings.end_time
    steps = 1.6 * stiff / quiet + 200.0  # measured: fast ejecta and the impact itself ask for 1.6 times the quiet number
    if settings.late:  # longitudinal waves are 1.5 times as fast as the bulk's
        steps += (settings.end_time - stiff) / quiet * min(1.5 * settings.late.sound_speed / 3800.0, 1.0)
    steps *= 3.0 if settings.integrator == "rk3" else 1.0
    relax = settings.relaxation_time / quiet if settings.relaxes else 0.0
    evaluations = steps * (1.0 if settings.gravity_shift == 0 else 0.3) * settings.target.attracts
    rows = settings.end_time / settings.history_interval
    energies = (_SECONDS_PER_PAIR * n**2 if n <= DIRECT else 5e-6 * n) * settings.target.attracts
    wall = n * (_SECONDS_PER_STEP * (steps + relax) + _SECONDS_PER_GRAVITY * evaluations) + rows * energies + 3.0
    snapshots = settings.end_time / settings.snapshot_interval + 2.0
    sizes = {"particles": n, "snapshots": snapshots}
    return {"wall_s": wall, "memory_bytes": 3e8 + 2800.0 * n, "disk_bytes": snapshots * 190.0 * n, **sizes}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Run or resume the stage in the folder ``out``; ``inputs`` is the run folder.

    Raises ``InputError`` (bad ``impact.toml``), ``UnphysicalState`` (particle, place, time, values), ``Stopped``.
    """
    job = Simulation(settings, Path(inputs), Path(out))
    relaxation = settings.relaxation_time if job.phase == "relax" else 0.0
    report = progress.Progress("sph", relaxation + settings.end_time)
    column = job.column
    facts = grounds.target_json(settings.target, column) if isinstance(column, grounds.Ground) else bodies.target_json(settings.target, column)
    archive.write_text(job.out / "target.json", json.dumps(facts, indent=1))
    saved = checkpoint.newest(job.out)
    if saved is None:
        job.begin()
    else:
        job.restore(*saved)
    report.start = (0.0 if job.phase == "relax" else relaxation) + job.integrator.time
    if job.phase == "relax":
        job.relax(report)
    job.strike(report, relaxation)
    job.finish()
    checkpoint.clear(job.out)
