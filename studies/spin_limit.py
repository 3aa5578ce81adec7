"""How fast a ball, or an oblate body, of loose grains can turn: spun up slowly, beside the closed form for its own
friction angle.

A cohesionless body of density rho with the half axes a >= b > c, c along the axis of rotation, holds together up to
(Holsapple 2001, Icarus 154, 432)

    sigma_c / sigma_a = (1 + sin phi) / (1 - sin phi),   sigma_i = rho a_i^2 / 5 (2 pi G rho A_i - omega^2 [i not c])
    omega^2 = 2 pi G rho (A_a - A_c (c / a)^2 (1 - sin phi) / (1 + sin phi)),   of a ball, whose A_i are 2/3:
    Omega^2 = omega^2 / (4 pi G rho / 3) = 2 sin phi / (1 + sin phi),

the stresses of a compression along the axis. Omega counts in the shedding rate of a ball of that density for all.

phi is measured on the same packing: grains packed in a cube in the same way, pressed evenly by six smooth plates, then
along one axis while the others keep their pressure, sin phi = (s_1 - P) / (s_1 + P) at the strain at which the ball
counts as failed: 1 % of an axis. A dense packing goes on hardening beyond that; its angle is that of the strain.

The ball is spun up in the frame that turns with it (``dem.grains.turning_frame``; without the force of Coriolis, at a
drag), Omega rising by ``RAMP`` per sqrt(r/g), and held at a fixed Omega; 4 % below its limit it is let go in the
inertial frame, without drag. rho is that of the even ellipsoid of the same mass and moments of inertia.

Command: ``python -m studies.spin_limit [--count N] [--friction MU] [--axes 177 174 116] [--seeds 1 2] [--out
FILE.json]``.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import quad

from dem.beds import solid_packing
from dem.beds.solid_bed import axes_of_inertia
from dem.beds.solid_body import SolidBody
from dem.beds.solid_settling import SolidSettling, stiffness
from dem.contact.columns import MASS, RADIUS, STIFFNESS
from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.contact.walls import PLANE, POINT, Wall
from dem.grains import turning_frame
from dem.grains.assembly import Assembly, Extras
from dem.grains.self_gravity import SelfGravity
from fixtures import solids
from matter.constants import G
from matter.particles import Particles
from matter.solids import solid
from matter.solids.placed import Placed
from matter.solids.solid import Solid

FAILED = 0.01
"""Change of an axis, or strain, at which a ball has failed."""
DENSITY, BALL = 2400.0, (160.0, 160.0, 160.0)
Axes = tuple[float, float, float]
RAMP, HOLD, DRAG = 1e-3, 60.0, 0.5
"""Rise of Omega per sqrt(r/g), time at a fixed Omega in sqrt(r/g), and rate of the drag times sqrt(r/g)."""
PRESSURE = 0.4
"""Pressure of the plates over that at the centre of the ball: the mean of 1 - r^2 / R^2 over its volume."""
RATE = 5e-4
"""Strain per d sqrt(rho / P) of the compression."""


def body_of(shape: Solid) -> SolidBody:
    """A body of this surface at rest."""
    z = np.array([0.0, 0.0, 1.0])
    return SolidBody(Placed(shape, shape.extent, z, z, np.eye(3)), DENSITY * shape.volume, "basalt", 0.0 * z, None)


def spun_body(axes: Axes) -> SolidBody:
    """The body of these full axes [m]."""
    return body_of(solid.ellipsoid(axes))


def cube(volume: float) -> SolidBody:
    """A cube of this volume [m^3]."""
    edge = volume ** (1.0 / 3.0)
    known = solids.box((edge, edge, edge))
    return body_of(solid.checked(known.vertices, known.triangles, 1.0, "cube"))


def settling(body: SolidBody, count: int, seed: int, contact: Contact) -> SolidSettling:
    """Grains of random places in the body, about to be packed."""
    one, two = np.random.SeedSequence(seed).spawn(2)
    radius = solid_packing.radii(count, 0.15, body.solid, one)
    points = solid_packing.centres(radius, body.solid, body.distance, two)
    return SolidSettling(points, radius, body, contact, 1e-3)


# -- the packing's friction angle


def compressed(count: int, seed: int, contact: Contact, most: float = 2.0 * FAILED, axes: Axes = BALL) -> np.ndarray:
    """Compression along z of a packing in a cube under even pressure: rows of strain along z, of the mean strain
    across it, and sin phi."""
    loaded = spun_body(axes)
    body = cube(loaded.solid.volume)
    work = settling(body, count, seed, contact)
    while work.plan[work.phase].fire:
        while work.done < work.steps:
            work.step()
        work.next()
    assert work.aside is not None
    grains = work.aside
    box = Plates(grains, contact, loaded, body)
    box.press(40.0)
    box.lay_down()
    box.press(20.0)
    start = box.size.copy()
    rows = []
    while True:
        strain = 1.0 - box.size / start
        rows.append([strain[2], 0.5 * (strain[0] + strain[1]), 0.0])
        if strain[2] > most:
            break
        stress = np.mean([box.step(RATE / box.unit) for _ in range(200)], axis=0)
        rows[-1][2] = (stress[2] - 0.5 * (stress[0] + stress[1])) / (stress[2] + 0.5 * (stress[0] + stress[1]))
    return np.array(rows[:-1])


class Plates:
    """Grains of the cube ``body`` between six smooth plates, without gravity, with the mean pressure and the k_n of
    the ``loaded`` body's grains, so that overlaps are those in it."""

    def __init__(self, grains: Particles, contact: Contact, loaded: SolidBody, body: SolidBody):
        pressure = PRESSURE * loaded.central_pressure
        edge = float(np.ptp(body.solid.vertices[:, 0])) + 2.0 * solid_packing.PROUD * float(grains.radius.mean())
        self.pressure, self.size = pressure, np.full(3, edge)
        fields = dict(grains)
        fields["stiffness"] = stiffness(grains.radius, grains.mass, loaded, contact)
        walls = [
            Wall(PLANE, point=tuple(-0.5 * edge * side * np.eye(3)[c]), direction=tuple(side * np.eye(3)[c]))
            for c in range(3)
            for side in (1.0, -1.0)
        ]
        self.bed = Assembly(Particles(fields), contact, walls, Field.constant((0.0, 0.0, 0.0)), overlap_limit=1.0)
        self.unit = 2.0 * self.bed.mean_radius * math.sqrt(DENSITY / pressure)
        self.bed.drag[:] = 1.0 / self.unit
        self.count = 0

    def stress(self) -> np.ndarray:
        """Mean normal stress (3,) [Pa] on the plates across each axis."""
        x, r, k = self.bed.position, self.bed.X[:, RADIUS], self.bed.V[:, STIFFNESS]
        half = 0.5 * self.size
        force = [k @ (np.maximum(r + x[:, c] - half[c], 0.0) + np.maximum(r - x[:, c] - half[c], 0.0))
                 for c in range(3)]  # fmt: skip
        area = np.prod(self.size) / self.size
        return 0.5 * np.array(force) / area

    def step(self, rate: float | None) -> np.ndarray:
        """One step: plates follow the pressure, those across z go together at ``rate`` [1/s] instead; the stress."""
        stress = self.stress()
        follow = np.clip(0.2 * (stress / self.pressure - 1.0), -0.02, 0.02) / self.unit
        if rate is not None:
            follow[2] = -rate
        self.size *= 1.0 + follow * self.bed.dt
        for c in range(3):
            self.bed.walls[2 * c, POINT + c], self.bed.walls[2 * c + 1, POINT + c] = (
                -0.5 * self.size[c], 0.5 * self.size[c],
            )  # fmt: skip
        self.bed.step()
        self.count += 1
        if self.count % 100 == 0:  # the plates have moved: who can reach them is asked anew
            self.bed._near_walls()
        return stress

    def press(self, time: float) -> None:
        """Follow the pressure for ``time`` in d sqrt(rho / P)."""
        for _ in range(int(time * self.unit / self.bed.dt)):
            self.step(None)

    def lay_down(self) -> None:
        """Less drag from here on: it may carry a thousandth of the stress of what follows."""
        self.bed.drag[:] = 0.1 / self.unit


def angle_at(rows: np.ndarray, strain: float) -> float:
    """phi [deg] mobilised at a strain along z."""
    return math.degrees(math.asin(float(np.interp(strain, rows[:, 0], rows[:, 2]))))


# -- the ball


class Spun:
    """A body of grains at rest, to be turned."""

    def __init__(self, count: int, seed: int, contact: Contact, axes: Axes = BALL):
        work = settling(spun_body(axes), count, seed, contact)
        while True:
            while work.done < work.steps:
                work.step()
            if not work.next():
                break
        grains = work.rested
        assert grains is not None
        self.turning = turning_frame.Centrifugal(np.zeros(3))
        self.bed = Assembly(
            grains, contact, gravity=work.gravity,
            extras=Extras(self_gravity=SelfGravity(), outer=(self.turning, turning_frame.Held())),
        )  # fmt: skip
        self.unit = math.sqrt(self.bed.mean_radius / work.surface_gravity())
        self.bed.drag[:] = DRAG / self.unit
        self.start = self.axes()
        self.density = float(grains.mass.sum()) / (math.pi / 6.0 * float(np.prod(self.start)))
        self.shedding = math.sqrt(4.0 / 3.0 * math.pi * G * self.density)
        self.omega = 0.0

    def axes(self) -> np.ndarray:
        """Full axes (3,) [m] along x, y, z, by the second moments."""
        m = self.bed.V[:, MASS]
        away = self.bed.position - m @ self.bed.position / m.sum()
        return np.asarray(2.0 * np.sqrt(5.0 * (m @ away**2) / m.sum()))

    def change(self) -> float:
        """Largest change of an axis since the start, of the equator's mean or the pole's."""
        change = self.axes() / self.start - 1.0
        return float(max(abs(change[2]), abs(0.5 * (change[0] + change[1]))))

    def turn(self, omega: float, time: float) -> float:
        """Go to Omega = ``omega`` evenly over ``time`` [sqrt(r/g)]; stops once it has failed. The change of axes."""
        steps = max(1, int(time * self.unit / self.bed.dt))
        before = self.omega
        for k in range(steps):
            self.omega = before + (omega - before) * (k + 1) / steps
            self.turning.omega[2] = self.omega * self.shedding
            self.bed.step()
            if k % 50 == 0 and self.change() > 2.0 * FAILED:
                break
        return self.change()


def let_go(spun: Spun, time: float) -> float:
    """Largest change of an axis over ``time`` [sqrt(r/g)] in the inertial frame, where nothing is damped and no force
    is made up."""
    grains = spun.bed.particles({"time": 0.0})
    fields = dict(grains)
    omega = np.array([0.0, 0.0, spun.omega * spun.shedding])
    _, fields["velocity"], fields["angular_velocity"] = turning_frame.inertial(
        grains.position, grains.velocity, grains.angular_velocity, omega
    )
    free = Assembly(
        Particles(fields, grains.attributes, grains.tables), spun.bed.contact, gravity=spun.bed.gravity,
        extras=Extras(self_gravity=SelfGravity()),
    )  # fmt: skip
    before = axes_of_inertia(free.mass, free.position)
    while free.time < time * spun.unit:
        free.step()
    return float(np.abs(axes_of_inertia(free.mass, free.position) / before - 1.0).max())


def limit(angle: float, axes: Axes = BALL) -> float:
    """Omega of the limit for a friction angle [deg]."""
    sine, half = math.sin(math.radians(angle)), np.asarray(axes) / max(axes)
    along, axis = (
        np.prod(half) * quad(lambda u, one=one: 1.0 / ((one**2 + u) * np.sqrt(np.prod(half**2 + u))), 0.0, np.inf)[0]
        for one in half[[0, 2]]
    )
    return float(math.sqrt(1.5 * (along - axis * (half[2] / half[0]) ** 2 * (1.0 - sine) / (1.0 + sine))))


def measured(count: int, seed: int, contact: Contact, axes: Axes = BALL) -> dict[str, Any]:
    """Angle, limit, and what the body does at 4 % below and above it, spun up slowly to each."""
    rows = compressed(count, seed, contact, axes=axes)
    angle = angle_at(rows, FAILED)
    expected = limit(angle, axes)
    spun = Spun(count, seed, contact, axes)
    spun.turn(0.85 * expected, 40.0)
    below, above = 0.96 * expected, 1.04 * expected
    spun.turn(below, (below - 0.85 * expected) / RAMP)
    held = spun.turn(below, HOLD)
    free = let_go(spun, 0.5 * HOLD)
    found = math.nan
    steps = np.arange(below, min(above, 0.999) + 0.5e-3, 1e-3)
    for omega in steps:
        if spun.turn(float(omega), 1e-3 / RAMP) > FAILED:
            found = float(omega)
            break
    last = spun.change() if found == found else spun.turn(float(steps[-1]), HOLD)
    return {
        "count": count, "seed": seed, "friction": contact.shell.friction, "axes_m": list(axes), "angle_deg": angle,
        "limit_over_shedding": expected, "density_kg_m3": spun.density, "change_at_minus_4_percent": held,
        "change_let_go": free,
        "failed_at_over_shedding": found, "failed_over_limit": found / expected, "change_at_the_end": last,
        "strain_across_over_along": float(np.interp(FAILED, rows[:, 0], rows[:, 1] / np.maximum(rows[:, 0], 1e-12))),
    }  # fmt: skip


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m studies.spin_limit", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=1500)
    parser.add_argument("--friction", type=float, default=0.55)
    parser.add_argument("--shape", type=float, default=0.4)
    parser.add_argument("--axes", type=float, nargs=3, default=BALL)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    contact = Contact(shell=GrainLaw(friction=options.friction, shape=options.shape))
    results = []
    for seed in options.seeds:
        results.append(measured(options.count, seed, contact, tuple(options.axes)))
        print(json.dumps(results[-1]), flush=True)
    if options.out:
        options.out.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
