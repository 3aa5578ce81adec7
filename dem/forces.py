"""The contact of two grains (all components) and the loop over the half list of pairs, compiled for the laws that a case names.

Conventions: n points from grain i to grain j; u is the velocity of j's surface relative to i's at the contact,
u = v_j - v_i - (l1 w_i + l2 w_j) x n with l1 + l2 = d the lever arms to the contact plane of the two spheres, so that torques and
forces conserve angular momentum exactly. Laws and sources: ``dem.laws``; the combination is that of Zhang et al. 2017, Icarus 294, 98
(pkdgrav).

Every pair stands once in the list, in the row of the grain that comes first; its force goes to both grains. Threads take contiguous
chunks of rows; what a chunk adds to grains beyond its own end goes into its spill buffer and is added afterwards in the order of the chunks.
A result is therefore bitwise repeatable at one number of threads; between numbers of threads the last bits differ.

``pair_loop(scheme)`` compiles the loop for one ``Scheme``. Its flags are constants to the compiler, so a case pays for no law that it does not use.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from dem.laws import cohesion_sjkr, cohesion_zhang, normal_hertz, normal_hooke, rolling_sds, tangential_mindlin, tangential_spring, twisting_sds
from matter.jit import kernel, law

_hooke = normal_hooke.force
_hertz = normal_hertz.force
_tangential = tangential_spring.force
_kept = tangential_mindlin.kept
_rolling = rolling_sds.moment
_twisting = twisting_sds.moment
_zhang = cohesion_zhang.pull
_sjkr_area, _sjkr_volume = cohesion_sjkr.area, cohesion_sjkr.volume

# normal laws, and cohesion
HOOKE, HERTZ = 0, 1
NO_COHESION, ZHANG, SJKR = 0, 1, 2


class Scheme(NamedTuple):
    """What a pair loop is compiled for.

    ``normal`` HOOKE or HERTZ; ``mindlin`` rule of ``tangential_mindlin`` (0: springs of constant stiffness); ``cohesion`` NO_COHESION, ZHANG or SJKR;
    ``sliding`` rule of ``tangential_spring``; ``offset`` 1: contacts carry an offset to their overlap (``dem.following_stiffness``); ``sleep`` 1: rows
    without a grain awake near them are skipped (``dem.sleeping``); ``attract`` 1: grains attract each other (``dem.self_gravity``).
    """

    normal: int = HOOKE
    mindlin: int = 0
    cohesion: int = NO_COHESION
    sliding: int = tangential_spring.CAP
    offset: int = 0
    sleep: int = 0
    attract: int = 0

    @property
    def history(self) -> int:
        """Columns of a contact's history: tangential spring 0-2 [m], rolling spring 3-5 [rad], twisting spring 6 [rad], 7: in contact; and with
        springs of changing stiffness 8: the normal tangent stiffness that they were last laid down for [N/m], or with an offset 8: that [m]."""
        return 9 if self.mindlin or self.offset else 8


# columns of the history that every scheme has
HISTORY = 8

# what a chunk reports of a step
ELASTIC, DISSIPATED, EXCESS, CONTACTS, OVERLAP, OVERLAP_I, OVERLAP_J, OVER_WARN = range(8)
REPORT = 8


@law(forceinline=True)
def turned(sx, sy, sz, nx, ny, nz, angle):
    """A spring turned by ``angle`` about the normal, laid back into the contact plane, with its length kept."""
    s2 = sx * sx + sy * sy + sz * sz
    if s2 == 0.0:
        return sx, sy, sz
    tx = sx + angle * (ny * sz - nz * sy)
    ty = sy + angle * (nz * sx - nx * sz)
    tz = sz + angle * (nx * sy - ny * sx)
    along = tx * nx + ty * ny + tz * nz
    tx -= along * nx
    ty -= along * ny
    tz -= along * nz
    t2 = tx * tx + ty * ty + tz * tz
    if t2 == 0.0:
        return 0.0, 0.0, 0.0
    q = np.sqrt(s2 / t2)
    return tx * q, ty * q, tz * q


@law(forceinline=True)
def edge_of_contact(overlap, un, flag, dt):
    """Weight of the dashpots, time over which springs load, and the new flag, in a step in which a contact may begin or end.

    The force of step n stands for the interval n - 1/2 .. n + 1/2. A contact that began tau = x / |u_n| before n lasted for
    1/2 + tau/dt of it (above 1: the end of the interval before is made good), and one that ends tau after n likewise. Without this
    weight the jump of the dashpot force makes the restitution depend on the phase of the step, by 2 % at t_c/30 and e_n = 0.55.
    ``flag`` is 0 before the contact, else 1 + what the last step has already given to this one.
    """
    if flag == 0.0:
        if -un * dt > 0.0:
            part = min(1.0, overlap / (-un * dt))
            return 0.5 + part, part * dt, 1.0
        return 1.0, dt, 1.0
    given = flag - 1.0
    if un * dt > overlap:
        part = 0.5 + overlap / (un * dt)
        return part - given, dt, 1.0 + max(0.0, part - 1.0)
    return 1.0 - given, dt, 1.0


@law(forceinline=True)
def contact(
    nx, ny, nz, overlap, un, ux, uy, uz, rx, ry, rz, twist_rate, spin, k, reduced, radius, table, h, dt, tail, over_speed, pull, bound,
    rule, normal, mindlin,
):  # fmt: skip
    """One contact over one step: forces and moments on the first body, and the history brought up to date in ``h`` (8,).

    ``u`` slip velocity in the contact plane, ``un`` separation speed, ``r`` rolling rate, ``twist_rate`` and ``spin`` the relative and
    the mean spin about n; ``k`` k_n (Hertz: the tangent stiffness), ``reduced`` mass, ``radius`` R, ``table`` the pair's row of
    ``Contact.pair_table``; ``over_speed`` closing speed above which the excess is taken out by a further dashpot (0: none); ``pull`` [N] and
    ``bound`` [J] force and energy of cohesion; ``rule`` (sliding), ``normal`` and ``mindlin`` as in ``Scheme``.
    Returns (F_n, F_t x y z, M x y z, elastic energy, dissipated energy, excess energy): F_n pushes apart, F_t and M act on the first.
    """
    share, span, h[7] = edge_of_contact(overlap, un, h[7], dt)
    root = np.sqrt(k * reduced) * share
    damping = table[0] * root
    if normal == HERTZ:
        fn = _hertz(overlap, un, k, damping, tail)
        spent = (2.0 / 3.0 * k * overlap - fn) * un * dt
        stored = 4.0 / 15.0 * k * overlap * overlap
    else:
        fn = _hooke(overlap, un, k, damping, tail)
        spent = (k * overlap - fn) * un * dt
        stored = 0.5 * k * overlap * overlap
    excess = 0.0
    mu = table[2]
    if mu > 0.0:
        load = abs(fn)
        kt = k * table[6]
        ct = table[1] * root
        turn = spin * dt
        sx, sy, sz = turned(h[0], h[1], h[2], nx, ny, nz, turn)
        # springs of changing stiffness: ``kept`` of each stays, ``old`` turns the new stiffness into the one it was laid down for
        kept, old = 1.0, 1.0
        if mindlin != 0:
            kept, old = _kept(k, h[8], mindlin), h[8] / k
            h[8] = k
        before = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        if mindlin != 0:
            before *= old
            sx *= kept
            sy *= kept
            sz *= kept
        tx, ty, tz, sx, sy, sz = _tangential(sx + ux * span, sy + uy * span, sz + uz * span, ux, uy, uz, kt, ct, mu * load, rule)
        h[0] = sx
        h[1] = sy
        h[2] = sz
        after = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        spent += (tx * ux + ty * uy + tz * uz) * dt - (after - before)
        stored += after
        mx, my, mz = 0.0, 0.0, 0.0
        arm = table[3] * radius
        if arm > 0.0:
            if table[4] > 0.0:
                ax, ay, az = turned(h[3], h[4], h[5], nx, ny, nz, turn)
                kr = k * arm * arm
                before = 0.5 * kr * (ax * ax + ay * ay + az * az)
                if mindlin != 0:
                    before *= old
                    ax *= kept
                    ay *= kept
                    az *= kept
                mx, my, mz, ax, ay, az = _rolling(
                    ax + rx * span, ay + ry * span, az + rz * span, rx, ry, rz, kr, damping * arm * arm, table[4] * arm * load, rule
                )
                h[3] = ax
                h[4] = ay
                h[5] = az
                after = 0.5 * kr * (ax * ax + ay * ay + az * az)
                spent += (mx * rx + my * ry + mz * rz) * dt - (after - before)
                stored += after
            if table[5] > 0.0:
                kq = 2.0 * kt * arm * arm
                before = 0.5 * kq * h[6] * h[6]
                if mindlin != 0:
                    before *= old
                    h[6] *= kept
                mt, h[6] = _twisting(h[6] + twist_rate * span, twist_rate, kq, 2.0 * ct * arm * arm, table[5] * mu * arm * load, rule)
                after = 0.5 * kq * h[6] * h[6]
                spent += mt * twist_rate * dt - (after - before)
                stored += after
                mx += mt * nx
                my += mt * ny
                mz += mt * nz
    else:
        tx, ty, tz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if over_speed > 0.0 and -un > over_speed:
        # twice the step as the time constant: the excess is gone within a few steps, and no step can reverse it
        push = reduced * (-un - over_speed) / (2.0 * dt)
        fn += push
        excess = -push * un * dt
    if pull != 0.0:
        # its jump at the edges of the contact weighs like that of the dashpots
        fn -= pull * share
        stored -= bound
    return fn, tx, ty, tz, mx, my, mz, stored, spent, excess


@law
def released(h, k, radius, table, mindlin):
    """Energy [J] of the springs of a contact that opens: it is lost. Arguments as in ``contact``."""
    if mindlin != 0:
        k = h[8]
    arm = table[3] * radius
    kt, kr = k * table[6], k * arm * arm
    sliding = kt * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2])
    return 0.5 * (sliding + kr * (h[3] * h[3] + h[4] * h[4] + h[5] * h[5]) + 2.0 * kt * arm * arm * h[6] * h[6])


@functools.cache
def pair_loop(scheme: Scheme) -> Any:
    """The compiled loop for one scheme: ``pair_forces``."""
    normal, mindlin, cohesion, rule = scheme.normal, scheme.mindlin, scheme.cohesion, scheme.sliding
    offset, sleep = scheme.offset, scheme.sleep

    @kernel(fastmath=True)
    def pair_forces(lo, hi, X, V, kind, returned, row, col, hist, table, dt, tail, over_speed, warn, F, spill, report, live, row_energy):
        """Forces and torques of all pairs whose first grain lies in rows ``lo <= i < hi``.

        ``X`` (n, 4) positions and radii; ``V`` (n, 8) predicted velocities, spins, mass, k_n; ``kind`` species; ``returned`` 1 for grains
        that have been ballistic; ``row``/``col`` the list; ``hist`` (m, columns); ``table`` (s, s, columns). ``over_speed`` is the limit on the closing
        speed of a returned grain over the contact wave speed. ``F`` (n, 6): rows lo..hi are set here;
        contributions to grains at and beyond ``hi`` go to ``spill`` (n, 6), of which rows from ``hi`` on must be zero. ``report`` (REPORT,).
        ``live`` (n) rows to evaluate and ``row_energy`` (n, 2) elastic energy and contacts of each row when it last was (``sleep`` only).
        Returns the highest grain index that was written, so that only that part of the spill need be added.
        """
        for i in range(lo, hi):
            for c in range(6):
                F[i, c] = 0.0
        elastic, dissipated, excess = 0.0, 0.0, 0.0
        contacts, over, last = 0, 0, hi - 1
        worst, worst_i, worst_j = 0.0, -1, -1
        for i in range(lo, hi):
            if sleep != 0:
                if live[i] == 0:
                    elastic += row_energy[i, 0]
                    contacts += int(row_energy[i, 1])
                    continue
                elastic_before, contacts_before = elastic, contacts
            xi, yi, zi, ri = X[i, 0], X[i, 1], X[i, 2], X[i, 3]
            vxi, vyi, vzi, mi, ki = V[i, 0], V[i, 1], V[i, 2], V[i, 6], V[i, 7]
            wxi, wyi, wzi = V[i, 3], V[i, 4], V[i, 5]
            fx, fy, fz, gx, gy, gz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for e in range(row[i], row[i + 1]):
                j = col[e]
                nx, ny, nz = X[j, 0] - xi, X[j, 1] - yi, X[j, 2] - zi
                rj = X[j, 3]
                d2 = nx * nx + ny * ny + nz * nz
                touch = ri + rj
                if offset != 0:
                    touch += hist[e, 8]
                if d2 >= touch * touch:
                    if hist[e, 7] != 0.0:
                        dissipated += released(hist[e], min(ki, V[j, 7]), ri * rj / (ri + rj), table[kind[i], kind[j]], mindlin)
                        for c in range(8):
                            hist[e, c] = 0.0
                        if mindlin != 0 or (offset != 0 and hist[e, 8] > 0.0):
                            hist[e, 8] = 0.0
                    if offset != 0 and hist[e, 8] < 0.0 and d2 >= (ri + rj) * (ri + rj):
                        hist[e, 8] = 0.0
                    continue
                d = np.sqrt(d2)
                q = 1.0 / d
                nx *= q
                ny *= q
                nz *= q
                overlap = touch - d
                l1 = 0.5 * (d + (ri * ri - rj * rj) * q)
                l2 = d - l1
                wxj, wyj, wzj = V[j, 3], V[j, 4], V[j, 5]
                ax, ay, az = l1 * wxi + l2 * wxj, l1 * wyi + l2 * wyj, l1 * wzi + l2 * wzj
                ux = V[j, 0] - vxi - (ay * nz - az * ny)
                uy = V[j, 1] - vyi - (az * nx - ax * nz)
                uz = V[j, 2] - vzi - (ax * ny - ay * nx)
                un = ux * nx + uy * ny + uz * nz
                ux -= un * nx
                uy -= un * ny
                uz -= un * nz
                px, py, pz = wxj - wxi, wyj - wyi, wzj - wzi
                twist = px * nx + py * ny + pz * nz
                spin = 0.5 * ((wxi + wxj) * nx + (wyi + wyj) * ny + (wzi + wzj) * nz)
                s = 0.5 * (l2 - l1) / (l1 * l2)
                rx = px - twist * nx + s * (ny * uz - nz * uy)
                ry = py - twist * ny + s * (nz * ux - nx * uz)
                rz = pz - twist * nz + s * (nx * uy - ny * ux)
                mj = V[j, 6]
                k = min(ki, V[j, 7])
                reduced = mi * mj / (mi + mj)
                fast = 0.0
                if returned[i] + returned[j] > 0:
                    fast = over_speed * (ri + rj) * np.sqrt(0.5 * k / reduced)
                else:
                    ratio = overlap / min(ri, rj)
                    if ratio > worst:
                        worst, worst_i, worst_j = ratio, i, j
                    if ratio > warn:
                        over += 1
                radius = ri * rj / (ri + rj)
                if normal == HERTZ:
                    k = 2.0 * table[kind[i], kind[j], 7] * np.sqrt(radius * overlap)
                pull, bound = 0.0, 0.0
                if cohesion == ZHANG:
                    pull = _zhang(table[kind[i], kind[j], 8], table[kind[i], kind[j], 3], radius)
                    bound = pull * overlap
                elif cohesion == SJKR:
                    pull = table[kind[i], kind[j], 8] * _sjkr_area(overlap, ri, rj)
                    bound = table[kind[i], kind[j], 8] * _sjkr_volume(overlap, ri, rj)
                fn, tx, ty, tz, mx, my, mz, stored, spent, beyond = contact(
                    nx, ny, nz, overlap, un, ux, uy, uz, rx, ry, rz, twist, spin, k, reduced, radius,
                    table[kind[i], kind[j]], hist[e], dt, tail, fast, pull, bound, rule, normal, mindlin,
                )  # fmt: skip
                contacts += 1
                elastic += stored
                dissipated += spent
                excess += beyond
                tx -= fn * nx
                ty -= fn * ny
                tz -= fn * nz
                cx, cy, cz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
                fx += tx
                fy += ty
                fz += tz
                gx += l1 * cx + mx
                gy += l1 * cy + my
                gz += l1 * cz + mz
                if j < hi:
                    F[j, 0] -= tx
                    F[j, 1] -= ty
                    F[j, 2] -= tz
                    F[j, 3] += l2 * cx - mx
                    F[j, 4] += l2 * cy - my
                    F[j, 5] += l2 * cz - mz
                else:
                    spill[j, 0] -= tx
                    spill[j, 1] -= ty
                    spill[j, 2] -= tz
                    spill[j, 3] += l2 * cx - mx
                    spill[j, 4] += l2 * cy - my
                    spill[j, 5] += l2 * cz - mz
                    last = max(last, j)
            F[i, 0] += fx
            F[i, 1] += fy
            F[i, 2] += fz
            F[i, 3] += gx
            F[i, 4] += gy
            F[i, 5] += gz
            if sleep != 0:
                row_energy[i, 0] = elastic - elastic_before
                row_energy[i, 1] = contacts - contacts_before
        report[0], report[1], report[2], report[3] = elastic, dissipated, excess, contacts
        report[4], report[5], report[6], report[7] = worst, worst_i, worst_j, over
        return last

    return pair_forces
