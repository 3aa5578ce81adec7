"""Which yield law a material has, chosen by ``kind`` and fed from a row of numbers.

A row holds the values of the law's ``Parameters`` in their order; for Drucker-Prager those of its ``Cone``.
"""

from matter.jit import law
from sph.strength import collins, drucker_prager, von_mises

LAWS = ("none", "von_mises", "drucker_prager", "collins")
PARAMETERS = (None, von_mises.Parameters, drucker_prager.Parameters, collins.Parameters)
WIDTH = 6
NONE, VON_MISES, DRUCKER_PRAGER, COLLINS = range(4)
SQRT3 = 1.7320508075688772


@law
def yield_stress(kind, row, P, u, D):
    """The limit of sqrt(3 J2) [Pa] at pressure P [Pa], specific energy u [J/kg] and damage D; 0 for a material without strength."""
    if kind == VON_MISES:
        return von_mises.yield_stress(u, von_mises.Parameters(row[0], row[1]))
    if kind == DRUCKER_PRAGER:
        return SQRT3 * drucker_prager.shear_strength(P, u, D, drucker_prager.Cone(row[0], row[1], row[2]))
    if kind == COLLINS:
        return SQRT3 * collins.shear_strength(P, u, D, collins.Parameters(row[0], row[1], row[2], row[3], row[4], row[5]))
    return 0.0


@law
def apex(kind, row, D):
    """The tension [Pa] at which the yield surface ends; 1e300 where it does not."""
    if kind == DRUCKER_PRAGER:
        return drucker_prager.apex(D, drucker_prager.Cone(row[0], row[1], row[2]))
    return 1e300
