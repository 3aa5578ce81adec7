"""The ledger of the shock stage in time: what is conserved, what limits the step, what is damaged, ejected or lost."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from matter.files import archive
from matter.geometry import tree
from sph.bodies import symmetry as symmetries
from sph.boundary import external_budget
from sph.stepping import state, vibration
from sph.stepping.integrator import Integrator

COLUMNS = (
    "time_s dt_s dt_limit mass_kg momentum_x momentum_y momentum_z angular_momentum_x angular_momentum_y "
    "angular_momentum_z "
    "kinetic_J internal_J gravitational_J total_J ejected_mass_kg damaged_mass_kg lost_mass_kg lost_internal_J "
    "max_pressure_Pa "
    "steps list_builds gravity_evaluations gravity_correction removed_angular_momentum_x removed_angular_momentum_y "
    "removed_angular_momentum_z"
).split() + external_budget.COLUMNS
VIBRATION = "vibration_J"
"""A last column where rock shakes (``sph.strength.block_model``): beside the total energy, no part of it."""

# particles up to which the potential energy is summed over all pairs; opening angle of the tree beyond
DIRECT, FINE = (40_000, 0.3)
# a body whose own energy is less than this fraction of the projectile's, and the opening angle that is enough for it
WEAK, WIDE = (0.1, 0.7)


def weak(own_J: float, impact_J: float) -> bool:
    """Whether a body's own energy counts so little beside the projectile's, ``impact_J``, that what a wide tree gets
    wrong (2e-4 of it) is below 2e-5 of the latter."""
    return abs(own_J) < WEAK * impact_J


def _at_least(position: np.ndarray, mass: np.ndarray) -> float:
    """The energy [J] of a uniform sphere of the same mass and moment of inertia, than which no spread of mass has
    less: of all potentials that of even density alone grows with r^2, as the variation of both asks."""
    offset = position - mass @ position / mass.sum()
    spread = float(mass @ np.einsum("ij,ij->i", offset, offset) / mass.sum())
    return 0.6 * tree.G * float(mass.sum()) ** 2 / float(np.sqrt(5.0 / 3.0 * spread))


def gravitational_energy(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, impact_J: float) -> float:
    """The energy [J] of a body's own gravity, as well as it counts beside ``impact_J``."""
    if weak(_at_least(position, mass), impact_J):
        own = tree.potential_energy(position, mass, softening, WIDE)
        if weak(own, impact_J):
            return own
    return tree.potential_energy(position, mass, softening, 0.0 if len(mass) <= DIRECT else FINE)


def row(integrator: Integrator, symmetry: str = "none", impact_J: float = 0.0) -> dict[str, float | str]:
    """One line of ``history.csv`` (SI), names in ``COLUMNS``.

    The gravitational energy is the direct sum over all pairs (a finer tree's above ``DIRECT`` particles, a wide tree's
    where it is ``weak`` beside ``impact_J`` [J] of the projectile), so that ``total_J`` shows what the tree, frozen
    gravity, the steps and every clipping (tension cut, pressure of lost particles) get wrong; nothing is taken out of
    it. In uniform gravity it is m g z. Ejected: unbound (v^2/2 > G M / r); without self-gravity what is beyond the
    surface of the target by more than its h and moves on outwards. Lost: particles whose neighbours have gone, with
    the internal energy that they keep. Outside: what gravity and boundaries have given
    (``sph.boundary.external_budget``). With a ``symmetry`` all sums are those of the whole.
    """
    cloud = integrator.cloud
    m, v, x = cloud.mass, cloud.velocity, cloud.position
    v2 = np.einsum("ij,ij->i", v, v)
    momentum = symmetries.summed(m @ v, symmetry)
    spin = symmetries.summed(m @ np.cross(x, v), symmetry, axial=True)
    given = integrator.external_budget.given
    pushed, turned = symmetries.summed(given[:3], symmetry), symmetries.summed(given[3:6], symmetry, axial=True)
    m = symmetries.copies(symmetry) * m
    kinetic, internal = 0.5 * float(m @ v2), float(m @ cloud.specific_energy)
    gravitational = integrator.environment.down * float(m @ x[:, 2])
    if integrator.environment.self_gravity:
        position, parts = symmetries.unfolded(x, symmetry), symmetries.copies(symmetry)
        weight, softening = np.tile(cloud.mass, parts), np.tile(integrator.softening, parts)
        gravitational += gravitational_energy(position, weight, softening, impact_J)
        r = np.linalg.norm(x, axis=1)
        unbound = 0.5 * v2 > tree.G * m.sum() / r
    else:
        unbound = integrator.thrown_out()
    lost = state.interaction_fractions(cloud.neighbours) <= 0.0
    values = (
        integrator.time, integrator.step_limit.dt, integrator.step_limit.why, m.sum(), *momentum, *spin, kinetic,
        internal, gravitational, kinetic + internal + gravitational, m[unbound].sum(),
        float(m @ state.damage_of(cloud, integrator.rows)), m[lost].sum(),
        float(m[lost] @ cloud.specific_energy[lost]), integrator.forces.evaluated.pressure.max(), integrator.steps,
        integrator.neighbourhood.builds, integrator.gravity.evaluations, integrator.gravity.correction,
        *integrator.torque.removed, *pushed, *turned, symmetries.copies(symmetry) * given[6],
    )  # fmt: skip
    entry = dict(zip(COLUMNS, (value if isinstance(value, str) else float(value) for value in values)))
    return entry | ({VIBRATION: vibration.energy(m, cloud.vibration)} if len(cloud.vibration) else {})


class History:
    """Rows of ``history.csv``, rewritten whole at every checkpoint and at the end."""

    def __init__(self, path: Path, symmetry: str = "none"):
        self.path, self.symmetry = path, symmetry
        self.impact_J = 0.0
        self.rows: list[dict[str, float | str]] = []

    def restore(self, steps: int) -> None:
        """Take up the rows written so far, up to the step of the checkpoint."""
        if self.path.is_file():
            with open(self.path, newline="") as file:
                for line in csv.DictReader(file):
                    entry = {name: value if name == "dt_limit" else float(value) for name, value in line.items()}
                    for name in external_budget.COLUMNS:  # of a run begun before they were booked
                        entry.setdefault(name, float("nan"))
                    if float(entry["steps"]) <= steps:
                        self.rows.append(entry)

    def add(self, integrator: Integrator) -> None:
        """Append the state as it stands, unless the last row is of the same step."""
        if not self.rows or self.rows[-1]["steps"] != integrator.steps:
            self.rows.append(row(integrator, self.symmetry, self.impact_J))

    def write(self) -> None:
        """Write the file, whole or not at all; numbers to the last bit."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        names = [*COLUMNS, VIBRATION] if self.rows and VIBRATION in self.rows[0] else COLUMNS
        writer.writerow(names)
        for entry in self.rows:
            writer.writerow(
                [value if isinstance(value, str) else repr(value) for value in (entry[name] for name in names)]
            )
        archive.write_text(self.path, text.getvalue())

    def drift(self) -> dict[str, float]:
        """Largest departures from the first row that nothing outside gave: energy [J], linear [kg m/s] and angular
        momentum [kg m^2/s]."""

        def largest(names: list[str], given: list[str]) -> float:
            own, outer = (np.array([[float(row[name]) for name in n] for row in self.rows]) for n in (names, given))
            off = own - own[0] - np.nan_to_num(outer - outer[0])
            return float(np.sqrt((off**2).sum(axis=1)).max())

        return {
            "energy_J": largest(["total_J"], ["outside_energy_J"]),
            "momentum_kg_m_s": largest(*([f"{kind}momentum_{a}" for a in "xyz"] for kind in ("", "outside_"))),
            "angular_momentum_kg_m2_s": largest(
                *([f"{kind}angular_momentum_{a}" for a in "xyz"] for kind in ("", "outside_"))
            ),
        }
