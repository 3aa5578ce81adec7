"""Systems of units that other codes' files declare: what a value is multiplied with to be in SI.

A system is three numbers, the units of length, mass and time in m, kg and s. A quantity of the dimension L^a M^b T^c
is multiplied with length^a mass^b time^c; temperatures stay in kelvin, angles in radians.
"""

from __future__ import annotations

from typing import NamedTuple

from matter.errors import InputError
from matter.formats.words import short

_DIMENSIONS = {
    "m": (1, 0, 0),
    "m/s": (1, 0, -1),
    "m/s^2": (1, 0, -2),
    "rad/s": (0, 0, -1),
    "kg": (0, 1, 0),
    "kg/m^3": (-3, 1, 0),
    "J/kg": (2, 0, -2),
    "J/(kg K)": (2, 0, -2),
    "Pa": (-1, 1, -2),
    "N/m": (0, 1, -2),
    "s": (0, 0, 1),
    "K": (0, 0, 0),
    "1": (0, 0, 0),
}
"""Exponents of length, mass and time in the SI units of ``matter.particles.FIELDS``."""


class UnitSystem(NamedTuple):
    """Units of length [m], mass [kg] and time [s], and what the file calls them."""

    length: float
    mass: float
    time: float
    name: str

    def factor(self, si: str) -> float:
        """What a value is multiplied with to be in the SI unit ``si``."""
        a, b, c = _DIMENSIONS[si]
        return self.length**a * self.mass**b * self.time**c


SI = UnitSystem(1.0, 1.0, 1.0, "si")
CGS = UnitSystem(1e-2, 1e-3, 1.0, "cgs")
# LAMMPS, "units": the styles whose derived units follow from those of length, mass and time
_STYLES = {
    "si": SI,
    "cgs": CGS,
    "micro": UnitSystem(1e-6, 1e-15, 1e-6, "micro"),
    "nano": UnitSystem(1e-9, 1e-21, 1e-9, "nano"),
}


def style(name: str, where: str) -> UnitSystem:
    """The system of a LAMMPS unit style. Raises ``InputError`` for one that is not of length, mass and time alone
    (``lj``, ``real``, ``metal``, ``electron``)."""
    if name not in _STYLES:
        raise InputError(
            f"{where}: its units are those of the style {short(name)}; read are {', '.join(_STYLES)}. Where its "
            f"numbers are SI all the same, write 'si' there"
        )
    return _STYLES[name]
