"""Which porosity law a material has, chosen by ``kind`` and fed from a row of numbers: ``p_alpha.Pores`` or ``strain_alpha.Parameters`` in their order."""

from matter.jit import law
from sph.eos import dispatch
from sph.porosity import crush, p_alpha, strain_alpha

LAWS = ("none", "p_alpha", "strain_alpha")
WIDTH = 5
NONE, P_ALPHA, STRAIN_ALPHA = range(3)


@law
def compact(kind, pores, curve, curve_row, eos_kind, eos_row, rho, u, rest, crushing):
    """The distention of a particle of bulk density rho [kg/m^3] and specific energy u [J/kg] that would rest at ``rest``.

    Returns alpha; the new resting distention (never above the old); f of the matrix strain for compression and for expansion; and the sound speed over that
    of the matrix.
    """
    if rest <= 1.0:
        return 1.0, 1.0, 1.0, 1.0, 1.0
    if kind == STRAIN_ALPHA:
        q = strain_alpha.Parameters(pores[0], pores[1], pores[2], pores[3])
        strain = strain_alpha.volume_strain(rho, eos_row[0], q)
        alpha = strain_alpha.distention(strain, q)
        if crushing and alpha <= rest:
            return alpha, alpha, strain_alpha.strain_factor(strain, q), 1.0, 1.0
        return rest, rest, 1.0, 1.0, 1.0
    p = p_alpha.Pores(pores[0], pores[1], pores[2], pores[3], pores[4])
    alpha, rest, loading = p_alpha.distention(rho, u, rest, eos_kind, eos_row, curve, curve_row, p, crushing)
    if alpha <= 1.0:
        return 1.0, rest, 1.0, 1.0, 1.0
    elastic = p_alpha.strain_factor(rho, u, alpha, p_alpha.elastic_slope(alpha, p), eos_kind, eos_row, p)
    loaded = elastic
    if loading:
        P = p_alpha.bulk_pressure(alpha, rho, 0.0 if p.cold > 0.0 else u, eos_kind, eos_row)
        loaded = p_alpha.strain_factor(rho, u, alpha, (p.start - 1.0) * crush.slope(curve, curve_row, P), eos_kind, eos_row, p)
    return alpha, rest, loaded, elastic, p_alpha.speed_factor(alpha, p)


@law
def at_pressure(kind, pores, curve, curve_row, eos_kind, eos_row, P):
    """The cold material under the pressure P >= 0 [Pa], loaded from rest: bulk density [kg/m^3], and the distention that it would rest at."""
    alpha, rest = 1.0, 1.0
    if kind == P_ALPHA and pores[0] > 1.0:
        p = p_alpha.Pores(pores[0], pores[1], pores[2], pores[3], pores[4])
        alpha, rest = p_alpha.along_elastic(p.alpha0, P, p), p.alpha0
        if P > crush.onset(curve, curve_row):
            alpha = p_alpha.on_curve(P, curve, curve_row, p)
            rest = min(max(p_alpha.along_elastic(alpha, -P, p), 1.0), p.alpha0) if alpha > 1.0 else 1.0
    elif kind == STRAIN_ALPHA and pores[0] > 1.0:
        q = strain_alpha.Parameters(pores[0], pores[1], pores[2], pores[3])
        low, high = 0.5 * eos_row[0] / q.alpha0, 2.0 * dispatch.density(eos_kind, eos_row, q.alpha0 * P, 0.0)
        for _ in range(100):
            rho = 0.5 * (low + high)
            alpha = strain_alpha.distention(strain_alpha.volume_strain(rho, eos_row[0], q), q)
            if dispatch.pressure_and_derivatives(eos_kind, eos_row, alpha * rho, 0.0)[0] / alpha > P:
                high = rho
            else:
                low = rho
        return 0.5 * (low + high), alpha
    return dispatch.density(eos_kind, eos_row, alpha * P, 0.0) / alpha, rest
