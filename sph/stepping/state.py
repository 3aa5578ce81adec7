"""What the state of a particle says: pressure, sound speed, yield, damage, pores; everything that a pair loop then
only reads.

Order for every particle: pores -> equation of state -> tension cut -> yield (radial return) -> damage. Damage acts
once per evaluation: on tension always, on shear where the yield law does not know it (von Mises); Drucker-Prager and
Collins mix it into the yield stress, and broken material keeps its friction. Friction goes by the mean pressure of the
neighbours (``sph.pairs.bearing_pressure``), tension by the particle's own.

    P_eff = (1 - D) P for P < 0, else P;    S_eff = (1 - D) S / alpha  or  S / alpha

S is that of the matrix, and so are the pressure and the strains that yield and flaws see (sigma_s = alpha sigma). The
tension cut is the material's, or where the cone of Drucker and Prager ends, whichever is less; heat softens both as it
does the yield stress, and in porous material they are divided by alpha like every stress. From Tillotson's energy of
incipient vaporisation on matter bears neither shear nor tension, though its melt energy may not be known: a ball of
aluminium of 7 MJ/kg that holds together flies off as a clump. Cracks run at 0.4 of the longitudinal speed, in pores as
much slower as sound.

A particle that has lost its neighbours expands freely: its pressure and stress fade with the number of neighbours
left, consistently in force and energy, so that nothing is created; its remaining internal energy is booked in the
history.

Artificial viscosity takes the speed of the compaction wave while pores close (``sph.porosity.loading_speed``), a tenth
to a third of that of sound.

The step goes by the longitudinal speed, c_l^2 = c^2 + 4/3 G / (alpha rho). What cannot hold any shear stress (Y = 0:
sand that has parted, melt) has no shear wave; such matter is not stiffer per mass for being thin, so that G / rho
counts with the density at rest where that is larger. Ejecta of a hundredth of it would else set the step by ten times
the speed of the ground.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from matter.compilation.jit import inner_kernel, law, parallel_kernel, prange
from matter.errors import UnphysicalState
from matter.files import checkpoint
from sph.bodies.particle_cloud import Cloud
from sph.damage import grady_kipp, growth
from sph.eos import dispatch as eos
from sph.materials import temperature
from sph.materials.rows import Materials, Rows
from sph.pairs import bearing_pressure
from sph.pairs.row import RHO_INVERSE, SOUND, SUPPORT, VOLUME, VX, VY, VZ, WIDTH, XX, XY, XZ, YY, YZ, ZZ, X, Y, Z
from sph.porosity import compaction_damage, loading_speed
from sph.porosity import dispatch as porosity
from sph.stepping import fine_particles
from sph.strength import block_model, inertial_friction, thermal_softening, von_mises
from sph.strength import dispatch as strengths
from sph.strength.block_model import SOUND as SOUND_AT_REST
from sph.strength.block_model import VISCOSITY
from sph.strength.inertial_friction import DIAMETER, I0, RATIO

FREE, BOUND = 4, 10  # a particle with at most FREE neighbours feels no pressure, from BOUND on all of it

KEPT = ("pressure", "sound", "wave", "damage_rate", "damage_cap", "distention", "strain_ratio", "status")
"""What of ``Evaluated`` a resumed run needs before it evaluates again."""


@law
def interaction_fraction(count):
    """The fraction of pressure and stress that a particle with ``count`` neighbours keeps."""
    return min(max((count - FREE) / (BOUND - FREE), 0.0), 1.0)


class Response(NamedTuple):
    """The arrays of ``Evaluated`` that every particle has, as the loops take them."""

    row: np.ndarray
    pressure: np.ndarray
    sound: np.ndarray
    wave: np.ndarray
    damage_rate: np.ndarray
    damage_cap: np.ndarray
    status: np.ndarray


class Pores(NamedTuple):
    """The arrays of ``Evaluated`` that only porous material has: the present ``distention`` (n,), ``strain_ratio``
    (n, 2)."""

    distention: np.ndarray
    strain_ratio: np.ndarray


class Late(NamedTuple):
    """The linear media of the late stage (``sph.stepping.late``): ``density`` (n,) without pressure [kg/m^3], ``c2``
    (m,) squared sound speeds [m^2/s^2], ``full`` (m,) mass of a particle that has them [kg]; all empty before it
    begins (None would be another type, and the loop compiled twice). Out: ``strain_ratio`` (n, 2), in which a finer
    particle's softness stands."""

    density: np.ndarray
    c2: np.ndarray
    full: np.ndarray
    strain_ratio: np.ndarray


NOT_LATE = (np.empty(0), np.empty(0))
"""``c2`` and ``full`` before the late stage."""


class Physics(NamedTuple):
    """Which physics is on: shear ``strength``, ``damage``, and whether pores give way for good (``crushing``)."""

    strength: bool
    damage: bool
    crushing: bool


_BLOCK = 256  # particles that a thread takes at a time


@law
def _close_pores(i, cloud, rows, pores, crushing, late_density, late_c2):
    """The present distention of a particle and the factor of its sound speed; fills ``pores`` and compacts the cloud's
    distention, in the linear medium of the late stage (``late_c2`` > 0) with its ``late_density``."""
    m = cloud.material[i]
    a, slow = 1.0, 1.0
    pore_law = rows.porosity[m], rows.pores[m], rows.crush[m], rows.crush_row[m], rows.eos[m], rows.eos_row[m]
    if rows.porosity[m] > 0 and late_c2 > 0.0:
        a = cloud.distention[i]
        if crushing:
            medium = porosity.LinearMedium(a * late_density[i], late_c2)
            a = porosity.compact_linear(*pore_law, cloud.density[i], cloud.specific_energy[i], a, medium)
            cloud.distention[i], late_density[i] = a, medium.solid / a
    elif rows.porosity[m] > 0:
        a, rest, loading, unloading, slow = porosity.compact(
            *pore_law, cloud.density[i], cloud.specific_energy[i], cloud.distention[i], crushing
        )
        cloud.distention[i] = rest
        pores.strain_ratio[i, 0], pores.strain_ratio[i, 1] = loading, unloading
    pores.distention[i] = a
    return a, slow


@law
def _inertial(rate, inertial, rho0, P):
    """The factor of what bears friction at this ``rate`` (6,) of strain; 1 where friction does not go by it."""
    if not (inertial[DIAMETER] > 0.0 and P > 0.0):
        return 1.0
    number = inertial_friction.inertial_number(
        rate[0], rate[1], rate[2], rate[3], rate[4], rate[5], inertial[DIAMETER], rho0, P
    )
    return inertial_friction.factor(number, inertial[I0], inertial[RATIO])


@law
def _shaken(limit, v_vib, rate, law, rows, m, bearing, rho, heat, D):
    """The ``limit`` of the shear stress, lowered by the vibration (``sph.strength.block_model``)."""
    p_vib = block_model.pressure(v_vib, bearing, rho, rows.vibration[m, SOUND_AT_REST])
    left = strengths.yield_stress(law, rows.strength_row[m], bearing - D * D * p_vib, heat, D)
    return min(limit, left + block_model.viscous(rate, rho, rows.vibration[m, VISCOSITY]))


@law
def _crack_growth(i, strain, D, slow, cloud, rows):
    """Cap of D^(1/3) and its rate [1/s] for a particle in which the largest principal strain is ``strain``."""
    m, first, last, flaw_strain = cloud.material[i], cloud.flaw_first[i], cloud.flaw_last[i], cloud.flaw_strain
    number = max(float(cloud.flaw_total[i]), float(last - first))
    opens = grady_kipp.active(flaw_strain, first, last, number, strain)
    if opens == 0.0:
        return 0.0, 0.0
    kind, mass, rho = rows.growth[m], cloud.mass[i], cloud.density[i]
    opened, total = growth.counted(kind, opens, number, strain, flaw_strain[first], flaw_strain[last - 1])
    cap = growth.cap(kind, opened, total)
    if cloud.root_damage[i] >= cap:
        return cap, 0.0
    crack = growth.crack_speed(kind, rows.crack_speed[m], rows.bulk[m], rows.shear[m], rho, D) * slow
    size = (mass / rho * 3.0 / (4.0 * math.pi)) ** (1.0 / 3.0)
    return cap, growth.rate(kind, opened, total, crack, size, cloud.support_radius[i])


@inner_kernel
def _evaluate_some(block, cloud, rows, physics, out, pores, late, plastic, rate, vibration):
    """One evaluation of the particles of a ``block``; arguments as ``_evaluate``."""
    position, velocity, mass, rho, u = cloud.position, cloud.velocity, cloud.mass, cloud.density, cloud.specific_energy
    h = cloud.support_radius
    stress, root_damage, material = cloud.stress, cloud.root_damage, cloud.material
    row, pressure, sound, wave, status = out.row, out.pressure, out.sound, out.wave, out.status
    damage_rate, damage_cap, strength, damage = out.damage_rate, out.damage_cap, physics.strength, physics.damage
    late_density, late_c2, linear = late.density, late.c2, len(late.c2) > 0
    for i in range(block * _BLOCK, min(len(mass), (block + 1) * _BLOCK)):
        m = material[i]
        bad = (
            not (rho[i] > 0.0)
            or not (abs(u[i]) < 1e30)
            or not (abs(velocity[i, 0] + velocity[i, 1] + velocity[i, 2]) < 1e30)
        )
        status[i] = 1 if bad else 0
        a, slow, G, c2, soft = 1.0, 1.0, rows.shear[m], 0.0, 1.0
        if linear:
            soft = fine_particles.softness(mass[i], late.full[m])
            c2 = soft * late_c2[m]
        closing2 = c2
        if pores is not None:
            a, slow = _close_pores(i, cloud, rows, pores, physics.crushing, late_density, c2)
        inv_distention = 1.0 / a
        if not linear:
            P, d_rho, d_u = eos.pressure_and_derivatives(rows.eos[m], rows.eos_row[m], a * rho[i], u[i])
            P *= inv_distention
            heating = P * inv_distention / (rho[i] * rho[i]) * d_u
            c2 = slow * slow * (d_rho + heating)
            closing2 = c2
            if pores is not None and pores.strain_ratio[i, 0] < pores.strain_ratio[i, 1]:
                closing2 = min(loading_speed.squared(d_rho, heating, P, rho[i], pores.strain_ratio[i, 0]), c2)
        else:
            P = c2 * (rho[i] - late_density[i])
            G *= soft
            late.strain_ratio[i, 0], late.strain_ratio[i, 1] = soft, soft
        heat = u[i]
        if rows.thermal[m, temperature.SPAN] > 0.0:
            heat = temperature.melting(rows.eos[m], rows.eos_row[m], rows.thermal[m], a * rho[i], u[i])
        boiling = heat >= rows.boils[m]  # what boils is no solid, whether its material says when it melts or not
        cut = 0.0 if boiling else rows.tension[m] * thermal_softening.softening(heat, rows.melt[m])
        P = max(P, -cut * inv_distention)
        keep = interaction_fraction(cloud.neighbours[i])
        sxx, sxy, sxz, syy, syz = stress[i, 0], stress[i, 1], stress[i, 2], stress[i, 3], stress[i, 4]
        D, s, carrying = 0.0, keep * inv_distention, rho[i]
        damage_rate[i], damage_cap[i] = 0.0, 0.0
        if strength and G > 0.0:
            root = root_damage[i]
            if pores is not None and damage and rows.growth[m] > 0:
                root = compaction_damage.total(
                    root, compaction_damage.root(cloud.distention[i], cloud.initial_distention[i])
                )
            D = root * root * root
            law = rows.strength[m]
            P = max(P, -strengths.apex(law, rows.strength_row[m], heat, D) * inv_distention)
            szz = -sxx - syy
            J2 = 0.5 * (sxx * sxx + syy * syy + szz * szz) + sxy * sxy + sxz * sxz + syz * syz
            bearing = a * bearing_pressure.of_friction(cloud.mean_pressure[i], P, a * rho[i] / rows.rho0[m])
            if rate is not None:
                bearing *= _inertial(rate[i], rows.inertial[m], rows.rho0[m], bearing * inv_distention)
            limit = strengths.yield_stress(law, rows.strength_row[m], bearing, heat, D)
            if vibration is not None and vibration[i] > 0.0:
                limit = _shaken(limit, vibration[i], rate[i], law, rows, m, bearing, rho[i], heat, D)
            if plastic is not None:
                limit *= strengths.hardening(law, rows.strength_row[m], plastic[i])
            if boiling:
                limit = 0.0
            if limit <= 0.0:
                carrying = max(carrying, rows.rho0[m] * inv_distention)
            f = von_mises.return_factor(J2, limit)
            if plastic is not None:
                plastic[i] += (1.0 - f) * math.sqrt(3.0 * J2) / (3.0 * G)
            sxx, sxy, sxz, syy, syz = f * sxx, f * sxy, f * sxz, f * syy, f * syz
            stress[i, 0], stress[i, 1], stress[i, 2], stress[i, 3], stress[i, 4] = sxx, sxy, sxz, syy, syz
            if damage and rows.flawed[m] > 0.0:
                strain = grady_kipp.largest_principal(sxx, sxy, sxz, syy, syz, a * P) / rows.young[m]
                damage_cap[i], damage_rate[i] = _crack_growth(i, strain, D, slow, cloud, rows)
            if rows.mixes_damage[m] == 0:
                s *= 1.0 - D
        else:
            sxx, sxy, sxz, syy, syz = 0.0, 0.0, 0.0, 0.0, 0.0
        if P < 0.0:
            P *= 1.0 - D
        P *= keep
        if not linear:
            c2, closing2 = max(c2, rows.least_c2[m]), max(closing2, rows.least_c2[m])
        c, closing = (math.sqrt(c2), math.sqrt(closing2)) if keep > 0.0 else (0.0, 0.0)
        pressure[i], sound[i] = P, c
        wave[i] = math.sqrt(c * c + 4.0 / 3.0 * s * G / carrying) if strength else c
        r = row[i]
        r[X], r[Y], r[Z] = position[i, 0], position[i, 1], position[i, 2]
        r[VX], r[VY], r[VZ] = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        r[VOLUME], r[RHO_INVERSE], r[SUPPORT], r[SOUND] = mass[i] / rho[i], 1.0 / rho[i], h[i], closing
        r[XX], r[XY], r[XZ] = s * sxx - P, s * sxy, s * sxz
        r[YY], r[YZ], r[ZZ] = s * syy - P, s * syz, -s * (sxx + syy) - P


@parallel_kernel
def _evaluate(cloud, rows, physics, out, pores, late, plastic, rate, vibration):
    """One evaluation of every particle; compiled without pores, plastic strain, rate of strain or vibration where
    these are None.

    In: ``sph.bodies.particle_cloud.Fields``, ``sph.materials.Rows``, ``Physics``, ``Late``, and, where the friction
    depends on them, the rates of strain (n, 6) and the speeds of vibration (n,). Out: ``Response`` and ``Pores``. The
    stress (yielded), distention (compacted) and plastic strain of the cloud change in place.
    """
    n = len(cloud.mass)
    # numba drops what such a loop itself writes to arrays inside a tuple, not what it calls
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        # int64 as where its type is first inferred: the loop's own index is unsigned, and would compile it twice
        _evaluate_some(np.int64(block), cloud, rows, physics, out, pores, late, plastic, rate, vibration)


class Evaluated:
    """Work arrays of the evaluation, kept from step to step: ``row`` (n, 16), ``pressure``, speed of ``sound`` and of
    the longitudinal ``wave``, ``damage_rate`` of D^(1/3) [1/s] and its ``damage_cap``, the present ``distention``, and
    ``strain_ratio`` (n, 2), by which the shear modulus is multiplied: strain of the matrix over that of the porous
    material (the factor f of P-alpha) in compression and in expansion, in the late stage a fine particle's softness
    (``sph.stepping.fine_particles``)."""

    def __init__(self, n: int):
        self.row = np.zeros((n, WIDTH))
        self.pressure, self.sound, self.wave, self.damage_rate, self.damage_cap = (np.zeros(n) for _ in range(5))
        self.distention, self.strain_ratio = np.ones(n), np.ones((n, 2))
        self.status = np.zeros(n, dtype=np.int8)

    @property
    def loading_sound(self) -> np.ndarray:
        """Speed (n,) [m/s] of sound, or of the compaction wave while pores close, as it stands in the rows."""
        return self.row[: len(self.pressure), SOUND]

    @property
    def response(self) -> Response:
        """The arrays as the compiled loops take them."""
        return Response(self.row, self.pressure, self.sound, self.wave, self.damage_rate, self.damage_cap, self.status)

    def state(self) -> dict[str, np.ndarray]:
        """What a resumed run needs before it evaluates again."""
        return {name: getattr(self, name) for name in KEPT}

    def restore(self, saved: checkpoint.State) -> None:
        """Take up a ``state``."""
        for name in KEPT:
            getattr(self, name)[:] = saved[name]

    def fit(self, rows: int) -> None:
        """Room for ``rows`` rows, those of images behind the particles' own."""
        if len(self.row) != rows:
            self.row = np.zeros((rows, WIDTH))


def evaluate(
    cloud: Cloud,
    rows: Rows,
    strength: bool,
    damage: bool,
    out: Evaluated,
    crushing: bool = True,
    late: tuple[np.ndarray, np.ndarray] = NOT_LATE,
) -> None:
    """Fill ``out`` from the cloud's predicted state; the stress yields and pores close in place. A bad state is left
    in ``out.status`` for ``check``.

    ``crushing`` False: pores give way elastically only (relaxation). ``late`` (m,), (m,): squared sound speeds of the
    late stage and the mass of a particle that has them (``sph.stepping.late``).
    """
    pores = Pores(out.distention, out.strain_ratio) if (rows.alpha0 > 1.0).any() else None
    medium = Late(cloud.late_density, *late, out.strain_ratio)
    plastic = cloud.plastic_strain if len(cloud.plastic_strain) else None
    physics = Physics(strength, damage, crushing)
    vibration = cloud.vibration if len(cloud.vibration) else None
    by_rate = vibration is not None or bool((rows.inertial[:, DIAMETER] > 0.0).any())
    rate = cloud.strain_rate if by_rate else None
    _evaluate(cloud.fields, rows, physics, out.response, pores, medium, plastic, rate, vibration)


def damage_of(cloud, rows: Rows) -> np.ndarray:
    """D of every particle (n,): by tension and, in porous material that breaks, by crushing."""
    start = cloud.initial_distention
    breaks = (rows.growth[cloud.material] > 0) & (start > 1.0)
    crushed = np.clip((start - cloud.distention) / np.where(breaks, start - 1.0, 1.0), 0.0, 1.0)
    return np.minimum(cloud.root_damage + np.where(breaks, np.cbrt(crushed), 0.0), 1.0) ** 3


def check(cloud, materials: Materials, out: Evaluated, time: float) -> None:
    """Raise ``UnphysicalState`` naming the first particle whose state no law covers."""
    if not out.status.any():
        return
    i = int(np.argmax(out.status))
    raise UnphysicalState(
        f"particle {int(cloud.identity[i])} ({materials.names[int(cloud.material[i])]}) at {cloud.position[i] / 1e3} "
        f"km, t = {time:.4g} s: "
        f"density {cloud.density[i]:.4g} kg/m^3, specific energy {cloud.specific_energy[i]:.4g} J/kg, velocity "
        f"{cloud.velocity[i]} m/s"
    )


def interaction_fractions(count: np.ndarray) -> np.ndarray:
    """``interaction_fraction`` for an array of neighbour counts."""
    return np.clip((count - FREE) / (BOUND - FREE), 0.0, 1.0)
