"""The settings of the collapse: ``[dem]`` of a case."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from dem import collapse_durations
from dem.contact.settings import Contact
from dem.engines import deviations
from dem.engines.deviations import Deviation
from matter.case import at_rest
from matter.case.at_rest import Densities
from matter.case.body import Impact, Model, Target
from matter.case.identity_fields import Follows, NotIdentity
from matter.case.quantity import PositiveLength, PositiveSpeed, PositiveTime


class Settings(Model):
    """Settings of the collapse."""

    target: Target | None = None
    """The body or ground, ``[target]``; with ``impact`` it sets the times that are not given."""
    impact: Impact | None = None
    """The impact, ``[impact]``."""
    densities: Densities = Field(default_factory=dict)
    """Materials that the case makes denser or lighter than their files."""
    contact: Contact = Contact()
    """How grains touch, ``[dem.contact]``; the bed settles under the same laws."""
    end_time: PositiveTime = Field(
        default_factory=lambda given: collapse_durations.crater_times(given, collapse_durations.END)
    )
    """Earliest end, counted from the impact; by default five formation times of the crater
    (``dem.collapse_durations``)."""
    latest_time: PositiveTime = Field(
        default_factory=lambda given: collapse_durations.crater_times(given, collapse_durations.LATEST)
    )
    """Latest end, counted from the impact; by default ten formation times."""
    still_interval: PositiveTime = Field(
        default_factory=lambda given: collapse_durations.crater_times(given, collapse_durations.STILL)
    )
    """The run ends when the profile has changed by less than a tenth of a mean grain radius (RMS) over this time; by
    default 5/6 of the formation time."""
    snapshot_interval: PositiveTime = Field(
        default_factory=lambda given: collapse_durations.crater_times(given, collapse_durations.SNAPSHOT)
    )
    """Simulated time between snapshots; by default a sixth of the formation time."""
    history_interval: PositiveTime = Field(
        default_factory=lambda given: collapse_durations.HISTORY * given["snapshot_interval"]
    )
    """Simulated time between rows of ``history.csv``; by default a twelfth of that between snapshots."""
    grains: Annotated[int, Field(ge=1), NotIdentity(), Follows()] = 20_000
    """Expected number of grains, for the prediction of the cost only."""
    bed_grains: Annotated[Annotated[int, Field(ge=1)] | None, NotIdentity(), Follows()] = None
    """Expected number of grains below the datum, for the prediction of the cost only."""
    bed_step: Annotated[PositiveTime | None, NotIdentity(), Follows()] = None
    """Expected time step of the bed, for the prediction of the cost only."""
    bed_radius: Annotated[PositiveLength | None, NotIdentity(), Follows()] = None
    """Expected mean radius of the bed's grains, for the prediction of the cost only."""
    step_factor: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    """Multiplies the time step (a sensitivity test halves it)."""
    engine: Literal["native", "lammps", "liggghts"] = "native"
    """Program that computes the collapse: bolide itself, or another that is installed."""
    ranks: Annotated[int, Field(ge=1, le=4096), NotIdentity()] = 1
    """MPI processes of another engine."""
    accept: tuple[Deviation, ...] = ()
    """Deviations that another engine may make, by name (``dem.engines.deviations``); each is refused otherwise."""

    springs_for: PositiveSpeed | Literal["auto", "bed"] = "auto"
    """Closing speed at which the springs of the start reach an overlap of x_max. The bed settles with soft springs
    that bear its weight; its contacts keep their forces when k_n is raised (``dem.stiffness.stiffening``). ``auto``:
    the fastest approach handed over, or ``bed`` for a sphere so large that its grains have the springs of their
    solid. ``bed``: keep the springs of the bed."""
    stiffness: Literal["fixed", "following"] = "fixed"
    """``following``: k_n falls with the speed of the contacts, and the step grows; see ``dem.stiffness.following``."""

    @model_validator(mode="after")
    def _order(self) -> Settings:
        if self.target is not None and at_rest.surface_gravity(self.target, self.densities) <= 0.0:
            raise ValueError(
                "without gravity no crater collapses: set [target] gravity, or leave out the stages bed, handoff and "
                "dem"
            )
        if self.latest_time < self.end_time:
            raise ValueError(f"latest_time ({self.latest_time:g} s) must not be before end_time ({self.end_time:g} s)")
        if missing := deviations.laws_missing(self.engine, self.contact):
            raise ValueError(f"{missing}: take the native engine, or leave it out")
        if self.engine != "native" and self.springs_for not in ("auto", "bed"):
            raise ValueError(
                f"springs_for = {self.springs_for:g} m/s needs contacts with offsets, which {self.engine} has not: "
                f"leave it out and settle the bed "
                "in springs for that speed ([bed] largest_speed), or take the native engine"
            )
        return self
