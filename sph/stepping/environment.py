"""External conditions of the SPH domain: gravity, boundaries and mirror symmetry."""

from __future__ import annotations

import math
from typing import NamedTuple

from sph.bodies import symmetry
from sph.boundary.edge import Edge
from sph.boundary.images import Images


class Environment(NamedTuple):
    """Everything besides pair forces that acts on the particles.

    self_gravity : whether the particles attract each other;  down : uniform gravity towards -z [m/s^2]. images, edge :
    periodic planes and walls, fixed rim and quiet layer (``sph.boundary``). With either, the net torque is their own
    and stays. sphere : radius of a spherical target without self-gravity [m], None for a flat one; only the history
    asks for it. symmetry : which part of the whole the cloud is (``sph.bodies.symmetry``); its mirrors are among the
    images. strikes_until : when the projectile is in [s] (``sph.pairs.body_contact``).
    """

    self_gravity: bool = True
    down: float = 0.0
    images: Images | None = None
    edge: Edge | None = None
    sphere: float | None = None
    symmetry: str = "none"
    strikes_until: float = math.inf

    @property
    def turns_freely(self) -> bool:
        """Whether nothing but mirrors and the cloud itself acts on it."""
        planes = () if self.images is None else self.images.planes
        return self.edge is None and len(planes) == len(symmetry.MIRRORS[self.symmetry])
