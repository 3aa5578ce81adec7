"""The one pass over all pairs: force, strain rate, divergence, heating, viscosity.

With V_j = m_j / rho_j, sigma = S - P 1 (effective), h_ij = (h_i + h_j) / 2, W = W(r_ij, h_ij), v_ji = v_j - v_i:

    a_i      = (1 / rho_i) sum_j V_j (sigma_i + sigma_j) . grad_i W  -  sum_j m_j Pi_ij grad_i W
    L_i      = sum_j V_j v_ji (x) grad_i W                               velocity gradient, plain
    drho_i   = -rho_i tr L_i
    du_i     = (1 / rho_i) sigma_i : L_i + sum_j w_ij m_j Pi_ij v_ij . grad_i W      w_ij = V_i / (V_i + V_j)
    dS_i     = 2 f mu (eps - tr eps / 3) + S.Omega^T + Omega.S
        eps, Omega from L_i C_i with C_i = (sum_j V_j x_ji (x) grad_i W)^-1

f is the strain of the matrix over that of the porous material (``Matter.strain_ratio`` of ``sph.pairs.scheme``; 1 in
solid material): it scales what strains, never what turns.

The heat of viscosity is shared by volume: a pair of one material ends with one specific energy, as behind a shock,
however unlike its particles. (Shared by halves, a light particle that meets heavy ones is heated by their mass ratio
too much: projectile particles a seventeenth of the target's overshoot the planar limit of 111 GPa to 160 GPa; by
volume they reach 84.)

Force and energy are exact conjugates (sum m v.a + sum m du = 0 to rounding for any sigma), pairs are antisymmetric
(momentum), and the volume form survives density jumps between layers. The correction C enters only the strain and
rotation rates of the stress, where it makes rigid rotation exact (Bonet & Lok 1999). Gathering (every particle sums
its own row of the list) keeps the result independent of the number of threads.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from matter.compilation.gather import LANES, columns, narrow_columns, scratch_width
from matter.compilation.jit import fast_min, parallel_kernel, prange
from sph.kernels import dispatch as kernels
from sph.pairs import bearing_pressure, body_contact, conductivity
from sph.pairs.rate_arrays import Rates
from sph.pairs.row import (
    BODY,
    ENERGY,
    RHO_INVERSE,
    SLOPE,
    SOUND,
    SUPPORT,
    TENSOR,
    VISCOSITY_FRACTION,
    VOLUME,
    VX,
    VY,
    VZ,
    WIDTH,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZZ,
    X,
    Y,
    Z,
)
from sph.pairs.scheme import Damping, Matter, Pairs, Rows, Scheme
from sph.viscosity import monaghan
from sph.viscosity import reconstructed as viscosity_reconstructed

SOURCES = ("Monaghan1992", "BonetLok1999")

_BLOCK = 64


@functools.cache
def pair_loop(scheme: Scheme):
    """The compiled loop ``(rows, pairs, matter, damping, out)`` of a scheme; in: ``Rows``, ``Pairs``, ``Matter`` and
    ``Damping`` of ``sph.pairs.scheme``; out: ``sph.pairs.rate_arrays.Sums``."""
    kernel, reconstructed, corrected, switched, with_bodies = scheme
    conducting, extra_rows, extra_width = scheme.conducting, scheme.extra_rows, scheme.extra_width

    @parallel_kernel(fastmath=True)
    def _pairs(rows, pairs, matter, damping, out):
        row, extra, start_density, inverse = rows.row, rows.extra, rows.start_density, rows.inverse
        filled = rows.filled
        # numba's parallel loops write arrays that have names of their own, not those inside a tuple
        acceleration, density_rate, energy_rate, stress_rate = out.acceleration, out.density, out.energy, out.stress
        divergence, approach, number = out.divergence, out.approach, out.number
        strain_rate, mean_pressure, approaching = out.strain_rate, out.mean_pressure, out.approaching
        n = len(number)  # rows behind these are images: read, never written
        for block in prange((n + _BLOCK - 1) // _BLOCK):
            most = 0
            for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                most = max(most, pairs.number[i])
            s = np.empty((WIDTH, scratch_width(most)))
            if extra_rows:
                t = np.empty((extra_width, scratch_width(most)))
            for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                many = pairs.number[i]
                # rows of the list are filled up with the particle itself, which adds exact zeros
                padded = (many + LANES - 1) // LANES * LANES
                for k in range(0, padded, LANES):
                    columns(row, pairs.partner, pairs.first[i], k, s)
                    if corrected:
                        columns(extra, pairs.partner, pairs.first[i], k, t)
                    elif extra_rows:
                        narrow_columns(extra, pairs.partner, pairs.first[i], k, t)
                x, y, z, vx, vy, vz = row[i, X], row[i, Y], row[i, Z], row[i, VX], row[i, VY], row[i, VZ]
                volume, rho_inv, h, c_i = row[i, VOLUME], row[i, RHO_INVERSE], row[i, SUPPORT], row[i, SOUND]
                inv_rho_ref = 1.0 / start_density[i] if reconstructed else rho_inv
                txx, txy, txz, tyy, tyz, tzz = row[i, XX], row[i, XY], row[i, XZ], row[i, YY], row[i, YZ], row[i, ZZ]
                if corrected:
                    bxx, bxy, bxz = extra[i, TENSOR], extra[i, TENSOR + 1], extra[i, TENSOR + 2]
                    byx, byy, byz = extra[i, TENSOR + 3], extra[i, TENSOR + 4], extra[i, TENSOR + 5]
                    bzx, bzy, bzz = extra[i, TENSOR + 6], extra[i, TENSOR + 7], extra[i, TENSOR + 8]
                if switched:
                    fraction = extra[i, VISCOSITY_FRACTION]
                if conducting:
                    body, u_i = body_contact.body_of(extra[i, BODY]), extra[i, ENERGY]
                if with_bodies:
                    approaches = body_contact.approach_of(extra[i, BODY], body)
                    parts = body_contact.parting_fraction(filled[i], -(txx + tyy + tzz))
                if reconstructed:
                    exx, exy, exz = extra[i, SLOPE], extra[i, SLOPE + 1], extra[i, SLOPE + 2]
                    eyy, eyz, ezz = extra[i, SLOPE + 3], extra[i, SLOPE + 4], extra[i, SLOPE + 5]
                ax, ay, az, heat, slowest, near = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                borne, weight, closing = 0.0, 0.0, 0.0
                lxx, lxy, lxz, lyx, lyy, lyz, lzx, lzy, lzz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                cxx, cxy, cxz, cyy, cyz, czz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for k in range(padded):
                    dx, dy, dz = x - s[X, k], y - s[Y, k], z - s[Z, k]
                    ux, uy, uz = vx - s[VX, k], vy - s[VY, k], vz - s[VZ, k]
                    r2 = dx * dx + dy * dy + dz * dz
                    hij = 0.5 * (h + s[SUPPORT, k])
                    r = math.sqrt(r2)
                    F = kernels.gradient_factor(kernel, r, hij)
                    gx, gy, gz = F * dx, F * dy, F * dz
                    V = s[VOLUME, k]
                    # viscosity: m_j Pi = (V_j / rho_j^-1) Pi with 1/rhobar = 2 / (rho_i + rho_j)
                    vr = ux * dx + uy * dy + uz * dz
                    limited_vr = vr
                    if reconstructed:
                        e_i = (
                            exx * dx * dx
                            + eyy * dy * dy
                            + ezz * dz * dz
                            + 2.0 * (exy * dx * dy + exz * dx * dz + eyz * dy * dz)
                        )
                        e_j = t[SLOPE, k] * dx * dx + t[SLOPE + 3, k] * dy * dy + t[SLOPE + 5, k] * dz * dz
                        e_j += 2.0 * (
                            t[SLOPE + 1, k] * dx * dy + t[SLOPE + 2, k] * dx * dz + t[SLOPE + 4, k] * dy * dz
                        )
                        limited_vr = viscosity_reconstructed.jump(
                            vr, e_i, e_j, r, r2, hij, 0.5 * (c_i + s[SOUND, k]), damping.near
                        )
                    mu = monaghan.approach(limited_vr, r2, hij)
                    rho_j_inv = s[RHO_INVERSE, k]
                    rho_sum, volume_sum = rho_inv + rho_j_inv, volume + V
                    inv_rho_volume = 1.0 / (rho_sum * volume_sum)  # one division for two
                    mean_density_ratio = 2.0 * inv_rho_ref * volume_sum * inv_rho_volume  # = rho_j 2 / (rho_i + rho_j)
                    viscous_term = (
                        V
                        * mean_density_ratio
                        * monaghan.viscous_pressure(mu, 0.5 * (c_i + s[SOUND, k]), damping.alpha, damping.beta)
                    )
                    inside = 1.0 if r < hij else 0.0
                    if conducting:
                        other = body_contact.body_of(t[BODY, k])
                    if with_bodies:
                        across, struck = body_contact.surface(body, other), body_contact.struck(body, other)
                        closed = min(approaches, body_contact.approach_of(t[BODY, k], other))
                        closed = 1.0 - struck * (1.0 - closed)
                        viscous_term *= closed
                    if switched:
                        viscous_term *= 0.5 * (fraction + t[VISCOSITY_FRACTION, k])
                    slowest = fast_min(slowest, mu * inside)
                    near += inside
                    heat += volume * rho_sum * inv_rho_volume * viscous_term * vr * F
                    if conducting:
                        alike = damping.conductivity if other == body else 0.0
                        speed = conductivity.exchange(mu, 0.5 * (c_i + s[SOUND, k]))
                        heat += alike * V * mean_density_ratio * speed * r * (u_i - t[ENERGY, k]) * F
                    q = V * F * r2
                    if reconstructed:
                        q *= rho_j_inv * rho_j_inv
                    borne += q * (s[XX, k] + s[YY, k] + s[ZZ, k])
                    weight -= q
                    if reconstructed:
                        closing -= q if mu < 0.0 else 0.0
                    w = V * inv_rho_ref
                    sxx, sxy, sxz = txx + s[XX, k], txy + s[XY, k], txz + s[XZ, k]
                    syy, syz, szz = tyy + s[YY, k], tyz + s[YZ, k], tzz + s[ZZ, k]
                    if with_bodies:
                        along = sxx * dx * dx + syy * dy * dy + szz * dz * dz
                        along += 2.0 * (sxy * dx * dy + sxz * dx * dz + syz * dy * dz)
                        passed = body_contact.pressed(across, along)
                        seen = body_contact.strained(vr < 0.0, closed, 1.0 - struck * (1.0 - parts), passed)
                        # where force and velocity gradient count a different part, the work between them is heat
                        heat += (
                            (seen - passed)
                            * w
                            * (
                                ux * (txx * gx + txy * gy + txz * gz)
                                + uy * (txy * gx + tyy * gy + tyz * gz)
                                + uz * (txz * gx + tyz * gy + tzz * gz)
                            )
                        )
                        w *= passed
                        ux, uy, uz = seen * ux, seen * uy, seen * uz
                    if not corrected:
                        ax += w * (sxx * gx + sxy * gy + sxz * gz) - viscous_term * gx
                        ay += w * (sxy * gx + syy * gy + syz * gz) - viscous_term * gy
                        az += w * (sxz * gx + syz * gy + szz * gz) - viscous_term * gz
                    else:
                        ax += (
                            w
                            * (
                                (bxx + t[TENSOR, k]) * gx
                                + (bxy + t[TENSOR + 1, k]) * gy
                                + (bxz + t[TENSOR + 2, k]) * gz
                            )
                            - viscous_term * gx
                        )
                        ay += (
                            w
                            * (
                                (byx + t[TENSOR + 3, k]) * gx
                                + (byy + t[TENSOR + 4, k]) * gy
                                + (byz + t[TENSOR + 5, k]) * gz
                            )
                            - viscous_term * gy
                        )
                        az += (
                            w
                            * (
                                (bzx + t[TENSOR + 6, k]) * gx
                                + (bzy + t[TENSOR + 7, k]) * gy
                                + (bzz + t[TENSOR + 8, k]) * gz
                            )
                            - viscous_term * gz
                        )
                    gx, gy, gz = V * gx, V * gy, V * gz
                    lxx -= ux * gx
                    lxy -= ux * gy
                    lxz -= ux * gz
                    lyx -= uy * gx
                    lyy -= uy * gy
                    lyz -= uy * gz
                    lzx -= uz * gx
                    lzy -= uz * gy
                    lzz -= uz * gz
                    cxx -= dx * gx
                    cxy -= dx * gy
                    cxz -= dx * gz
                    cyy -= dy * gy
                    cyz -= dy * gz
                    czz -= dz * gz
                acceleration[i, 0], acceleration[i, 1], acceleration[i, 2] = ax, ay, az
                if corrected:
                    ixx, ixy, ixz = inverse[i, 0], inverse[i, 1], inverse[i, 2]
                    iyy, iyz, izz = inverse[i, 3], inverse[i, 4], inverse[i, 5]
                    lxx, lxy, lxz = (
                        lxx * ixx + lxy * ixy + lxz * ixz,
                        lxx * ixy + lxy * iyy + lxz * iyz,
                        lxx * ixz + lxy * iyz + lxz * izz,
                    )
                    lyx, lyy, lyz = (
                        lyx * ixx + lyy * ixy + lyz * ixz,
                        lyx * ixy + lyy * iyy + lyz * iyz,
                        lyx * ixz + lyy * iyz + lyz * izz,
                    )
                    lzx, lzy, lzz = (
                        lzx * ixx + lzy * ixy + lzz * ixz,
                        lzx * ixy + lzy * iyy + lzz * iyz,
                        lzx * ixz + lzy * iyz + lzz * izz,
                    )
                trace = lxx + lyy + lzz
                density_rate[i] = -trace / inv_rho_ref
                energy_rate[i] = (
                    inv_rho_ref
                    * (txx * lxx + tyy * lyy + tzz * lzz + txy * (lxy + lyx) + txz * (lxz + lzx) + tyz * (lyz + lzy))
                    + heat
                )
                if reconstructed:
                    volume_ratio = inv_rho_ref / rho_inv  # 1 / eta: sums over first volumes as sums over present ones
                    trace *= volume_ratio
                    lxx, lxy, lxz, lyx, lyy, lyz, lzx, lzy, lzz = (
                        lxx * volume_ratio, lxy * volume_ratio, lxz * volume_ratio,
                        lyx * volume_ratio, lyy * volume_ratio, lyz * volume_ratio,
                        lzx * volume_ratio, lzy * volume_ratio, lzz * volume_ratio,
                    )  # fmt: skip
                    cxx, cxy, cxz, cyy, cyz, czz = (
                        cxx * volume_ratio,
                        cxy * volume_ratio,
                        cxz * volume_ratio,
                        cyy * volume_ratio,
                        cyz * volume_ratio,
                        czz * volume_ratio,
                    )
                divergence[i] = trace
                approach[i] = -slowest
                approaching[i] = closing / weight if reconstructed and weight > 0.0 else 1.0
                mean_pressure[i] = bearing_pressure.mean(borne / 3.0, weight, rho_inv / inv_rho_ref)
                number[i] = int(near) - (padded - many)
                G = matter.shear[matter.material[i]]
                sheared = matter.strength and G > 0.0
                if (sheared or reconstructed) and not corrected:
                    det = cxx * (cyy * czz - cyz * cyz) - cxy * (cxy * czz - cyz * cxz) + cxz * (cxy * cyz - cyy * cxz)
                    # a lopsided neighbourhood (surface spray) has no useful inverse: plain gradients there
                    if det > 0.05 and det < 20.0:
                        inv = 1.0 / det
                        ixx, ixy, ixz = (
                            (cyy * czz - cyz * cyz) * inv,
                            (cxz * cyz - cxy * czz) * inv,
                            (cxy * cyz - cxz * cyy) * inv,
                        )
                        iyy, iyz, izz = (
                            (cxx * czz - cxz * cxz) * inv,
                            (cxy * cxz - cxx * cyz) * inv,
                            (cxx * cyy - cxy * cxy) * inv,
                        )
                        lxx, lxy, lxz = (
                            lxx * ixx + lxy * ixy + lxz * ixz,
                            lxx * ixy + lxy * iyy + lxz * iyz,
                            lxx * ixz + lxy * iyz + lxz * izz,
                        )
                        lyx, lyy, lyz = (
                            lyx * ixx + lyy * ixy + lyz * ixz,
                            lyx * ixy + lyy * iyy + lyz * iyz,
                            lyx * ixz + lyy * iyz + lyz * izz,
                        )
                        lzx, lzy, lzz = (
                            lzx * ixx + lzy * ixy + lzz * ixz,
                            lzx * ixy + lzy * iyy + lzz * iyz,
                            lzx * ixz + lzy * iyz + lzz * izz,
                        )
                if reconstructed:
                    strain_rate[i, 0], strain_rate[i, 1], strain_rate[i, 2] = lxx, 0.5 * (lxy + lyx), 0.5 * (lxz + lzx)
                    strain_rate[i, 3], strain_rate[i, 4], strain_rate[i, 5] = lyy, 0.5 * (lyz + lzy), lzz
                if sheared:
                    G *= matter.strain_ratio[i, 0] if trace < 0.0 else matter.strain_ratio[i, 1]
                    third = (lxx + lyy + lzz) / 3.0
                    exx, eyy = lxx - third, lyy - third
                    exy, exz, eyz = 0.5 * (lxy + lyx), 0.5 * (lxz + lzx), 0.5 * (lyz + lzy)
                    # spin tensor W_ab = (L_ab - L_ba) / 2; Jaumann: dS = 2 G dev(eps) + W S - S W
                    wxy, wxz, wyz = 0.5 * (lxy - lyx), 0.5 * (lxz - lzx), 0.5 * (lyz - lzy)
                    a, b, c, d, e = (
                        matter.stress[i, 0],
                        matter.stress[i, 1],
                        matter.stress[i, 2],
                        matter.stress[i, 3],
                        matter.stress[i, 4],
                    )
                    f = -a - d
                    stress_rate[i, 0] = 2.0 * G * exx + 2.0 * (wxy * b + wxz * c)
                    stress_rate[i, 1] = 2.0 * G * exy + wxy * (d - a) + wxz * e + wyz * c
                    stress_rate[i, 2] = 2.0 * G * exz + wxy * e + wxz * (f - a) - wyz * b
                    stress_rate[i, 3] = 2.0 * G * eyy + 2.0 * (-wxy * b + wyz * e)
                    stress_rate[i, 4] = 2.0 * G * eyz - wxy * c - wxz * b + wyz * (f - d)
                else:
                    for k in range(5):
                        stress_rate[i, k] = 0.0

    return _pairs


def compute(scheme: Scheme, rows: Rows, neighbours, matter: Matter, damping: Damping, out: Rates) -> None:
    """Fill ``out`` from evaluated rows (``sph.stepping.state``) over the neighbour list.

    The rows are turned by ``sph.pairs.start_volumes`` where the scheme is ``reconstructed``, and have extra rows and
    ``inverse`` where it asks for them (``sph.pairs.gradients``, ``sph.viscosity.switch``).
    """
    if scheme.reconstructed and len(out.strain_rate) == 0:
        raise ValueError("a reconstructed viscosity keeps the velocity gradient: Rates(n, strain_rate=True)")
    if len(out.mean_pressure) != len(out.count):  # the loop would write beyond its end
        raise ValueError(f"{len(out.mean_pressure)} mean pressures for {len(out.count)} particles")
    pair_loop(scheme)(rows, Pairs.from_neighbours(neighbours), matter, damping, out.sums)
