"""What the stages share about a case: the layered target and the impact, as validated models.

Frame of every stage: the target's centre (or, for a flat target, the impact point) is the origin, the impact point
lies on +z, and the projectile flies in the x-z plane towards +x: v = speed (sin a, 0, -cos a) with a =
``angle_from_vertical`` (0 is head-on).
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from matter.case import quantity
from matter.case.block_tables import Blocks
from matter.case.identity_fields import IdentityIfSet
from matter.case.model import Model, known_material
from matter.case.quantity import Acceleration, Angle, Length, PositiveLength, PositiveMass, PositiveSpeed, PositiveTime
from matter.errors import InputError
from matter.solids.placed import Placed, of_axes, of_file

SOLIDS = ("ellipsoid", "mesh")
"""Shapes of a target that are neither a sphere nor flat ground."""
FLAT = ("half_space", "half_sphere", "block")
"""Shapes of flat ground."""
SITE = ("latitude", "longitude", "azimuth", "arrival", "spin_period", "companion")
LIGHT = 299_792_458.0
"""Speed of light [m/s]."""
MIDDLE = (1.0 - 0.5**0.5) / 3.0
"""Depth above which half of a crater's volume lies, over its diameter: of a paraboloid a third as deep as wide."""


class Layer(Model):
    """One layer of a target, counted from the centre outwards, or from the bottom up."""

    name: str
    """Name of the layer, free to choose; a case may leave it out."""
    material: str
    """Material of the layer (``run_case --list`` names them all)."""
    thickness: PositiveLength
    """Thickness of the layer before any compression; a case may leave out that of the lowest layer of flat ground,
    which then goes down 2.2 expected crater diameters."""

    _known = field_validator("material")(known_material)


class Companion(Model):
    """A point mass in mutual orbit with an ellipsoid or mesh; its tide acts on the grains."""

    mass: PositiveMass
    """Mass of the companion."""
    distance: PositiveLength
    """Distance of the companion from the body's centre of mass; it stands over the equator, above longitude 0."""


class Target(Model):
    """A target of uniform layers before any compression."""

    layers: Annotated[tuple[Layer, ...], Field(min_length=1)]
    """Layers from the centre outwards, in flat ground from the bottom up: the last is always the one that is hit."""
    start: Literal["relaxed", "literal"] = "relaxed"
    """``relaxed``: hydrostatic, each layer keeps its mass; an ellipsoid or mesh bears the weight of what lies above,
    so that its ground does not fall. ``literal``: uniform layers without pressure, as published."""
    shape: Literal["sphere", "ellipsoid", "mesh", "half_space", "half_sphere", "block"] = "sphere"
    """``sphere`` about the origin, hit at its pole; a body of one material that is an ``ellipsoid`` or has the surface
    of a file (``mesh``); or a piece of flat ground below z = 0, hit at the origin: ``half_space`` (upright cylinder),
    ``half_sphere`` (a bowl of ground whose radius is the sum of all layers) or ``block``."""
    axes: tuple[PositiveLength, PositiveLength, PositiveLength] | None = None
    """Full axes of an ellipsoid along x, y and z of its own frame; z is the spin axis."""
    file: str | None = None
    """The closed surface of a ``mesh``: OBJ, PLY or STL, beside the case."""
    file_unit: PositiveLength | None = None
    """Length of one unit of the file, ``"1 km"``: these formats do not record it."""
    latitude: Angle = 0.0
    """Latitude of the point of impact on an ellipsoid or mesh, from the centre of mass."""
    longitude: Angle = 0.0
    """Longitude of the point of impact, towards the east."""
    azimuth: Angle = math.radians(90.0)
    """Direction in which the projectile flies, seen from above the site of an ellipsoid or mesh: 0 is north, 90 deg is
    east."""
    arrival: tuple[float, float, float] | None = None
    """Direction in which the projectile flies in the frame of an ellipsoid or mesh, of any length. The azimuth and
    ``[impact] angle_from_vertical`` follow from it, and where they are left out too, latitude and longitude of the
    site: its line then leads to the centre of mass."""
    spin_period: PositiveTime | None = None
    """Period of an ellipsoid's or mesh's rotation about +z of its own frame; by default it does not turn."""
    companion: Companion | None = None
    """A companion of an ellipsoid or mesh, ``[target.companion]``; none by default."""
    width: PositiveLength | None = None
    """Width of the block, or diameter of the half-space; by default twice the depth."""
    gravity: Annotated[Acceleration, Field(ge=0)] = 0.0
    """Uniform gravity towards -z; flat ground only."""
    self_gravity: bool | None = None
    """Whether the target attracts itself; by default a sphere does and flat ground does not."""
    blocks: Annotated[tuple[Blocks, ...], Field(max_length=1), IdentityIfSet()] = ()
    """Blocks in flat ground, an ellipsoid or a mesh, ``[[target.blocks]]``; one population so far. None by default."""

    @model_validator(mode="before")
    @classmethod
    def _as_thick_as_its_shape(cls, given: Any) -> Any:
        """An ellipsoid's or mesh's one layer is the whole body; what is wrong with its shape is told afterwards."""
        if not isinstance(given, dict) or given.get("shape") not in SOLIDS:
            return given
        layers = given.get("layers")
        if (
            not isinstance(layers, list | tuple)
            or not layers
            or not isinstance(layers[0], dict)
            or "thickness" in layers[0]
        ):
            return given
        try:
            if given["shape"] == "ellipsoid":
                axes = [
                    quantity.parse(value, "m") if isinstance(value, str) else float(value) for value in given["axes"]
                ]
                radius = 0.5 * float(axes[0] * axes[1] * axes[2]) ** (1.0 / 3.0)
            else:
                unit = given["file_unit"]
                length = quantity.parse(unit, "m") if isinstance(unit, str) else float(unit)
                radius = of_file(given["file"], length, 0.0, 0.0, 0.0).solid.radius
        except (InputError, KeyError, TypeError, ValueError, IndexError):
            radius = 1.0
        return {**given, "layers": [{**layers[0], "thickness": f"{radius!r} m"}, *layers[1:]]}

    @model_validator(mode="after")
    def _fits(self) -> Target:
        if not self.flat and self.gravity > 0.0:
            raise ValueError(
                "gravity: uniform gravity is for half_space, half_sphere and block; a sphere has its own "
                "(self_gravity)"
            )
        if self.width is not None and (not self.flat or self.shape == "half_sphere"):
            raise ValueError(f"width: a {self.shape} is as wide as its layers make it")
        if fault := self._fault_of_solid() or self._fault_of_blocks():
            raise ValueError(fault)
        return self

    def _fault_of_blocks(self) -> str:
        """What keeps this target from holding blocks."""
        if not self.blocks:
            return ""
        if self.shape == "sphere":
            return 'blocks: of flat ground, an ellipsoid or a mesh; a ball is shape = "ellipsoid" with equal axes'
        if len(self.layers) > 1:
            return "blocks: of a target of one layer"
        return ""

    def _fault_of_solid(self) -> str:
        """What keeps an ellipsoid or mesh from being one, or gives its keys to another shape."""
        for key, shape in {"axes": "ellipsoid", "file": "mesh", "file_unit": "mesh"}.items():
            if (getattr(self, key) is not None) != (self.shape == shape):
                return f'{key}: needed by shape = "{shape}", and only there'
        if not self.solid:
            fields = type(self).model_fields
            given = [key for key in SITE if getattr(self, key) != fields[key].default]
            return f"{given[0]}: of an ellipsoid or mesh only" if given else ""
        if abs(self.latitude) > 0.5 * math.pi:
            return f"latitude must lie within 90 deg, got {math.degrees(self.latitude):.4g} deg"
        if len(self.layers) > 1:
            return f"layers: a {self.shape} is of one material"
        try:
            radius = self.placed.solid.radius
        except InputError as reason:
            return f"file: {reason}"
        if self.arrival is not None and not any(self.arrival):
            return "arrival: (0, 0, 0) is no direction"
        if self.companion is not None and self.companion.distance <= self.placed.solid.extent:
            return f"companion: distance {self.companion.distance:.6g} m lies inside the body"
        if abs(self.layers[0].thickness / radius - 1.0) > 1e-3:
            return f"thickness: leave it out; the {self.shape} makes it {radius:.6g} m (the ball of its volume)"
        return ""

    @property
    def solid(self) -> bool:
        """Whether the target is an ellipsoid or mesh."""
        return self.shape in SOLIDS

    @property
    def placed(self) -> Placed:
        """The ellipsoid or mesh in the frame of the run. Raises ``InputError`` for no closed surface."""
        site = self.latitude, self.longitude, self.azimuth
        if self.shape == "ellipsoid":
            assert self.axes is not None
            return of_axes(self.axes, *site)
        assert self.file is not None and self.file_unit is not None
        return of_file(self.file, self.file_unit, *site)

    def aim(self, impact: Impact) -> tuple[float, float, float]:
        """Velocity of the projectile [m/s]."""
        return self.placed.velocity(impact.speed, impact.angle_from_vertical) if self.solid else impact.velocity

    @property
    def flat(self) -> bool:
        """Whether the target is flat ground with the impact point at the origin."""
        return self.shape != "sphere" and not self.solid

    @property
    def attracts(self) -> bool:
        """Whether self-gravity is on."""
        return not self.flat if self.self_gravity is None else self.self_gravity

    @property
    def weighs(self) -> bool:
        """Whether any gravity acts, so that pressure grows with depth."""
        return self.gravity > 0.0 or (self.attracts and not self.flat)

    @property
    def frame(self) -> str:
        """``sphere``, ``plane`` or ``solid``, as snapshots and ``target.json`` say."""
        return "plane" if self.flat else "solid" if self.solid else "sphere"

    @property
    def impact_point(self) -> tuple[float, float, float]:
        """Where the projectile hits [m], before relaxation."""
        return (0.0, 0.0, 0.0 if self.flat else self.placed.height if self.solid else self.radius)

    @property
    def half_width(self) -> float:
        """Half the width of flat ground [m]."""
        if self.shape == "half_sphere":
            return self.radius
        return 0.5 * self.width if self.width is not None else self.radius

    @property
    def outer_radii(self) -> tuple[float, ...]:
        """Outer radius of each layer, in flat ground the height of its top above the bottom [m], before relaxation."""
        radii, r = [], 0.0
        for layer in self.layers:
            r += layer.thickness
            radii.append(r)
        return tuple(radii)

    @property
    def radius(self) -> float:
        """Radius of the body (of an ellipsoid or mesh: of the ball of its volume), in flat ground its depth [m],
        before relaxation."""
        return self.outer_radii[-1]

    def layer_of(self, diameter: float) -> Layer:
        """The layer in which the middle of a crater of ``diameter`` [m] lies (``MIDDLE``): its scaling laws, strength
        and times are taken for the whole crater."""
        below = MIDDLE * diameter
        for layer in reversed(self.layers):
            below -= layer.thickness
            if below < 0.0:
                return layer
        return self.layers[0]

    @property
    def materials(self) -> tuple[str, ...]:
        """Distinct materials, in order of first use from the centre."""
        return tuple(dict.fromkeys(layer.material for layer in self.layers))

    @property
    def block_materials(self) -> tuple[str, ...]:
        """Materials of the blocks."""
        return tuple(dict.fromkeys(table.material for table in self.blocks))


class Part(Model):
    """A part of a projectile that is no ball: it flies with the others, and meets the ground on its own."""

    share: Annotated[float, Field(gt=0, le=1)]
    """Mass of the part over that of the whole; those of all parts add up to 1."""
    material: str | None = None
    """Material of the part; by default that of the projectile."""
    size: tuple[PositiveLength, PositiveLength, PositiveLength] | None = None
    """Edges of a box: along the flight, horizontally across it, and perpendicular to both. By default the part is a
    ball of its material at its own density. Matter that does not fill it becomes pellets with gaps between them."""
    offset: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    """Position of its centre along the flight, across it and up, from any common origin: only the distances between
    parts matter, because their centre of mass flies to the site."""

    @field_validator("material")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        return name if name is None else known_material(name)


class Projectile(Model):
    """A uniform sphere, or several parts of the same total mass."""

    material: str
    """Material of the projectile (``run_case --list`` names them all)."""
    radius: PositiveLength
    """Radius of the projectile, or, if it has parts, of a ball of their total mass."""
    parts: tuple[Part, ...] = ()
    """What it is made of, ``[[impact.projectile.parts]]``: a spacecraft's body and its panels, say; by default it is
    the ball itself."""

    _known = field_validator("material")(known_material)

    @field_validator("parts")
    @classmethod
    def _whole(cls, parts: tuple[Part, ...]) -> tuple[Part, ...]:
        total = math.fsum(part.share for part in parts)
        if parts and abs(total - 1.0) > 1e-6:
            raise ValueError(f"the shares of all parts must add up to 1, they add up to {total:.6g}")
        return parts

    def material_of(self, part: Part) -> str:
        """Material of a part."""
        return part.material or self.material

    @property
    def materials(self) -> tuple[str, ...]:
        """Distinct materials, that of the ball first."""
        return tuple(dict.fromkeys([self.material, *(self.material_of(part) for part in self.parts)]))

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return 4.0 / 3.0 * math.pi * self.radius**3


class Impact(Model):
    """How the projectile hits."""

    speed: PositiveSpeed
    """Speed at contact; left out, it is what the encounters of ``[nbody]`` find."""
    angle_from_vertical: Angle
    """Angle of the trajectory from the vertical at contact: 0 is head-on, 90 deg grazing; left out, it is what the
    encounters of ``[nbody]`` find."""
    projectile: Projectile
    """What hits, ``[impact.projectile]``."""
    expected_transient_diameter: PositiveLength
    """Sets the extent of flat ground, the fine zone of the particles, the bed and the length of runs where the case
    leaves them open; it does not enter the physics. If it is left out, scaling laws give it."""

    @field_validator("speed")
    @classmethod
    def _slower_than_light(cls, speed: float) -> float:
        if speed >= LIGHT:
            raise ValueError(f"{speed:.4g} m/s is faster than light")
        return speed

    @field_validator("angle_from_vertical")
    @classmethod
    def _downwards(cls, angle: float) -> float:
        if not 0.0 <= angle < math.radians(90.0):
            raise ValueError(
                f"must be at least 0 and less than 90 deg (given: {math.degrees(angle):.4g} deg; 0 is straight down)"
            )
        return angle

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Velocity of the projectile [m/s]."""
        a = self.angle_from_vertical
        return (self.speed * math.sin(a), 0.0, -self.speed * math.cos(a))
