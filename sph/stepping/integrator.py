"""The integrator of the shock stage: one leapfrog step (``sph.stepping.leapfrog``) as a list of named sub-steps, whose
parts are gravity (``gravity_field``), pairs (``pair_forces``), boundaries (``sph.boundary``) and the limit of the step
(``step_limit``).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import checkpoint
from sph.bodies.particle_cloud import Cloud, Neighbourhood
from sph.boundary.external_budget import ExternalBudget
from sph.materials.rows import Materials, Rows
from sph.pairs import smoothing
from sph.pairs.scheme import Damping
from sph.stepping import gravity_field, late, leapfrog, net_torque, vibration
from sph.stepping.environment import Environment
from sph.stepping.gravity_field import GravityField
from sph.stepping.numerics import Numerics
from sph.stepping.pair_forces import PairForces, Switches
from sph.stepping.step_limit import StepLimit
from sph.viscosity import morris_monaghan
from sph.viscosity import switch as viscosity_switch

DENSITY_FLOOR = 0.005  # of the density at rest; only particles that have lost their neighbours come near it


class Integrator:
    """Steps a cloud.

    The net torque of pairs and gravity is taken out at each evaluation (``sph.stepping.net_torque``);
    ``torque.removed`` holds its integral [kg m^2/s], so that what was corrected stays in sight.

    Parameters
    ----------
    radius : the target's [m], which the first step and the search start from.
    numerics : how the equations are solved (``sph.stepping.numerics``).
    environment : gravity, images and edges (``Environment``).

    ``switches`` say which physics is on (``sph.stepping.pair_forces``).
    """

    def __init__(
        self, cloud: Cloud, materials: Materials, radius: float, numerics: Numerics, environment: Environment
    ):
        self.cloud, self.materials, self.environment = cloud, materials, environment
        self.edge, self.external_budget = environment.edge, ExternalBudget(environment)
        self.damping = Damping(numerics.alpha, numerics.beta, 1.0 / numerics.support, numerics.conductivity)
        self.switches, self.step_limit = Switches(), StepLimit(numerics.courant, numerics.signal)
        self.late_medium: late.LateStageMedium | None = None
        self.time, self.steps = 0.0, 0
        self.torque = net_torque.Torque()
        self.gravity = GravityField(cloud, radius, numerics.gravity_shift, environment)
        self.neighbourhood = Neighbourhood(cloud, 1.5 * radius, environment.images)
        self.forces = PairForces(cloud, numerics, environment)
        if self.forces.scheme.reconstructed and len(cloud.strain_rate) == 0:
            cloud.strain_rate = np.zeros((len(cloud), 6))
        if materials.inertial and not self.forces.scheme.reconstructed:
            raise InputError('inertial_friction needs numerics = "reconstructed", which keeps the rates of strain')
        if materials.vibrate and not self.forces.scheme.reconstructed:
            raise InputError('block_model needs numerics = "reconstructed", which keeps the rates of strain')
        if materials.vibrate and len(cloud.vibration) == 0:
            cloud.vibration = np.zeros(len(cloud))
        if materials.harden and len(cloud.plastic_strain) == 0:
            cloud.plastic_strain = np.zeros(len(cloud))
        if self.forces.scheme.switched:
            cloud.viscosity = np.full(len(cloud), morris_monaghan.START)

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Arrays and numbers that a resumed run needs to go on to the last bit, with those of cloud, rates, list and
        images."""
        forces, images = self.forces, self.environment.images
        arrays = checkpoint.under("cloud", self.cloud.state()) | checkpoint.under("rates", forces.rates.state())
        listed, numbers = self.neighbourhood.state()
        arrays |= checkpoint.under("evaluated", forces.evaluated.state()) | listed | {"limits": self.step_limit.counts}
        numbers |= {"time": self.time, "dt": self.step_limit.dt, "steps": self.steps} | self.gravity.state()
        numbers |= {"torque_removed": self.torque.removed} | self.external_budget.state()
        return arrays, numbers | (images.state() if images is not None else {})

    def restore(self, arrays: Mapping[str, np.ndarray], numbers: Mapping[str, Any]) -> None:
        """Take up a ``state``; the cloud has to be that of the state already (``Cloud.restored``)."""
        # in the order in which it was saved: the first list has sorted it
        self.cloud.restore(checkpoint.Part(arrays, "cloud"))
        if self.environment.images is not None:
            self.environment.images.restore(numbers)
        self.neighbourhood.restore(arrays, numbers)
        self.external_budget.restore(numbers)
        self.forces.rates.restore(checkpoint.Part(arrays, "rates"))
        self.forces.evaluated.restore(checkpoint.Part(arrays, "evaluated"))
        self.step_limit.counts[:], self.torque.removed[:] = arrays["limits"], numbers["torque_removed"]
        self.time, self.step_limit.dt, self.steps = float(numbers["time"]), float(numbers["dt"]), int(numbers["steps"])
        self.gravity.restore(numbers)

    @property
    def rows(self) -> Rows:
        """The moduli and laws of the materials, in the late stage those of its medium."""
        return self.materials.rows if self.late_medium is None else self.late_medium.rows

    @property
    def softening(self) -> np.ndarray:
        """Plummer length of every particle [m]."""
        return gravity_field.softening(self.cloud)

    def thrown_out(self) -> np.ndarray:
        """(n,) what is beyond the surface of a target without self-gravity by more than its h and moves on outwards:
        above z = 0, or off a sphere."""
        x, v, h = self.cloud.position, self.cloud.velocity, self.cloud.support_radius
        if self.environment.sphere is None:
            return (x[:, 2] > h) & (v[:, 2] > 0.0)
        return (np.linalg.norm(x, axis=1) > self.environment.sphere + h) & (np.einsum("ij,ij->i", x, v) > 0.0)

    def start(self) -> None:
        """Gravity and rates of the state as it stands."""
        self.gravity.evaluate(self.cloud, self.time)
        self.evaluate()

    def next_step(self, until: float) -> float:
        """The next step [s], no further than the time ``until``; counts what limits it."""
        forces = self.forces
        return self.step_limit.next(self.cloud, forces.rates, forces.evaluated, self.damping, until - self.time)

    def step(self, dt: float, velocity_factor: float = 1.0) -> None:
        """One time step; ``velocity_factor`` < 1 damps velocities (relaxation)."""
        self._kick_and_drift(dt)
        self._follow_length()
        self.neighbourhood.update(self.cloud, dt, self.time)
        self.gravity.update(self.cloud, self.time)
        self.evaluate()
        self._kick(dt, velocity_factor)
        self._fade_layers(dt)
        self._follow_viscosity_switch(dt)
        self._follow_vibration(dt)
        self.torque.removed += dt * self.torque.present
        self.steps += 1

    def _kick_and_drift(self, dt: float) -> None:
        """Half a kick, the drift, and the prediction for the end of the step."""
        self.external_budget.kick(0.5 * dt)
        sums, response = self.forces.rates.sums, self.forces.evaluated.response
        leapfrog.open_step(dt, self.cloud.fields, sums, response, self.switches.freeze_energy)
        self.time += dt

    def _follow_length(self) -> None:
        """Smoothing lengths after the density."""
        c, limits, images = self.cloud, self.forces.numerics.limits_of_length, self.environment.images
        if limits is not None and not self.switches.freeze_energy:
            # a periodic box has room for no longer support
            longest = images.longest / (1.0 + 2.0 * self.neighbourhood.SKIN) if images is not None else np.inf
            smoothing.follow(c.density, c.start_density, c.start_support, *limits, longest, c.support_radius)

    def evaluate(self) -> None:
        """State and rates at the present positions, with the conditions of boundaries and of the net torque."""
        cloud, forces = self.cloud, self.forces
        pairs = self.neighbourhood.pairs
        forces.evaluate(cloud, self.materials, self.late_medium, self.switches, pairs, self.damping, self.time)
        self.external_budget.evaluate(cloud, forces.rates, self.edge)
        if self.edge is not None:
            self.edge.zero_rates(cloud, forces.rates)
        if self.environment.turns_freely:
            self.torque.present = net_torque.remove(cloud, forces.rates.acceleration, self.environment.symmetry)

    def _kick(self, dt: float, velocity_factor: float) -> None:
        """The other half of the kick, with the rates at the end of the step."""
        floor = DENSITY_FLOOR * self.materials.bulk_density
        sums, response = self.forces.rates.sums, self.forces.evaluated.response
        frozen = self.switches.freeze_energy
        leapfrog.close_step(dt, self.cloud.fields, sums, response, floor, frozen, velocity_factor)
        self.external_budget.kick(0.5 * dt)

    def _fade_layers(self, dt: float) -> None:
        """The quiet layers before the rim."""
        if self.edge is not None:
            self.external_budget.fade(self.cloud, self.edge, self.forces.evaluated.wave, dt)

    def _follow_viscosity_switch(self, dt: float) -> None:
        """The fraction of the viscosity after a step."""
        if self.forces.scheme.switched:
            c, forces = self.cloud, self.forces
            viscosity_switch.follow(dt, forces.rates.divergence, forces.evaluated.sound, c.support_radius, c.viscosity)

    def _follow_vibration(self, dt: float) -> None:
        """The vibration after a step; none while the target settles."""
        c = self.cloud
        if len(c.vibration) and not self.switches.freeze_energy:
            divergence = self.forces.rates.divergence
            vibration.follow(dt, self.time, c.material, self.rows.vibration, c.velocity, divergence, c.vibration)

    def enter_late_stage(self, sound_speed: float, spacing: float, weight: np.ndarray) -> tuple[float, float]:
        """Enter the late stage (``sph.stepping.late``) or its next part; ``spacing`` of the particles of the crater
        [m], ``weight`` (n,) and the energies [J] as there."""
        medium = late.late_medium(self.materials, sound_speed, spacing)
        energies = late.switch(self.cloud, self.materials.rows, medium, weight, self.late_medium)
        self.late_medium = medium
        self.evaluate()
        return energies

    def resume_late_stage(self, sound_speed: float, spacing: float) -> None:
        """Take the moduli of the late stage (a resumed run)."""
        self.late_medium = late.late_medium(self.materials, sound_speed, spacing)

    def set_viscosity(self, alpha: float, beta: float) -> None:
        """Set the artificial-viscosity coefficients from now on."""
        self.damping = self.damping._replace(alpha=alpha, beta=beta)
