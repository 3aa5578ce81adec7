"""Stage 2: the impact as shock physics, from a layered body in balance to the end of the simulated time.

Phases: ``relax`` (no strength, damped, energy held: the particles settle on the hydrostatic profile), then ``impact`` (everything on). Leaves ``target.json``,
snapshots with a series index, ``history.csv``, ``last.vtkhdf`` and ``stage_report.json``.
"""

from __future__ import annotations

import json
import time as clock
import tomllib
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from matter import archive, checkpoint, progress, regions, snapshot
from matter.body import Impact, Model, Target
from matter.errors import InputError
from matter.particles import Particles
from matter.quantity import PositiveLength, PositiveTime, Time
from sph import ground as grounds
from sph import late as late_stage
from sph import materials as material_rows
from sph import state, timestep, used_laws, viscosity_switch
from sph import target as bodies
from sph.boundary import surroundings
from sph.boundary.edge import Edge
from sph.cloud import ARRAYS, OPTIONAL, Cloud
from sph.damage import seeding
from sph.history import DIRECT, History
from sph.integrator import Integrator
from sph.material_settings import Choice
from sph.runge_kutta import RungeKutta
from sph.strength import dispatch as strengths

_CHECKPOINT_WALL = 20.0  # seconds of wall time between checkpoints
# warm, 2 cores of a Zen 5 machine: seconds per particle and step of the hydrodynamics, per particle of one gravity evaluation, per pair of the direct sum
_SECONDS_PER_STEP, _SECONDS_PER_GRAVITY, _SECONDS_PER_PAIR = 4.0e-7, 1.1e-6, 4.0e-10


class Settings(Model):
    """Settings of the shock stage.

    spacing_at_impact, spacing_far : particle spacing within ``fine_radius`` of the impact point and far away; between them it grows by ``growth`` per distance.
    contact_refinement, contact_radius : within ``contact_radius`` of the impact point the spacing is finer by this factor.
        Equal spacings and no refinement give a uniform hexagonal lattice.
    projectile_particles : about how many particles the projectile has (1 is one heavy particle); by default its particles weigh what the target's
        at the contact weigh: light particles thrown at heavy ones bounce off one by one, with peak pressures three times the planar limit.
    end_time : simulated time after the start [s];  snapshot_interval, history_interval : output every so often.
    alpha, beta : artificial viscosity;  courant : step factor;  theta : opening angle of gravity;
    gravity_shift : gravity is evaluated anew when a bound particle has moved this share of its h (0: at every step).
    relaxation_time, damping : length [s] and rate [1/s] of the damped settling.
    strength, damage : switches;  control : no projectile.
    sides, floor : what ends flat ground (a half-sphere has sides only): ``free``, ``fixed`` (a rim that never moves), ``quiet`` (a layer that takes waves in
        before such a rim), ``wall`` (smooth mirror; floors, sides of a block), ``periodic`` (sides of a block). By default quiet under gravity and for a
        half-space.
    edge_width : width of the quiet layer; six times ``spacing_far`` by default.
    rim : stress of the fixed rim: its ``own`` of the start, which passes on half of a shear stress, or ``stressed`` as what leans on it
        (``sph.boundary.stressed_rim``).
    kernel, support : kernel of the sums, and its support radius over the spacing.
    volumes : weights of the sums: the ``present`` volumes, or those of the ``start`` (``sph.start_volumes``: right behind strong shocks).
    smoothing : ``fixed``: supports stay as long as they began; ``density``: they follow it, within ``shortest`` and ``longest`` times the first
        (``sph.smoothing``).
    length_terms : with ``volumes = "start"`` and ``smoothing = "density"``: what the change of a support adds to the density's rate (``sph.length_terms``).
    gradients : ``plain``, or ``corrected`` in force, density and heat too (``sph.gradients``: thin shells, spinning bodies; not strong shocks).
    viscosity_switch : ``none``: all of the viscosity everywhere; ``balsara``: less of it in shear (``sph.viscosity_balsara``); ``morris_monaghan``: a
        twentieth of it where nothing has been compressed (``sph.viscosity_morris_monaghan``).
    artificial_stress : strength eps of the repulsion in tension (``sph.artificial_stress``; 0: none).
    integrator : ``leapfrog`` (``sph.integrator``) or ``rk3``, with errors of a step below ``tolerance`` (``sph.runge_kutta``).
    late : ``at`` and ``sound_speed`` of the late stage (``sph.late``); none by default.
    materials : changes of single materials, ``[sph.materials.ice]`` (``sph.material_settings``).
    """

    target: Target
    impact: Impact
    spacing_at_impact: PositiveLength = 52e3
    spacing_far: PositiveLength = 200e3
    fine_radius: PositiveLength = 650e3
    growth: Annotated[float, Field(gt=0, le=0.3)] = 0.1
    contact_refinement: Annotated[float, Field(ge=1, le=10)] = 2.0
    contact_radius: PositiveLength = 120e3
    projectile_particles: Annotated[int, Field(ge=1, le=100_000)] | None = None
    end_time: PositiveTime = 3600.0
    snapshot_interval: PositiveTime = 60.0
    history_interval: PositiveTime = 30.0
    first_step: PositiveTime = 0.05
    alpha: Annotated[float, Field(ge=0, le=10)] = 2.0
    beta: Annotated[float, Field(ge=0, le=50)] = 10.0
    courant: Annotated[float, Field(gt=0, le=1)] = 0.3
    theta: Annotated[float, Field(gt=0, le=1)] = 0.5
    gravity_shift: Annotated[float, Field(ge=0, le=1)] = 0.05
    relaxation_time: Time = 1000.0
    damping: Annotated[float, Field(ge=0)] = 0.01
    strength: bool = True
    damage: bool = True
    sides: Literal["free", "fixed", "quiet", "wall", "periodic"] | None = None
    floor: Literal["free", "fixed", "quiet", "wall"] | None = None
    edge_width: PositiveLength | None = None
    kernel: Literal["cubic_spline", "wendland"] = "cubic_spline"
    support: Annotated[float, Field(ge=1.6, le=4.0)] = 2.0
    volumes: Literal["present", "start"] = "present"
    smoothing: Literal["fixed", "density"] = "fixed"
    shortest: Annotated[float, Field(gt=0.2, le=1)] = 0.5
    longest: Annotated[float, Field(ge=1, le=4)] = 2.0
    length_terms: bool = False
    rim: Literal["own", "stressed"] = "own"
    gradients: Literal["plain", "corrected"] = "plain"
    viscosity_switch: Literal["none", "balsara", "morris_monaghan"] = "none"
    artificial_stress: Annotated[float, Field(ge=0, le=1)] = 0.0
    integrator: Literal["leapfrog", "rk3"] = "leapfrog"
    tolerance: Annotated[float, Field(gt=0, le=0.1)] = 1e-5
    late: late_stage.Settings | None = None
    materials: dict[str, Choice] = Field(default_factory=dict)
    control: bool = False
    seed: Annotated[int, Field(ge=0)] = 1

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
        "runge_kutta": settings.integrator == "rk3", "kernel": settings.kernel == "cubic_spline", "kernel_wendland": settings.kernel == "wendland",
        "artificial_stress": settings.artificial_stress > 0.0, "gradients": settings.gradients == "corrected",
        "length_terms": settings.length_terms, "boundary/stressed_rim": settings.rim == "stressed",
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


def _read_impact(settings: Settings, inputs: Path) -> Impact:
    """The impact that stage 1 chose (``1_nbody/impact.toml``), or the settings' own where there is none."""
    path = inputs / "1_nbody" / "impact.toml"
    if not path.is_file():
        return settings.impact
    content = tomllib.loads(path.read_text())
    try:
        ball = content.get("projectile", {})
        return Impact.model_validate(
            {
                "speed": content["speed"],
                "angle_from_vertical": content["angle_from_vertical"],
                "projectile": {k: ball[k] for k in ("material", "radius") if k in ball} or settings.impact.projectile,
                "expected_transient_diameter": f"{settings.impact.expected_transient_diameter!r} m",
            },
            context={"units": "required"},
        )
    except KeyError as missing:
        raise InputError(f"{path} lacks the key {missing}") from None
    except ValueError as reason:
        raise InputError(f"{path}: {reason}") from None


class _Run:
    """One run of the stage: the integrator, its history, and where it stands between two outputs."""

    def __init__(self, settings: Settings, inputs: Path, out: Path):
        self.settings, self.out = settings, out
        self.impact = _read_impact(settings, inputs)
        names = tuple(dict.fromkeys([*settings.target.materials, self.impact.projectile.material]))
        self.materials = material_rows.collect(names, settings.materials)
        self.column: bodies.Profile | grounds.Ground
        if settings.target.flat:
            self.column, self.radius = grounds.hydrostatic(settings.target, self.materials), max(settings.target.radius, settings.target.half_width)
        else:
            self.column = bodies.hydrostatic(settings.target, materials=self.materials)
            self.radius = float(self.column.radius[-1])
        self.edge: Edge | None = None
        self.late: dict[str, float] = {}
        self.history = History(out / "history.csv")
        self.times: dict[str, float] = {}
        self.phase = "relax" if settings.relaxes else "impact"
        self.saved_at = clock.monotonic()

    def _integrator(self, cloud: Cloud) -> Integrator:
        s = self.settings
        kind = Integrator if s.integrator == "leapfrog" else partial(RungeKutta, tolerance=s.tolerance)
        return kind(
            cloud, self.materials, self.radius, alpha=s.alpha, beta=s.beta, courant=s.courant, theta=s.theta, gravity_shift=s.gravity_shift,
            self_gravity=s.target.attracts, down=s.target.gravity, images=surroundings.images(s.target, s.sides, s.floor, self.bottom), edge=self.edge,
            wendland=True if s.kernel == "wendland" else None, clumping=s.artificial_stress or None,
            first_volumes=s.volumes == "start", limits_of_h=(s.shortest, s.longest) if s.smoothing == "density" else None,
            length_terms=s.length_terms, stressed_rim=s.rim == "stressed",
            corrected=s.gradients == "corrected", viscosity_switch=None if s.viscosity_switch == "none" else s.viscosity_switch,
            sphere=None if s.target.flat else self.radius,
        )  # fmt: skip

    @property
    def bottom(self) -> float:
        """Height of the bottom of flat ground [m]."""
        return self.column.bottom if isinstance(self.column, grounds.Ground) else 0.0

    def _edge(self, target: bodies.Body, energy: np.ndarray, count: int) -> Edge | None:
        """The outer edge about the target as it stands, for ``count`` particles in all."""
        s = self.settings
        return surroundings.edge(s.target, s.sides, s.floor, self.bottom, s.width_of_edge, target, energy, count)

    def begin(self) -> None:
        """The first state of the first phase."""
        s = self.settings
        if isinstance(self.column, grounds.Ground):
            body = grounds.build(s.target, self.column, self.materials, s.zones, s.seed)
        else:
            body = bodies.build(s.target, self.column, self.materials, s.zones, s.seed)
        self.edge = self._edge(body, np.zeros(len(body.mass)), len(body.mass))
        self.integrator = self._integrator(Cloud.of(body))
        self._enter(self.phase)
        if self.phase == "impact":
            self._strike()

    def _enter(self, phase: str) -> None:
        self.phase = phase
        i, relaxing = self.integrator, phase == "relax"
        i.hold, i.strength, i.damage = relaxing, self.settings.strength and not relaxing, self.settings.damage and not relaxing
        if relaxing:
            i.dt = 1.0
            i.start()

    def _strike(self) -> None:
        """End the relaxation: the target at rest with S = 0 and D = 0, the projectile above it, time zero."""
        s, target = self.settings, self.integrator.cloud
        order = np.argsort(target.identity)
        pieces = [
            bodies.Body(
                target.position[order],
                target.mass[order],
                target.density[order],
                target.smoothing_length[order],
                target.layer[order],
                target.material[order],
                target.distention[order],
            )
        ]
        del target, order, self.integrator  # its memory is that of the next one
        if not s.control:
            count = s.projectile_particles
            spacing = (self.impact.projectile.volume / count) ** (1.0 / 3.0) if count else s.zones.contact
            surface = 0.0 if s.target.flat else self.radius
            pieces.append(bodies.projectile(self.impact, spacing, surface, s.support * s.zones.contact, self.materials, s.support))
        cloud = Cloud.of(*pieces)
        self.edge = self._edge(pieces[0], np.zeros(len(pieces[0].mass)), len(cloud))
        del pieces
        if not s.control:
            cloud.velocity[cloud.layer < 0] = self.impact.velocity
        seeding.seed_flaws(cloud, self.materials, s.seed)
        self.integrator = self._integrator(cloud)
        self.phase = "impact"
        self._enter("impact")
        self.integrator.dt = s.first_step / 1.1
        self.integrator.start()
        if self.materials.porous:  # the pressures of the particles, not quite those of the profile, have closed some pores: no damage of the impact
            cloud.initial_distention[:] = cloud.distention
            self.integrator.start()

    # ---------------------------------------------------------------- checkpoint
    def save(self) -> None:
        """Everything that a resumed run needs to go on to the last bit."""
        i = self.integrator
        arrays = {f"cloud/{name}": getattr(i.cloud, name) for name in (*ARRAYS, *OPTIONAL, "flaw_strain")}
        arrays |= {f"rates/{name}": value for name, value in vars(i.rates).items()}
        arrays |= {f"evaluated/{name}": getattr(i.evaluated, name) for name in state.KEPT}
        arrays |= {"places": i.neighbourhood.places, "reach": i.neighbourhood.reach, "limits": i.limits}
        if self.edge is not None:
            arrays |= {f"edge/{name}": value for name, value in vars(self.edge).items()}
        scalars = {
            "phase": self.phase, "time": i.time, "dt": i.dt, "steps": i.steps, "allowed": i.allowed, "builds": i.neighbourhood.builds,
            "gravity_evaluations": i.gravity_evaluations, "gravity_correction": i.gravity_correction,
            "gravity_time": i.gravity_time, "torque_removed": i.torque_removed, "times": json.dumps(self.times),
            "late": json.dumps(self.late),
            **({"images_time": i.images.time, "images_margin": i.images.margin} if i.images is not None else {}),
        }  # fmt: skip
        self.history.write()
        checkpoint.save(self.out, i.steps + (10**8 if self.phase == "impact" else 0), arrays, scalars)
        self.saved_at = clock.monotonic()

    def restore(self, arrays: dict[str, np.ndarray], scalars: dict[str, Any]) -> None:
        """Take up a checkpoint."""
        cloud = Cloud(len(arrays["cloud/mass"]))
        for name in (*ARRAYS, *OPTIONAL, "flaw_strain"):
            setattr(cloud, name, arrays[f"cloud/{name}"])
        self.edge = Edge.restored({name: arrays[f"edge/{name}"] for name in Edge.ARRAYS}) if "edge/fixed" in arrays else None
        i = self.integrator = self._integrator(cloud)
        for name in (*ARRAYS, *OPTIONAL, "flaw_strain"):  # the order in which they were saved
            setattr(cloud, name, arrays[f"cloud/{name}"])
        if i.images is not None:
            i.images.time, i.images.margin = float(scalars["images_time"]), float(scalars["images_margin"])
        i.neighbourhood.restore(arrays["places"], arrays["reach"])
        for name in vars(i.rates):
            getattr(i.rates, name)[:] = arrays[f"rates/{name}"]
        for name in state.KEPT:
            getattr(i.evaluated, name)[:] = arrays[f"evaluated/{name}"]
        i.limits[:] = arrays["limits"]
        i.time, i.dt, i.steps = float(scalars["time"]), float(scalars["dt"]), int(scalars["steps"])
        i.allowed = float(scalars["allowed"])
        i.neighbourhood.builds = int(scalars["builds"])
        i.gravity_evaluations, i.gravity_correction = int(scalars["gravity_evaluations"]), float(scalars["gravity_correction"])
        i.gravity_time = float(scalars["gravity_time"])
        i.torque_removed[:] = scalars["torque_removed"]
        self.times = json.loads(scalars["times"])
        self.late = json.loads(scalars["late"])
        if self.late:
            i.softened(self.late["sound_speed_m_s"])
        self.phase = str(scalars["phase"])
        relaxing = self.phase == "relax"
        i.hold, i.strength, i.damage = relaxing, self.settings.strength and not relaxing, self.settings.damage and not relaxing
        if not relaxing:
            self.history.restore(i.steps)

    # ---------------------------------------------------------------- loops
    def _pause(self, report: progress.Progress, done: float) -> None:
        i = self.integrator
        report.update(done, f"{self.phase} t = {i.time:.0f} s, dt = {i.dt:.3g} s ({i.why})")
        if progress.stop_requested() or clock.monotonic() - self.saved_at > _CHECKPOINT_WALL:
            self.save()
            progress.stop_here("sph")

    def relax(self, report: progress.Progress) -> None:
        """Damped settling without strength, energy held."""
        i, s = self.integrator, self.settings
        while i.time < s.relaxation_time:
            dt = i.next_step(s.relaxation_time)
            i.step(dt, 1.0 / (1.0 + s.damping * dt))
            self._pause(report, i.time)
        self.rest_speed = float(np.sqrt(i.cloud.mass @ np.einsum("ij,ij->i", i.cloud.velocity, i.cloud.velocity) / i.cloud.mass.sum()))
        del i
        self._strike()

    def strike(self, report: progress.Progress, offset: float) -> None:
        """The impact up to the end time, with outputs on the way."""
        i, s = self.integrator, self.settings
        interval = s.history_interval
        if i.steps == 0:
            self._output(0)
        while i.time < s.end_time:
            mark = min((np.floor(i.time / interval + 1e-9) + 1.0) * interval, s.end_time)
            if s.late is not None and not self.late:
                mark = min(mark, max(s.late.at, i.time))
                if i.time >= s.late.at:
                    self._soften(s.late)
                    continue
            i.step(i.next_step(mark))
            if i.time >= mark:
                i.time = mark
                if mark == s.end_time or abs(mark / interval - round(mark / interval)) < 1e-9:
                    self._output(round(mark / interval))
            self._pause(report, offset + i.time)

    def _soften(self, chosen: late_stage.Settings) -> None:
        """Enter the late stage, and note what it does to the elastic energy."""
        i, position = self.integrator, self.integrator.cloud.position
        if isinstance(self.column, grounds.Ground):
            weight = np.interp(-position[:, 2], self.column.middle, self.column.pressure, left=0.0)
        else:
            weight = np.interp(np.linalg.norm(position, axis=1), self.column.middle, self.column.pressure, right=0.0)
        self.history.add(i)
        before, after = i.soften(chosen.sound_speed, weight)
        v2 = np.einsum("ij,ij->i", i.cloud.velocity, i.cloud.velocity)
        self.late = {
            "time_s": i.time, "sound_speed_m_s": chosen.sound_speed, "steps_before": i.steps, "elastic_energy_before_J": before,
            "elastic_energy_after_J": after, "kinetic_energy_J": 0.5 * float(i.cloud.mass @ v2),
        }  # fmt: skip

    def _output(self, number: int) -> None:
        i, s = self.integrator, self.settings
        self.history.add(i)
        every = max(1, round(s.snapshot_interval / s.history_interval))
        if number % every == 0 or i.time >= s.end_time:
            name = f"snap_{len([t for t in self.times.values() if t < i.time]):04d}{snapshot.SUFFIX}"
            snapshot.write(self.particles(), self.out / name)
            self.times[name] = i.time
            snapshot.write_series(self.out, self.times, "snap")

    def particles(self) -> Particles:
        """The cloud as a snapshot, in order of identity."""
        i, c = self.integrator, self.integrator.cloud
        damage = state.damage_of(c, self.materials.rows)
        whole = self.materials.rows.strength[c.material] > strengths.VON_MISES  # laws that mix damage into the yield stress
        deviator = np.empty((len(c), 6))
        np.multiply((np.where(whole, 1.0, 1.0 - damage) / i.evaluated.alpha)[:, None], c.stress, out=deviator[:, :5])
        deviator[:, 5] = -(deviator[:, 0] + deviator[:, 3])
        fields = {
            "identity": c.identity, "position": c.position, "velocity": c.velocity, "mass": c.mass, "density": c.density,
            "specific_energy": c.specific_energy, "smoothing_length": c.smoothing_length, "pressure": i.evaluated.pressure,
            "deviatoric_stress": deviator, "damage": damage,
            "distention": i.evaluated.alpha, "material": c.material, "layer": c.layer, "sound_speed": i.evaluated.sound,
            "peak_pressure": c.peak_pressure, "gravity": c.gravity, "initial_position": c.initial_position, "neighbours": c.neighbours,
        }  # fmt: skip
        order = np.argsort(c.identity)
        attributes = {
            "time": i.time,
            "stage": "sph",
            "frame": self.settings.target.frame,
            "materials": list(self.materials.names),
            "layers": [layer.name for layer in self.settings.target.layers],
            **({"target_depth_m": -self.bottom} if self.settings.target.flat else {"target_radius_m": self.radius}),
            "spacing_at_impact_m": self.settings.spacing_at_impact,
        }
        return Particles({name: array[order] for name, array in fields.items()}, attributes)

    def finish(self) -> None:
        """Last snapshot, history, report."""
        i = self.integrator
        snapshot.write(self.particles(), self.out / f"last{snapshot.SUFFIX}")
        self.history.write()
        ball = self.impact
        mass = self.materials.bulk_density[self.materials.index(ball.projectile.material)] * ball.projectile.volume
        scale = {
            "energy_J": 0.5 * mass * ball.speed**2,
            "momentum_kg_m_s": mass * ball.speed,
            "angular_momentum_kg_m2_s": mass * ball.speed * self.radius * max(np.sin(ball.angle_from_vertical), 0.1),
        }
        drift = self.history.drift()
        report = {
            "particles": len(i.cloud),
            "steps": i.steps,
            "step_limits": {name: int(n) for name, n in zip(timestep.REASONS, i.limits)},
            "list_builds": i.neighbourhood.builds,
            "gravity_evaluations": i.gravity_evaluations,
            "gravity_correction_max_rel": i.gravity_correction,
            "removed_angular_momentum_over_projectile": float(np.linalg.norm(i.torque_removed)) / scale["angular_momentum_kg_m2_s"],
            "projectile": {"mass_kg": mass, "kinetic_energy_J": scale["energy_J"], "momentum_kg_m_s": scale["momentum_kg_m_s"]},
            "late": self.late or None,
            "drift": drift,
            "drift_over_projectile": {name: drift[name] / scale[name] for name in drift},
            "peak_pressure_Pa": float(i.cloud.peak_pressure.max()),
            "mean_neighbours": float(i.cloud.neighbours[i.cloud.layer >= 0].mean()),
        }
        archive.write_text(self.out / "stage_report.json", json.dumps(report, indent=1))


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Run or resume the stage in the folder ``out``; ``inputs`` is the run folder.

    Raises ``InputError`` (bad ``impact.toml``), ``UnphysicalState`` (particle, place, time, values), ``Stopped``.
    """
    job = _Run(settings, Path(inputs), Path(out))
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
