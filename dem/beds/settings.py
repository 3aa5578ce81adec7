"""The settings of the bed: ``[bed]`` of a case."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from dem.beds import extent
from dem.contact.settings import Contact
from matter.case.at_rest import Densities
from matter.case.body import Impact, Model, Target
from matter.case.identity_fields import Follows, NotIdentity
from matter.case.quantity import PositiveLength, PositiveSpeed
from matter.geometry.ground_region import SHAPES


class Settings(Model):
    """Settings of the bed."""

    target: Annotated[Target, NotIdentity()]
    """The body or ground that is hit, ``[target]``."""
    impact: Annotated[Impact, NotIdentity(but=("expected_transient_diameter",))]
    """How the projectile hits, ``[impact]``; the bed takes its size from ``expected_transient_diameter``."""
    densities: Densities = Field(default_factory=dict)
    """Materials that the case makes denser or lighter than their files; for the prediction of ``--check`` only, the
    bed itself is as dense as ``target.json`` says."""
    contact: Contact = Contact()
    """How grains touch; by default that of the collapse, ``[dem.contact]``."""
    count: Annotated[int, Field(ge=200, le=20_000_000)] = 20_000
    """Grains in the bed and its headroom together."""
    arc_radius: PositiveLength = Field(default_factory=lambda given: extent.radius(given["target"], given["impact"]))
    """Radius of the bed along the datum (of a cone: half its angle times the body's radius); by default 1.65 expected
    transient diameters, which is 3 radii of the settled crater (``dem.beds.extent``)."""
    depth: PositiveLength | None = None
    """Depth of the bed below the datum; None: 0.75 expected transient diameters, and no deeper than flat ground or the
    innermost layer's surface (the core) goes (``dem.beds.extent``)."""
    headroom_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.15
    """Height of the headroom above the datum, over ``impact.expected_transient_diameter``."""
    radius_spread: Annotated[float, Field(ge=0.0, lt=0.5)] = 0.15
    """Grain radii are uniform within +- this fraction of their mean."""
    growth: Annotated[float, Field(ge=0.0, le=0.1), Follows()] = 0.04
    """Growth of the mean grain radius per distance from the impact, in random packings of flat ground: it begins at
    1.3 expected radii of the settled crater and ends at twice the radius (``dem.beds.grading``). 0: grains alike."""
    seed: int = 1
    """Seed of radii and first positions."""
    shape: Literal["auto", "cap", "bowl", "box", "cylinder", "whole"] = "auto"
    """The piece of ground that is filled: a spherical ``cap`` of a body; ``bowl`` (half-sphere), ``box`` or
    ``cylinder`` of flat ground, whose radius or half width is ``arc_radius``; the ``whole`` of an ellipsoid or mesh,
    or a bowl, box or cylinder of its ground round the site laid flat (``dem.beds.patch``; box and cylinder:
    experimental). ``auto``: as the target is (half_sphere: bowl, half_space: cylinder, block: box; ellipsoid, mesh:
    whole)."""
    packing: Literal["loose", "rcp", "hcp", "hcp_tilted"] = "loose"
    """How densely grains are packed. ``loose``: at random, so that the ground keeps its volume while it flows and
    comes to rest. Its solid fraction lies a third of the way from that of steady shear of the same grains to random
    close packing (``dem.beds.loose_packing``; the whole of an ellipsoid or mesh: at that of steady shear). The others
    are denser and swell before they flow: ``rcp``, random close packing; or, for equal grains in flat ground,
    hexagonal close packing: ``hcp`` with layers parallel to the ground, where whole layers can lift, and
    ``hcp_tilted``, turned so that no layer is parallel to it."""
    largest_speed: PositiveSpeed | None = None
    """Largest speed of contacts to come, for k_n in flat ground; None: k_n for the load at rest only
    (``dem.beds.flat_settling.stiffness``)."""

    @model_validator(mode="after")
    def _fit_for_blocks(self) -> Settings:
        if self.target.blocks and self.on_patch:
            raise ValueError(
                f'shape: a patch of a body\'s ground, "{self.shape}", holds no blocks; shape = "whole" does'
            )
        if self.target.blocks and self.packing != "loose":
            raise ValueError(f'packing: blocks lie in a loose bed only: packing = "loose", not "{self.packing}"')
        return self

    @property
    def on_patch(self) -> bool:
        """Whether the bed is a patch of an ellipsoid's or mesh's ground, laid flat."""
        return self.target.solid and self.shape in SHAPES
