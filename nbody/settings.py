"""Settings of the census: every key of ``[nbody]`` in a case file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from matter.case.body import Impact, Model
from matter.case.identity_fields import Follows
from matter.case.quantity import Angle
from nbody.census import census
from nbody.population import conditions, rules


class Settings(Model):
    """Settings of the census."""

    impact: Impact
    """The impact of the case: projectile always, speed and angle where ``pinned``."""
    pinned: Annotated[bool, Follows()] = True
    """True: ``impact.toml`` carries the speed and angle of ``[impact]``; False: those that ``rule`` finds."""
    body: Literal["io", "europa", "ganymede", "callisto"] = "callisto"
    """The moon that is hit."""
    population: str = "literal"
    """``literal`` (Winter 2017 as its tables demand), ``corrected``, ``isotropic``, or a CSV file of asymptotes."""
    encounters: int = Field(default=300, ge=1, le=10_000_000)
    """Number of simulated encounters (entries into the moon's Hill sphere)."""
    rule: str = "mean of retrograde impacts"
    """Which impact is taken from the census (``nbody.population.rules``)."""
    latitude: Angle | None = None
    """Latitude of the crater: the angle is averaged over impacts within 10 deg of it, north and south."""
    seed: int = Field(default=1, ge=0)
    """Seed of the random numbers."""

    @field_validator("rule")
    @classmethod
    def _rule(cls, value: str) -> str:
        return rules.check(value)

    @property
    def request(self) -> census.Request:
        """What to count; raises ``InputError`` for an unknown population."""
        return census.Request(self.body, conditions.population(self.population), "fast", self.encounters, self.seed)
