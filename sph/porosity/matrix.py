"""What a porosity law may ask of the solid around the pores when it makes its row of numbers."""

from typing import NamedTuple


class Matrix(NamedTuple):
    """rho0 [kg/m^3] and bulk modulus [Pa] of the solid at rest; the pressure at which its crush curve starts [Pa] (0:
    none)."""

    rho0: float
    bulk_modulus: float
    crush_onset: float = 0.0
