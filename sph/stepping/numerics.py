"""How the equations of the shock stage are solved: the numerical keys of ``[sph]``, and what the loops over pairs are
compiled for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from matter.case.body import Model
from matter.case.identity_fields import Follows
from sph.kernels import dispatch as kernels
from sph.pairs import lattice_gradients
from sph.pairs.scheme import Scheme

if TYPE_CHECKING:
    KernelName = str
else:
    KernelName = Literal.__getitem__(kernels.FAMILY.names)


SETS: dict[str, dict[str, Any]] = {
    "monaghan": {
        "viscosity": "monaghan", "alpha": 2.0, "beta": 10.0, "courant": 0.3, "kernel": "cubic_spline", "support": 2.0,
        "volumes": "present", "smoothing": "fixed", "shortest": 0.5, "length_terms": False, "gradients": "plain",
        "conductivity": 0.0,
    },
    "reconstructed": {
        "viscosity": "reconstructed", "alpha": 3.0, "beta": 10.0, "courant": 0.45, "kernel": "wendland",
        "support": 2.6,
        "volumes": "start", "smoothing": "density", "shortest": 0.7, "length_terms": True, "gradients": "normalised",
        "conductivity": 8.0,
    },
}  # fmt: skip
"""What the keys of ``[sph]`` take that a case leaves open, by its ``numerics``."""


def _of_set(key: str) -> Any:
    """A field that takes what the chosen set says."""
    return Field(default_factory=lambda given: SETS[given["numerics"]][key])


def _length_terms(given: dict[str, Any]) -> bool:
    able = given["volumes"] == "start" and given["smoothing"] == "density"
    return able and SETS[given["numerics"]]["length_terms"]


def _may_conduct(viscosity: str, switch: str, gradients: str) -> bool:
    """What ``sph.pairs.conductivity`` asks for: to know the smooth flow, and room in the extra rows
    (``sph.pairs.row``)."""
    return viscosity == "reconstructed" and switch == "none" and gradients != "corrected"


def _conductivity(given: dict[str, Any]) -> float:
    able = _may_conduct(given["viscosity"], given["viscosity_switch"], given["gradients"])
    return SETS[given["numerics"]]["conductivity"] if able else 0.0


class Numerics(Model):
    """Numerical choices of the shock stage."""

    numerics: Literal["monaghan", "reconstructed"] = "reconstructed"
    """A set of choices that were measured together; single keys go before. ``monaghan``: viscosity = "monaghan",
    alpha = 2, beta = 10, courant = 0.3, kernel = "cubic_spline", support = 2, volumes = "present", smoothing =
    "fixed", shortest = 0.5, length_terms = false, gradients = "plain", conductivity = 0. ``reconstructed``: viscosity
    = "reconstructed", alpha = 3, beta = 10, courant = 0.45, kernel = "wendland", support = 2.6, volumes = "start",
    smoothing = "density", shortest = 0.7, length_terms = true, gradients = "normalised", conductivity = 8 (smooth flow
    hardly feels its viscosity; twice the neighbours)."""
    viscosity: Annotated[Literal["monaghan", "reconstructed"], Follows()] = _of_set("viscosity")
    """Artificial viscosity of ``monaghan`` (``sph.viscosity``), or of ``reconstructed`` velocity jumps, which smooth
    flow hardly feels (``sph.viscosity.reconstructed``); that of ``numerics``."""
    alpha: Annotated[float, Field(ge=0, le=10)] = _of_set("alpha")
    """Linear coefficient of the artificial viscosity; by default that of ``numerics``."""
    beta: Annotated[float, Field(ge=0, le=50)] = _of_set("beta")
    """Quadratic coefficient of the artificial viscosity; by default that of ``numerics``."""
    courant: Annotated[float, Field(gt=0, le=1)] = _of_set("courant")
    """Courant factor of the time step; by default that of ``numerics``."""
    theta: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Opening angle of the gravity tree (smaller is more accurate)."""
    gravity_shift: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Gravity is evaluated again once a bound particle has moved this fraction of its support radius (0: at every
    step)."""
    kernel: Annotated[KernelName, Follows()] = _of_set("kernel")
    """Kernel of the SPH sums; that of ``numerics``."""
    support: Annotated[float, Field(ge=1.6, le=4.0), Follows()] = _of_set("support")
    """Support radius of the kernel over the particle spacing; that of ``numerics``."""
    volumes: Annotated[Literal["present", "start"], Follows()] = _of_set("volumes")
    """Weights of the sums: the ``present`` volumes, or those of the ``start`` (right behind strong shocks;
    ``sph.pairs.start_volumes``); those of ``numerics``."""
    smoothing: Annotated[Literal["fixed", "density"], Follows()] = _of_set("smoothing")
    """Smoothing lengths: ``fixed`` at their first value, or following the ``density`` between ``shortest`` and
    ``longest`` times it (``sph.pairs.smoothing``); those of ``numerics``."""
    shortest: Annotated[float, Field(gt=0.2, le=1), Follows()] = _of_set("shortest")
    """With ``smoothing = "density"``: least smoothing length over its first value; by default that of ``numerics``. A
    shock squeezes matter in one direction: where it does so by four (loose porous ice) particles keep too few
    neighbours beside them with 0.5, and P comes out 3 % low."""
    longest: Annotated[float, Field(ge=1, le=4), Follows()] = 2.0
    """With ``smoothing = "density"``: largest smoothing length over its first value."""
    length_terms: Annotated[bool, Follows()] = Field(default_factory=_length_terms)
    """With ``volumes = "start"`` and ``smoothing = "density"``: include what the change of smoothing lengths adds to
    the density's rate (``sph.pairs.length_terms``); by default, where both are so, that of ``numerics``."""
    gradients: Literal["plain", "normalised", "corrected"] = _of_set("gradients")
    """``plain``; ``normalised``, exact in an undisturbed lattice (for bodies in balance and waves;
    ``sph.pairs.lattice_gradients``); ``corrected`` in force, density and heat too (for thin shells and spinning
    bodies, not for strong shocks; ``sph.pairs.gradients``); by default that of ``numerics``."""
    viscosity_switch: Literal["none", "morris_monaghan"] = "none"
    """``none``: full viscosity everywhere; ``morris_monaghan``: a twentieth of it where nothing has been compressed
    (``sph.viscosity.morris_monaghan``)."""
    conductivity: Annotated[float, Field(ge=0, le=20), Follows()] = Field(default_factory=_conductivity)
    """Coefficient of the artificial conductivity, which spreads what a strong shock's first step heats too much
    (``sph.pairs.conductivity``; 0: none). Needs ``viscosity = "reconstructed"`` without ``viscosity_switch`` and
    without corrected gradients; by default, where all are so, that of ``numerics``."""

    @property
    def scheme(self) -> Scheme:
        """What the loops over pairs are compiled for."""
        return Scheme(
            kernel=kernels.FAMILY.kind(self.kernel),
            start_volumes=self.volumes == "start",
            corrected=self.gradients == "corrected",
            switched=self.viscosity_switch != "none",
            reconstructed=self.viscosity == "reconstructed",
            conducting=self.conductivity > 0.0,
        )

    @property
    def conducts(self) -> bool:
        """Whether these choices allow a ``conductivity``."""
        return _may_conduct(self.viscosity, self.viscosity_switch, self.gradients)

    @property
    def limits_of_length(self) -> tuple[float, float] | None:
        """Least and largest smoothing length over its first value; None where it stays."""
        return (self.shortest, self.longest) if self.smoothing == "density" else None

    @property
    def gradient_scale(self) -> float:
        """What all gradients are multiplied by (``sph.pairs.lattice_gradients``)."""
        return lattice_gradients.scale(self.support, self.kernel) if self.gradients == "normalised" else 1.0
