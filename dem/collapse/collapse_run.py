"""One run of the collapse: the assembly, what is remembered about it, its history, checkpoints and last files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem.beds import bed_walls, settling
from dem.beds.bed_walls import Domain
from dem.beds.flat_ground import FlatGround
from dem.beds.layered_body import LayeredBody
from dem.beds.solid_body import SolidBody
from dem.beds.whole_body_bed import PoseTracker, WholeBody
from dem.collapse import flight, flight_collisions, ground_fraction, whole_body_collapse
from dem.collapse.balance import Balance, handed_energy
from dem.collapse.origins import Origins
from dem.collapse.stillness import STILL_CHANGE, Stillness, surface_profile
from dem.contact.columns import (
    ALL_DISSIPATED,
    ANGULAR_IMPULSE,
    ANGULAR_REMOVED,
    ENERGY_REMOVED,
    GRAINS_REMOVED,
    IMPULSE,
    MASS_REMOVED,
    MOMENTUM_REMOVED,
)
from dem.contact.settings import OVERLAP_WARN
from dem.grains import shaking
from dem.grains.assembly import BALLISTIC, LEFT, REASONS, Assembly, Extras
from dem.settings import Settings
from dem.stiffness import stiffening
from dem.stiffness.following import LIMIT as STIFFNESS_LIMIT
from dem.stiffness.following import Following
from matter.cadence import Cadence
from matter.errors import InputError, UnphysicalState, Unsound
from matter.files import archive, checkpoint, snapshot
from matter.geometry.ground_region import Cone, Upright
from matter.particles import Particles
from matter.progress import Progress, stop_here
from matter.wording import readable

MOMENTUM_LIMIT = 1e-9
"""Largest error of the momentum balance (momentum + what left - impulses), over the sum of m |v| at the start (of m
sqrt(g r) where nothing moves)."""
ENERGY_LIMIT = 0.01
"""Largest error of the energy balance, over the kinetic energy that the compact grains were handed plus what was
dissipated (not by ejecta in flight or in scaled contacts, which hold far more). Of what changing springs take up only
the fraction of the weight is taken out (``dem.stiffness.change``)."""
LIMITS = {
    "momentum_error": MOMENTUM_LIMIT,
    "angular_momentum_error": MOMENTUM_LIMIT,
    "energy_error": ENERGY_LIMIT,
    "stiffness_excess": STIFFNESS_LIMIT,
}
HOPELESS = 100.0
"""Times a limit beyond which a run is stopped on its way."""

_VECTORS = ("momentum", "angular_momentum")
COLUMNS = (
    "time_s", "dt_s", "mass_kg", *(f"{v}_{c}" for v in _VECTORS for c in "xyz"), "kinetic_J", "rotational_J",
    "gravitational_J", "elastic_J",
    "dissipated_contacts_J", "dissipated_returning_J", "dissipated_damping_J", "dissipated_walls_J", "booked_J",
    "total_J",
    *(f"impulse_{c}" for c in "xyz"), *(f"angular_impulse_{c}" for c in "xyz"), "momentum_error",
    "angular_momentum_error", "energy_error",
    "overlap_max", "overlaps_above_warning", "contacts", "speed_max", "grains_active", "grains_ballistic",
    "grains_left", "booked_mass_kg",
    "profile_change", "stiffness_change_J", "stiffness_over_start", "stiffness_excess_J",
    "dissipated_flight_J",
)  # fmt: skip


@dataclass
class Due:
    """Times [s] at which the next ``row`` of the history, ``look`` at the profile and ``snapshot`` fall due, and the
    ``snapshots`` that are written."""

    row: float
    look: float
    snapshot: float
    snapshots: int = 0


DOMAINS: dict[str, type[Domain | WholeBody]] = {
    "plane": Upright, "sphere": Cone, "solid": WholeBody
}  # fmt: skip
"""Where grains lie, by the frame of the start."""


class Collapse:
    """One run of the stage: the assembly and what is remembered about it."""

    def __init__(self, settings: Settings, start: Particles, body: LayeredBody | FlatGround | SolidBody, out: Path):
        _check(start, settings)
        self.settings, self.out = settings, out
        frame = start.attributes.get("frame", "sphere")
        if {"plane": FlatGround, "solid": SolidBody}.get(frame, LayeredBody) is not type(body):
            raise InputError("the start and target.json do not share a frame: flat ground, a sphere or another solid")
        self.domain: Domain | WholeBody = DOMAINS[frame].of_attribute(start.attributes["domain"])
        self.tracker = PoseTracker(start) if frame == "solid" else None
        self.domain = whole_body_collapse.with_hill_sphere(self.domain, body)
        start["stiffness"] = capped_stiffness(start)
        dt = settings.contact.time_step(start, body.gravity()) * settings.step_factor
        self.springs = stiffening.springs_for(
            settings.springs_for if settings.engine == "native" else "bed", start, settings.contact, frame == "sphere"
        )
        stiffer = self.springs.factor != 1.0
        self.bed = Assembly(
            start, settings.contact, bed_walls.walls(self.domain), body.gravity(), dt=dt,
            threads=settling.threads_for(len(start)), skin=0.3,
            extras=Extras(
                stiffer or settings.stiffness == "following", *whole_body_collapse.forces(body, settings),
                shaking=shaking.of_start(start),
            ),
        )  # fmt: skip
        self.springs_energy = (self.bed.elastic, self.bed.elastic)
        if stiffer:
            self.springs_energy = stiffening.stiffen(self.bed, self.springs)
            self.domain = stiffening.damped_for(self.domain, self.springs)
        handed = handed_energy(self.bed, body.surface_gravity)
        self.following = None
        if settings.stiffness == "following" and not isinstance(body, SolidBody):
            self.following = Following(self.bed, float(body.pressure(np.array(self.domain.floor))), handed)
        self.carried = {k: v for k, v in start.attributes.items() if k not in ("time", "stage")} | {
            "domain": self.domain.as_attribute()
        }
        self.origins = Origins(start)
        self.still = Stillness(settings.still_interval)
        self.rows: list[list[float]] = []
        self.due = Due(*3 * (self.bed.start_time,))
        self.balance = Balance.begin(self.bed, body.surface_gravity, handed)
        self.worst_overlap = 0.0
        self.begun = whole_body_collapse.leaving_of(self.bed, self.tracker, self.carried.get("shot"), self.origins)

    # -- time

    def advance(self) -> None:
        """Step until the profile is still (not before ``end_time``) or ``latest_time`` is reached."""
        bed, settings = self.bed, self.settings
        progress = Progress("dem", settings.latest_time, start=bed.time, soonest=settings.end_time)
        cadence = Cadence()
        while True:
            self._due()
            now = bed.time
            if now >= settings.latest_time or (now >= settings.end_time and self.still.change < STILL_CHANGE):
                return
            if bed.steps % flight.EVERY == 0:
                flight_collisions.collide(bed, flight.EVERY * bed.dt)
                flight.look(bed, self.domain)
                flight.damp(bed, self.domain)
            bed.step()
            if self.following:
                self.following.see()
            self.worst_overlap = max(self.worst_overlap, bed.worst)
            progress.update(
                bed.time, f"t = {readable.clock(bed.time)}, {bed.speed:.3g} m/s, {bed.moving - bed.active} in flight"
            )
            if cadence.due():
                with cadence.writing():
                    self.save()
                stop_here("dem")

    def _due(self) -> None:
        """Write what falls due at this step: a look at the profile, a row of the history, a snapshot."""
        now, settings = self.bed.time, self.settings
        if now >= self.due.look:
            self.still.look(surface_profile(self.bed, self.domain, self.tracker), self.bed.mean_radius)
            self.due.look += self.still.every
        if now >= self.due.row:
            self.rows.append(self._row())
            self._watch()
            self.due.row += settings.history_interval
        if now >= self.due.snapshot:
            self._snapshot(f"snap_{self.due.snapshots:04d}", tables=False)
            self.due.snapshots += 1
            self.due.snapshot += settings.snapshot_interval

    def _watch(self) -> None:
        """Stop a run whose balances are beyond hope, instead of finding out at its end. Raises ``UnphysicalState``."""
        row = dict(zip(COLUMNS, self.rows[-1]))
        for name in ("momentum_error", "angular_momentum_error", "energy_error"):
            if abs(row[name]) > HOPELESS * LIMITS[name]:  # never where an engine does not measure it
                raise UnphysicalState(
                    f"dem: unstable: {name} = {row[name]:.3g} at {readable.clock(self.bed.time)} (limit "
                    f"{LIMITS[name]:g}), with overlaps of up to {row['overlap_max']:.3g} radii: a smaller step "
                    "(contact.steps_per_contact) or stiffer springs help; the snapshots until then are kept"
                )

    def _row(self) -> list[float]:
        bed = self.bed
        energies, booked = bed.energies(), bed.booked.sum(axis=0)
        p, l, off = bed.momentum(), bed.angular_momentum(), self.balance.errors(bed)
        return [
            bed.time, bed.dt, float(bed.mass[: bed.moving].sum()), *p, *l, *energies.values(),
            *bed.report[ALL_DISSIPATED], booked[ENERGY_REMOVED], off.total,
            *bed.report[IMPULSE], *bed.report[ANGULAR_IMPULSE], *off[1:], bed.worst, bed.over_warn, bed.contacts,
            bed.speed, bed.active,
            bed.moving - bed.active, len(bed.X) - bed.moving, booked[MASS_REMOVED], self.still.change,
            bed.stiffness_energy, bed.softness, bed.stiffness_excess,
            bed.lost_in_flight,
        ]  # fmt: skip

    # -- files

    def _particles(self, tables: bool) -> Particles:
        attributes = {**self.carried, "time": self.bed.time, "stage": "dem"}
        return self.origins.onto(self.bed.particles(attributes, tables))

    def _snapshot(self, name: str, tables: bool) -> None:
        snapshot.write(self._particles(tables), self.out / f"{name}{snapshot.SUFFIX}")

    def _write_history(self) -> None:
        rows = ([f"{value:.10g}" if math.isfinite(value) else "" for value in row] for row in self.rows)
        lines = [",".join(COLUMNS), *map(",".join, rows)]  # what is not known yet is an empty cell
        archive.write_text(self.out / "history.csv", "\n".join(lines) + "\n")

    def save(self) -> None:
        """Write a checkpoint (the whole state) and the history so far."""
        state = checkpoint.under("bed", self.bed.saved()) | checkpoint.under("still", self.still.state())
        state |= checkpoint.under("balance", self.balance.state()) | checkpoint.under("due", asdict(self.due))
        if self.following:
            state |= checkpoint.under("following", self.following.state())
        state |= {"rows": np.array(self.rows), "worst_overlap": self.worst_overlap}
        checkpoint.save(self.out, self.bed.steps, *checkpoint.arrays_and_numbers(state))
        self._write_history()

    def restore(self, arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any]) -> None:
        """Continue from a checkpoint, bit for bit."""
        saved = checkpoint.SavedState(arrays, scalars)
        self.bed.restore(checkpoint.Part(saved, "bed"))
        self.still.restore(checkpoint.Part(saved, "still"))
        self.balance = Balance.restored(checkpoint.Part(saved, "balance"))
        if self.following:
            self.following.restore(checkpoint.Part(saved, "following"))
        self.due = Due(**{name: saved[f"due/{name}"] for name in Due.__dataclass_fields__})
        self.rows, self.worst_overlap = [list(row) for row in saved["rows"]], saved["worst_overlap"]

    def finish(self) -> None:
        """Write the last files; raise ``Unsound`` when a balance is broken."""
        if not self.rows or self.rows[-1][0] < self.bed.time:
            self.rows.append(self._row())
        self._write_history()
        self._snapshot("last", tables=True)
        times = {path.name: float(snapshot.read(path).attributes["time"]) for path in snapshot.series(self.out)}
        snapshot.write_series(self.out, times)
        report = self._report() | ground_fraction.report(self.out, self.domain, self.carried)
        archive.write_json(self.out / "stage_report.json", report)
        # what another program has computed is not computed again from here
        (checkpoint.keep_last if self.settings.engine == "native" else checkpoint.clear)(self.out)
        broken = [
            f"{name} = {report[name]:.3g} (limit {limit:g})"
            for name, limit in LIMITS.items()
            if report[name] is not None and abs(report[name]) > limit
        ]
        if broken:
            raise Unsound("dem: " + "; ".join(broken))

    def _report(self) -> dict[str, Any]:
        bed, last = self.bed, dict(zip(COLUMNS, self.rows[-1]))
        worst = {
            name: max((abs(row[COLUMNS.index(name)]) for row in self.rows), default=0.0)
            for name in ("momentum_error", "angular_momentum_error")
        }
        notes = [
            "Ocean grains have no friction, rolling or twisting resistance; as spheres they still keep an angle of "
            "some 6 degrees.",
        ]
        if self.worst_overlap > OVERLAP_WARN:
            notes.append(f"Overlaps reached {self.worst_overlap:.3f} radii (warning above {OVERLAP_WARN:g}).")
        if last["dissipated_returning_J"] > 0.0:
            notes.append(
                f"Returning ejecta above the contact speed limit lost {last['dissipated_returning_J']:.3g} J in "
                f"scaled contacts."
            )
        still = self.still.change < STILL_CHANGE
        if not still:
            notes.append(f"Stopped at latest_time while the profile still changed by {self.still.change:.3g} radii.")
        return {
            "time_s": bed.time,
            "steps": bed.steps,
            "time_step_s": bed.dt,
            "list_builds": bed.builds,
            "grains": len(bed.X),
            "still": bool(still),
            "profile_change_radii": self.still.change if np.isfinite(self.still.change) else None,
            "overlap_max": self.worst_overlap,
            "overlap_warning": OVERLAP_WARN,
            "dissipated_returning_J": last["dissipated_returning_J"],
            "energy_error": last["energy_error"],
            "kinetic_handed_J": self.balance.handed,
            "springs": {
                "for_speed_m_s": self.springs.speed or None,
                "stiffness_over_bed": self.springs.factor,
                "elastic_before_J": self.springs_energy[0],
                "elastic_after_J": self.springs_energy[1],
            },
            "stiffness_excess": bed.stiffness_excess / max(self.balance.handed, 1e-300),
            **worst,
            **whole_body_collapse.report(bed, self.tracker, self.carried.get("shot"), self.origins, self.begun),
            "ballistic_at_end": int((bed.state == BALLISTIC).sum()),
            "left": int((bed.state == LEFT).sum()),
            "booked": {reason: _book(row) for reason, row in zip(REASONS, bed.booked)},
            "notes": notes,
        }  # fmt: skip


def _book(row: np.ndarray) -> dict[str, Any]:
    p, l = row[MOMENTUM_REMOVED].tolist(), row[ANGULAR_REMOVED].tolist()
    return {
        "grains": int(row[GRAINS_REMOVED]),
        "mass_kg": row[MASS_REMOVED],
        "momentum_kg_m_s": p,
        "angular_momentum_kg_m2_s": l,
        "energy_J": row[ENERGY_REMOVED],
    }


def _check(start: Particles, settings: Settings) -> None:
    """Refuse a start that cannot be run, naming what is missing."""
    start.need(
        "identity", "position", "velocity", "angular_velocity", "mass", "radius", "material", "species", "stiffness"
    )
    if "domain" not in start.attributes:
        raise InputError(
            "the start lacks the attribute 'domain' (core, datum, cone): it must come from a bed of this project"
        )
    time_now = float(start.attributes.get("time", 0.0))
    if time_now >= settings.end_time:
        raise InputError(f"[dem] end_time = {settings.end_time:g} s is not after the handoff at {time_now:g} s")


def capped_stiffness(start: Particles) -> np.ndarray:
    """k_n of the start [N/m] with light ejecta softened: none may ask for a finer step than the bed does, within a
    factor sqrt(2).

    A grain much lighter than the bed's (vapour, thin ejecta) would otherwise set the step of all.
    """
    frequency = start.stiffness / start.mass
    usual = float(np.percentile(frequency, 90.0))
    return np.minimum(start.stiffness, 2.0 * usual * start.mass)
