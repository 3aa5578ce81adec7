"""Stress deviator of the grid code: elastic up to the yield law of the shock stage, as friction is.

    Ds/Dt = 2 G f dev(E) / alpha + W s - s W,   sqrt(3 J2) <= Y(P),   E, W: rate of strain and spin
    d(rho v)/dt = div s,   dE/dt = div(s v)

after each pair of sweeps of ``godunov``, which carry rho s with the matter. E and W are central differences between
cells with matter; stress and velocity at a face are the means of both cells, the stress is zero where one is empty.
f : ratio of strains of the pores (``sph.porosity``).
"""

from __future__ import annotations

import math

from matter.compilation.jit import kernel, law
from studies.eulerian.godunov import ACROSS_R, ALONG_Z, CLOSING, ENERGY, LIMIT, OPENING, RHO, SHEARED, VR, VZ

RR, ZZ, RZ = range(3)
"""Components of the deviator; that around the axis is -(rr + zz)."""


@law
def gradient(before, here, after, filled_before, filled_after, h):
    """Difference over ``h`` between neighbours that hold matter."""
    if filled_before and filled_after:
        return 0.5 * (after - before) / h
    if filled_after:
        return (after - here) / h
    return (here - before) / h if filled_before else 0.0


@kernel
def strain(conserved, state, h, dt):
    """Deviators in ``conserved`` (nr, nz, 8) after ``dt`` [s] of the flow in ``state`` in cells of size ``h`` [m]."""
    nr, nz = state.shape[0], state.shape[1]
    for i in range(nr):
        r = (i + 0.5) * h
        for k in range(nz):
            here = state[i, k]
            rho = here[RHO]
            if rho <= 0.0 or here[LIMIT] <= 0.0:
                for n in range(3):
                    conserved[i, k, SHEARED + n] = 0.0
                continue
            inner, outer = state[max(i - 1, 0), k], state[min(i + 1, nr - 1), k]
            lower, upper = state[i, max(k - 1, 0)], state[i, min(k + 1, nz - 1)]
            mirrored = -here[VR] if i == 0 else inner[VR]
            has_outer, has_lower = i < nr - 1 and outer[RHO] > 0.0, k > 0 and lower[RHO] > 0.0
            has_upper = k < nz - 1 and upper[RHO] > 0.0
            rr = gradient(mirrored, here[VR], outer[VR], i == 0 or inner[RHO] > 0.0, has_outer, h)
            zr = gradient(inner[VZ], here[VZ], outer[VZ], i == 0 or inner[RHO] > 0.0, has_outer, h)
            rz = gradient(lower[VR], here[VR], upper[VR], has_lower, has_upper, h)
            zz = gradient(lower[VZ], here[VZ], upper[VZ], has_lower, has_upper, h)
            third, spin = (rr + zz + here[VR] / r) / 3.0, 0.5 * (rz - zr)
            held = conserved[i, k, SHEARED:]
            s_rr, s_zz, s_rz = held[RR] / rho, held[ZZ] / rho, held[RZ] / rho
            twice = 2.0 * dt * (here[CLOSING] if third < 0.0 else here[OPENING])
            a = s_rr + twice * (rr - third) + 2.0 * spin * s_rz * dt
            b = s_zz + twice * (zz - third) - 2.0 * spin * s_rz * dt
            c = s_rz + twice * 0.5 * (rz + zr) + spin * (s_zz - s_rr) * dt
            size = math.sqrt(3.0 * (a * a + b * b + a * b + c * c))
            left = here[LIMIT] / size if size > here[LIMIT] else 1.0
            held[RR], held[ZZ], held[RZ] = rho * left * a, rho * left * b, rho * left * c


@law
def through(conserved, state, i, k, ni, nk, normal):
    """Traction (r, z) [Pa] and its power [W/m^2] at the face between the cells (i, k) and (ni, nk), at the edge of the
    block the same cell; ``normal``: RR where it faces along r, ZZ along z."""
    one, other = state[i, k], state[ni, nk]
    if one[RHO] <= 0.0 or other[RHO] <= 0.0:
        return 0.0, 0.0, 0.0
    along = 0.5 * (conserved[i, k, SHEARED + normal] / one[RHO] + conserved[ni, nk, SHEARED + normal] / other[RHO])
    shear = 0.5 * (conserved[i, k, SHEARED + RZ] / one[RHO] + conserved[ni, nk, SHEARED + RZ] / other[RHO])
    t_r, t_z = (along, shear) if normal == RR else (shear, along)
    return t_r, t_z, 0.5 * (t_r * (one[VR] + other[VR]) + t_z * (one[VZ] + other[VZ]))


@kernel
def accelerate(conserved, state, h, dt):
    """Momentum and energy after the deviators have acted for ``dt`` [s]."""
    nr, nz = state.shape[0], state.shape[1]
    for i in range(nr):
        r = (i + 0.5) * h
        for k in range(-1, nz):  # the face above the cell k
            below, above = max(k, 0), min(k + 1, nz - 1)
            t_r, t_z, power = through(conserved, state, i, below, i, above, ZZ)
            for n, value in ((ACROSS_R, t_r), (ALONG_Z, t_z), (ENERGY, power)):
                if k >= 0:
                    conserved[i, k, n] += value * dt / h
                if k < nz - 1:
                    conserved[i, k + 1, n] -= value * dt / h
        for k in range(nz):
            t_r, t_z, power = through(conserved, state, i, k, min(i + 1, nr - 1), k, RR)
            for n, value in ((ACROSS_R, t_r), (ALONG_Z, t_z), (ENERGY, power)):
                conserved[i, k, n] += value * (i + 1) * dt / r
                if i < nr - 1:
                    conserved[i + 1, k, n] -= value * (i + 1) * dt / (r + h)
            if state[i, k, RHO] > 0.0:  # what acts around the axis
                around = -(conserved[i, k, SHEARED] + conserved[i, k, SHEARED + ZZ]) / state[i, k, RHO]
                conserved[i, k, ACROSS_R] -= around * dt / r
