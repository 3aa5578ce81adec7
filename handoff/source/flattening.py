"""The shock stage's matter on an ellipsoid or mesh flattened round the site, for a bed that is a patch of its ground
(``dem.beds.patch``, whose gravity, density and depth the bed carries as its attribute ``patch``).

Where the body stands at the time of a snapshot is found by its matter (``matter.solids.pose_tracker``), so that its
rotation and its motion are taken off; then its ground is flattened (``matter.solids.tangent_map``). From there on all
is as on flat ground. The flattened snapshot is kept in ``laid_flat.vtkhdf``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handoff.domains import turning
from handoff.domains.domain import Domain
from handoff.source import handoff_time, hydrostatic
from matter.case.body import Target
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from matter.solids.body_shape import Shape
from matter.solids.placed import PATCH
from matter.solids.pose_tracker import PoseTracker
from matter.solids.tangent_map import TangentMap

FILE = f"laid_flat{snapshot.SUFFIX}"
_BEFORE = ("identity", "position", "mass", "layer", "state")
DATUM = {"kind": "plane", "centre_m": [0.0, 0.0, 0.0], "source": "surface of the body before the impact, laid flat"}


class Patch:
    """The flattened ground of a body: as it stood in the snapshot ``before`` anything hit it, and the ``facts`` that
    the bed carries. Raises ``InputError`` where its surface cuts itself, or the facts lack something."""

    def __init__(self, target: Target, before: Particles, facts: Mapping[str, Any]):
        try:
            self.gravity, density, depth = (float(facts[key]) for key in ("gravity_m_s2", "density_kg_m3", "depth_m"))
        except KeyError as missing:
            raise InputError(f"the bed's attribute {PATCH!r} lacks {missing}") from None
        self.column = hydrostatic.uniform(self.gravity, density, depth)
        self.ground = TangentMap(Shape(target.placed, target.axes), PoseTracker(before))

    def flattened(self, particles: Particles) -> Particles:
        """A snapshot as flat ground: the frame is ``plane``, what the body's own gravity was is left out."""
        known = {name: values for name, values in particles.items() if name != "gravity"}
        flat = self.ground.flattened(Particles(known, particles.attributes))
        flat.attributes = {**particles.attributes, "frame": "plane"}
        return flat

    def measuring(self, size: float) -> dict[str, Any]:
        """Datum and gravity for measuring a crater in the grains (``crater.results.measurement_config``); ``size`` [m]
        is that of the expected crater."""
        return {"datum": DATUM, "gravity_m_s2": self.gravity, "expected_transient_diameter_m": size}


def of_bed(bed: Particles, target: Target | None, folder: Path) -> Patch | None:
    """The patch that the ``bed`` is, of the ``target`` whose first snapshot lies in the ``folder``; None where it is
    none. Raises ``InputError`` where the target is no body."""
    facts = bed.attributes.get(PATCH)
    if facts is None:
        return None
    if target is None or not target.solid:
        raise InputError('the bed is a patch of a body: [target] shape = "ellipsoid" or "mesh" must say which')
    return Patch(target, snapshot.read(handoff_time.files(folder)[0], _BEFORE), facts)


def to_bed(particles: Particles, region: Domain, patch: Patch | None) -> Particles:
    """A snapshot in the frame in which the bed lies."""
    return turning.to_bed(particles, region) if patch is None else patch.flattened(particles)
