"""How the equations of the shock stage are solved: the numerical keys of ``[sph]``, and what the loops over pairs are compiled for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from matter.body import Model
from sph import lattice_gradients
from sph.kernels import dispatch as kernels
from sph.scheme import Scheme

if TYPE_CHECKING:
    KernelName = str
else:
    KernelName = Literal.__getitem__(kernels.FAMILY.names)


class Numerics(Model):
    """Numerical choices of the shock stage."""

    viscosity: Literal["monaghan", "reconstructed"] = "monaghan"
    """Artificial viscosity of ``monaghan`` (``sph.viscosity``), or of ``reconstructed`` velocity jumps, which smooth flow hardly feels
    (``sph.viscosity_reconstructed``; with alpha = 3, beta = 10)."""
    alpha: Annotated[float, Field(ge=0, le=10)] = 2.0
    """Linear coefficient of the artificial viscosity."""
    beta: Annotated[float, Field(ge=0, le=50)] = 10.0
    """Quadratic coefficient of the artificial viscosity."""
    courant: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Courant factor of the time step."""
    theta: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Opening angle of the gravity tree (smaller is more accurate)."""
    gravity_shift: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Gravity is evaluated again once a bound particle has moved this share of its smoothing length (0: at every step)."""
    kernel: KernelName = "cubic_spline"
    """Kernel of the SPH sums."""
    support: Annotated[float, Field(ge=1.6, le=4.0)] = 2.0
    """Support radius of the kernel over the particle spacing."""
    volumes: Literal["present", "start"] = "present"
    """Weights of the sums: the ``present`` volumes, or those of the ``start`` (right behind strong shocks; ``sph.start_volumes``)."""
    smoothing: Literal["fixed", "density"] = "fixed"
    """Smoothing lengths: ``fixed`` at their first value, or following the ``density`` between ``shortest`` and ``longest`` times it (``sph.smoothing``)."""
    shortest: Annotated[float, Field(gt=0.2, le=1)] = 0.5
    """With ``smoothing = "density"``: least smoothing length over its first value."""
    longest: Annotated[float, Field(ge=1, le=4)] = 2.0
    """With ``smoothing = "density"``: largest smoothing length over its first value."""
    length_terms: bool = False
    """With ``volumes = "start"`` and ``smoothing = "density"``: include what the change of smoothing lengths adds to the density's rate
    (``sph.length_terms``)."""
    rim: Literal["own", "stressed"] = "own"
    """Stress of the fixed rim: ``own``, that of the start, which passes on half of a shear stress; or ``stressed`` as what leans on it
    (``sph.boundary.stressed_rim``)."""
    gradients: Literal["plain", "normalised", "corrected"] = "plain"
    """``plain``; ``normalised``, exact in an undisturbed lattice (for bodies in balance and waves; ``sph.lattice_gradients``); ``corrected`` in force, density
    and heat too (for thin shells and spinning bodies, not for strong shocks; ``sph.gradients``)."""
    viscosity_switch: Literal["none", "balsara", "morris_monaghan"] = "none"
    """``none``: full viscosity everywhere; ``balsara``: less of it in shear (``sph.viscosity_balsara``); ``morris_monaghan``: a twentieth of it where nothing
    has been compressed (``sph.viscosity_morris_monaghan``)."""
    artificial_stress: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Strength of the repulsion that keeps particles from clumping in tension (``sph.artificial_stress``; 0: none)."""
    integrator: Literal["leapfrog", "rk3"] = "leapfrog"
    """Time integration: ``leapfrog`` (``sph.integrator``), or ``rk3`` with errors of a step below ``tolerance`` (``sph.runge_kutta``)."""
    tolerance: Annotated[float, Field(gt=0, le=0.1)] = 1e-5
    """With ``integrator = "rk3"``: largest relative error of a step."""

    @property
    def scheme(self) -> Scheme:
        """What the loops over pairs are compiled for."""
        return Scheme(
            kernel=kernels.FAMILY.kind(self.kernel),
            start_volumes=self.volumes == "start",
            corrected=self.gradients == "corrected",
            switched=self.viscosity_switch != "none",
            artificial_stress=self.artificial_stress > 0.0,
            reconstructed=self.viscosity == "reconstructed",
        )

    @property
    def limits_of_length(self) -> tuple[float, float] | None:
        """Least and largest smoothing length over its first value; None where it stays."""
        return (self.shortest, self.longest) if self.smoothing == "density" else None

    @property
    def gradient_scale(self) -> float:
        """What all gradients are multiplied by (``sph.lattice_gradients``)."""
        return lattice_gradients.scale(self.support, self.kernel) if self.gradients == "normalised" else 1.0
