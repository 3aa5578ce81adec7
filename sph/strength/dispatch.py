"""Which yield law a material has, chosen by ``kind`` and fed from a row of numbers.

A law file defines ``yield_stress``, the flag ``MIXES_DAMAGE`` (whether damage stands in it; else damage takes the
shear stress as a whole), where its surface ends in tension ``apex``, and where plastic strain hardens it (``HARDENS``)
``hardening``. ``RUBS`` says that pressure raises it, so that ``inertial_friction`` can.
"""

from matter.compilation.law_family import Family
from sph.strength import collins, drucker_prager, johnson_cook, von_mises

FAMILY = Family("strength", "yield law", (von_mises, drucker_prager, collins, johnson_cook), none=True)

yield_stress = FAMILY.choose(
    "yield_stress",
    "P, u, D",
    otherwise="0.0",
    about="The limit of sqrt(3 J2) [Pa] at pressure P [Pa], specific energy u [J/kg] and damage D; 0 for a material "
    "without strength.",
)
hardening = FAMILY.choose(
    "hardening", "strain", otherwise="1.0", about="The factor of the yield stress at a plastic strain; 1 without any."
)
apex = FAMILY.choose(
    "apex",
    "u, D",
    otherwise="1e300",
    about="The tension [Pa] at which the yield surface ends; 1e300 where it does not.",
)
