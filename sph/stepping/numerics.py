"""How the equations of the shock stage are solved: the numerical keys of ``[sph]``, and what the loops over pairs are
compiled for."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from matter.case.body import Model
from sph.kernels import dispatch as kernels
from sph.pairs import lattice_gradients
from sph.pairs.scheme import Scheme
from sph.stepping import timestep

SETS: dict[str, dict[str, Any]] = {
    "monaghan": {
        "alpha": 2.0, "beta": 10.0, "courant": 0.3, "gradients": "plain", "kernel": "cubic_spline", "support": 2.0,
        "conductivity": 0.0,
    },
    "reconstructed": {
        "alpha": 3.0, "beta": 10.0, "courant": 0.5, "gradients": "normalised", "kernel": "wendland", "support": 2.6,
        "conductivity": 8.0,
    },
}  # fmt: skip
"""Numbers and choices of each set: those of a key of ``[sph]`` are taken where a case leaves it open, ``kernel``,
``support`` (radius over the particle spacing) and ``conductivity`` always."""

LIMITS_OF_LENGTH = (0.7, 2.0)
"""Least and largest smoothing length over its first value, where it follows the density. A shock squeezes matter in
one direction: where it does so by four (loose porous ice) particles keep too few neighbours beside them with 0.5, and
P comes out 3 % low."""


def _of_set(key: str) -> Any:
    """A field that takes what the chosen set says."""
    return Field(default_factory=lambda given: SETS[given["numerics"]][key])


class Numerics(Model):
    """Numerical choices of the shock stage."""

    numerics: Literal["monaghan", "reconstructed"] = "reconstructed"
    """A set of choices that were measured together; single keys override it. ``monaghan``: alpha = 2, beta = 10,
    courant = 0.3, gradients = "plain", kernel = "cubic_spline", support = 2, conductivity = 0, with Monaghan's
    viscosity (``sph.viscosity``), present volumes and fixed smoothing lengths. ``reconstructed``: alpha = 3, beta =
    10, courant = 0.5, gradients = "normalised", kernel = "wendland", support = 2.6, conductivity = 8, with the
    viscosity of reconstructed velocity jumps, which smooth flow hardly feels (``sph.viscosity.reconstructed``), the
    volumes of the start (right behind strong shocks; ``sph.pairs.start_volumes``) and smoothing lengths that follow
    the density (``sph.pairs.smoothing``, ``length_terms``); twice the neighbours."""
    alpha: Annotated[float, Field(ge=0, le=10)] = _of_set("alpha")
    """Linear coefficient of the artificial viscosity; by default that of ``numerics``."""
    beta: Annotated[float, Field(ge=0, le=50)] = _of_set("beta")
    """Quadratic coefficient of the artificial viscosity; by default that of ``numerics``."""
    courant: Annotated[float, Field(gt=0, le=1)] = _of_set("courant")
    """Courant factor of the time step; by default that of ``numerics``."""
    gravity_shift: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Gravity is evaluated again once a bound particle has moved this fraction of its support radius (0: at every
    step)."""
    gradients: Literal["plain", "normalised", "corrected"] = _of_set("gradients")
    """``plain``; ``normalised``, exact in an undisturbed lattice (for bodies in balance and waves;
    ``sph.pairs.lattice_gradients``); ``corrected`` in force, density and heat too (for thin shells and spinning
    bodies, not for strong shocks; ``sph.pairs.gradients``); by default that of ``numerics``."""
    viscosity_switch: Literal["none", "morris_monaghan"] = "none"
    """``none``: full viscosity everywhere; ``morris_monaghan``: a twentieth of it where nothing has been compressed
    (``sph.viscosity.morris_monaghan``)."""

    @property
    def reconstructed(self) -> bool:
        """Whether the set is ``reconstructed``."""
        return self.numerics == "reconstructed"

    @property
    def kernel(self) -> str:
        """Kernel of the SPH sums."""
        return str(SETS[self.numerics]["kernel"])

    @property
    def support(self) -> float:
        """Support radius of the kernel over the particle spacing."""
        return float(SETS[self.numerics]["support"])

    @property
    def conductivity(self) -> float:
        """Coefficient of the artificial conductivity, which spreads what a strong shock's first step heats too much
        (``sph.pairs.conductivity``); 0 where the scheme has none."""
        return float(SETS[self.numerics]["conductivity"]) if self.scheme.conducting else 0.0

    @property
    def signal(self) -> timestep.Signal:
        """What the viscosity adds to the signal speed of the time step."""
        return timestep.RECONSTRUCTED if self.reconstructed else timestep.MONAGHAN

    @property
    def scheme(self) -> Scheme:
        """What the loops over pairs are compiled for."""
        return Scheme(
            kernel=kernels.FAMILY.kind(self.kernel),
            reconstructed=self.reconstructed,
            corrected=self.gradients == "corrected",
            switched=self.viscosity_switch != "none",
        )

    @property
    def limits_of_length(self) -> tuple[float, float] | None:
        """``LIMITS_OF_LENGTH``; None where the smoothing lengths stay."""
        return LIMITS_OF_LENGTH if self.reconstructed else None

    @property
    def gradient_scale(self) -> float:
        """What all gradients are multiplied by (``sph.pairs.lattice_gradients``)."""
        return lattice_gradients.scale(self.support, self.kernel) if self.gradients == "normalised" else 1.0
