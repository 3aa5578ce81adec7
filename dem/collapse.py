"""One run of the collapse: the assembly, what is remembered about it, its history, checkpoints and last files."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from dem import flight, flight_collisions, sleeping, stiffening
from dem.assembly import BALLISTIC, LEFT, REASONS, Assembly, Extras
from dem.beds import settling
from dem.beds.container import Container
from dem.beds.domain import Domain
from dem.beds.flat_ground import FlatGround
from dem.beds.layered_body import LayeredBody
from dem.columns import (
    ANGULAR_GONE,
    ANGULAR_IMPULSE,
    AT_WALLS,
    DISSIPATED,
    DRAGGED,
    ENERGY_GONE,
    GRAINS_GONE,
    IMPULSE,
    MASS_GONE,
    MOMENTUM_GONE,
    RADIUS,
    SPENT,
    WX,
)
from dem.following_stiffness import LIMIT as STIFFNESS_LIMIT
from dem.following_stiffness import Following
from dem.settings import Settings
from dem.stillness import Stillness, surface_profile
from matter import archive, checkpoint, readable, snapshot
from matter.errors import InputError, Unsound
from matter.particles import Particles
from matter.progress import Progress, stop_here, stop_requested

MOMENTUM_LIMIT = 1e-9
"""Largest error of the momentum balance (momentum + what left - impulses), over the sum of m |v| at the start (of m sqrt(g r) where nothing moves)."""
ENERGY_LIMIT = 0.05
"""Largest error of the energy balance, over the kinetic energy that the compact grains were handed plus what was dissipated (not by ejecta in flight or in
scaled contacts, which hold far more). Of what changing springs take
up only the share of the weight is taken out (``dem.spring_change``)."""
LIMITS = {"momentum_error": MOMENTUM_LIMIT, "angular_momentum_error": MOMENTUM_LIMIT, "energy_error": ENERGY_LIMIT, "stiffness_excess": STIFFNESS_LIMIT}
CHECKPOINT_EVERY_S = 15.0

_VECTORS = ("momentum", "angular_momentum")
COLUMNS = (
    "time_s", "dt_s", "mass_kg", *(f"{v}_{c}" for v in _VECTORS for c in "xyz"), "kinetic_J", "rotational_J", "gravitational_J", "elastic_J",
    "dissipated_contacts_J", "dissipated_returning_J", "dissipated_damping_J", "dissipated_walls_J", "booked_J", "total_J",
    *(f"impulse_{c}" for c in "xyz"), *(f"angular_impulse_{c}" for c in "xyz"), "momentum_error", "angular_momentum_error", "energy_error",
    "overlap_max", "overlaps_above_warning", "contacts", "speed_max", "grains_active", "grains_ballistic", "grains_left", "booked_mass_kg",
    "profile_change", "stiffness_change_J", "stiffness_over_start", "grains_asleep", "stiffness_excess_J", "dissipated_flight_J",
)  # fmt: skip


class Collapse:
    """One run of the stage: the assembly and what is remembered about it."""

    def __init__(self, settings: Settings, start: Particles, body: LayeredBody | FlatGround, out: Path):
        _check(start, settings)
        self.settings, self.out = settings, out
        flat = start.attributes.get("frame") == "plane"
        if flat != isinstance(body, FlatGround):
            raise InputError("the start and target.json do not share a frame: one is flat ground, the other a sphere")
        self.domain: Domain | Container = (Container if flat else Domain).of_attribute(start.attributes["domain"])
        start["stiffness"] = capped_stiffness(start)
        dt = settings.contact.time_step(start, body.gravity()) * settings.step_factor
        self.springs = stiffening.springs_for(settings.springs_for if settings.engine == "native" else "bed", start, settings.contact, flat)
        stiffer = self.springs.factor != 1.0
        self.bed = Assembly(
            start, settings.contact, self.domain.walls(), body.gravity(), dt=dt, threads=settling.threads_for(len(start)), skin=0.3,
            extras=Extras(stiffer or settings.stiffness == "following", settings.sleeping),
        )  # fmt: skip
        self.springs_energy = (self.bed.elastic, self.bed.elastic)
        if stiffer:
            self.springs_energy = stiffening.stiffen(self.bed, self.springs)
            self.domain = stiffening.damped_for(self.domain, self.springs)
        self.handed = handed_energy(self.bed, body.surface_gravity)
        floor = self.domain.floor if isinstance(self.domain, Container) else self.domain.core_radius
        self.following = Following(self.bed, float(body.pressure(np.array(floor))), self.handed) if settings.stiffness == "following" else None
        self.carried = {k: v for k, v in start.attributes.items() if k not in ("time", "stage")} | {"domain": self.domain.as_attribute()}
        self.still = Stillness(settings.still_interval)
        self.change, self.snapshots = np.inf, 0
        self.rows: list[list[float]] = []
        self.next_row = self.next_look = self.next_snapshot = self.bed.start_time
        self.start_momentum, self.start_angular = self.bed.momentum(), self.bed.angular_momentum()
        self.start_energy = sum(self.bed.energies().values())
        m, speed = self.bed.mass, np.linalg.norm(self.bed.W[:, :3], axis=1)
        if not speed.any():  # a control run: errors count against sqrt(g r), what a fall by half a radius gives
            gravity = body.surface_gravity
            speed = np.full(len(m), np.sqrt(gravity * self.bed.mean_radius))
        self.scale_p = float(np.sum(m * speed))
        self.scale_l = float(np.sum(m * np.linalg.norm(self.bed.X[:, :3], axis=1) * speed))
        self.worst_overlap, self.returned = 0.0, 0

    # -- time ----------------------------------------------------------------------------------------------------------------

    def advance(self) -> None:
        """Step until the profile is still (not before ``end_time``) or ``latest_time`` is reached."""
        bed, settings = self.bed, self.settings
        progress = Progress("dem", settings.end_time, start=bed.time)
        last_saved = time.monotonic()
        while True:
            self._due()
            now = bed.time
            if now >= settings.latest_time or (now >= settings.end_time and self.change < settings.still_change):
                return
            if bed.steps % flight.EVERY == 0:
                flight_collisions.collide(bed, flight.EVERY * bed.dt)
                flight.look(bed, self.domain)
                flight.damp(bed, self.domain)
            if settings.sleeping and bed.steps % sleeping.EVERY == 0:
                sleeping.look(bed)
            bed.step()
            if self.following:
                self.following.see()
            self.worst_overlap = max(self.worst_overlap, bed.worst)
            if now > settings.end_time:
                progress.total = settings.latest_time
            progress.update(bed.time, f"t = {readable.clock(bed.time)}, {bed.speed:.3g} m/s, {bed.moving - bed.active} in flight")
            if stop_requested() or time.monotonic() - last_saved > CHECKPOINT_EVERY_S:
                self.save()
                last_saved = time.monotonic()
                stop_here("dem")

    def _due(self) -> None:
        """Write what falls due at this step: a look at the profile, a row of the history, a snapshot."""
        now, settings = self.bed.time, self.settings
        if now >= self.next_look:
            self.change = self.still.look(surface_profile(self.bed, self.domain), self.bed.mean_radius)
            self.next_look += self.still.every
        if now >= self.next_row:
            self.rows.append(self._row())
            self.next_row += settings.history_interval
        if now >= self.next_snapshot:
            self._snapshot(f"snap_{self.snapshots:04d}", tables=False)
            self.snapshots += 1
            self.next_snapshot += settings.snapshot_interval

    def _row(self) -> list[float]:
        bed = self.bed
        energies, booked = bed.energies(), bed.booked.sum(axis=0)
        p, l = bed.momentum(), bed.angular_momentum()
        total = sum(energies.values()) + float(bed.report[SPENT].sum()) + booked[ENERGY_GONE] - bed.weight_energy
        spent = float(bed.report[[DISSIPATED, DRAGGED, AT_WALLS]].sum()) - bed.lost_in_flight  # what fast ejecta lose would hide errors of the bed
        error_p = np.linalg.norm(p + booked[MOMENTUM_GONE] - bed.report[IMPULSE] - self.start_momentum) / max(self.scale_p, 1e-300)
        error_l = np.linalg.norm(l + booked[ANGULAR_GONE] - bed.report[ANGULAR_IMPULSE] - self.start_angular) / max(self.scale_l, 1e-300)
        error_e = (total - self.start_energy) / max(self.handed + spent, 1e-300)
        return [
            bed.time, bed.dt, float(bed.mass[: bed.moving].sum()), *p, *l, *energies.values(), *bed.report[SPENT], booked[ENERGY_GONE], total,
            *bed.report[IMPULSE], *bed.report[ANGULAR_IMPULSE], error_p, error_l, error_e, bed.worst, bed.over_warn, bed.contacts, bed.speed, bed.active,
            bed.moving - bed.active, len(bed.X) - bed.moving, booked[MASS_GONE], self.change,
            bed.stiffness_energy, bed.softness, int(np.count_nonzero(bed.asleep)), bed.stiffness_excess, bed.lost_in_flight,
        ]  # fmt: skip

    # -- files ---------------------------------------------------------------------------------------------------------------

    def _particles(self, tables: bool) -> Particles:
        attributes = {**self.carried, "time": self.bed.time, "stage": "dem"}
        return self.bed.particles(attributes, tables)

    def _snapshot(self, name: str, tables: bool) -> None:
        snapshot.write(self._particles(tables), self.out / f"{name}{snapshot.SUFFIX}")

    def _write_history(self) -> None:
        lines = [",".join(COLUMNS), *(",".join(f"{value:.10g}" for value in row) for row in self.rows)]
        archive.write_text(self.out / "history.csv", "\n".join(lines) + "\n")

    def save(self) -> None:
        """Write a checkpoint (the whole state) and the history so far."""
        arrays, scalars = self.bed.state_arrays()
        if self.following:
            arrays = {**arrays, **self.following.state()}
        arrays = {**arrays, "history_rows": np.array(self.rows), "profiles": np.array(self.still.kept)}
        for name in ("start_momentum", "start_angular"):
            arrays[name] = getattr(self, name)
        own = {f"own_{name}": getattr(self, name) for name in _OWN}
        checkpoint.save(self.out, self.bed.steps, arrays, {**scalars, **own})
        self._write_history()

    def restore(self, arrays: dict[str, np.ndarray], scalars: dict[str, Any]) -> None:
        """Continue from a checkpoint, bit for bit."""
        self.bed.restore(arrays, scalars)
        self.rows = [list(row) for row in arrays["history_rows"]]
        self.still.kept = list(arrays["profiles"])
        for name in ("start_momentum", "start_angular"):
            setattr(self, name, arrays[name])
        for name in _OWN:
            setattr(self, name, scalars[f"own_{name}"])
        if self.following:
            self.following.restore(arrays)

    def finish(self) -> None:
        """Write the last files; raise ``Unsound`` when a balance is broken."""
        if not self.rows or self.rows[-1][0] < self.bed.time:
            self.rows.append(self._row())
        self._write_history()
        self._snapshot("last", tables=True)
        times = {path.name: float(snapshot.read(path).attributes["time"]) for path in snapshot.series(self.out)}
        snapshot.write_series(self.out, times, "snap")
        report = self._report()
        archive.write_text(self.out / "stage_report.json", json.dumps(report, indent=1))
        checkpoint.clear(self.out)
        broken = [f"{name} = {report[name]:.3g} (limit {limit:g})" for name, limit in LIMITS.items() if report[name] is not None and abs(report[name]) > limit]
        if broken:
            raise Unsound("dem: " + "; ".join(broken))

    def _report(self) -> dict[str, Any]:
        bed, last = self.bed, dict(zip(COLUMNS, self.rows[-1]))
        worst = {name: max((abs(row[COLUMNS.index(name)]) for row in self.rows), default=0.0) for name in ("momentum_error", "angular_momentum_error")}
        notes = [
            "Ocean grains have no friction, rolling or twisting resistance; as spheres they still keep an angle of some 6 degrees.",
            f"Sliding rule: {self.settings.contact.sliding}; attractive tail kept: {self.settings.contact.attractive_tail}.",
        ]
        if self.worst_overlap > self.settings.contact.overlap_warn:
            notes.append(f"Overlaps reached {self.worst_overlap:.3f} radii (warning above {self.settings.contact.overlap_warn:g}).")
        if last["dissipated_returning_J"] > 0.0:
            notes.append(f"Returning ejecta above the contact speed limit lost {last['dissipated_returning_J']:.3g} J in scaled contacts.")
        still = self.change < self.settings.still_change
        if not still:
            notes.append(f"Stopped at latest_time while the profile still changed by {self.change:.3g} radii.")
        return {
            "time_s": bed.time,
            "steps": bed.steps,
            "time_step_s": bed.dt,
            "list_builds": bed.builds,
            "grains": len(bed.X),
            "still": bool(still),
            "profile_change_radii": self.change if np.isfinite(self.change) else None,
            "overlap_max": self.worst_overlap,
            "overlap_warning": self.settings.contact.overlap_warn,
            "dissipated_returning_J": last["dissipated_returning_J"],
            "energy_error": last["energy_error"],
            "kinetic_handed_J": self.handed,
            "springs": {
                "for_speed_m_s": self.springs.speed or None,
                "stiffness_over_bed": self.springs.factor,
                "elastic_before_J": self.springs_energy[0],
                "elastic_after_J": self.springs_energy[1],
            },
            "stiffness_excess": bed.stiffness_excess / max(self.handed, 1e-300),
            **worst,
            "ballistic_at_end": int((bed.state == BALLISTIC).sum()),
            "left": int((bed.state == LEFT).sum()),
            "booked": {reason: _book(row) for reason, row in zip(REASONS, bed.booked)},
            "notes": notes,
        }  # fmt: skip


_OWN = (
    "change", "snapshots", "next_row", "next_look", "next_snapshot", "start_energy", "handed", "scale_p", "scale_l", "worst_overlap",
    "returned",
)  # fmt: skip


def _book(row: np.ndarray) -> dict[str, Any]:
    p, l = row[MOMENTUM_GONE].tolist(), row[ANGULAR_GONE].tolist()
    return {"grains": int(row[GRAINS_GONE]), "mass_kg": row[MASS_GONE], "momentum_kg_m_s": p, "angular_momentum_kg_m2_s": l, "energy_J": row[ENERGY_GONE]}


def _check(start: Particles, settings: Settings) -> None:
    """Refuse a start that cannot be run, naming what is missing."""
    start.need("identity", "position", "velocity", "angular_velocity", "mass", "radius", "material", "species", "stiffness")
    if "domain" not in start.attributes:
        raise InputError("the start lacks the attribute 'domain' (core, datum, cone): it must come from a bed of this project")
    time_now = float(start.attributes.get("time", 0.0))
    if time_now >= settings.end_time:
        raise InputError(f"[dem] end_time = {settings.end_time:g} s is not after the handoff at {time_now:g} s")


def handed_energy(bed: Assembly, gravity: float) -> float:
    """Kinetic energy [J] of the compact grains, what errors of energy count against; where nothing moves that of a fall by half a radius, m g r / 2."""
    compact = bed.returned == 0
    m, r, w = bed.mass[compact], bed.X[compact, RADIUS], bed.W[compact]
    moving = 0.5 * m @ np.sum(w[:, :3] ** 2, axis=1) + 0.2 * (m * r**2) @ np.sum(w[:, WX:] ** 2, axis=1)
    return float(moving if moving > 0.0 else 0.5 * gravity * (m @ r))


def capped_stiffness(start: Particles) -> np.ndarray:
    """k_n of the start [N/m] with light ejecta softened: none may ask for a finer step than the bed does, within a factor sqrt(2).

    A grain much lighter than the bed's (vapour, thin ejecta) would otherwise set the step of all.
    """
    frequency = start.stiffness / start.mass
    usual = float(np.percentile(frequency, 90.0))
    return np.minimum(start.stiffness, 2.0 * usual * start.mass)
