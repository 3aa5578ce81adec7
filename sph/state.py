"""What the state of a particle says: pressure, sound speed, yield, damage; everything that a pair loop then only reads.

Order for every particle: equation of state -> tension cut -> yield (radial return) -> damage. Damage acts once per evaluation, on tension and on shear:

    P_eff = (1 - D) P for P < 0, else P;    S_eff = (1 - D) S

A particle that has lost its neighbours expands freely: its pressure and stress fade with the number of neighbours left, consistently in force and
energy, so that nothing is created; its remaining internal energy is booked in the history.
"""

from __future__ import annotations

import math

import numpy as np

from matter.errors import UnphysicalState
from matter.jit import law, parallel_kernel, prange
from sph.damage import grady_kipp
from sph.eos import tillotson
from sph.materials import Materials, Rows
from sph.strength import von_mises

FREE, BOUND = 4, 10  # a particle with at most FREE neighbours feels no pressure, from BOUND on all of it
WIDTH = 16  # values of a particle's row in the pair loop
# columns of a row: x y z vx vy vz volume(m/rho) 1/rho h c  sigma_xx xy xz yy yz zz (effective total stress)


@law
def holding(count):
    """The share of pressure and stress that a particle with ``count`` neighbours keeps."""
    return min(max((count - FREE) / (BOUND - FREE), 0.0), 1.0)


@parallel_kernel
def _evaluate(
    position, velocity, mass, rho, u, h, stress, root_damage, material, count, rows, flaw_first, flaw_last, flaw_strain, strength, damage,
    row, pressure, sound, wave, damage_rate, damage_cap, status,
):  # fmt: skip
    n = len(mass)
    for i in prange(n):
        m = material[i]
        t = rows.tillotson[m]
        p = tillotson.Parameters(t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7], t[8], t[9])
        bad = not (rho[i] > 0.0) or not (abs(u[i]) < 1e30) or not (abs(velocity[i, 0] + velocity[i, 1] + velocity[i, 2]) < 1e30)
        status[i] = 1 if bad else 0
        P, d_rho, d_u = tillotson.pressure_and_derivatives(rho[i], u[i], p)
        c2 = d_rho + P / (rho[i] * rho[i]) * d_u
        P = max(P, -rows.tension[m])
        keep = holding(count[i])
        sxx, sxy, sxz, syy, syz = stress[i, 0], stress[i, 1], stress[i, 2], stress[i, 3], stress[i, 4]
        D = 0.0
        damage_rate[i], damage_cap[i] = 0.0, 0.0
        if strength and rows.shear[m] > 0.0:
            szz = -sxx - syy
            J2 = 0.5 * (sxx * sxx + syy * syy + szz * szz) + sxy * sxy + sxz * sxz + syz * syz
            y = von_mises.Parameters(rows.von_mises[m, 0], rows.von_mises[m, 1])
            f = von_mises.return_factor(J2, von_mises.yield_stress(u[i], y))
            sxx, sxy, sxz, syy, syz = f * sxx, f * sxy, f * sxz, f * syy, f * syz
            stress[i, 0], stress[i, 1], stress[i, 2], stress[i, 3], stress[i, 4] = sxx, sxy, sxz, syy, syz
            if damage and rows.flawed[m] > 0.0:
                first, last = flaw_first[i], flaw_last[i]
                strain = grady_kipp.largest_principal(sxx, sxy, sxz, syy, syz, P) / rows.young[m]
                active = 0
                while first + active < last and flaw_strain[first + active] < strain:
                    active += 1
                cap = (active / (last - first)) ** (1.0 / 3.0)
                damage_cap[i] = cap
                if root_damage[i] < cap:
                    size = (mass[i] / rho[i] * 3.0 / (4.0 * math.pi)) ** (1.0 / 3.0)
                    damage_rate[i] = grady_kipp.growth_rate(float(active), rows.crack_speed[m], size)
            D = root_damage[i] ** 3
        else:
            sxx, sxy, sxz, syy, syz = 0.0, 0.0, 0.0, 0.0, 0.0
        if P < 0.0:
            P *= 1.0 - D
        P *= keep
        s = (1.0 - D) * keep
        c = math.sqrt(max(c2, 0.01 * p.A / p.rho0)) if keep > 0.0 else 0.0
        pressure[i], sound[i] = P, c
        wave[i] = math.sqrt(c * c + 4.0 / 3.0 * s * rows.shear[m] / rho[i]) if strength else c
        r = row[i]
        r[0], r[1], r[2] = position[i, 0], position[i, 1], position[i, 2]
        r[3], r[4], r[5] = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        r[6], r[7], r[8], r[9] = mass[i] / rho[i], 1.0 / rho[i], h[i], c
        r[10], r[11], r[12] = s * sxx - P, s * sxy, s * sxz
        r[13], r[14], r[15] = s * syy - P, s * syz, -s * (sxx + syy) - P


class Evaluated:
    """Work arrays of the evaluation, kept from step to step: ``row`` (n, 16), ``pressure``, ``sound``, ``wave`` (longitudinal speed),
    ``damage_rate`` of D^(1/3) [1/s] and its ``damage_cap``."""

    def __init__(self, n: int):
        self.row = np.zeros((n, WIDTH))
        self.pressure, self.sound, self.wave, self.damage_rate, self.damage_cap = (np.zeros(n) for _ in range(5))
        self.status = np.zeros(n, dtype=np.int8)


def evaluate(cloud, rows: Rows, strength: bool, damage: bool, out: Evaluated) -> None:
    """Fill ``out`` from the cloud's predicted state; the stress yields in place. A bad state is left in ``out.status`` for ``check``."""
    _evaluate(
        cloud.position, cloud.velocity, cloud.mass, cloud.density, cloud.specific_energy, cloud.smoothing_length, cloud.stress, cloud.root_damage,
        cloud.material, cloud.neighbours, rows, cloud.flaw_first, cloud.flaw_last, cloud.flaw_strain, strength, damage,
        out.row, out.pressure, out.sound, out.wave, out.damage_rate, out.damage_cap, out.status,
    )  # fmt: skip


def check(cloud, materials: Materials, out: Evaluated, time: float) -> None:
    """Raise ``UnphysicalState`` naming the first particle whose state no law covers."""
    if not out.status.any():
        return
    i = int(np.argmax(out.status))
    raise UnphysicalState(
        f"particle {int(cloud.identity[i])} ({materials.names[int(cloud.material[i])]}) at {cloud.position[i] / 1e3} km, t = {time:.4g} s: "
        f"density {cloud.density[i]:.4g} kg/m^3, specific energy {cloud.specific_energy[i]:.4g} J/kg, velocity {cloud.velocity[i]} m/s"
    )


def holding_array(count: np.ndarray) -> np.ndarray:
    """``holding`` for an array of neighbour counts."""
    return np.clip((count - FREE) / (BOUND - FREE), 0.0, 1.0)
