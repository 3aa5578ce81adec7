"""A packing that keeps its volume when the ground flows and comes to rest: looser than random close packing, which
swells.

Sheared for long, dense grains dilate and loose ones close up until the solid fraction is that of the critical state,
phi_c, which follows from the contact law alone (Schofield & Wroth 1968). ``dem.trials.steady_shear`` measures it.
Under a crater ground is shaken as well, and what is shaken closes up. Beds therefore rest at

    phi = phi_c + SHAKEN (phi_rcp - phi_c).

Round the cavity of ``cases/first_crater`` (phi_c = 0.572) a bed at 0.569 closed up to 0.586 while the crater formed, a
close one swelled from 0.649 to 0.616: by the line through both, a bed a third of the way keeps its volume. A liquid
has no friction: its grains rest at random close packing, and so they begin.

Grains that come down onto each other close up by themselves until friction holds them. So they begin without weight,
touching, none pressed, at phi - SINKS (phi_rcp - phi): begun at 0.554, 0.575 or 0.583, grains of phi_c = 0.571 came to
rest at 0.577, 0.588 and 0.592, whatever the drag and the friction while they came down. Radii grow into that fraction
from below: grains that were shrunk into it have gaps all round and fall on.

Source: Schofield & Wroth 1968, Critical State Soil Mechanics, ch. 5.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from dem.beds import bed_measures
from dem.beds.flat_ground import FlatGround
from dem.beds.grain_packing import FRACTION
from dem.beds.layered_body import LayeredBody
from dem.beds.settling_phases import LOOSE_PHASES, Phase
from dem.contact.settings import SPECIES, Contact
from dem.trials import friction_angle
from matter.geometry.ground_region import Cone, Upright
from matter.particles import Particles

SOURCES = ("SchofieldWroth1968",)

CLOSE = 0.645
"""Solid fraction of the bulk at which grains without friction rest."""
SHAKEN = 0.33
"""Of what the critical state lacks to a close packing: where the ground round a crater keeps its volume."""
SINKS = 0.12
"""By how much the solid fraction grows while grains come down, over what it lacks to a close packing at rest."""
GROWN = 1.013
"""Radii over those at which the grains are first brought apart."""
ALONG_WALLS = 0.6
"""Width of the layer along walls that stays empty, in mean radii."""
AFTER = 2.0
"""Length of the phase ``sink`` beyond the fall of the uppermost grains, in sqrt(r/g)."""

FEWEST = 50
"""Grains of a layer that make a bulk whose fraction is worth measuring."""

D = TypeVar("D", Upright, Cone)
Draw = Callable[[np.ndarray, D, np.random.SeedSequence], np.ndarray]


def at_rest(critical: float) -> float:
    """Solid fraction of a bed that keeps its volume, of grains with this ``critical`` one."""
    return critical + SHAKEN * max(0.0, CLOSE - critical)


def begins(fraction: np.ndarray) -> np.ndarray:
    """Solid fraction of the bulk at which grains begin that are to rest at ``fraction``."""
    return fraction - SINKS * (FRACTION - fraction)


@dataclass(frozen=True)
class LooseBed(Generic[D]):
    """How a loose bed of this ``ground`` begins in its ``domain``: solid ``fraction`` at rest (layers,)."""

    ground: FlatGround | LayeredBody
    domain: D
    fraction: np.ndarray

    @staticmethod
    def of_law(ground: FlatGround | LayeredBody, domain: D, contact: Contact) -> LooseBed[D]:
        """With the critical state of the contact law: known, or measured in three quarters of a minute."""
        liquid = np.array([SPECIES[contact.species_of(name)] == "ocean" for name in ground.materials])
        solid = CLOSE if liquid.all() else at_rest(friction_angle.loose_fraction(contact))
        return LooseBed(ground, domain, np.where(liquid, CLOSE, solid))

    def mean(self, fraction: np.ndarray) -> float:
        """Mean by volume over the domain of something of each layer (layers,)."""
        edges = np.linspace(self.domain.floor, self.domain.top, 2001)
        volume = np.array([self.domain.volume_between(a, b) for a, b in itertools.pairwise(edges)])
        layer = self.ground.layer_of(0.5 * (edges[1:] + edges[:-1]))
        return float(volume @ fraction[layer] / volume.sum())

    def filled(self, domain: D, mean_radius: float, lid: bool = True) -> float:
        """Volume [m^3] of a domain that a packing fills as it does its bulk: without a layer along walls and lid."""
        inner = domain.inset(ALONG_WALLS * mean_radius)
        return inner.volume_between(inner.floor, inner.top if lid else domain.top)

    def radii(self, radius: np.ndarray) -> np.ndarray:
        """These radii in proportion, before they grow, so that the grains at rest fill the domain."""
        for _ in range(4):  # the layer along the walls is as wide as they are large
            wanted = self.mean(self.fraction) * self.filled(self.domain, float(radius.mean()), lid=False)
            radius = radius * (wanted / _volume(radius)) ** (1.0 / 3.0)
        return radius / GROWN

    def raised(self, radius: np.ndarray) -> D:
        """The domain with its top where grains of ``radii``, grown by ``GROWN``, begin."""
        mean = float(radius.mean())
        missing = _volume(GROWN * radius) / self.mean(begins(self.fraction)) - self.filled(self.domain, mean)
        inner = self.domain.inset(ALONG_WALLS * mean)
        return self.domain.raised(missing * mean / inner.volume_between(inner.datum, inner.datum + mean))

    def begins_at(self, position: np.ndarray) -> np.ndarray:
        """How densely the layers of these positions (n, 3) begin, over the densest."""
        part = begins(self.fraction) / begins(self.fraction).max()
        return np.asarray(part[self.ground.layer_of(self.domain.height(position))])

    def centres(self, radius: np.ndarray, raised: D, draw: Draw[D], seed: np.random.SeedSequence) -> np.ndarray:
        """Centres (n, 3) in the ``raised`` domain, in each layer as many as it begins with, by a law that draws them
        uniformly."""
        seeds = seed.spawn(2)
        rng, todo, found = np.random.default_rng(seeds[0]), np.arange(len(radius)), np.empty((len(radius), 3))
        while len(todo):
            found[todo] = draw(radius[todo], raised, seeds[1].spawn(1)[0])
            todo = todo[rng.random(len(todo)) >= self.begins_at(found[todo])]
        return found

    def growth(self, grains: Particles, raised: D) -> np.ndarray:
        """Factors (n,) on the radii with which the bulk of each layer is filled as it begins; of a layer that has no
        bulk, that of the whole."""
        x, r = grains.position, grains.radius
        mean = float(r.mean())
        margin, height = bed_measures.BULK_MARGIN * mean, raised.height(x)
        layer = self.ground.layer_of(height)
        inner = (raised.side_depth(x) > margin) & (height > raised.floor + margin) & (height < raised.top - margin)
        whole = self.mean(begins(self.fraction)) * self.filled(raised, mean) / _volume(r)
        factor = np.full(len(r), whole ** (1.0 / 3.0))
        for k, wanted in enumerate(begins(self.fraction)):
            if (inner & (layer == k)).sum() >= FEWEST:
                found = bed_measures.bulk_fraction_where(x, r, inner & (layer == k))
                factor[layer == k] = (wanted / found) ** (1.0 / 3.0)
        return factor

    def phases(self, mean_radius: float) -> tuple[Phase, ...]:
        """The phases of such a bed: ``sink`` is as long as the uppermost grains need, at half of sqrt(g r), and
        ``AFTER`` more."""
        closes = self.mean(self.fraction) / self.mean(begins(self.fraction)) - 1.0
        falls = closes * (self.domain.top - self.domain.floor) / mean_radius
        liquid = (self.fraction == CLOSE).any()
        return tuple(
            p._replace(length=AFTER + 2.0 * falls) if p.name == "sink" else p
            for p in LOOSE_PHASES
            if liquid or p.name != "trim"
        )


def _volume(radius: np.ndarray) -> float:
    return float(4.0 / 3.0 * math.pi * np.sum(radius**3))
