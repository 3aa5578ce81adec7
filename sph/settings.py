"""Settings of the shock stage: every key of ``[sph]`` in a case file, with its default or what that follows from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, create_model, model_validator

from matter.blocks import placing
from matter.case.body import Impact, Target
from matter.case.identity_fields import NotIdentity
from matter.case.quantity import PositiveLength, PositiveTime, Time
from matter.compilation.law_family import keys
from matter.errors import InputError
from sph.bodies import projectile, rubble
from sph.bodies import symmetry as symmetries
from sph.bodies import target as bodies
from sph.boundary import dispatch as boundaries
from sph.materials import rows as material_rows
from sph.materials.settings import Choice
from sph.planning import durations, late_speeds, resolution
from sph.stepping import late as late_stage
from sph.stepping import sides_and_floor
from sph.stepping.numerics import Numerics

# what a default is worked out with raises nothing: a mistake in the materials is told by the settings' own check


def _solved_spacing(given: dict[str, Any]) -> float:
    zone = given["fine_radius"], given["growth"], given["contact_radius"]
    return resolution.solved(given["target"], given["impact"], given["particles"], *zone)


def _crater_times(given: dict[str, Any], factor: float) -> float:
    try:
        materials = durations.chosen(given["target"], given["impact"], given["materials"])
    except InputError:
        return factor
    return durations.rounded(
        factor * durations.crater_time(given["target"], given["impact"], materials, given["strength"], given["damage"])
    )


def _relaxation(given: dict[str, Any]) -> float:
    try:
        return durations.relaxation_time(
            given["target"], durations.chosen(given["target"], given["impact"], given["materials"])
        )
    except InputError:
        return 0.0


if TYPE_CHECKING:
    _Keys = Numerics
else:
    _Keys = create_model("_Keys", __base__=Numerics, **keys((boundaries.FAMILY,)))


class Settings(_Keys):
    """Settings of the shock stage. Equal spacings and no refinement give a uniform hexagonal lattice."""

    target: Target
    """The body or ground that is hit, ``[target]``."""
    impact: Impact
    """How the projectile hits, ``[impact]``."""
    materials: dict[str, Choice] = Field(default_factory=dict)
    """Changes to single materials, ``[sph.materials.ice]`` for example (``sph.materials.settings``)."""
    strength: bool = True
    """Whether solids have shear strength."""
    damage: bool = True
    """Whether solids break."""
    particles: Annotated[int, Field(ge=500, le=100_000_000), NotIdentity()] = resolution.PARTICLES
    """About how many particles the target has, where ``spacing_at_impact`` is not given: it is solved for this number
    (``sph.planning.resolution``)."""
    fine_radius: PositiveLength = Field(default_factory=lambda given: resolution.fine_radius(given["impact"]))
    """Radius about the impact point inside which the spacing is ``spacing_at_impact``; by default 0.6 expected
    diameters, at least 3 projectile radii."""
    growth: Annotated[float, Field(gt=0, le=0.3)] = 0.1
    """How fast the spacing grows outside ``fine_radius``: change of spacing over distance."""
    contact_radius: PositiveLength = Field(
        default_factory=lambda given: resolution.CONTACT * given["impact"].projectile.radius
    )
    """Radius about the impact point of the refined contact zone; by default 2 projectile radii."""
    spacing_at_impact: PositiveLength = Field(default_factory=_solved_spacing)
    """Particle spacing within ``fine_radius`` of the impact point; by default the one that gives ``particles``."""
    spacing_far: PositiveLength = Field(
        default_factory=lambda given: resolution.spacing_far(given["target"], given["spacing_at_impact"])
    )
    """Particle spacing far away from the impact point, at least ``spacing_at_impact``; by default four times that, in
    a body at least a tenth of its radius."""
    contact_refinement: Annotated[float, Field(ge=1, le=10)] = Field(
        default_factory=lambda given: resolution.refinement(
            given["spacing_at_impact"], given["impact"].projectile.radius
        )
    )
    """Within ``contact_radius`` the spacing is finer by this factor (1: not at all); by default halfway to ten
    particles per projectile radius, at most 2."""
    projectile_particles: Annotated[int, Field(ge=1, le=100_000)] | None = None
    """About how many particles the projectile has (up to 3: a single heavy particle). By default its particles weigh
    what the target's at the contact weigh: light particles thrown at heavy ones bounce off one by one, with peak
    pressures three times the planar limit. Not for a projectile of parts."""
    end_time: PositiveTime = Field(default_factory=lambda given: _crater_times(given, durations.END))
    """Simulated time after the impact; by default two formation times of the crater (``sph.planning.durations``)."""
    snapshot_interval: PositiveTime = Field(default_factory=lambda given: _crater_times(given, durations.SNAPSHOT))
    """Simulated time between snapshots; by default a fifteenth of the formation time."""
    history_interval: PositiveTime = Field(
        default_factory=lambda given: durations.HISTORY * given["snapshot_interval"]
    )
    """Simulated time between rows of ``history.csv``; by default a quarter of that between snapshots."""
    first_step: PositiveTime = Field(default_factory=lambda given: durations.first_step(given["impact"]))
    """Length of the first time step, later ones follow from ``courant``; by default a hundredth of the time in which
    the projectile flies its own radius."""
    relaxation_time: Time = Field(default_factory=_relaxation)
    """Length of the damped settling before the impact (0: none); by default 1.5 times the way of sound through a
    body's radius, none for flat ground."""
    damping: Annotated[float, Field(ge=0)] = Field(
        default_factory=lambda given: (
            durations.rounded(durations.FOLDS / given["relaxation_time"]) if given["relaxation_time"] else 0.0
        )
    )
    """Damping rate of the settling [1/s]; by default ten over ``relaxation_time``."""
    sides: boundaries.Side | None = Field(
        default=None,
        description=f"Lateral boundary condition of flat ground: {boundaries.WORDS}. By default ``quiet`` for a "
        "half-space and under gravity, ``free`` otherwise.",
    )
    floor: boundaries.Floor | None = None
    """Lower boundary condition of flat ground, as ``sides``; a half-sphere has sides only."""
    late: late_stage.Settings | None = None
    """``[sph.late]``: a late stage with a low bulk modulus, for long times at small scale (``sph.stepping.late``). By
    default the one that fits the expected crater, if it grows after the shock (``sph.planning.late_speeds``)."""
    symmetry: symmetries.Symmetry = "none"
    """``half``: only y > 0 is computed, beside a mirror; ``quarter``: x > 0 and y > 0, of an impact straight down.
    What is left is the whole. Refused where the impact breaks the body: fragments and cracks would be mirrored too."""
    control: bool = False
    """A control run without projectile."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the particles' first positions and of the flaws."""

    @model_validator(mode="after")
    def _late_follows(self) -> Settings:
        given = "late" in self.model_fields_set
        if given and (self.late is None or self.late.viscosity_at is not None):
            return self
        try:
            crater = late_speeds.growth(self.target, self.impact, self.chosen_materials(), self.strength, self.damage)
        except InputError:
            return self
        followed = self.late
        if crater is not None and followed is not None:
            leaves = min(crater.viscosity_at(self.spacing_at_impact), followed.viscosity_time)
            followed = followed.model_copy(update={"viscosity_at": leaves})
        elif crater is not None:
            found = late_speeds.late_stage(crater, self.spacing_at_impact, self.end_time)
            followed = late_stage.Settings.model_validate(found) if found else None
        object.__setattr__(self, "late", followed)  # as a default is: the model is frozen for its users
        return self

    @model_validator(mode="after")
    def _sizes(self) -> Settings:
        if self.spacing_at_impact > 0.5 * self.target.radius:
            raise ValueError("spacing_at_impact must be below half the target's radius")
        if self.spacing_far < self.spacing_at_impact:
            raise ValueError("spacing_far must be at least spacing_at_impact")
        if self.late is not None and self.late.at is not None and self.late.at >= self.end_time:
            raise ValueError("late.at must be before end_time")
        if self.late is not None and any(at >= self.end_time for at, _ in self.late.switches):
            raise ValueError("late.slower: every at must be before end_time")
        if self.late is not None and self.late.viscosity_time >= self.end_time:
            raise ValueError("late.viscosity_at must be before end_time")
        if fault := symmetries.fault(self.symmetry, self.target, self.impact) or sides_and_floor.fault(self):
            raise ValueError(fault)
        materials, ball = self.chosen_materials(), self.impact.projectile
        if self.target.blocks and (fault := rubble.fault(self.target, ball, self.symmetry, self.scheme.conducting)):
            raise ValueError(fault)
        if (found := placing.of_target(self.target)) is not None:
            rubble.matrix_density(materials, self.target.layers[0].material, found)
        if ball.parts and self.projectile_particles is not None:
            raise ValueError(
                "projectile_particles: the particles of a projectile of parts are as far apart as the target's at the "
                "contact; leave it out"
            )
        if ball.parts:
            projectile.sizes(ball, self.projectile_spacing, materials)
        return self

    def chosen_materials(self) -> material_rows.Materials:
        """The materials of target and projectile with the laws that the case chooses; raises ``InputError``."""
        return durations.chosen(self.target, self.impact, self.materials)

    @property
    def zones(self) -> bodies.Zones:
        """Where the particles are how fine."""
        contact = self.spacing_at_impact / self.contact_refinement
        return bodies.Zones(
            contact,
            self.contact_radius,
            self.spacing_at_impact,
            self.fine_radius,
            self.spacing_far,
            self.growth,
            self.support,
        )

    @property
    def projectile_spacing(self) -> float:
        """Distance of the projectile's particles, in parts the width of the cells of a box [m]."""
        count = self.projectile_particles
        return float((self.impact.projectile.volume / count) ** (1.0 / 3.0)) if count else self.zones.contact

    @property
    def relaxes(self) -> bool:
        """Whether the target settles before the impact: there is weight to settle under."""
        return self.target.start == "relaxed" and self.target.weighs and self.relaxation_time > 0.0
