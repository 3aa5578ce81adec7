"""Kutta's third-order method with the embedded midpoint rule as error control (Kutta 1901; Schaefer et al. 2016), for
literal comparison.

    k1 = f(y),  k2 = f(y + dt/2 k1),  k3 = f(y - dt k1 + 2 dt k2),   y_3 = y + dt/6 (k1 + 4 k2 + k3),   y_2 = y + dt k2

A step is taken when for every particle |x_3 - x_2| <= eps max(|x_3 - x|, 0.1 h) and |rho_3 - rho_2| <= eps rho, else
it is tried again with 0.9 (eps / error)^(1/3) of its length, which is also the longest next step. The limits of
``sph.stepping.timestep`` hold as well. Three evaluations a step where the default (``sph.stepping.leapfrog``) has one;
the total energy is not kept beyond the error of the method.

Yield, pores and damage are irreversible: a trial state never leaves them behind, every stage begins with those of y.
"""

from __future__ import annotations

import numpy as np

from sph.stepping.integrator import Integrator

SOURCES = ("Kutta1901", "Schaefer2016")

_STATE = ("position", "velocity", "density", "specific_energy", "stress", "root_damage", "distention")


class RungeKutta(Integrator):
    """Steps a cloud; as ``Integrator``, with ``numerics.tolerance`` for eps."""

    rejected = 0

    def _slopes(self) -> dict[str, np.ndarray]:
        cloud, r, e = self.cloud, self.rates, self.evaluated
        slopes = {
            "position": cloud.velocity,
            "velocity": r.acceleration + cloud.gravity,
            "density": r.density,
            "stress": r.stress,
        }
        slopes |= {"specific_energy": r.energy, "root_damage": e.damage_rate, "cap": e.damage_cap}
        return {name: value.copy() for name, value in slopes.items()}

    def _set(self, start: dict[str, np.ndarray], dt: float, slopes: list[tuple[float, dict[str, np.ndarray]]]) -> None:
        """The cloud as ``start`` + dt times the weighted ``slopes``."""
        cloud = self.cloud
        for name in _STATE:
            value = start[name].copy()
            if name != "distention" and not (self.hold and name in ("specific_energy", "root_damage")):
                for weight, slope in slopes:
                    value += (weight * dt) * slope[name]
            getattr(cloud, name)[:] = value
        if not self.hold:
            cap = np.maximum.reduce([slope["cap"] for _, slope in slopes])
            cloud.root_damage[:] = np.maximum(start["root_damage"], np.minimum(cloud.root_damage, cap))
        np.maximum(cloud.density, self.floor[cloud.material], out=cloud.density)

    def _evaluate_at(self, time: float, dt: float, kept: list[dict[str, np.ndarray]]) -> None:
        """Rates of the cloud as it stands; ``kept`` arrays follow its order where it is sorted anew."""
        cloud = self.cloud
        self.time = time
        self._follow_length()
        before = cloud.identity.copy()
        if self.neighbourhood.update(cloud, dt, time):
            place = np.empty(len(before), dtype=np.int64)
            place[before] = np.arange(len(before))
            order = place[cloud.identity]
            for arrays in kept:
                for name in arrays:
                    arrays[name] = arrays[name][order]
        self._evaluate()

    def _error(self, start: dict[str, np.ndarray], dt: float, middle: dict[str, np.ndarray]) -> float:
        """The largest error over eps of the cloud, which stands at y_3."""
        cloud = self.cloud
        far = np.linalg.norm(cloud.position - start["position"] - dt * middle["position"], axis=1)
        moved = np.maximum(np.linalg.norm(cloud.position - start["position"], axis=1), 0.1 * cloud.support_radius)
        dense = np.abs(cloud.density - start["density"] - dt * middle["density"]) / start["density"]
        bound = cloud.neighbours > 0
        return float(np.where(bound, np.maximum(far / moved, dense), 0.0).max()) / self.numerics.tolerance

    def step(self, dt: float, keep: float = 1.0) -> None:
        """One step of at most ``dt``, shortened until its error is small enough; ``keep`` < 1 damps velocities
        (relaxation)."""
        cloud, begun, turned = self.cloud, self.time, self._torque.copy()
        pushed = self.outside.rate.copy()
        start, first = {name: getattr(cloud, name).copy() for name in _STATE}, self._slopes()
        while True:
            self._set(start, dt, [(0.5, first)])
            self._evaluate_at(begun + 0.5 * dt, dt, [start, first])
            middle, torque = self._slopes(), turned + 4.0 * self._torque
            push = pushed + 4.0 * self.outside.rate
            self._set(start, dt, [(-1.0, first), (2.0, middle)])
            self._evaluate_at(begun + dt, dt, [start, first, middle])
            last, torque = self._slopes(), torque + self._torque
            push += self.outside.rate
            self._set(start, dt, [(1.0 / 6.0, first), (4.0 / 6.0, middle), (1.0 / 6.0, last)])
            error = self._error(start, dt, middle)
            self.allowed = dt * min(max(0.9 * max(error, 1e-12) ** (-1.0 / 3.0), 0.1), 5.0)
            if error <= 1.0:
                break
            dt, self.rejected = self.allowed, self.rejected + 1
        cloud.velocity *= keep
        self._evaluate_at(begun + dt, dt, [])
        if self._gravity_is_stale():
            self._gravity()
        if not self.hold:
            np.maximum(cloud.peak_pressure, self.evaluated.pressure, out=cloud.peak_pressure)
        self.outside.given += dt / 6.0 * push
        if self.edge is not None:
            self.outside.fade(cloud, self.edge, self.evaluated.wave, dt)
        self._follow_switch(dt)
        self.torque_removed += dt / 6.0 * torque
        self.steps += 1
