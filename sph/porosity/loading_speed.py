"""Speed of the compaction wave in porous material.

While pores close along the crush curve, d alpha / d rho = (f - 1) alpha / rho (f: strain of the matrix over that of
the whole, ``sph.porosity``), the pressure P = P_s(alpha rho, u) / alpha rises without heat from outside, du / d rho =
P / rho^2, by

    c_l^2 = dP / d rho = f dP_s/drho + h + (1 - f) P / rho,      h = P / (alpha rho^2) dP_s/du

against c^2 = dP_s/drho + h where they stay. Weak ground has f of some hundredths, so that a wave of compaction runs at
a tenth to a third of the speed of sound. The linear term of artificial viscosity, alpha c v, has to go by c_l: by c it
spreads the front over c / c_l times as many particles, which slows the flow behind it and leaves pores open. Measured
against a Lagrangian code of one dimension: docs/results/porous_source.
"""

from matter.compilation.jit import law


@law
def squared(d_rho, heating, P, rho, f):
    """c_l^2 [m^2/s^2], from dP_s/drho of the matrix and the ``heating`` h [m^2/s^2], the pressure P [Pa] and density
    rho [kg/m^3] of the porous material, and f."""
    return f * d_rho + heating + (1.0 - f) * max(P, 0.0) / rho
