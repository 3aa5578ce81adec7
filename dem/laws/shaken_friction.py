"""Friction that grains lose while their ground shakes: the block model of acoustic fluidisation as in the shock stage
(``sph.strength.block_model``), for grains, which are all broken rock.

    dv_vib/dt = -v_vib / T_dec
    p_vib = max(min(P, rho c v_vib), 0)
    |F_t| <= mu_s f |F_n|,    |M_r| <= mu_r beta R f |F_n|,    |M_t| <= mu_t mu_s beta R f |F_n|,    f = 1 - p_vib / P

v_vib [m/s] the speed of the vibration, T_dec [s] its decay time, P [Pa] the pressure on the grain, rho [kg/m^3] the
bulk density of what it fills, c [m/s] the speed of sound of its material at rest; F_t, M_r and M_t of
``tangential_spring``, ``rolling_sds`` and ``twisting_sds``. f = 1 without vibration and where nothing bears on the
grain. A contact takes the smaller f of its two grains. On walls friction stays: floor and sides are where the grains
end, not the ground.

P is a grain's own, the third of the trace of its stress, P = sum_c F_n l_c / (3 V): normal forces of its springs (no
dashpots, no cohesion) times their arms l_c from its centre to the plane of contact, over the volume V = m / rho that
it fills. It is what the shock stage calls P, and sums over grains to the virial of the whole. (F_n over an area of
each contact would leave friction where there should be none: forces between grains scatter, some carry several times
the mean, and those are the ones that hold a slope.)

Not there: the growth of v_vib, which belongs to the shock, and the viscosity of the shock stage: grains that flow lose
energy in their collisions instead. A heap loses less than its contacts: spheres without any friction keep an angle of
some 6 degrees.

Source: Wuennemann & Ivanov 2003, Planet. Space Sci. 51, 831, as ``sph.strength.block_model`` reads it. LIGGGHTS: none;
LAMMPS: none.
"""

from __future__ import annotations

import math

from matter.compilation.jit import law

SOURCES = ("WuennemannIvanov2003", "MeloshIvanov1999")
LEAST = 1e-9
"""Smallest f. With exactly 0 the contact would drop its tangential spring."""


@law
def speed_after(v_vib, time, decay_time):
    """v_vib [m/s] after a ``time`` [s]."""
    return v_vib * math.exp(-time / decay_time)


@law
def bearing_fraction(v_vib, P, rho, sound):
    """f, the fraction of the normal force that friction is made of, under a pressure P [Pa]; at least ``LEAST``."""
    if P <= 0.0:
        return 1.0
    return max(1.0 - rho * sound * v_vib / P, LEAST)
