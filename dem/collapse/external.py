"""The collapse on LAMMPS or LIGGGHTS: the same inputs, snapshots, history and end as ``dem.stage``, with the stepping
done by a subprocess.

The engine writes a binary dump at every row of the history. Each is read into the stage's own assembly, which then
stands for the engine's state: energies, momenta, overlaps, the surface profile, what has left and when the profile is
still are found by the same code as in a native run. What cannot be known from dumps is left out: elastic energy is
that of the normal springs, all that is lost is booked as dissipated in contacts, and the balances of momentum and
energy are not measured.

Ejecta that are clear of the bed at the start and cannot be back before ``latest_time`` are flown here, under the same
gravity; all others stay in the engine's box with the bed. What leaves the box is booked when it is missed.

Stop and resume use the engine's own restart files, which hold the contact history. The stage's checkpoint of the same
step stands beside each. An engine that begins from a restart works out its first forces with the velocities of a full
step, where one that goes on has those of half a step: LAMMPS is therefore told to restart its integration at every
restart that it writes, and a resumed run on one rank has the same bits. On several ranks the domains are cut again,
and LIGGGHTS' restarts do not give back all of its state (1e-6 radii apart after ten steps): such a resume is another
run of the same collapse.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from dem.beds import bed_walls
from dem.beds.flat_ground import FlatGround
from dem.beds.layered_body import LayeredBody
from dem.beds.whole_body_bed import WholeBody
from dem.collapse import flight
from dem.collapse.collapse_run import COLUMNS, Collapse
from dem.collapse.stillness import STILL_CHANGE
from dem.contact.columns import DISSIPATED, ENERGY_REMOVED, MASS, RADIUS, TOUCHING, XYZ
from dem.engines import binary_dump, deviations, lammps, liggghts, program, wall_meshes
from dem.engines.central_gravity import Polynomial
from dem.engines.over_body import OverBody
from dem.engines.over_ground import OverGround
from dem.engines.scene import HOLD_STEPS, Plan, Scene
from dem.grains import shaking
from dem.grains.assembly import BALLISTIC, LEFT
from dem.settings import Settings
from dem.stiffness import stiffening
from matter.errors import InputError, UnphysicalState
from matter.files import checkpoint
from matter.geometry.ground_region import Upright
from matter.particles import Particles
from matter.progress import Progress, stop_here

ENGINES: dict[str, ModuleType] = {"lammps": lammps, "liggghts": liggghts}
POLL_S = 0.05
FOLDER, DECK, LOG = "engine", "in.deck", "engine.log"
LIST_STEPS = 8
"""Steps that a neighbour list should serve; an engine builds one in the time of one or two."""
_POSITION, _MOTION = slice(1, 4), slice(4, 10)
"""Columns of a dump (``dem.engines.scene.COLUMNS``): position, velocity and spin; the grain's number before them."""
_UNKNOWN = tuple(COLUMNS.index(name) for name in ("momentum_error", "angular_momentum_error", "energy_error"))


class ExternalCollapse(Collapse):
    """One run of the stage on another engine."""

    def __init__(self, settings: Settings, start: Particles, body: LayeredBody | FlatGround, out: Path):
        program.find(settings.engine)
        if settings.stiffness != "fixed":  # a scheme of our own stepping
            raise InputError(
                f"[dem] stiffness = 'following' needs engine = 'native': {settings.engine} steps every grain with one "
                f"stiffness"
            )
        if shaking.of_start(start) is not None:
            raise InputError(
                f"[dem] engine = {settings.engine!r}: the ground shakes at the handoff, and {settings.engine} has no "
                "friction that shaking takes (block_model): use engine = 'native'"
            )
        loaded = any(
            np.any(start.tables.get(f"contacts/{name}", np.zeros((0, TOUCHING)))[:, :TOUCHING])
            for name in ("history", "wall_history")
        )
        super().__init__(settings, start, body, out)
        self.engine, self.folder = ENGINES[settings.engine], out / FOLDER
        assert not isinstance(self.domain, WholeBody)  # refused before: no engine knows grains that attract
        bed, rest = self.bed, settings.latest_time - self.bed.start_time
        self.over = (
            OverGround(self.domain, bed.gravity)
            if isinstance(self.domain, Upright)
            else OverBody(self.domain, bed.gravity)
        )
        flight.look(bed, self.domain)
        self.aloft = np.sort(
            bed.identity[(bed.state == BALLISTIC) & self.over.stays_away(bed.position, bed.velocity, rest)]
        )
        grains = bed.particles({"time": bed.start_time, "species": []}, tables=False)
        grains = grains.select((grains["state"] != LEFT) & ~np.isin(grains.identity, self.aloft))
        reach = self.over.reach(grains.position, grains.velocity, rest, float(bed.X[:, RADIUS].max()))
        self.scene = Scene(
            grains,
            settings.contact,
            bed_walls.walls(self.domain),
            bed.gravity,
            bed.dt,
            reach,
            self.domain,
            self._skin(),
        )
        ejecta = bool(np.any(grains.identity >= start.attributes.get("bed_grains", np.iinfo(np.int64).max)))
        wanted = stiffening.springs_for(
            settings.springs_for, start, settings.contact, not isinstance(self.domain, Upright)
        )
        self.needs = deviations.needed(
            settings.engine, self.scene, deviations.Start(loaded, ejecta, wanted.factor > 1.0)
        )
        deviations.check(settings.engine, self.scene, self.needs, settings.accept)
        # whole holds, so that a restart finds the forces of the step at which it was written
        self.row_steps = HOLD_STEPS * max(1, round(settings.history_interval / (HOLD_STEPS * self.bed.dt)))
        self.restart_steps = self.row_steps * max(
            1, round(settings.snapshot_interval / (self.row_steps * self.bed.dt))
        )

    def _fly(self, steps: int) -> None:
        """Move the grains that fly here by ``steps`` steps of velocity Verlet."""
        bed = self.bed
        here = np.isin(bed.identity, self.aloft) & (bed.state == BALLISTIC)
        x, v = bed.position[here], bed.velocity[here]
        for _ in range(steps):
            v = v + 0.5 * bed.dt * self.over.pull(x)
            x = x + bed.dt * v
            v = v + 0.5 * bed.dt * self.over.pull(x)
        bed.position[here], bed.velocity[here], bed.V[here, XYZ] = x, v, v

    def _skin(self) -> float:
        """Skin in mean radii: what lets the fastest grain go some steps before the engine rebuilds its list."""
        bed = self.bed
        there = (bed.state != LEFT) & ~np.isin(bed.identity, self.aloft)
        fastest = float(np.max(np.linalg.norm(bed.velocity[there], axis=1)))
        return float(np.clip(2.0 * LIST_STEPS * fastest * bed.dt / bed.mean_radius, 0.1, 0.6))

    # -- time

    def advance(self) -> None:
        """Run the engine until the profile is still (not before ``end_time``) or ``latest_time`` is reached."""
        bed, settings = self.bed, self.settings
        self.folder.mkdir(exist_ok=True)
        total = int(np.ceil((settings.latest_time - bed.start_time) / bed.dt / self.row_steps)) * self.row_steps
        resume = bed.steps if bed.steps > 0 else None
        for stale in self.folder.glob("dump.*.bin"):
            stale.unlink()
        plan = Plan(total, self.row_steps, self.restart_steps, resume)
        self.engine.write(self.scene, plan, self.folder, DECK)
        if resume is None:
            self._due()
        progress = Progress("dem", settings.latest_time, start=bed.time, soonest=settings.end_time)
        running = program.start(settings.engine, DECK, settings.ranks, self.folder, LOG)
        try:
            for step in self._finished_steps(running, bed.steps, total):
                self._take(step)
                progress.update(bed.time, f"{settings.engine}: {bed.speed:.3g} m/s", force=True)
                if bed.time >= settings.end_time and self.still.change < STILL_CHANGE:
                    break
        finally:
            running.end()

    def _finished_steps(self, running: subprocess.Popen[bytes], last: int, total: int) -> Iterator[int]:
        """The steps after ``last`` whose dump (and restart, where due) is whole.

        The engine's log tells how far it is, but its files may be closed later than that: a dump counts when it is
        whole, a restart when the engine has gone on to the next row.
        """
        log = self.folder / LOG
        while last < total:
            ended = running.poll() is not None  # asked first: what it wrote before its end is then read
            reached = _reached(log)
            step = last + self.row_steps
            with_restart = step % self.restart_steps == 0 and step < total
            if (
                step <= reached
                and (ended or reached > step or not with_restart)
                and binary_dump.whole(self._dump(step))
            ):
                yield step
                last = step
            elif ended:
                raise UnphysicalState(
                    f"{self.settings.engine} ended after step {last} of {total}: "
                    f"{program.complaint(self.folder, LOG)} (see {log})"
                )
            else:
                time.sleep(POLL_S)
            stop_here("dem")

    def _dump(self, step: int) -> Path:
        return self.folder / f"dump.{step}.bin"

    def _take(self, step: int) -> None:
        """Bring the assembly to the engine's state at ``step`` and write what falls due."""
        bed, path = self.bed, self._dump(step)
        _, table = binary_dump.read(path, len(Plan(0, 1).columns))
        order = np.argsort(bed.identity, kind="stable")
        at = order[np.searchsorted(bed.identity[order], table[:, 0].astype(np.int64) - 1)]
        seen = np.zeros(len(bed.X), dtype=bool)
        seen[at] = True
        keep = bed.state[at] != LEFT  # those are booked, whatever the engine still does with them
        at, table = at[keep], table[keep]
        bed.position[at], bed.W[at], bed.V[at, :MASS] = table[:, _POSITION], table[:, _MOTION], table[:, _MOTION]
        self._fly(step - bed.steps)
        bed.steps = step
        self._book_missing(~seen & (bed.state != LEFT) & ~np.isin(bed.identity, self.aloft))
        bed.renew()
        flight.look(bed, self.domain)
        self.worst_overlap = max(self.worst_overlap, bed.worst)
        self._due()
        path.unlink()
        if step % self.restart_steps == 0:
            self.save()
            for old in self.folder.glob("restart.*"):
                if int(old.name.split(".")[1]) < step - self.restart_steps:
                    old.unlink()

    def _book_missing(self, missing: np.ndarray) -> None:
        """Book what the engine no longer holds; a grain that cannot have left by its last known position and speed is
        an error."""
        bed = self.bed
        if not missing.any():
            return
        travel = 2.0 * self.row_steps * bed.dt * np.linalg.norm(bed.velocity, axis=1) + 2.0 * bed.X[:, RADIUS]
        beyond = missing & (np.max(np.abs(bed.position), axis=1) + travel > self.scene.reach)
        past_side = missing & ~beyond & self.over.past_side(bed.position, travel)
        lost = missing & ~beyond & ~past_side
        if lost.any():
            raise UnphysicalState(
                f"{self.settings.engine} lost grain {bed.identity[lost][0]} inside the domain; last seen at "
                f"{bed.where(int(np.flatnonzero(lost)[0]))}"
            )
        flying = bed.state == BALLISTIC
        # from flat ground nothing escapes: what leaves the box comes down outside, or too late
        flat = isinstance(self.domain, Upright)
        escaped = beyond & (not flat)
        outside = (past_side & flying) | (beyond & flat)
        by_reason = {
            "escaped": bed.identity[escaped],
            "landed_outside": bed.identity[outside],
            "through_the_side": bed.identity[past_side & ~flying],
        }
        for reason, who in by_reason.items():
            bed.change_states(np.isin(bed.identity, who), LEFT, reason)

    # -- what is known

    def _row(self) -> list[float]:
        bed = self.bed
        booked = float(bed.booked[:, ENERGY_REMOVED].sum())
        bed.report[DISSIPATED] = self.balance.energy - sum(bed.energies().values()) - booked
        row = super()._row()
        for k in _UNKNOWN:
            row[k] = float("nan")
        return row

    def _report(self) -> dict[str, Any]:
        report = super()._report()
        for k in _UNKNOWN:
            report[COLUMNS[k]] = None
        scene = self.scene
        report["list_builds"] = None
        report["engine"] = {
            "name": self.settings.engine,
            "ranks": self.settings.ranks,
            "deviations": {name: deviations.SENTENCES[name] for name in self.needs},
            "classes": len(scene.classes),
            "rounding_by_classes": scene.classes.rounding(scene.grains),
            "gravity_error": Polynomial.fit(scene.gravity, scene.lower).error if scene.gravity.radius > 0.0 else 0.0,
            "gravity_held_steps": HOLD_STEPS,
            "wall_deviation_radii": wall_meshes.DEVIATION if self.settings.engine == liggghts.NAME else 0.0,
            "box_half_edge_m": scene.reach,
        }
        report["notes"] += [
            f"Stepped by {self.settings.engine}; energies, momenta and overlaps are those of its dumps. elastic_J "
            f"holds the normal springs only, "
            "dissipated_contacts_J all that is missing from the total; the balances are not measured.",
            "The engine keeps springs in the contact plane by projection; they do not turn with the pair's mean spin "
            "about the normal.",
            f"{len(self.aloft)} grains that could not be back before the latest end were flown by the stage itself.",
        ]
        return report

    def finish(self) -> None:
        """Write the last files and remove what only a resume needs."""
        super().finish()
        for pattern in ("dump.*.bin", "restart.*", "restart_forced_*", "start.data", "core_*.dat"):
            for path in self.folder.glob(pattern):
                path.unlink()


def run(settings: Settings, start: Particles, body: LayeredBody | FlatGround, out: Path) -> None:
    """Run or resume the collapse on ``settings.engine`` in ``out``."""
    collapse = ExternalCollapse(settings, start, body, out)
    saved = checkpoint.newest(out)
    if saved is not None and (out / FOLDER / f"restart.{saved[1]['bed/steps']}").is_file():
        collapse.restore(*saved)
    collapse.advance()
    collapse.finish()


def _reached(log: Path) -> int:
    """The last step that the log's table names, -1 before the first."""
    if not log.is_file():
        return -1
    for line in reversed(log.read_bytes()[-4000:].split(b"\n")[:-1]):
        words = line.split()
        if len(words) == 3 and words[0].isdigit() and words[1].isdigit():
            return int(words[0])
    return -1
