"""One sweep of a second-order Godunov scheme along r or z: Euler's equations for any equation of state.

    d(rho)/dt + div(rho v) = 0,   d(rho v)/dt + div(rho v v) + grad P = 0,   dE/dt + div((E + P) v) = 0

    E = rho (u + v^2 / 2),   P = P(rho, u) of ``sph.eos``, not below zero: matter here bears no tension

in cells about the axis of symmetry, by sweeps along r and z in turn (Strang 1968). A sweep reconstructs density,
velocities, pressure and specific energy by limited slopes (van Leer 1974), moves them on by half a step (Hancock), and
takes the flux between the two states at each face from the solver of Harten, Lax and van Leer with a contact (HLLC:
Toro, Spruce & Speares 1994, Shock Waves 4, 25). Pressure and energy are both reconstructed, so faces need no equation
of state and a contact stays at one pressure. Pores move with the matter: rho alpha is conserved but for what closes.
Empty cells have density zero. Friction: ``friction``. The code shares nothing with the particles of the shock stage
but the scalar laws of the material.
"""

from __future__ import annotations

import math

import numpy as np

from matter.compilation.jit import kernel, law
from sph.eos import dispatch
from sph.porosity import dispatch as porosity
from sph.strength import dispatch as strengths

MASS, ACROSS_R, ALONG_Z, ENERGY, DISTENDED, SHEARED = range(6)
"""Columns of what is conserved, a cubic metre: mass, both momenta, energy, rho alpha; where matter has friction rho
times the deviator's rr, zz, rz as well."""
RHO, VR, VZ, P, U, C, ALPHA, CLOSING, OPENING, LIMIT = range(10)
"""Columns of the state: density, velocities, pressure, specific energy, sound speed, distention; of matter with
friction the shear modulus while it is compressed and while it expands, and the largest sqrt(3 J2)."""
CARRIED = 6
"""First column of a line with what matter takes along: distention and deviator."""
REFLECTING, OPEN = 0, 1


@kernel
def states(conserved, state, material, empty):
    """Fills ``state`` (nr, nz, 10) from what is conserved (nr, nz, 5 or 8), closes pores; returns the fastest signal
    [m/s]. ``material``: kind and row of the equation of state, of the pores, of their crush curve, of the yield law,
    and the shear modulus [Pa], 0 without friction.

    A cell of no more than the density ``empty`` [kg/m^3] counts as empty: what it holds stays, until more comes.
    """
    fastest = 0.0
    kind, row, pores, pores_row, crush, crush_row, strength, strength_row, shear = material
    for i in range(conserved.shape[0]):
        for k in range(conserved.shape[1]):
            rho = conserved[i, k, MASS]
            if rho <= empty:
                for column in range(10):
                    state[i, k, column] = 0.0
                continue
            vr, vz = conserved[i, k, ACROSS_R] / rho, conserved[i, k, ALONG_Z] / rho
            u = max(conserved[i, k, ENERGY] / rho - 0.5 * (vr * vr + vz * vz), 0.0)
            alpha, slow, loading, unloading = max(conserved[i, k, DISTENDED] / rho, 1.0), 1.0, 1.0, 1.0
            if pores > 0:
                alpha, rest, loading, unloading, slow = porosity.compact(
                    pores, pores_row, crush, crush_row, kind, row, rho, u, alpha, True
                )
                conserved[i, k, DISTENDED] = rho * rest
            pressure, d_rho, d_u = dispatch.pressure_and_derivatives(kind, row, alpha * rho, u)
            pressure /= alpha
            d_u /= alpha
            c = slow * math.sqrt(max(d_rho + max(pressure, 0.0) / (rho * rho) * d_u, 0.0))
            if shear > 0.0 and pressure > 0.0:
                state[i, k, CLOSING], state[i, k, OPENING] = shear * loading / alpha, shear * unloading / alpha
                state[i, k, LIMIT] = strengths.yield_stress(strength, strength_row, alpha * pressure, u, 1.0) / alpha
                c = math.sqrt(c * c + 4.0 / 3.0 * state[i, k, OPENING] / rho)
            else:
                state[i, k, CLOSING] = state[i, k, OPENING] = state[i, k, LIMIT] = 0.0
            state[i, k, RHO], state[i, k, VR], state[i, k, VZ] = rho, vr, vz
            state[i, k, P], state[i, k, U], state[i, k, C] = max(pressure, 0.0), u, c
            state[i, k, ALPHA] = conserved[i, k, DISTENDED] / rho
            fastest = max(fastest, max(abs(vr), abs(vz)) + c)
    return fastest


@law
def limited(left, right):
    """Slope between the differences to both neighbours (van Leer 1974); 0 at an extremum."""
    product = left * right
    return 2.0 * product / (left + right) if product > 0.0 else 0.0


@law
def flux(rl, nl, tl, pl, ul, cl, rr, nr, tr, pr, ur, cr):
    """HLLC: flux of mass, momentum across the face, momentum along it, energy, between left and right states: density,
    velocity across and along the face, pressure, specific energy, sound speed."""
    if rl <= 0.0 and rr <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    if rl <= 0.0:  # matter leaves into empty space at its own speed
        rl, nl, tl, pl, ul, cl = 0.0, nr, tr, 0.0, 0.0, cr
    if rr <= 0.0:
        rr, nr, tr, pr, ur, cr = 0.0, nl, tl, 0.0, 0.0, cl
    slow, fast = min(nl - cl, nr - cr), max(nl + cl, nr + cr)
    into_left, into_right = rl * (nl - slow), rr * (fast - nr)
    if into_left + into_right <= 0.0:
        contact = 0.5 * (nl + nr)
    else:
        contact = (pl - pr + into_left * nl + into_right * nr) / (into_left + into_right)
    if contact >= 0.0:
        rho, n, t, p, u, edge = rl, nl, tl, pl, ul, slow
    else:
        rho, n, t, p, u, edge = rr, nr, tr, pr, ur, fast
    energy = rho * (u + 0.5 * (n * n + t * t))
    mass, normal, along, power = rho * n, rho * n * n + p, rho * n * t, (energy + p) * n
    between_waves = slow < 0.0 if contact >= 0.0 else fast > 0.0
    if between_waves and rho > 0.0 and edge != n and edge != contact:
        star = rho * (edge - n) / (edge - contact)
        inner = star * (energy / rho + (contact - n) * (contact + p / (rho * (edge - n))))
        mass += edge * (star - rho)
        normal += edge * (star * contact - rho * n)
        along += edge * (star - rho) * t
        power += edge * (inner - energy)
    return mass, normal, along, power


@law
def bound(line, n, ends):
    """Fills the two cells beyond either end of a line."""
    for g in range(2):
        for end in range(2):
            ghost = g if end == 0 else n + 3 - g
            if ends[end] == REFLECTING:
                inside = 3 - g if end == 0 else n + g
            else:
                inside = 2 if end == 0 else n + 1
            for column in range(line.shape[1]):
                line[ghost, column] = line[inside, column]
            if ends[end] == REFLECTING:
                line[ghost, 1] = -line[inside, 1]


@law
def reconstruct(line, n, area, volume, dt, low, high, middle):
    """States at both faces of the cells of a line after half a step, and the pressure at their middles."""
    for i in range(1, n + 3):
        before, here, after = line[i - 1], line[i], line[i + 1]
        edge_of_matter = before[0] <= 0.0 or after[0] <= 0.0
        rho, v, t, p, u, c = here[0], here[1], here[2], here[3], here[4], here[5]
        s_rho = limited(rho - before[0], after[0] - rho)
        s_v, s_t, s_p, s_u, moved = 0.0, 0.0, 0.0, 0.0, 0.0
        d_rho, d_v, d_t, d_p, d_u = 0.0, 0.0, 0.0, 0.0, 0.0
        if not edge_of_matter and rho > 0.0:
            s_v, s_t = limited(v - before[1], after[1] - v), limited(t - before[2], after[2] - t)
            s_p, s_u = limited(p - before[3], after[3] - p), limited(u - before[4], after[4] - u)
            cell = min(max(i - 2, 0), n - 1)
            width = 2.0 * volume[cell] / (area[cell] + area[cell + 1])
            half = 0.5 * dt / width
            spread = half * s_v + 0.5 * dt * v * (area[cell + 1] - area[cell]) / volume[cell]
            moved = half * v
            d_rho, d_v = -moved * s_rho - rho * spread, -moved * s_v - half * s_p / rho
            d_t, d_u = -moved * s_t, -moved * s_u - p / rho * spread
            d_p = -moved * s_p - (rho * c * c * spread if p > 0.0 else 0.0)
            if rho + d_rho - 0.5 * abs(s_rho) <= 0.0:
                d_rho, d_v, d_t, d_p, d_u = 0.0, 0.0, 0.0, 0.0, 0.0
        for side, face in ((-0.5, low), (0.5, high)):
            face[i, 0], face[i, 1] = rho + d_rho + side * s_rho, v + d_v + side * s_v
            face[i, 2] = t + d_t + side * s_t
            face[i, 3], face[i, 4] = max(p + d_p + side * s_p, 0.0), max(u + d_u + side * s_u, 0.0)
        middle[i] = max(p + d_p, 0.0)


@law
def upwind(line, column, left, rightwards):
    """What matter takes along of a ``column`` through the face between the cells ``left`` and ``left`` + 1."""
    i, side = (left, 0.5) if rightwards else (left + 1, -0.5)
    here = line[i, column]
    if i == 0 or i == len(line) - 1 or line[i - 1, 0] <= 0.0 or line[i + 1, 0] <= 0.0:
        return here
    return here + side * limited(here - line[i - 1, column], line[i + 1, column] - here)


@kernel
def sweep(conserved, state, axis, area, volume, dt, ends):
    """One sweep along ``axis`` (0: r, 1: z) by ``dt`` [s]; ``area`` of faces and ``volume`` of cells on a line (per
    cell of the other axis), ``ends``: what the two boundaries are. ``state`` is that of ``conserved`` before."""
    n, lines = conserved.shape[axis], conserved.shape[1 - axis]
    across, along = (VR, VZ) if axis == 0 else (VZ, VR)
    normal, other = (ACROSS_R, ALONG_Z) if axis == 0 else (ALONG_Z, ACROSS_R)
    columns = conserved.shape[2]
    line = np.empty((n + 4, CARRIED + columns - DISTENDED))
    low, high = np.empty((n + 4, 5)), np.empty((n + 4, 5))
    through = np.empty((n + 1, columns))
    middle = np.empty(n + 4)
    for j in range(lines):
        for i in range(n):
            cell = state[i, j] if axis == 0 else state[j, i]
            line[i + 2, 0], line[i + 2, 1], line[i + 2, 2] = cell[RHO], cell[across], cell[along]
            line[i + 2, 3], line[i + 2, 4], line[i + 2, 5], line[i + 2, CARRIED] = (
                cell[P],
                cell[U],
                cell[C],
                cell[ALPHA],
            )
            moved = conserved[i, j] if axis == 0 else conserved[j, i]
            for column in range(SHEARED, columns):
                line[i + 2, CARRIED + column - DISTENDED] = moved[column] / cell[RHO] if cell[RHO] > 0.0 else 0.0
        bound(line, n, ends)
        reconstruct(line, n, area, volume, dt, low, high, middle)
        for f in range(n + 1):
            a, b = high[f + 1], low[f + 2]
            through[f, 0], through[f, 1], through[f, 2], through[f, 3] = flux(
                a[0], a[1], a[2], a[3], a[4], line[f + 1, 5], b[0], b[1], b[2], b[3], b[4], line[f + 2, 5]
            )
            for column in range(DISTENDED, columns):
                carried = upwind(line, CARRIED + column - DISTENDED, f + 1, through[f, 0] > 0.0)
                through[f, column] = through[f, 0] * carried
        for i in range(n):
            cell = conserved[i, j] if axis == 0 else conserved[j, i]
            scale, left, right = dt / volume[i], area[i], area[i + 1]
            cell[MASS] -= scale * (right * through[i + 1, 0] - left * through[i, 0])
            cell[normal] -= scale * (right * through[i + 1, 1] - left * through[i, 1] - (right - left) * middle[i + 2])
            cell[other] -= scale * (right * through[i + 1, 2] - left * through[i, 2])
            cell[ENERGY] -= scale * (right * through[i + 1, 3] - left * through[i, 3])
            for column in range(DISTENDED, columns):
                cell[column] -= scale * (right * through[i + 1, column] - left * through[i, column])
