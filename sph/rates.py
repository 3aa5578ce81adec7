"""The one pass over all pairs: force, strain rate, divergence, heating, viscosity.

With V_j = m_j / rho_j, sigma = S - P 1 (effective), h_ij = (h_i + h_j) / 2, W = W(r_ij, h_ij), v_ji = v_j - v_i:

    a_i      = (1 / rho_i) sum_j V_j (sigma_i + sigma_j) . grad_i W  -  sum_j m_j Pi_ij grad_i W
    L_i      = sum_j V_j v_ji (x) grad_i W                               velocity gradient, plain
    drho_i   = -rho_i tr L_i
    du_i     = (1 / rho_i) sigma_i : L_i + sum_j w_ij m_j Pi_ij v_ij . grad_i W      w_ij = V_i / (V_i + V_j)
    dS_i     = 2 f mu (eps - tr eps / 3) + S.Omega^T + Omega.S           eps, Omega from L_i C_i with C_i = (sum_j V_j x_ji (x) grad_i W)^-1

f is the strain of the matrix over that of the porous material (``stiffness``; 1 in solid material): it scales what strains, never what turns.

The heat of viscosity is shared by volume: a pair of one material ends with one specific energy, as behind a shock, however unlike its particles. (Shared
by halves, a light particle that meets heavy ones is heated by their mass ratio too much: projectile particles a seventeenth of the target's
overshoot the planar limit of 111 GPa to 160 GPa; by volume they reach 84.)

Force and energy are exact conjugates (sum m v.a + sum m du = 0 to rounding for any sigma), pairs are antisymmetric (momentum), and the volume form
survives density jumps between layers. The correction C enters only the strain and rotation rates of the stress, where it makes rigid rotation exact
(Bonet & Lok 1999). Gathering (every particle sums its own row of the list) keeps the result independent of the number of threads.
"""

from __future__ import annotations

import math

import numpy as np

from matter.gather import LANES, columns
from matter.jit import fast_min, parallel_kernel, prange
from sph import artificial_stress, kernel, kernel_wendland, viscosity
from sph.state import WIDTH

_BLOCK = 64


@parallel_kernel(fastmath=True)
def _pairs(
    row,
    index,
    entry,
    listed,
    material,
    shear,
    stiffness,
    stress,
    alpha,
    beta,
    strength,
    wendland,
    clumping,
    start_density,
    inverse,
    beside,
    switched,
    acceleration,
    density_rate,
    energy_rate,
    stress_rate,
    divergence,
    curl,
    approach,
    count,
):
    n = len(count)  # rows behind these are images: read, never written
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        most = 0
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            most = max(most, listed[i])
        s = np.empty((WIDTH, most + 2 * LANES))
        if beside is not None:
            t = np.empty((WIDTH, most + 2 * LANES))
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            many = listed[i]
            padded = (many + LANES - 1) // LANES * LANES  # rows of the list are filled up with the particle itself, which adds exact zeros
            for k in range(0, padded, LANES):
                columns(row, index, entry[i], k, s)
                if beside is not None:
                    columns(beside, index, entry[i], k, t)
            x, y, z, vx, vy, vz = row[i, 0], row[i, 1], row[i, 2], row[i, 3], row[i, 4], row[i, 5]
            volume, rho_inv, h, c_i = row[i, 6], row[i, 7], row[i, 8], row[i, 9]
            if start_density is None:  # compiled for one of the two
                before = rho_inv
            else:
                before = 1.0 / start_density[i]
            txx, txy, txz, tyy, tyz, tzz = row[i, 10], row[i, 11], row[i, 12], row[i, 13], row[i, 14], row[i, 15]
            if inverse is not None:
                bxx, bxy, bxz = beside[i, 1], beside[i, 2], beside[i, 3]
                byx, byy, byz = beside[i, 4], beside[i, 5], beside[i, 6]
                bzx, bzy, bzz = beside[i, 7], beside[i, 8], beside[i, 9]
            if switched is not None:
                share = beside[i, 0]
            ax, ay, az, heat, slowest, near = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            lxx, lxy, lxz, lyx, lyy, lyz, lzx, lzy, lzz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            cxx, cxy, cxz, cyy, cyz, czz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(padded):
                dx, dy, dz = x - s[0, k], y - s[1, k], z - s[2, k]
                ux, uy, uz = vx - s[3, k], vy - s[4, k], vz - s[5, k]
                r2 = dx * dx + dy * dy + dz * dz
                hij = 0.5 * (h + s[8, k])
                r = math.sqrt(r2)
                if wendland is None:  # compiled for one of the two
                    F = kernel.gradient_factor(r, hij)
                else:
                    F = kernel_wendland.gradient_factor(r, hij)
                gx, gy, gz = F * dx, F * dy, F * dz
                V = s[6, k]
                # viscosity: m_j Pi = (V_j / rho_j^-1) Pi with 1/rhobar = 2 / (rho_i + rho_j)
                vr = ux * dx + uy * dy + uz * dz
                mu = viscosity.approach(vr, r2, hij)
                rho_j_inv = s[7, k]
                rho_sum, volume_sum = rho_inv + rho_j_inv, volume + V
                both = 1.0 / (rho_sum * volume_sum)  # one division for two
                bar = 2.0 * before * volume_sum * both  # = rho_j 2 / (rho_i + rho_j)
                push = V * bar * viscosity.viscous_pressure(mu, 0.5 * (c_i + s[9, k]), alpha, beta)
                inside = 1.0 if r < hij else 0.0
                if switched is not None:
                    push *= 0.5 * (share + t[0, k])
                slowest = fast_min(slowest, mu * inside)
                near += inside
                heat += volume * rho_sum * both * push * vr * F
                w = V * before
                sxx, sxy, sxz = txx + s[10, k], txy + s[11, k], txz + s[12, k]
                syy, syz, szz = tyy + s[13, k], tyz + s[14, k], tzz + s[15, k]
                if clumping is not None:
                    pull = dx * (sxx * dx + 2.0 * (sxy * dy + sxz * dz)) + dy * (syy * dy + 2.0 * syz * dz) + szz * dz * dz
                    apart = w * artificial_stress.pressure(pull, r, r2, hij, clumping)
                    heat += 0.5 * apart * vr * F
                    push += apart
                if inverse is None:
                    ax += w * (sxx * gx + sxy * gy + sxz * gz) - push * gx
                    ay += w * (sxy * gx + syy * gy + syz * gz) - push * gy
                    az += w * (sxz * gx + syz * gy + szz * gz) - push * gz
                else:
                    ax += w * ((bxx + t[1, k]) * gx + (bxy + t[2, k]) * gy + (bxz + t[3, k]) * gz) - push * gx
                    ay += w * ((byx + t[4, k]) * gx + (byy + t[5, k]) * gy + (byz + t[6, k]) * gz) - push * gy
                    az += w * ((bzx + t[7, k]) * gx + (bzy + t[8, k]) * gy + (bzz + t[9, k]) * gz) - push * gz
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
            if inverse is not None:
                ixx, ixy, ixz = inverse[i, 0], inverse[i, 1], inverse[i, 2]
                iyy, iyz, izz = inverse[i, 3], inverse[i, 4], inverse[i, 5]
                lxx, lxy, lxz = lxx * ixx + lxy * ixy + lxz * ixz, lxx * ixy + lxy * iyy + lxz * iyz, lxx * ixz + lxy * iyz + lxz * izz
                lyx, lyy, lyz = lyx * ixx + lyy * ixy + lyz * ixz, lyx * ixy + lyy * iyy + lyz * iyz, lyx * ixz + lyy * iyz + lyz * izz
                lzx, lzy, lzz = lzx * ixx + lzy * ixy + lzz * ixz, lzx * ixy + lzy * iyy + lzz * iyz, lzx * ixz + lzy * iyz + lzz * izz
            trace = lxx + lyy + lzz
            density_rate[i] = -trace / before
            energy_rate[i] = before * (txx * lxx + tyy * lyy + tzz * lzz + txy * (lxy + lyx) + txz * (lxz + lzx) + tyz * (lyz + lzy)) + heat
            if start_density is not None:
                thin = before / rho_inv  # 1 / eta: sums over first volumes as sums over present ones
                trace *= thin
                lxx, lxy, lxz, lyx, lyy, lyz, lzx, lzy, lzz = (
                    lxx * thin, lxy * thin, lxz * thin, lyx * thin, lyy * thin, lyz * thin, lzx * thin, lzy * thin, lzz * thin
                )  # fmt: skip
                cxx, cxy, cxz, cyy, cyz, czz = cxx * thin, cxy * thin, cxz * thin, cyy * thin, cyz * thin, czz * thin
            divergence[i] = trace
            if switched is not None:
                curl[i] = math.sqrt((lzy - lyz) ** 2 + (lxz - lzx) ** 2 + (lyx - lxy) ** 2)
            approach[i] = -slowest
            count[i] = int(near) - (padded - many)
            G = shear[material[i]]
            if strength and G > 0.0:
                G *= stiffness[i, 0] if trace < 0.0 else stiffness[i, 1]
                if inverse is None:
                    det = cxx * (cyy * czz - cyz * cyz) - cxy * (cxy * czz - cyz * cxz) + cxz * (cxy * cyz - cyy * cxz)
                    # a lopsided neighbourhood (surface spray) has no useful inverse: plain gradients there
                    if det > 0.05 and det < 20.0:
                        inv = 1.0 / det
                        ixx, ixy, ixz = (cyy * czz - cyz * cyz) * inv, (cxz * cyz - cxy * czz) * inv, (cxy * cyz - cxz * cyy) * inv
                        iyy, iyz, izz = (cxx * czz - cxz * cxz) * inv, (cxy * cxz - cxx * cyz) * inv, (cxx * cyy - cxy * cxy) * inv
                        lxx, lxy, lxz = lxx * ixx + lxy * ixy + lxz * ixz, lxx * ixy + lxy * iyy + lxz * iyz, lxx * ixz + lxy * iyz + lxz * izz
                        lyx, lyy, lyz = lyx * ixx + lyy * ixy + lyz * ixz, lyx * ixy + lyy * iyy + lyz * iyz, lyx * ixz + lyy * iyz + lyz * izz
                        lzx, lzy, lzz = lzx * ixx + lzy * ixy + lzz * ixz, lzx * ixy + lzy * iyy + lzz * iyz, lzx * ixz + lzy * iyz + lzz * izz
                third = (lxx + lyy + lzz) / 3.0
                exx, eyy = lxx - third, lyy - third
                exy, exz, eyz = 0.5 * (lxy + lyx), 0.5 * (lxz + lzx), 0.5 * (lyz + lzy)
                # spin tensor W_ab = (L_ab - L_ba) / 2; Jaumann: dS = 2 G dev(eps) + W S - S W
                wxy, wxz, wyz = 0.5 * (lxy - lyx), 0.5 * (lxz - lzx), 0.5 * (lyz - lzy)
                a, b, c, d, e = stress[i, 0], stress[i, 1], stress[i, 2], stress[i, 3], stress[i, 4]
                f = -a - d
                stress_rate[i, 0] = 2.0 * G * exx + 2.0 * (wxy * b + wxz * c)
                stress_rate[i, 1] = 2.0 * G * exy + wxy * (d - a) + wxz * e + wyz * c
                stress_rate[i, 2] = 2.0 * G * exz + wxy * e + wxz * (f - a) - wyz * b
                stress_rate[i, 3] = 2.0 * G * eyy + 2.0 * (-wxy * b + wyz * e)
                stress_rate[i, 4] = 2.0 * G * eyz - wxy * c - wxz * b + wyz * (f - d)
            else:
                for k in range(5):
                    stress_rate[i, k] = 0.0


class Rates:
    """Time derivatives and by-products of one evaluation, kept from step to step.

    ``acceleration`` (n, 3), ``density`` [kg/(m^3 s)], ``energy`` [W/kg], ``stress`` (n, 5) [Pa/s], ``divergence`` of velocity [1/s],
    ``curl`` the size of its curl [1/s] (only where a switch of the viscosity asks for it), ``approach`` the largest -mu [m/s] of the viscosity, ``count``
    neighbours inside the support.
    """

    def __init__(self, n: int, curl: bool = False):
        self.acceleration, self.stress = np.zeros((n, 3)), np.zeros((n, 5))
        self.density, self.energy, self.divergence, self.approach = (np.zeros(n) for _ in range(4))
        self.curl = np.zeros(n if curl else 0)
        self.count = np.zeros(n, dtype=np.int32)


def compute(
    row, neighbours, cloud, shear, stiffness, alpha: float, beta: float, strength: bool, out: Rates,
    wendland: bool | None = None, clumping: float | None = None, start_density: np.ndarray | None = None,
    inverse: np.ndarray | None = None, beside: np.ndarray | None = None, switched: bool | None = None,
) -> None:  # fmt: skip
    """Fill ``out`` from evaluated rows and ``stiffness`` (``sph.state``) over the neighbour list.

    ``wendland`` True takes that kernel, None the cubic spline; ``clumping`` is the strength of the artificial stress, None for none; ``start_density`` (n,)
    goes with rows turned by ``sph.start_volumes``; ``inverse`` (n, 6) corrects the gradients (``sph.gradients``); ``switched`` True takes each particle's
    share of the viscosity (``sph.viscosity_switch``). ``beside`` (rows, 16) holds what either adds to a row.
    """
    if switched and len(out.curl) == 0:
        raise ValueError("a switch of the viscosity asks for the curl: Rates(n, curl=True)")
    _pairs(
        row, neighbours.index, neighbours.entry, neighbours.count, cloud.material, shear, stiffness, cloud.stress, alpha, beta, strength,
        wendland, clumping, start_density, inverse, beside, switched,
        out.acceleration, out.density, out.energy, out.stress, out.divergence, out.curl, out.approach, out.count,
    )  # fmt: skip
