"""One contact of two bodies, all components: how they meet, what the laws give over a step, and what the springs hold. Grains, walls and the periodic cell all
come here.

Conventions: n points from the first body to the second; u is the velocity of the second's surface relative to the first's at the contact,
u = v_2 - v_1 - (l1 w_1 + l2 w_2) x n with l1 + l2 = d the lever arms to the contact plane of the two spheres, so that torques and
forces conserve angular momentum exactly. Laws and sources: ``dem.laws``; the combination is that of Zhang et al. 2017, Icarus 294, 98
(pkdgrav).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dem.columns import COHESION, DAMPING_N, DAMPING_T, FRICTION, LAID, MODULUS, RATIO, ROLL, ROLLING, SHAPE, SLIP, TWIST, TWISTING
from dem.laws import cohesion_sjkr, cohesion_zhang, normal_hertz, normal_hooke, rolling_sds, tangential_mindlin, tangential_spring, twisting_sds
from dem.scheme import HERTZ, SJKR, ZHANG
from matter.jit import kernel, law

_hooke = normal_hooke.force
_hertz = normal_hertz.force
_tangential = tangential_spring.force
_kept = tangential_mindlin.kept
_rolling = rolling_sds.moment
_twisting = twisting_sds.moment
_zhang = cohesion_zhang.pull
_sjkr_area, _sjkr_volume = cohesion_sjkr.area, cohesion_sjkr.volume


class Meeting(NamedTuple):
    """How two bodies meet: unit vector ``n`` from the first to the second, ``overlap`` [m], separation speed ``un`` and slip velocity ``u`` in the contact
    plane [m/s], rolling rate ``r``, relative spin ``twist`` and mean ``spin`` about n [rad/s]."""

    nx: float
    ny: float
    nz: float
    overlap: float
    un: float
    ux: float
    uy: float
    uz: float
    rx: float
    ry: float
    rz: float
    twist: float
    spin: float


class Numbers(NamedTuple):
    """The numbers of a contact, as in a row of the table of pairs (``dem.columns``)."""

    damping_n: float
    damping_t: float
    friction: float
    shape: float
    rolling: float
    twisting: float
    ratio: float
    modulus: float
    strength: float


class Springs(NamedTuple):
    """The history of a contact (``dem.columns``): tangential spring ``s`` [m], rolling spring ``a`` and twisting spring ``phi`` [rad], ``flag``, and the
    stiffness that they were ``laid`` down for [N/m], where the scheme has it."""

    sx: float
    sy: float
    sz: float
    ax: float
    ay: float
    az: float
    phi: float
    flag: float
    laid: float


class Bodies(NamedTuple):
    """``stiffness``: k_n [N/m], the smaller of the two (of no account with Hertz); ``mass``: the reduced mass [kg]; ``radius``: R [m]; ``first`` and ``second``
    radius [m], the second 0 for a wall; ``over_speed``: closing speed [m/s] above which the excess is taken out by a further dashpot (0: none)."""

    stiffness: float
    mass: float
    radius: float
    first: float
    second: float
    over_speed: float


class Response(NamedTuple):
    """What a contact gives: normal force ``fn`` (pushes apart), tangential force ``t`` [N] and moment ``m`` [N m] on the first body; energy ``stored`` in
    springs, ``spent`` and taken out as ``excess`` in this step [J]; the ``springs`` after it."""

    fn: float
    tx: float
    ty: float
    tz: float
    mx: float
    my: float
    mz: float
    stored: float
    spent: float
    excess: float
    springs: Springs


class Ball(NamedTuple):
    """A grain as a contact sees it: ``radius`` [m] and spin ``w`` [rad/s]."""

    radius: float
    wx: float
    wy: float
    wz: float


@law(inline="always")  # in the caller's own code, with its fastmath: compiled by itself, its sums would be arranged otherwise
def meeting_of_grains(way, velocity, one, two, offset):
    """How two grains meet: their ``Meeting``, and the lever arms l1, l2 [m].

    ``way`` (3) from the first centre to the second [m], ``velocity`` (3) of the second relative to the first [m/s], ``one`` and ``two`` ``Ball``; ``offset``
    [m] is added to the overlap (``dem.spring_change``). Rolling rate: ``dem.laws.rolling_sds``.
    """
    nx, ny, nz = way
    ri, wxi, wyi, wzi = one
    rj, wxj, wyj, wzj = two
    d = math.sqrt(nx * nx + ny * ny + nz * nz)
    q = 1.0 / d
    nx *= q
    ny *= q
    nz *= q
    overlap = ri + rj + offset - d
    l1 = 0.5 * (d + (ri * ri - rj * rj) * q)
    l2 = d - l1
    ax, ay, az = l1 * wxi + l2 * wxj, l1 * wyi + l2 * wyj, l1 * wzi + l2 * wzj
    ux = velocity[0] - (ay * nz - az * ny)
    uy = velocity[1] - (az * nx - ax * nz)
    uz = velocity[2] - (ax * ny - ay * nx)
    un = ux * nx + uy * ny + uz * nz
    ux -= un * nx
    uy -= un * ny
    uz -= un * nz
    px, py, pz = wxj - wxi, wyj - wyi, wzj - wzi
    twist = px * nx + py * ny + pz * nz
    spin = 0.5 * ((wxi + wxj) * nx + (wyi + wyj) * ny + (wzi + wzj) * nz)
    lean = 0.5 * (l2 - l1) / (l1 * l2)
    rx = px - twist * nx + lean * (ny * uz - nz * uy)
    ry = py - twist * ny + lean * (nz * ux - nx * uz)
    rz = pz - twist * nz + lean * (nx * uy - ny * ux)
    return Meeting(nx, ny, nz, overlap, un, ux, uy, uz, rx, ry, rz, twist, spin), l1, l2


@law(forceinline=True)
def meeting_with_wall(n, distance, velocity, ball, overlap):
    """How a grain meets a wall, which is body 2 and at rest: u = -v - d w x n.

    ``n`` (3) unit vector towards the wall, ``distance`` d [m] of the grain's centre, ``velocity`` (3) [m/s], ``ball``, ``overlap`` [m]. The rolling rate lacks
    its second term, so that pure sliding raises no moment.
    """
    nx, ny, nz = n
    _, wx, wy, wz = ball
    ux = -velocity[0] - distance * (wy * nz - wz * ny)
    uy = -velocity[1] - distance * (wz * nx - wx * nz)
    uz = -velocity[2] - distance * (wx * ny - wy * nx)
    un = ux * nx + uy * ny + uz * nz
    wn = wx * nx + wy * ny + wz * nz
    return Meeting(nx, ny, nz, overlap, un, ux - un * nx, uy - un * ny, uz - un * nz, wn * nx - wx, wn * ny - wy, wn * nz - wz, -wn, wn)


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
    q = math.sqrt(s2 / t2)
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
def tangent_stiffness(overlap, bodies, numbers, normal):
    """k_n [N/m], with Hertz the tangent stiffness 2 E* sqrt(R x), from the overlap x [m]."""
    if normal == HERTZ:
        return 2.0 * numbers.modulus * math.sqrt(bodies.radius * overlap)
    return bodies.stiffness


@law(forceinline=True)
def cohesion_of(overlap, bodies, numbers, cohesion):
    """Pull [N] and binding energy [J] of cohesion at this overlap [m]."""
    if cohesion == ZHANG:
        pull = _zhang(numbers.strength, numbers.shape, bodies.radius)
        return pull, pull * overlap
    if cohesion == SJKR:
        pull = numbers.strength * _sjkr_area(overlap, bodies.first, bodies.second)
        return pull, numbers.strength * _sjkr_volume(overlap, bodies.first, bodies.second)
    return 0.0, 0.0


@law(forceinline=True)
def contact(meeting, bodies, numbers, springs, dt, tail, laws):
    """One contact over one step of ``dt`` [s]: a ``Response`` from ``Meeting``, ``Bodies``, ``Numbers`` and the ``Springs`` before it.

    ``tail``: the normal force may pull at the end of a contact; ``laws`` (normal, mindlin, cohesion, sliding) as in ``Scheme``. With ``mindlin`` and friction
    the springs are now laid down for the present tangent stiffness.
    """
    nx, ny, nz, overlap, un, ux, uy, uz, rx, ry, rz, twist_rate, spin = meeting
    sx, sy, sz, ax, ay, az, phi, flag, laid = springs
    normal, mindlin, cohesion, rule = laws
    reduced, radius, over_speed = bodies.mass, bodies.radius, bodies.over_speed
    k = tangent_stiffness(overlap, bodies, numbers, normal)
    pull, bound = cohesion_of(overlap, bodies, numbers, cohesion)
    share, span, flag = edge_of_contact(overlap, un, flag, dt)
    root = math.sqrt(k * reduced) * share
    damping = numbers.damping_n * root
    if normal == HERTZ:
        fn = _hertz(overlap, un, k, damping, tail)
        spent = (2.0 / 3.0 * k * overlap - fn) * un * dt
        stored = 4.0 / 15.0 * k * overlap * overlap
    else:
        fn = _hooke(overlap, un, k, damping, tail)
        spent = (k * overlap - fn) * un * dt
        stored = 0.5 * k * overlap * overlap
    excess = 0.0
    mu = numbers.friction
    tx, ty, tz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if mu > 0.0:
        load = abs(fn)
        kt = k * numbers.ratio
        ct = numbers.damping_t * root
        turn = spin * dt
        sx, sy, sz = turned(sx, sy, sz, nx, ny, nz, turn)
        # springs of changing stiffness: ``kept`` of each stays, ``old`` turns the new stiffness into the one it was laid down for
        kept, old = 1.0, 1.0
        if mindlin != 0:
            kept, old = _kept(k, laid, mindlin), laid / k
        before = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        if mindlin != 0:
            before *= old
            sx *= kept
            sy *= kept
            sz *= kept
        tx, ty, tz, sx, sy, sz = _tangential(sx + ux * span, sy + uy * span, sz + uz * span, ux, uy, uz, kt, ct, mu * load, rule)
        after = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        spent += (tx * ux + ty * uy + tz * uz) * dt - (after - before)
        stored += after
        arm = numbers.shape * radius
        if arm > 0.0:
            if numbers.rolling > 0.0:
                ax, ay, az = turned(ax, ay, az, nx, ny, nz, turn)
                kr = k * arm * arm
                before = 0.5 * kr * (ax * ax + ay * ay + az * az)
                if mindlin != 0:
                    before *= old
                    ax *= kept
                    ay *= kept
                    az *= kept
                mx, my, mz, ax, ay, az = _rolling(
                    ax + rx * span, ay + ry * span, az + rz * span, rx, ry, rz, kr, damping * arm * arm, numbers.rolling * arm * load, rule
                )
                after = 0.5 * kr * (ax * ax + ay * ay + az * az)
                spent += (mx * rx + my * ry + mz * rz) * dt - (after - before)
                stored += after
            if numbers.twisting > 0.0:
                kq = 2.0 * kt * arm * arm
                before = 0.5 * kq * phi * phi
                if mindlin != 0:
                    before *= old
                    phi *= kept
                mt, phi = _twisting(phi + twist_rate * span, twist_rate, kq, 2.0 * ct * arm * arm, numbers.twisting * mu * arm * load, rule)
                after = 0.5 * kq * phi * phi
                spent += mt * twist_rate * dt - (after - before)
                stored += after
                mx += mt * nx
                my += mt * ny
                mz += mt * nz
        if mindlin != 0:
            laid = k
    if over_speed > 0.0 and -un > over_speed:
        # twice the step as the time constant: the excess is gone within a few steps, and no step can reverse it
        push = reduced * (-un - over_speed) / (2.0 * dt)
        fn += push
        excess = -push * un * dt
    if pull != 0.0:
        # its jump at the edges of the contact weighs like that of the dashpots
        fn -= pull * share
        stored -= bound
    return Response(fn, tx, ty, tz, mx, my, mz, stored, spent, excess, Springs(sx, sy, sz, ax, ay, az, phi, flag, laid))


@law
def released(h, k, radius, table, mindlin):
    """Energy [J] of the springs of a contact that opens, which is lost: history ``h`` and ``table`` rows of their tables, k_n [N/m], R [m]."""
    if mindlin != 0:
        k = h[LAID]
    arm = table[SHAPE] * radius
    kt, kr = k * table[RATIO], k * arm * arm
    sliding = kt * (h[SLIP] * h[SLIP] + h[SLIP + 1] * h[SLIP + 1] + h[SLIP + 2] * h[SLIP + 2])
    rolling = kr * (h[ROLL] * h[ROLL] + h[ROLL + 1] * h[ROLL + 1] + h[ROLL + 2] * h[ROLL + 2])
    return 0.5 * (sliding + rolling + 2.0 * kt * arm * arm * h[TWIST] * h[TWIST])


def turned_energy(h: np.ndarray, k: np.ndarray, radius: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Energy [J] of the tangential, rolling and twisting springs of many contacts, (c,): ``released`` for rows of histories and tables."""
    arm2, kt = (table[:, SHAPE] * radius) ** 2, k * table[:, RATIO]
    slip2, roll2 = np.sum(h[:, SLIP:ROLL] ** 2, axis=1), np.sum(h[:, ROLL:TWIST] ** 2, axis=1)
    return np.asarray(0.5 * (kt * slip2 + k * arm2 * roll2 + 2.0 * kt * arm2 * h[:, TWIST] ** 2))


@law(forceinline=True)
def numbers_of(row):
    """``Numbers`` from a row of the table of pairs."""
    return Numbers(
        row[DAMPING_N], row[DAMPING_T], row[FRICTION], row[SHAPE], row[ROLLING], row[TWISTING], row[RATIO], row[MODULUS], row[COHESION]
    )  # fmt: skip


@kernel
def at_rest(overlap, radii, stiffness, rows, normal, cohesion):
    """Contacts at rest: k_n (Hertz: the tangent stiffness) [N/m] and normal force, cohesion included [N], each (c,).

    ``overlap`` (c,) [m], ``radii`` (c, 2) [m], ``stiffness`` (c,) the smaller k_n [N/m], ``rows`` (c, columns) of the table of pairs.
    """
    k, push = np.empty(len(overlap)), np.empty(len(overlap))
    for c in range(len(overlap)):
        first, second = radii[c, 0], radii[c, 1]
        bodies = Bodies(stiffness[c], 0.0, first * second / (first + second), first, second, 0.0)
        numbers = numbers_of(rows[c])
        k[c] = tangent_stiffness(max(overlap[c], 0.0), bodies, numbers, normal)
        push[c] = _hertz(overlap[c], 0.0, k[c], 0.0, True) if normal == HERTZ else _hooke(overlap[c], 0.0, k[c], 0.0, True)
        push[c] -= cohesion_of(overlap[c], bodies, numbers, cohesion)[0]
    return k, push
