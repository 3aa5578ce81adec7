"""One run of the shock stage: the integrator, its history and outputs, and the whole state in its checkpoints.

Phases: ``relax`` (no strength, damped, energy held), then ``impact`` (everything on).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from matter import progress
from matter.blocks import block_file, placing
from matter.cadence import Cadence
from matter.files import checkpoint, snapshot
from matter.particles import Particles
from matter.wording import readable
from sph import cloud_snapshot, cost_prediction
from sph.bodies import ground as grounds
from sph.bodies import projectile, rubble, seeding, solid_target, symmetry
from sph.bodies import target as bodies
from sph.bodies.particle_cloud import Cloud
from sph.boundary.edge import Edge
from sph.materials import rows as material_rows
from sph.pairs import body_contact
from sph.settings import Settings
from sph.stepping import flow_reynolds, individual_steps, sides_and_floor, watch
from sph.stepping.environment import Environment
from sph.stepping.history import History
from sph.stepping.integrator import Integrator
from sph.stepping.late import BETA
from sph.viscosity import reconstructed


class Simulation:
    """One run of the stage: the integrator, its history, and where it stands between two outputs."""

    def __init__(self, settings: Settings, out: Path):
        self.settings, self.out, self.impact = settings, out, settings.impact
        target, ball = settings.target, self.impact.projectile
        names = tuple(dict.fromkeys([*target.materials, *ball.materials, *target.block_materials]))
        self.materials = material_rows.collect(names, settings.materials)
        self.column: bodies.Profile | grounds.Ground
        if settings.target.flat:
            self.column, self.radius = (
                grounds.hydrostatic(settings.target, self.materials),
                max(settings.target.radius, settings.target.half_width),
            )
        else:
            self.column = bodies.hydrostatic(settings.target, materials=self.materials)
            self.radius = float(self.column.radius[-1])
        self.placing = placing.of_target(settings.target)
        self.rubble: dict[str, Any] = {}
        if self.placing is not None:
            self.materials, self.matrix = rubble.with_matrix(
                self.materials, settings.target.layers[0].material, self.placing
            )
        self.materials = self.materials.hit_by(ball.radius)
        self.edge: Edge | None = None
        self.late: list[dict[str, float]] = []
        self.viscosity_reduced = False
        self.flow: list[dict[str, Any]] = []
        self.individual: list[dict[str, Any]] = []
        self.history = History(out / "history.csv", settings.symmetry)
        self.times: dict[str, float] = {}
        self.phase = "relax" if settings.relaxes else "impact"
        self.cadence = Cadence()
        self.work = cost_prediction.work(settings)

    def _integrator(self, cloud: Cloud) -> Integrator:
        s = self.settings
        planes = sides_and_floor.images(s, self.bottom)
        until = body_contact.ends(2.0 * self.impact.projectile.radius, self.impact.speed, s.support * s.zones.contact)
        sphere = None if s.target.flat else self.radius
        environment = Environment(s.target.attracts, s.target.gravity, planes, self.edge, sphere, s.symmetry, until)
        return Integrator(cloud, self.materials, self.radius, s, environment)

    @property
    def bottom(self) -> float:
        """Height of the bottom of flat ground [m]."""
        return self.column.bottom if isinstance(self.column, grounds.Ground) else 0.0

    def _edge(self, target: bodies.Body, energy: np.ndarray, count: int) -> Edge | None:
        """The outer edge about the target as it stands, for ``count`` particles in all."""
        return sides_and_floor.edge(self.settings, self.bottom, target, energy, count)

    def begin(self) -> None:
        """The first state of the first phase."""
        s = self.settings
        if isinstance(self.column, grounds.Ground):
            body = grounds.build(s.target, self.column, self.materials, s.zones, s.seed, s.symmetry)
        elif s.target.solid:
            body = solid_target.build(s.target, self.materials, s.zones, s.seed)
        else:
            body = bodies.build(s.target, self.column, self.materials, s.zones, s.seed, s.symmetry)
        body = self._with_blocks(body)
        self.edge = self._edge(body, np.zeros(len(body.mass)), len(body.mass))
        self.integrator = self._integrator(Cloud.from_bodies(body))
        self._enter(self.phase)
        if self.phase == "impact":
            self._add_projectile()

    def _with_blocks(self, body: bodies.Body) -> bodies.Body:
        """The body with its blocks, where it has any; writes ``blocks.h5``."""
        target = self.settings.target
        if self.placing is None:
            return body
        position, column = body.position, self.column
        zones, site, bears = self.settings.zones, np.array(target.impact_point), None

        def weight(mass: np.ndarray) -> np.ndarray:
            if isinstance(column, grounds.Ground):
                return np.asarray(np.interp(-position[:, 2], column.middle, column.pressure))
            return solid_target.weight(target, self.materials, position, mass)

        if target.start == "relaxed" and target.weighs:
            bears = weight
        body, self.rubble = rubble.filled(body, self.materials, self.matrix, self.placing, zones, site, bears)
        block_file.write(rubble.listed(target, self.materials, self.placing, zones), self.out)
        return body

    def _enter(self, phase: str) -> None:
        self.phase = phase
        i, relaxing = self.integrator, phase == "relax"
        self._switch_physics()
        if relaxing:
            i.step_limit.dt = 1.0
            i.start()

    def _switch_physics(self) -> None:
        """Strength and damage, and u and D held, as the phase wants them."""
        i, relaxing = self.integrator, self.phase == "relax"
        i.switches.freeze_energy, i.switches.strength = relaxing, self.settings.strength and not relaxing
        i.switches.damage = self.settings.damage and not relaxing

    def _add_projectile(self) -> None:
        """End the relaxation: the target at rest with S = 0 and D = 0, the projectile above it, time zero."""
        s, target = self.settings, self.integrator.cloud
        order = np.argsort(target.identity)
        pieces = [
            bodies.Body(
                target.position[order],
                target.mass[order],
                target.density[order],
                target.support_radius[order],
                target.layer[order],
                target.material[order],
                target.distention[order],
                target.block[order] if len(target.block) else -1,
            )
        ]
        del target, order, self.integrator  # its memory is that of the next one
        if not s.control:
            surface = s.target.impact_point[2] if s.target.flat or s.target.solid else self.radius
            pieces.append(
                projectile.build(
                    s.target,
                    self.impact,
                    s.projectile_spacing,
                    surface,
                    s.support * s.zones.contact,
                    self.materials,
                    s.support,
                    s.symmetry,
                )
            )
        cloud = Cloud.from_bodies(*pieces)
        self.edge = self._edge(pieces[0], np.zeros(len(pieces[0].mass)), len(cloud))
        del pieces
        if not s.control:
            cloud.velocity[cloud.layer < 0] = s.target.aim(self.impact)
        if s.target.spin_period:
            mine = cloud.layer >= 0
            arm = cloud.position[mine]
            if self.rubble:  # blocks lie to one side of the middle: it turns about its centre of mass
                arm = arm - cloud.mass[mine] @ arm / cloud.mass[mine].sum()
            cloud.velocity[mine] += np.cross(solid_target.spin(s.target), arm)
        seeding.seed_flaws(cloud, self.materials, s.seed)
        self.integrator = self._integrator(cloud)
        self.phase = "impact"
        self._enter("impact")
        self.integrator.step_limit.dt = s.first_step / 1.1
        self.integrator.start()
        # the pressures of the particles, not quite those of the profile, have closed some pores: no damage of the
        # impact
        if self.materials.porous:
            cloud.initial_distention[:] = cloud.distention
            self.integrator.start()

    # ---------------------------------------------------------------- checkpoint
    def save(self) -> None:
        """Everything that a resumed run needs to go on to the last bit."""
        i = self.integrator
        arrays, numbers = i.state()
        if self.edge is not None:
            arrays |= checkpoint.under("edge", self.edge.state())
        numbers |= {
            "phase": self.phase, "times": json.dumps(self.times), "late": json.dumps(self.late),
            "thinned": self.viscosity_reduced, "flow": json.dumps(self.flow),
            "individual": json.dumps(self.individual), "rubble": json.dumps(self.rubble),
        }  # fmt: skip
        with self.cadence.writing():
            self.history.write()
            checkpoint.save(self.out, i.steps + (10**8 if self.phase == "impact" else 0), arrays, numbers)

    def restore(self, arrays: dict[str, np.ndarray], scalars: dict[str, Any]) -> None:
        """Take up a checkpoint."""
        self.edge = Edge.restored(checkpoint.Part(arrays, "edge")) if "edge/fixed" in arrays else None
        i = self.integrator = self._integrator(Cloud.restored(checkpoint.Part(arrays, "cloud")))
        i.restore(arrays, scalars)
        self.times, self.rubble = json.loads(scalars["times"]), json.loads(scalars["rubble"])
        self.late = json.loads(scalars["late"])
        self.flow, self.individual = json.loads(scalars["flow"]), json.loads(scalars["individual"])
        if self.late:
            i.resume_late_stage(self.late[-1]["sound_speed_m_s"], self.settings.spacing_at_impact)
        if bool(scalars["thinned"]):
            self._reduce_viscosity()
        self.phase = str(scalars["phase"])
        self._switch_physics()
        if self.phase != "relax":
            self.history.restore(i.steps)

    # ---------------------------------------------------------------- loops
    def _pause(self, report: progress.Progress, done: float) -> None:
        i = self.integrator
        report.update(
            self.work(done),
            f"{self.phase} t = {readable.clock(i.time)}, dt = {i.step_limit.dt:.3g} s ({i.step_limit.why})",
        )
        if self.cadence.due():
            self.save()
            progress.stop_here("sph")

    def relax(self, report: progress.Progress) -> None:
        """Damped settling without strength, energy held."""
        i, s = self.integrator, self.settings
        while i.time < s.relaxation_time:
            dt = i.next_step(s.relaxation_time)
            i.step(dt, 1.0 / (1.0 + s.damping * dt))
            self._pause(report, i.time)
        self.rest_speed = float(
            np.sqrt(i.cloud.mass @ np.einsum("ij,ij->i", i.cloud.velocity, i.cloud.velocity) / i.cloud.mass.sum())
        )
        del i
        self._add_projectile()

    def follow_impact(self, report: progress.Progress, offset: float) -> None:
        """The impact up to the end time, with outputs on the way."""
        i, s = self.integrator, self.settings
        ball = self.impact.projectile
        mass = 0.0 if s.control else self.materials.bulk_density[self.materials.index(ball.material)] * ball.volume
        self.history.impact_J = 0.5 * mass * self.impact.speed**2
        self.watch = watch.Watch(self.history.impact_J, pushed=self.edge is not None)
        if i.steps == 0:
            self._output()
        while i.time < s.end_time:
            mark = min(self._next_output(), s.end_time)
            coming = self._coming()
            if due := [change for at, change in coming if i.time >= at]:
                self._note_flow()
                for change in due:
                    change()
                self._note_flow()
                continue
            mark = min([mark, *(at for at, _ in coming)])
            i.step(i.next_step(mark))
            self.watch.step(i.step_limit.dt, i.time, i.step_limit.why)
            if i.time >= mark:
                i.time = mark
                if mark == s.end_time or any(
                    self._due(interval) for interval in (s.history_interval, s.snapshot_interval)
                ):
                    self._output()
            self._pause(report, offset + i.time)

    def _coming(self) -> list[tuple[float, Callable[[], None]]]:
        """What the late stage has yet to change, and when [s]."""
        chosen = self.settings.late
        if chosen is None:
            return []
        changes = [] if self.viscosity_reduced else [(chosen.viscosity_time, self._reduce_viscosity)]
        return [*changes, *((at, partial(self._enter_late_stage, c)) for at, c in chosen.switches[len(self.late) :])]

    def _reduce_viscosity(self) -> None:
        """Take up the artificial viscosity of the late stage."""
        chosen = self.settings.late
        if chosen is not None:
            self.integrator.set_viscosity(chosen.alpha, BETA)
            self.viscosity_reduced = True

    def _note_flow(self) -> None:
        """A row of the flow's Reynolds number."""
        i, c = self.integrator, self.integrator.cloud
        mine = c.layer >= 0
        fraction = (
            c.viscosity[mine] if len(c.viscosity) else reconstructed.SMOOTH if i.forces.scheme.reconstructed else 1.0
        )
        target = self.settings.target
        position = target.placed.from_site(c.position[mine]) if target.solid else c.position[mine]
        reynolds = flow_reynolds.measure(
            position, c.velocity[mine], symmetry.copies(self.settings.symmetry) * c.mass[mine],
            0.5 * c.support_radius[mine],
            i.forces.evaluated.loading_sound[mine], fraction,
            c.density[mine], self.materials.bulk_density[c.material[mine]], i.damping.alpha,
            self.radius if target.shape == "sphere" else None,
        )  # fmt: skip
        if reynolds is not None:
            self.flow.append({"time_s": i.time, **reynolds})

    def _next_output(self) -> float:
        """The next multiple of either interval [s]; where both meet to rounding, that of the history."""
        time, s = self.integrator.time, self.settings
        row, shot = (
            (np.floor(time / every + 1e-9) + 1.0) * every for every in (s.history_interval, s.snapshot_interval)
        )
        return float(row if abs(row - shot) < 1e-9 * row else min(row, shot))

    def _due(self, interval: float) -> bool:
        """Whether the time is a multiple of ``interval`` [s]."""
        times = self.integrator.time / interval
        return abs(times - round(times)) < 1e-9 * max(times, 1.0)

    def _enter_late_stage(self, sound_speed: float) -> None:
        """Enter the late stage or its next part, and note what it does to the elastic energy."""
        i, position = self.integrator, self.integrator.cloud.position
        if isinstance(self.column, grounds.Ground):
            weight = np.interp(-position[:, 2], self.column.middle, self.column.pressure, left=0.0)
        elif self.settings.target.solid:
            weight = solid_target.carried(self.settings.target, self.materials, i.cloud)
        else:
            weight = np.interp(np.linalg.norm(position, axis=1), self.column.middle, self.column.pressure, right=0.0)
        self.history.add(i)
        parts = symmetry.copies(self.settings.symmetry)
        spacing = self.settings.spacing_at_impact
        before, after = (parts * energy for energy in i.enter_late_stage(sound_speed, spacing, weight))
        v2 = np.einsum("ij,ij->i", i.cloud.velocity, i.cloud.velocity)
        note = {
            "time_s": i.time, "sound_speed_m_s": sound_speed, "steps_before": i.steps,
            "elastic_energy_before_J": before,
            "elastic_energy_after_J": after, "kinetic_energy_J": 0.5 * parts * float(i.cloud.mass @ v2),
        }  # fmt: skip
        self.late.append(note)

    def _output(self) -> None:
        """A row of the history, and a snapshot where one is due."""
        i = self.integrator
        self.history.add(i)
        self.watch.energy(self.history.rows, bool(self.late))
        if (
            i.steps > 0
            and i.time
            >= individual_steps.FRACTIONS[min(len(self.individual), len(individual_steps.FRACTIONS) - 1)]
            * self.settings.end_time
        ):
            self.individual.append(individual_steps.measure(i))
        if self._due(self.settings.snapshot_interval) or i.time >= self.settings.end_time:
            name = f"snap_{len([t for t in self.times.values() if t < i.time]):04d}{snapshot.SUFFIX}"
            snapshot.write(self.particles(), self.out / name)
            self.times[name] = i.time
            self._note_flow()
            snapshot.write_series(self.out, self.times)

    def particles(self) -> Particles:
        """The cloud as a snapshot, in order of identity."""
        return cloud_snapshot.particles(self.integrator, self.settings, self.column, self.radius)

    def finish(self) -> None:
        """Last snapshot and history."""
        snapshot.write(self.particles(), self.out / f"last{snapshot.SUFFIX}")
        self.history.write()
