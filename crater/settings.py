"""The crater stage's keys: how a crater is measured, what it is compared with, and the errors that no single run can show."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from matter import quantity
from matter.body import Impact, Model, Target
from matter.quantity import Length, Speed, Volume

RISE_LIMIT = 0.15
"""In expected transient diameters: what rises higher is in flight."""
_Error = Annotated[Length, Field(ge=0)]


class Errors(Model):
    """The chain error of each measure of one crater; a measure that is left out has none that is known."""

    diameter_apparent_m: _Error | None = None
    """Of the apparent diameter."""
    diameter_rim_m: _Error | None = None
    """Of the rim-to-rim diameter."""
    depth_m: _Error | None = None
    """Of the depth below the datum."""
    depth_rim_to_floor_m: _Error | None = None
    """Of the depth from rim to floor."""
    rim_height_m: _Error | None = None
    """Of the rim's height."""
    volume_m3: Annotated[Volume, Field(ge=0)] | None = None
    """Of the volume below the datum."""


class ChainError(Model):
    """Chain errors of the transient crater, at its largest volume and where it is deepest, and of the final one."""

    transient: Errors = Errors()
    """Of the transient crater at its largest volume."""
    transient_at_maximum_depth: Errors = Errors()
    """Of the transient crater where it is deepest."""
    final: Errors = Errors()
    """Of the final crater."""


class Published(Model):
    """A published number of the case, ``[[crater.reference]]``."""

    quantity: Literal["diameter_apparent_m", "diameter_rim_m", "depth_m", "depth_rim_to_floor_m", "rim_height_m", "volume_m3", "time_s"]
    """Which measure, named as in ``measures.json``."""
    of: Literal["transient", "final"] = "transient"
    """Of which crater."""
    at: Literal["volume", "depth", "diameter"] = "depth"
    """The transient crater is that at the first maximum of this."""
    value: str
    """With unit, ``"980 km"``."""
    plus: str
    """Upper error with unit."""
    minus: str
    """Lower error with unit."""
    source: str
    """The publication."""
    note: str = ""
    """A remark that stands beside the number."""

    @field_validator("value", "plus", "minus")
    @classmethod
    def _readable(cls, text: str) -> str:
        quantity.parse(text)
        return text


class Settings(Model):
    """How the crater is measured and what it is compared with."""

    target: Target
    """The body or ground that is hit, ``[target]``."""
    impact: Impact
    """How the projectile hits, ``[impact]``."""
    reference: tuple[Published, ...] = ()
    """Published numbers of the case with their errors."""
    sectors: Annotated[int, Field(ge=8, le=144)] = 24
    """Sectors in azimuth; their scatter is the azimuthal error."""
    rise_limit_over_diameter: Annotated[float, Field(gt=0, le=2)] = RISE_LIMIT
    """What would rise above this many expected transient diameters is in flight and takes no part in heights."""
    every: Annotated[int, Field(ge=1)] = 1
    """Measure every n-th snapshot of the shock stage."""
    escape_speed: Annotated[Speed, Field(ge=0)] = 0.0
    """Flat ground: what rises faster than this leaves the body that the ground stands for."""
    ground: Literal["fluid", "rock", "sand"] = "fluid"
    """Kind of ground whose scaling laws the crater is compared with; ``fluid`` for weak ground without friction."""
    simple_to_complex: str = "2.5 km"
    """Transition diameter between simple and complex craters on this body."""
    seed: int = 1
    """Seed of the bootstrap over azimuth."""
    chain: ChainError | None = None
    """Chain errors of the measures; those of a shipped case come from its ``expected.toml``."""
    particles: Annotated[int, Field(gt=0)] = 15_000
    """Size of the shock stage's snapshots, for the prediction of ``--check`` only."""
