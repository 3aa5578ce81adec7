"""The integrator of the shock stage: what a cloud is surrounded by, its evaluation of gravity and rates, its steps and
their limits. It steps by leapfrog (``sph.stepping.leapfrog``).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import checkpoint
from matter.geometry import tree
from sph.bodies import symmetry
from sph.bodies.particle_cloud import PARTS, Cloud, Neighbourhood, moved_further
from sph.boundary.external_budget import ExternalBudget
from sph.materials.rows import Materials
from sph.pairs import gradients, length_terms, smoothing, start_volumes
from sph.pairs import rates as pair_rates
from sph.pairs.row import ENERGY, MATERIAL, SLOPE, VISCOSITY_FRACTION, VOLUME
from sph.pairs.scheme import Rows
from sph.stepping import late, leapfrog, net_torque, state, timestep
from sph.stepping.environment import Environment
from sph.stepping.numerics import Numerics
from sph.viscosity import morris_monaghan
from sph.viscosity import switch as switches

REFRESH_AGE = 0.002  # of sqrt(R^3 / G M)
_NUMBERS: dict[str, type] = {
    "time": float, "dt": float, "steps": int, "gravity_time": float, "gravity_evaluations": int,
    "gravity_correction": float,
}  # fmt: skip
"""What of an ``Integrator`` a checkpoint holds beside arrays."""
DENSITY_FLOOR = 0.005  # of the density at rest; only particles that have lost their neighbours come near it


class Integrator:
    """Steps a cloud.

    The net torque of pairs and gravity is taken out at each evaluation (``sph.stepping.net_torque``);
    ``torque_removed`` holds its integral [kg m^2/s], so that what was corrected stays in sight.

    Parameters
    ----------
    radius : the target's [m], which the first step and the search start from.
    numerics : how the equations are solved (``sph.stepping.numerics``).
    around : gravity, images and edges (``Environment``).

    ``strength``, ``damage`` say which physics is on; ``freeze_energy`` keeps u, D and h constant (relaxation).
    """

    def __init__(
        self, cloud: Cloud, materials: Materials, radius: float, numerics: Numerics, environment: Environment
    ):
        self.cloud, self.materials, self.rows = cloud, materials, materials.rows
        self.numerics, self.scheme, self.environment = numerics, numerics.scheme, environment
        self.images, self.edge, self.external_budget = (
            environment.images,
            environment.edge,
            ExternalBudget(environment),
        )
        self.damping = pair_rates.Damping(numerics.alpha, numerics.beta, 1.0 / numerics.support, numerics.conductivity)
        self.limits_of_length, self.gradient_scale = numerics.limits_of_length, numerics.gradient_scale
        self.strength = self.damage = True
        self.freeze_energy, self.why = False, "growth"
        self.late_medium: late.LateStageMedium | None = None
        self.time, self.dt, self.steps, self.gravity_evaluations, self.gravity_correction = 0.0, 0.0, 0, 0, 0.0
        self.torque_removed, self._torque = np.zeros(3), np.zeros(3)
        self.gravity_time, self._parts = 0.0, np.zeros(PARTS, dtype=np.bool_)
        self.min_refresh_age = REFRESH_AGE * float(
            np.sqrt(radius**3 / (tree.G * cloud.mass.sum() * symmetry.copies(environment.symmetry)))
        )
        self.limits = np.zeros(len(timestep.REASONS), dtype=np.int64)
        self.floor = DENSITY_FLOOR * materials.bulk_density
        self.neighbourhood = Neighbourhood(cloud, 1.5 * radius, environment.images)
        self.evaluated = state.Evaluated(len(cloud))
        self.rates = pair_rates.Rates(len(cloud), self.scheme.reconstructed)
        self._omega = np.ones(len(cloud) if numerics.length_terms else 0)
        self._omega_at_rest = length_terms.at_rest(numerics.support, numerics.kernel) if numerics.length_terms else 1.0
        self._inverse = np.zeros((len(cloud) if self.scheme.corrected else 0, 6))
        self._extra = np.zeros((0, self.scheme.extra_width))
        if self.scheme.reconstructed and len(cloud.strain_rate) == 0:
            cloud.strain_rate = np.zeros((len(cloud), 6))
        if materials.inertial and not self.scheme.reconstructed:
            raise InputError('inertial_friction needs viscosity = "reconstructed", which keeps the rates of strain')
        if materials.harden and len(cloud.plastic_strain) == 0:
            cloud.plastic_strain = np.zeros(len(cloud))
        if self.scheme.switched:
            cloud.viscosity = np.full(len(cloud), morris_monaghan.START)

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Arrays and numbers that a resumed run needs to go on to the last bit, with those of cloud, rates, list and
        images."""
        arrays = checkpoint.under("cloud", self.cloud.state()) | checkpoint.under("rates", self.rates.state())
        listed, numbers = self.neighbourhood.state()
        arrays |= checkpoint.under("evaluated", self.evaluated.state()) | listed | {"limits": self.limits}
        numbers |= {name: getattr(self, name) for name in _NUMBERS} | {"torque_removed": self.torque_removed}
        numbers |= self.external_budget.state()
        return arrays, numbers | (self.images.state() if self.images is not None else {})

    def restore(self, arrays: Mapping[str, np.ndarray], numbers: Mapping[str, Any]) -> None:
        """Take up a ``state``; the cloud has to be that of the state already (``Cloud.restored``)."""
        # in the order in which it was saved: the first list has sorted it
        self.cloud.restore(checkpoint.Part(arrays, "cloud"))
        if self.images is not None:
            self.images.restore(numbers)
        self.neighbourhood.restore(arrays, numbers)
        self.external_budget.restore(numbers)
        self.rates.restore(checkpoint.Part(arrays, "rates"))
        self.evaluated.restore(checkpoint.Part(arrays, "evaluated"))
        self.limits[:], self.torque_removed[:] = arrays["limits"], numbers["torque_removed"]
        for name, kind in _NUMBERS.items():
            setattr(self, name, kind(numbers[name]))

    @property
    def softening(self) -> np.ndarray:
        """Plummer length of every particle: a quarter of its first support, half its spacing [m]; it stays, or the
        field would not be that of an energy."""
        return 0.25 * self.cloud.start_support

    @property
    def longest(self) -> float:
        """The longest support [m] that a periodic box has room for."""
        return self.images.longest / (1.0 + 2.0 * self.neighbourhood.SKIN) if self.images is not None else np.inf

    def thrown_out(self) -> np.ndarray:
        """(n,) what is beyond the surface of a target without self-gravity by more than its h and moves on outwards:
        above z = 0, or off a sphere."""
        x, v, h = self.cloud.position, self.cloud.velocity, self.cloud.support_radius
        if self.environment.sphere is None:
            return (x[:, 2] > h) & (v[:, 2] > 0.0)
        return (np.linalg.norm(x, axis=1) > self.environment.sphere + h) & (np.einsum("ij,ij->i", x, v) > 0.0)

    def start(self) -> None:
        """Gravity and rates of the state as it stands."""
        self._gravity()
        self._evaluate()

    def _gravity(self) -> None:
        cloud = self.cloud
        if not self.environment.self_gravity:
            cloud.gravity[:] = (0.0, 0.0, -self.environment.down)
            cloud.gravity_position[:] = cloud.position
            return
        position, mass, softening = cloud.position, cloud.mass, self.softening
        if self.environment.symmetry != "none":
            parts = symmetry.copies(self.environment.symmetry)
            position = symmetry.unfolded(position, self.environment.symmetry)
            mass, softening = np.tile(mass, parts), np.tile(softening, parts)
        raw = tree.gravity(position, mass, softening, self.numerics.theta)
        field, size = tree.remove_net_force(raw, position, mass)
        cloud.gravity[:] = field[: len(cloud)]
        if self.environment.down > 0.0:
            cloud.gravity[:, 2] -= self.environment.down
        cloud.gravity_position[:] = cloud.position
        self.gravity_time = self.time
        self.gravity_evaluations += 1
        self.gravity_correction = max(self.gravity_correction, size)

    def _gravity_is_stale(self) -> bool:
        """Whether a bound particle has moved by ``gravity_shift`` of its h, unless the field is younger than
        ``REFRESH_AGE`` of the free-fall time.

        In that time even the projectile crosses 2 % of the body, so that its g of some 1 m/s^2, beside shock
        accelerations of 1000 m/s^2, is off by 5 %; without the exception it alone would call for a new field at almost
        every step of the impact.
        """
        cloud = self.cloud
        shift = self.numerics.gravity_shift
        if not self.environment.self_gravity:
            return False
        if shift > 0.0 and self.time - self.gravity_time < self.min_refresh_age:
            return False
        moved_further(
            cloud.position,
            cloud.gravity_position,
            shift * cloud.support_radius,
            cloud.neighbours,
            state.BOUND,
            self._parts,
        )
        return bool(self._parts.any())

    def _evaluate(self) -> None:
        cloud = self.cloud
        if self.images is not None:
            self.evaluated.fit(len(cloud) + len(self.images.owner))
        state.evaluate(
            cloud,
            self.rows,
            self.strength,
            self.damage,
            self.evaluated,
            not self.freeze_energy,
            self.late_medium.c2 if self.late_medium is not None else None,
        )
        state.check(cloud, self.materials, self.evaluated, self.time)
        e, pairs = self.evaluated, self.neighbourhood.pairs
        if self.scheme.start_volumes:
            start_volumes.turn(e.row, cloud.start_density)
        self._fill_images()
        if self.numerics.length_terms and self.limits_of_length is not None:
            length_terms.scale(
                self.scheme,
                self._rows(),
                pairs,
                cloud.start_support,
                self.limits_of_length,
                self._omega,
                self._omega_at_rest,
            )
            self._fill_images()
        if self.gradient_scale != 1.0:
            e.row[:, VOLUME] *= self.gradient_scale
        self._fill_extra()
        matter = pair_rates.Matter(cloud.material, self.rows.shear, e.strain_ratio, cloud.stress, self.strength)
        pair_rates.compute(self.scheme, self._rows(), pairs, matter, self.damping, self.rates)
        if self.numerics.length_terms:
            length_terms.divide(self.rates, self._omega)
        cloud.neighbours[:] = self.rates.count
        if self.scheme.reconstructed:
            cloud.strain_rate[:] = self.rates.strain_rate
        self.external_budget.evaluate(cloud, self.rates, self.edge)
        if self.edge is not None:
            self.edge.zero_rates(cloud, self.rates)
        if self.environment.turns_freely:
            self._remove_net_torque()

    def _fill_images(self) -> None:
        if self.images is not None:
            self.images.rows(self.evaluated.row, len(self.cloud), self.time)

    def _rows(self) -> Rows:
        """What the loops over pairs read, as it stands."""
        return Rows(self.evaluated.row, self._extra, self.cloud.start_density, self._inverse)

    def _fill_extra(self) -> None:
        """What switch and corrected gradients add to the rows, images included."""
        if not self.scheme.extra_rows:
            return
        cloud, row = self.cloud, self.evaluated.row
        if len(self._extra) < len(row):
            self._extra = np.zeros((len(row), self.scheme.extra_width))
        if self.scheme.switched:
            self._extra[: len(cloud), VISCOSITY_FRACTION] = cloud.viscosity
        if self.scheme.reconstructed:
            self._extra[: len(cloud), SLOPE : SLOPE + 6] = cloud.strain_rate
        if self.scheme.conducting:
            self._extra[: len(cloud), MATERIAL] = cloud.material
            self._extra[: len(cloud), ENERGY] = cloud.specific_energy
        if self.scheme.corrected:
            gradients.correct(self.scheme, self._rows(), self.neighbourhood.pairs)
        if self.images is not None:
            self.images.extra(self._extra, len(cloud), self.scheme.corrected)

    def _follow_switch(self, dt: float) -> None:
        """The fraction of the viscosity after a step."""
        if self.scheme.switched:
            c, r = self.cloud, self.rates
            switches.follow(dt, r.divergence, self.evaluated.sound, c.support_radius, c.viscosity)

    def _follow_length(self) -> None:
        """Smoothing lengths after the density."""
        c = self.cloud
        if self.limits_of_length is not None and not self.freeze_energy:
            smoothing.follow(
                c.density, c.start_density, c.start_support, *self.limits_of_length, self.longest, c.support_radius
            )

    def _remove_net_torque(self) -> None:
        self._torque = net_torque.remove(self.cloud, self.rates.acceleration, self.environment.symmetry)

    def enter_late_stage(self, sound_speed: float, weight: np.ndarray) -> tuple[float, float]:
        """Enter the late stage (``sph.stepping.late``) or its next part; ``weight`` (n,) and the energies [J] as
        there."""
        rows = self.materials.rows
        energies = late.switch(self.cloud, rows, late.late_medium(rows, sound_speed), weight, self.late_medium)
        self.resume_late_stage(sound_speed)
        self._evaluate()
        return energies

    def resume_late_stage(self, sound_speed: float) -> None:
        """Take the moduli of the late stage (a resumed run)."""
        self.late_medium = late.late_medium(self.materials.rows, sound_speed)
        self.rows = self.late_medium.rows

    def set_viscosity(self, alpha: float, beta: float) -> None:
        """Set the artificial-viscosity coefficients from now on."""
        self.damping = self.damping._replace(alpha=alpha, beta=beta)

    def next_step(self, until: float) -> float:
        """The next step [s], no further than the time ``until``; counts what limits it."""
        dt, why, _ = timestep.limit(
            self.cloud, self.rates, self.evaluated, self.damping.alpha, self.damping.beta, self.numerics.courant
        )
        if self.dt > 0.0 and dt > 1.1 * self.dt:
            dt, why = 1.1 * self.dt, timestep.REASONS.index("growth")
        self.dt = dt
        left = until - self.time
        if dt >= left:
            dt, why = left, timestep.REASONS.index("output")
        elif dt > 0.5 * left:
            dt = 0.5 * left  # two even steps rather than one and a sliver
        self.limits[why] += 1
        self.why = timestep.REASONS[why]
        return dt

    def step(self, dt: float, velocity_factor: float = 1.0) -> None:
        """One time step; ``velocity_factor`` < 1 damps velocities (relaxation)."""
        cloud, r, e = self.cloud, self.rates, self.evaluated
        self.external_budget.kick(0.5 * dt)
        leapfrog.open_step(dt, cloud.fields, r.sums, e.response, self.freeze_energy)
        self.time += dt
        self._follow_length()
        self.neighbourhood.update(cloud, dt, self.time)
        if self._gravity_is_stale():
            self._gravity()
        self._evaluate()
        leapfrog.close_step(dt, cloud.fields, r.sums, e.response, self.floor, self.freeze_energy, velocity_factor)
        self.external_budget.kick(0.5 * dt)
        if self.edge is not None:
            self.external_budget.fade(cloud, self.edge, e.wave, dt)
        self._follow_switch(dt)
        self.torque_removed += dt * self._torque
        self.steps += 1
