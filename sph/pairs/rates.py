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

**Two precisions.** Differences of positions and velocities, stress and all sums are double. In single precision is
what a pair has to itself: dW/dr / r, Pi, half of (V_i - V_j) / (V_i + V_j) (so that w_ij + w_ji = 1 to the bit) and
the heat that it conducts. Both partners find the same bits, or the same with the other sign
(``matter.compilation.jit.symmetric_law``), so that momentum, energy and linear fields are as exact as in double
precision; the rates themselves differ from it by 2e-7. All in single precision they would be 1e-7 wrong in each of
these. Partners are taken ``CHUNK`` at a time, in three passes that the compiler vectorises each by itself; numbers in
SI from supports of a micrometre to 10,000 km stay in the range of single precision.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from matter.compilation.gather import LANES, columns, mixed_columns, single_columns
from matter.compilation.jit import fast_min, parallel_kernel, prange, single, symmetric_law
from sph.kernels import dispatch as kernels
from sph.pairs import block_contact, conductivity
from sph.pairs.rate_arrays import Rates
from sph.pairs.row import (
    CHUNK,
    ENERGY,
    MATERIAL,
    NARROW,
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

_approach, _viscous_pressure = single(monaghan.approach), single(monaghan.viscous_pressure)
_jump, _exchange = single(viscosity_reconstructed.jump), single(conductivity.exchange)
_ZERO, _HALF, _ONE, _TWO = (np.float32(number) for number in (0.0, 0.5, 1.0, 2.0))

# what single precision is made of, and into which of its columns the pair's own numbers go
_NARROW = (X, Y, Z, SUPPORT, VOLUME, VX, VY, VZ, RHO_INVERSE, SOUND)
_FACTOR, _VISCOUS, _UNEVEN, _HEAT = X, Y, Z, VX
_MOVING = (X, Y, Z, VX, VY, VZ)
_take = mixed_columns(_MOVING, (*_MOVING, VOLUME, XX, XY, XZ, YY, YZ, ZZ), _NARROW)


@symmetric_law
def _dot(ax, ay, az, bx, by, bz):
    return ax * bx + ay * by + az * bz


@symmetric_law
def _along(xx, xy, xz, yy, yz, zz, dx, dy, dz):
    """x.T.x of a symmetric tensor."""
    off = xy * (dx * dy) + xz * (dx * dz) + yz * (dy * dz)
    return xx * (dx * dx) + yy * (dy * dy) + zz * (dz * dz) + _TWO * off


@symmetric_law
def _switched(viscous, one, other):
    return viscous * (_HALF * (one + other))


@symmetric_law
def _conducted(k, mean, speed, r, one, other):
    return k * (mean * speed * r) * (one - other)


@functools.cache
def pair_loop(scheme: Scheme):
    """The compiled loop ``(rows, pairs, matter, damping, out)`` of a scheme; in: ``Rows``, ``Pairs``, ``Matter`` and
    ``Damping`` of ``sph.pairs.scheme``; out: ``sph.pairs.rate_arrays.Sums``."""
    kernel, reconstructed, corrected, switched, with_blocks = scheme
    conducting, extra_rows, extra_width = scheme.conducting, scheme.extra_rows, scheme.extra_width
    gradient_factor = single(kernels.FAMILY.laws[kernel].gradient_factor)

    @symmetric_law
    def _pair(r2, vr, e_i, e_j, supports, sounds, rho_inv, volume_i, volume_j, alpha, beta, spacing):
        """r, whether it is inside the support, dW/dr / r, mu, the mean sound speed, rho_i rho_j / rhobar, viscous
        pressure times that, and half (V_i - V_j) / (V_i + V_j); of the supports, sound speeds and 1 / rho the sums."""
        r, h, sound = math.sqrt(r2), _HALF * supports, _HALF * sounds
        closing = _jump(vr, e_i, e_j, r, r2, h, sound, spacing) if reconstructed else vr
        mu, volumes = _approach(closing, r2, h), volume_i + volume_j
        inverse = _ONE / (rho_inv * volumes)  # one division for two
        mean = _TWO * volumes * inverse
        viscous = mean * _viscous_pressure(mu, sound, alpha, beta)
        uneven = _HALF * (volume_i - volume_j) * (rho_inv * inverse)
        return r, _ONE if r < h else _ZERO, gradient_factor(r, h), mu, sound, mean, viscous, uneven

    @parallel_kernel(fastmath=True)
    def _pairs(rows, pairs, matter, damping, out):
        row, extra, start_density, inverse = rows.row, rows.extra, rows.start_density, rows.inverse
        # numba's parallel loops write arrays that have names of their own, not those inside a tuple
        acceleration, density_rate, energy_rate, stress_rate = out.acceleration, out.density, out.energy, out.stress
        divergence, approach, number = out.divergence, out.approach, out.number
        strain_rate = out.strain_rate
        spacing, conductance = np.float32(damping.near), np.float32(damping.conductivity)
        alpha, beta = np.float32(damping.alpha), np.float32(damping.beta)
        n = len(number)  # rows behind these are images: read, never written
        for block in prange((n + _BLOCK - 1) // _BLOCK):
            s = np.empty((WIDTH, CHUNK))
            g = np.empty((len(_NARROW), CHUNK), dtype=np.float32)
            if extra_rows:
                e = np.empty((NARROW, CHUNK), dtype=np.float32)
            if corrected:
                t = np.empty((extra_width, CHUNK))
            for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                many = pairs.number[i]
                # rows of the list are filled up with the particle itself, which adds exact zeros
                padded = (many + LANES - 1) // LANES * LANES
                rho_inv = row[i, RHO_INVERSE]
                inv_rho_ref = 1.0 / start_density[i] if reconstructed else rho_inv
                volume, rho_inv_i = np.float32(row[i, VOLUME]), np.float32(rho_inv)
                h, sound_i = np.float32(row[i, SUPPORT]), np.float32(row[i, SOUND])
                if reconstructed:
                    exx, exy = np.float32(extra[i, SLOPE]), np.float32(extra[i, SLOPE + 1])
                    exz, eyy = np.float32(extra[i, SLOPE + 2]), np.float32(extra[i, SLOPE + 3])
                    eyz, ezz = np.float32(extra[i, SLOPE + 4]), np.float32(extra[i, SLOPE + 5])
                if switched:
                    fraction = np.float32(extra[i, VISCOSITY_FRACTION])
                if conducting:
                    kind, u_i = np.float32(extra[i, MATERIAL]), np.float32(extra[i, ENERGY])
                slowest, near = _ZERO, _ZERO
                txx, txy, txz, tyy, tyz, tzz = row[i, XX], row[i, XY], row[i, XZ], row[i, YY], row[i, YZ], row[i, ZZ]
                if corrected:
                    bxx, bxy, bxz = extra[i, TENSOR], extra[i, TENSOR + 1], extra[i, TENSOR + 2]
                    byx, byy, byz = extra[i, TENSOR + 3], extra[i, TENSOR + 4], extra[i, TENSOR + 5]
                    bzx, bzy, bzz = extra[i, TENSOR + 6], extra[i, TENSOR + 7], extra[i, TENSOR + 8]
                if with_blocks:
                    body = np.float32(extra[i, MATERIAL])
                ax, ay, az, heat = 0.0, 0.0, 0.0, 0.0
                lxx, lxy, lxz, lyx, lyy, lyz, lzx, lzy, lzz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                cxx, cxy, cxz, cyy, cyz, czz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for start in range(0, padded, CHUNK):
                    filled = min((padded - start) // LANES, CHUNK // LANES) * LANES
                    for k in range(0, filled, LANES):
                        _take(row, i, pairs.partner, pairs.first[i] + start, k, s, g)
                        if extra_rows:
                            single_columns(extra, pairs.partner, pairs.first[i] + start, k, e)
                        if corrected:
                            columns(extra, pairs.partner, pairs.first[i] + start, k, t)
                    for k in range(filled):
                        dx, dy, dz = g[X, k], g[Y, k], g[Z, k]
                        vr = _dot(g[VX, k], g[VY, k], g[VZ, k], dx, dy, dz)
                        e_i, e_j = _ZERO, _ZERO
                        if reconstructed:
                            e_i = _along(exx, exy, exz, eyy, eyz, ezz, dx, dy, dz)
                            e_j = _along(e[0, k], e[1, k], e[2, k], e[3, k], e[4, k], e[5, k], dx, dy, dz)
                        r, inside, factor, mu, sound, mean, viscous, uneven = _pair(
                            _dot(dx, dy, dz, dx, dy, dz), vr, e_i, e_j, h + g[SUPPORT, k], sound_i + g[SOUND, k],
                            rho_inv_i + g[RHO_INVERSE, k], volume, g[VOLUME, k], alpha, beta, spacing,
                        )  # fmt: skip
                        if switched:
                            viscous = _switched(viscous, fraction, e[VISCOSITY_FRACTION, k])
                        slowest = fast_min(slowest, mu * inside)
                        near += inside
                        g[_FACTOR, k], g[_VISCOUS, k], g[_UNEVEN, k] = factor, viscous, uneven
                        if conducting:
                            alike = conductance if e[MATERIAL, k] == kind else _ZERO
                            g[_HEAT, k] = _conducted(alike, mean, _exchange(mu, sound), r, u_i, e[ENERGY, k])
                    for k in range(filled):
                        dx, dy, dz, ux, uy, uz = s[X, k], s[Y, k], s[Z, k], s[VX, k], s[VY, k], s[VZ, k]
                        VF, viscous = s[VOLUME, k] * np.float64(g[_FACTOR, k]), np.float64(g[_VISCOUS, k])
                        gx, gy, gz = VF * dx, VF * dy, VF * dz
                        heat += (0.5 + np.float64(g[_UNEVEN, k])) * viscous * (ux * gx + uy * gy + uz * gz)
                        if conducting:
                            heat += VF * np.float64(g[_HEAT, k])
                        sxx, sxy, sxz = txx + s[XX, k], txy + s[XY, k], txz + s[XZ, k]
                        syy, syz, szz = tyy + s[YY, k], tyz + s[YZ, k], tzz + s[ZZ, k]
                        rest = 1.0
                        if with_blocks:
                            along = sxx * dx * dx + syy * dy * dy + szz * dz * dz
                            along += 2.0 * (sxy * dx * dy + sxz * dx * dz + syz * dy * dz)
                            cut = block_contact.cut(body, e[MATERIAL, k], along)
                            opens = cut if ux * dx + uy * dy + uz * dz > 0.0 else 0.0
                            heat += (cut - opens) * (
                                ux * (txx * gx + txy * gy + txz * gz)
                                + uy * (txy * gx + tyy * gy + tyz * gz)
                                + uz * (txz * gx + tyz * gy + tzz * gz)
                            )  # what the velocity gradient below counts of it as work
                            rest = 1.0 - cut
                            ux, uy, uz = (1.0 - opens) * ux, (1.0 - opens) * uy, (1.0 - opens) * uz
                        if not corrected:
                            ax += rest * (sxx * gx + sxy * gy + sxz * gz) - viscous * gx
                            ay += rest * (sxy * gx + syy * gy + syz * gz) - viscous * gy
                            az += rest * (sxz * gx + syz * gy + szz * gz) - viscous * gz
                        else:
                            ax += (
                                rest
                                * (
                                    (bxx + t[TENSOR, k]) * gx
                                    + (bxy + t[TENSOR + 1, k]) * gy
                                    + (bxz + t[TENSOR + 2, k]) * gz
                                )
                                - viscous * gx
                            )
                            ay += (
                                rest
                                * (
                                    (byx + t[TENSOR + 3, k]) * gx
                                    + (byy + t[TENSOR + 4, k]) * gy
                                    + (byz + t[TENSOR + 5, k]) * gz
                                )
                                - viscous * gy
                            )
                            az += (
                                rest
                                * (
                                    (bzx + t[TENSOR + 6, k]) * gx
                                    + (bzy + t[TENSOR + 7, k]) * gy
                                    + (bzz + t[TENSOR + 8, k]) * gz
                                )
                                - viscous * gz
                            )
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
                ax, ay, az, heat = inv_rho_ref * ax, inv_rho_ref * ay, inv_rho_ref * az, inv_rho_ref * heat
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
                    dxx, dyy = lxx - third, lyy - third
                    dxy, dxz, dyz = 0.5 * (lxy + lyx), 0.5 * (lxz + lzx), 0.5 * (lyz + lzy)
                    # spin tensor W_ab = (L_ab - L_ba) / 2; Jaumann: dS = 2 G dev(eps) + W S - S W
                    wxy, wxz, wyz = 0.5 * (lxy - lyx), 0.5 * (lxz - lzx), 0.5 * (lyz - lzy)
                    a, b, c, d, q = (
                        matter.stress[i, 0],
                        matter.stress[i, 1],
                        matter.stress[i, 2],
                        matter.stress[i, 3],
                        matter.stress[i, 4],
                    )
                    f = -a - d
                    stress_rate[i, 0] = 2.0 * G * dxx + 2.0 * (wxy * b + wxz * c)
                    stress_rate[i, 1] = 2.0 * G * dxy + wxy * (d - a) + wxz * q + wyz * c
                    stress_rate[i, 2] = 2.0 * G * dxz + wxy * q + wxz * (f - a) - wyz * b
                    stress_rate[i, 3] = 2.0 * G * dyy + 2.0 * (-wxy * b + wyz * q)
                    stress_rate[i, 4] = 2.0 * G * dyz - wxy * c - wxz * b + wyz * (f - d)
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
    pair_loop(scheme)(rows, Pairs.from_neighbours(neighbours), matter, damping, out.sums)
