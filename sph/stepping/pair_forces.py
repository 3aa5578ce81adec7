"""The state of the particles and the sums over their pairs: evaluation (``sph.stepping.state``), images, extra rows,
and the pass over all pairs (``sph.pairs.rates``)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sph.bodies.particle_cloud import Cloud
from sph.materials.rows import Materials
from sph.materials.rows import Rows as MaterialRows
from sph.pairs import body_contact, gradients, length_terms, start_volumes
from sph.pairs import rates as pair_rates
from sph.pairs.row import BODY, ENERGY, SLOPE, VISCOSITY_FRACTION, VOLUME
from sph.pairs.scheme import Rows
from sph.stepping import state
from sph.stepping.environment import Environment
from sph.stepping.late import LateStageMedium
from sph.stepping.numerics import Numerics


@dataclass
class Switches:
    """Which physics is on: shear ``strength``, ``damage``; ``freeze_energy`` keeps u, D and h constant
    (relaxation)."""

    strength: bool = True
    damage: bool = True
    freeze_energy: bool = False


class PairForces:
    """``evaluated`` : pressure, sound speed and rows of the particles; ``rates`` : their time derivatives.

    ``images`` : those of periodic planes and walls, None without, of the ``environment``.
    """

    def __init__(self, cloud: Cloud, numerics: Numerics, environment: Environment):
        self.numerics, self.images = numerics, environment.images
        self._strikes_until = environment.strikes_until
        self._projectile_apart = body_contact.resolved(
            cloud.initial_position, cloud.start_support / numerics.support, cloud.layer < 0
        )
        several = numerics.scheme.conducting and (len(cloud.block) > 0 or self._projectile_apart)
        self.scheme = numerics.scheme._replace(with_bodies=several)
        self.evaluated = state.Evaluated(len(cloud))
        self.rates = pair_rates.Rates(len(cloud))
        self._gradient_scale = numerics.gradient_scale
        self._omega = np.ones(len(cloud) if self.scheme.reconstructed else 0)
        self._filled = np.ones(len(cloud) if self.scheme.reconstructed else 0)
        self._lattice = length_terms.at_rest(numerics.support, numerics.kernel)
        self._inverse = np.zeros((len(cloud) if self.scheme.corrected else 0, 6))
        self._extra = np.zeros((0, self.scheme.extra_width))

    def evaluate(
        self,
        cloud: Cloud,
        materials: Materials,
        late_medium: LateStageMedium | None,
        switches: Switches,
        pairs,
        damping: pair_rates.Damping,
        time: float,
    ) -> None:
        """Fill ``evaluated`` and ``rates`` at the ``time`` [s] over the neighbour list ``pairs``; the stress yields
        and pores close in place. Raises ``UnphysicalState``."""
        rows = materials.rows if late_medium is None else late_medium.rows
        self._evaluate_state(cloud, materials, rows, late_medium, switches, time)
        self._fill_images(cloud, time)
        limits = self.numerics.limits_of_length
        if limits is not None:
            length_terms.scale(
                self.scheme, self.rows(cloud), pairs, cloud.start_support, limits, self._omega, self._lattice
            )
            self._fill_images(cloud, time)
        if self._gradient_scale != 1.0:
            self.evaluated.row[:, VOLUME] *= self._gradient_scale
        self._fill_extra(cloud, materials, pairs, time)
        self.sum_over_pairs(cloud, rows, switches.strength, pairs, damping)
        cloud.neighbours[:] = self.rates.count
        if self.scheme.reconstructed:
            length_terms.divide(self.rates, self._omega)

    def sum_over_pairs(
        self, cloud: Cloud, rows: MaterialRows, strength: bool, pairs, damping: pair_rates.Damping
    ) -> None:
        """The pass over all pairs, from rows that are filled. What the next evaluation reads of it, rates of strain
        and mean pressures, is the cloud's alone, which sorts it with the rest (the former rates stand in the extra
        rows)."""
        matter = pair_rates.Matter(cloud.material, rows.shear, self.evaluated.strain_ratio, cloud.stress, strength)
        self.rates.strain_rate, self.rates.mean_pressure = cloud.strain_rate, cloud.mean_pressure
        pair_rates.compute(self.scheme, self.rows(cloud), pairs, matter, damping, self.rates)
        self.rates.strain_rate, self.rates.mean_pressure = np.zeros((0, 6)), np.zeros(0)

    def rows(self, cloud: Cloud) -> Rows:
        """The rows that the loops over pairs read."""
        return Rows(self.evaluated.row, self._extra, cloud.start_density, self._inverse, self._filled)

    def _evaluate_state(
        self,
        cloud: Cloud,
        materials: Materials,
        rows: MaterialRows,
        late_medium: LateStageMedium | None,
        switches: Switches,
        time: float,
    ) -> None:
        """Pressure, yield, damage and pores of every particle."""
        if self.images is not None:
            self.evaluated.fit(len(cloud) + len(self.images.owner))
        late = (late_medium.c2, late_medium.full) if late_medium is not None else state.NOT_LATE
        state.evaluate(
            cloud, rows, switches.strength, switches.damage, self.evaluated, not switches.freeze_energy, late
        )
        state.check(cloud, materials, self.evaluated, time)
        if self.scheme.reconstructed:
            start_volumes.turn(self.evaluated.row, cloud.start_density)

    def _fill_images(self, cloud: Cloud, time: float) -> None:
        if self.images is not None:
            self.images.rows(self.evaluated.row, len(cloud), time)

    def _fill_extra(self, cloud: Cloud, materials: Materials, pairs, time: float) -> None:
        """The extra rows that some schemes read, images included."""
        if not self.scheme.extra_rows:
            return
        n, row = len(cloud), self.evaluated.row
        if len(self._extra) < len(row):
            self._extra = np.zeros((len(row), self.scheme.extra_width))
        if self.scheme.switched:
            self._extra[:n, VISCOSITY_FRACTION] = cloud.viscosity
        if self.scheme.reconstructed:
            self._extra[:n, SLOPE : SLOPE + 6] = cloud.strain_rate
        if self.scheme.conducting:
            self._extra[:n, ENERGY] = cloud.specific_energy
            # variants of one material bear its name (``sph.bodies.rubble``)
            kind = np.array([materials.names.index(name) for name in materials.names])[cloud.material]
            body_contact.write(
                body_contact.bodies(kind, cloud.block, self._projectile_apart & (cloud.layer < 0)),
                self._filled if time < self._strikes_until else np.ones(n),
                self._extra[:n, BODY],
            )
        if self.scheme.corrected:
            gradients.correct(self.scheme, self.rows(cloud), pairs)
        if self.images is not None:
            self.images.extra(self._extra, n, self.scheme.corrected)
