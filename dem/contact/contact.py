"""One contact of two bodies, all components: how they meet, what the laws give over a step, and what the springs hold.
Grains, walls and the periodic cell all come here.

Conventions: n points from the first body to the second; u is the velocity of the second's surface relative to the
first's at the contact, u = v_2 - v_1 - (l1 w_1 + l2 w_2) x n with l1 + l2 = d the lever arms to the contact plane of
the two spheres, so that torques and forces conserve angular momentum exactly. Laws and sources: ``dem.laws``; the
combination is that of Zhang et al. 2017, Icarus 294, 98 (pkdgrav).
"""

from __future__ import annotations

import math
import sys
from typing import Any, NamedTuple

import numpy as np

from dem.contact.columns import (
    COHESION,
    DAMPING_N,
    NORMAL,
    PAIR_COLUMNS,
    RATIO,
    REFERENCE_STIFFNESS,
    ROLL,
    SHAPE,
    SLIP,
    TWIST,
)
from dem.laws import dispatch as chosen
from matter.compilation.jit import kernel, law
from matter.compilation.law_family import compiled


class Numbers(NamedTuple):
    """The numbers of a contact, as in a row of the table of pairs (``dem.contact.columns``); those of the normal law
    and of cohesion are rows of their families."""

    damping_n: float
    damping_t: float
    friction: float
    shape: float
    rolling: float
    twisting: float
    ratio: float
    normal: tuple[float, ...]
    cohesion: tuple[float, ...]


class Springs(NamedTuple):
    """The history of a contact (``dem.contact.columns``): tangential spring ``s`` [m], rolling spring ``a`` and
    twisting spring ``phi`` [rad], ``flag``, and ``reference_stiffness`` [N/m], the normal tangent stiffness to which
    the springs refer, where the scheme has it."""

    sx: float
    sy: float
    sz: float
    ax: float
    ay: float
    az: float
    phi: float
    flag: float
    reference_stiffness: float


class Bodies(NamedTuple):
    """``stiffness``: k_n [N/m], the smaller of the two (of no account with Hertz); ``mass``: the reduced mass [kg];
    ``radius``: R [m]; ``first`` and ``second`` radius [m], the second 0 for a wall; ``over_speed``: closing speed
    [m/s] above which the excess is taken out by a further dashpot (0: none)."""

    stiffness: float
    mass: float
    radius: float
    first: float
    second: float
    over_speed: float


class Response(NamedTuple):
    """What a contact gives: normal force ``fn`` (pushes apart), tangential force ``t`` [N] and moment ``m`` [N m] on
    the first body; ``elastic_energy`` in springs, ``dissipated_energy`` and ``excess`` taken out in this step [J]; the
    ``springs`` after it."""

    fn: float
    tx: float
    ty: float
    tz: float
    mx: float
    my: float
    mz: float
    elastic_energy: float
    dissipated_energy: float
    excess: float
    springs: Springs


@law(forceinline=True)
def lowered(numbers, bearing):
    """The ``Numbers`` of a contact of which only the fraction ``bearing`` of the normal force makes friction
    (``dem.laws.shaken_friction``): limits of sliding, rolling and twisting fall with it."""
    return Numbers(
        numbers.damping_n,
        numbers.damping_t,
        numbers.friction * bearing,  # twisting has it too
        numbers.shape,
        numbers.rolling * bearing,
        numbers.twisting,
        numbers.ratio,
        numbers.normal,
        numbers.cohesion,
    )


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
    """Weight of the dashpots, time over which springs load, and the new flag, in a step in which a contact may begin
    or end.

    The force of step n stands for the interval n - 1/2 .. n + 1/2. A contact that began tau = x / |u_n| before n
    lasted for 1/2 + tau/dt of it (above 1: the end of the interval before is made good), and one that ends tau after n
    likewise. Without this weight the jump of the dashpot force makes the restitution depend on the phase of the step,
    by 2 % at t_c/30 and e_n = 0.55. ``flag`` is 0 before the contact, else 1 + what the last step has already given to
    this one.
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
def _rolling(kinematics, spring, limit, kr, damping, step, scheme):
    """Moment (3) [N m] and spring (3) [rad] of rolling after a step, the energy [J] that it dissipates and that it
    holds. ``step``: turn about the normal, time the spring grows for, length; what stays of the spring, and its
    stiffness over the present one."""
    nx, ny, nz, _, _, ux, uy, uz, rx, ry, rz, _, _, curvature_difference = kinematics
    turn, span, dt, kept, old = step
    ax, ay, az = turned(spring[0], spring[1], spring[2], nx, ny, nz, turn)
    before = 0.5 * kr * (ax * ax + ay * ay + az * az)
    if scheme.rescale != 0:
        before *= old
        ax *= kept
        ay *= kept
        az *= kept
    mx, my, mz, ax, ay, az = chosen.rolling_moment(
        scheme.rolling, ax + rx * span, ay + ry * span, az + rz * span, rx, ry, rz, kr, damping, limit
    )
    after = 0.5 * kr * (ax * ax + ay * ay + az * az)
    # sliding turns the spring of unequal grains too, but the moment works on their spins alone
    slid = mx * (ny * uz - nz * uy) + my * (nz * ux - nx * uz) + mz * (nx * uy - ny * ux)
    spent = (mx * rx + my * ry + mz * rz - curvature_difference * slid) * dt - (after - before)
    return mx, my, mz, ax, ay, az, spent, after


@law(forceinline=True)
def _twisting(rate, phi, limit, kq, damping, step, scheme):
    """Moment [N m] about the normal and spring [rad] of twisting after a step, the energy [J] that it dissipates and
    that it holds; ``step`` as in ``_rolling``, without the turn."""
    span, dt, kept, old = step
    before = 0.5 * kq * phi * phi
    if scheme.rescale != 0:
        before *= old
        phi *= kept
    mt, phi = chosen.twisting_moment(scheme.twisting, phi + rate * span, rate, kq, damping, limit)
    after = 0.5 * kq * phi * phi
    return mt, phi, mt * rate * dt - (after - before), after


@law(forceinline=True)
def contact(kinematics, bodies, numbers, springs, dt, scheme):
    """One contact over one step of ``dt`` [s]: a ``Response`` from ``ContactKinematics``, ``Bodies``, ``Numbers`` and
    the ``Springs`` before it.

    ``scheme`` a ``dem.contact.contact_scheme.Scheme``: which laws. With ``rescale`` and friction the springs then
    refer to the present tangent stiffness.
    """
    nx, ny, nz, overlap, un, ux, uy, uz, _, _, _, twist_rate, spin, _ = kinematics
    sx, sy, sz, ax, ay, az, phi, flag, reference_stiffness = springs
    normal, rescale = scheme.normal, scheme.rescale
    reduced, radius, over_speed = bodies.mass, bodies.radius, bodies.over_speed
    k = chosen.stiffness(normal, numbers.normal, overlap, bodies)
    pull = chosen.pull(scheme.cohesion, numbers.cohesion, overlap, bodies)
    bound = chosen.binding_energy(scheme.cohesion, numbers.cohesion, overlap, bodies)
    fraction, span, flag = edge_of_contact(overlap, un, flag, dt)
    root = math.sqrt(k * reduced) * fraction
    damping = numbers.damping_n * root
    fn = chosen.normal_force(normal, overlap, un, k, damping)
    dissipated_energy = (chosen.elastic_force(normal, overlap, k) - fn) * un * dt
    elastic_energy = chosen.elastic_energy(normal, overlap, k)
    excess = 0.0
    mu = numbers.friction
    tx, ty, tz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if mu > 0.0:
        load = abs(fn)
        kt = k * numbers.ratio
        ct = numbers.damping_t * root
        turn = spin * dt
        sx, sy, sz = turned(sx, sy, sz, nx, ny, nz, turn)
        # springs of changing stiffness: ``kept`` of each stays, ``old`` turns the new stiffness into their
        # reference stiffness
        kept, old = 1.0, 1.0
        if rescale != 0:
            kept, old = (
                chosen.retained_fraction(scheme.tangential, k, reference_stiffness),
                reference_stiffness / k,
            )
        before = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        if rescale != 0:
            before *= old
            sx *= kept
            sy *= kept
            sz *= kept
        tx, ty, tz, sx, sy, sz = chosen.tangential_force(
            scheme.tangential, sx + ux * span, sy + uy * span, sz + uz * span, ux, uy, uz, kt, ct, mu * load
        )
        after = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        dissipated_energy += (tx * ux + ty * uy + tz * uz) * dt - (after - before)
        elastic_energy += after
        arm = numbers.shape * radius
        if arm > 0.0:
            if numbers.rolling > 0.0:
                mx, my, mz, ax, ay, az, spent, stored = _rolling(
                    kinematics, (ax, ay, az), numbers.rolling * arm * load, k * arm * arm, damping * arm * arm,
                    (turn, span, dt, kept, old), scheme,
                )  # fmt: skip
                dissipated_energy += spent
                elastic_energy += stored
            if numbers.twisting > 0.0:
                mt, phi, spent, stored = _twisting(
                    twist_rate, phi, numbers.twisting * mu * arm * load, 2.0 * kt * arm * arm, 2.0 * ct * arm * arm,
                    (span, dt, kept, old), scheme,
                )  # fmt: skip
                dissipated_energy += spent
                elastic_energy += stored
                mx += mt * nx
                my += mt * ny
                mz += mt * nz
        if rescale != 0:
            reference_stiffness = k
    if over_speed > 0.0 and -un > over_speed:
        # twice the step as the time constant: the excess is gone within a few steps, and no step can reverse it
        correction = reduced * (-un - over_speed) / (2.0 * dt)
        fn += correction
        excess = -correction * un * dt
    if pull != 0.0:
        # its jump at the edges of the contact weighs like that of the dashpots
        fn -= pull * fraction
        elastic_energy -= bound
    return Response(
        fn,
        tx,
        ty,
        tz,
        mx,
        my,
        mz,
        elastic_energy,
        dissipated_energy,
        excess,
        Springs(sx, sy, sz, ax, ay, az, phi, flag, reference_stiffness),
    )


def reader(arguments: str, template: str, first: int = 0) -> Any:
    """The compiled ``numbers(arguments)``: the ``Numbers`` that stand at ``template``, a text with the column as
    ``{}``, from the column ``first`` on."""
    columns = [template.format(first + column) for column in range(PAIR_COLUMNS)]
    families = (f"({''.join(f'{column}, ' for column in columns[part])})" for part in (NORMAL, COHESION))
    text = ", ".join([*columns[DAMPING_N : RATIO + 1], *families])
    lines = [f"def numbers({arguments}):", f"    return Numbers({text})"]
    return compiled("numbers", lines, {"Numbers": Numbers}, "The ``Numbers`` of a contact.", True, sys._getframe(1))


numbers_of = reader("table, a, b", "table[a, b, {}]")
"""``Numbers`` from a table of pairs, or of walls and species: an element of it is read where it stands, since a row
cut out is counted atomically, twice. All indices are int64: another integer type would be compiled again."""


@law
def released(h, k, radius, table, rescale):
    """Energy [J] of the springs of a contact that opens, which is lost: history ``h`` and ``table`` rows of their
    tables, k_n [N/m], R [m]."""
    if rescale != 0:
        k = h[REFERENCE_STIFFNESS]
    arm = table[SHAPE] * radius
    kt, kr = k * table[RATIO], k * arm * arm
    sliding = kt * (h[SLIP] * h[SLIP] + h[SLIP + 1] * h[SLIP + 1] + h[SLIP + 2] * h[SLIP + 2])
    rolling = kr * (h[ROLL] * h[ROLL] + h[ROLL + 1] * h[ROLL + 1] + h[ROLL + 2] * h[ROLL + 2])
    return 0.5 * (sliding + rolling + 2.0 * kt * arm * arm * h[TWIST] * h[TWIST])


def turned_energy(h: np.ndarray, k: np.ndarray, radius: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Energy [J] of the tangential, rolling and twisting springs of many contacts, (c,): ``released`` for rows of
    histories and tables."""
    arm2, kt = (table[:, SHAPE] * radius) ** 2, k * table[:, RATIO]
    slip2, roll2 = np.sum(h[:, SLIP:ROLL] ** 2, axis=1), np.sum(h[:, ROLL:TWIST] ** 2, axis=1)
    return np.asarray(0.5 * (kt * slip2 + k * arm2 * roll2 + 2.0 * kt * arm2 * h[:, TWIST] ** 2))


@kernel
def at_rest(overlap, radii, stiffness, rows, scheme):
    """Contacts at rest: k_n (the tangent stiffness) [N/m] and normal force, cohesion included [N], each (c,).

    ``overlap`` (c,) [m], ``radii`` (c, 2) [m], ``stiffness`` (c,) the smaller k_n [N/m], ``rows`` (c, columns) of the
    table of pairs, ``scheme`` a ``dem.contact.contact_scheme.Scheme``.
    """
    k, normal = np.empty(len(overlap)), np.empty(len(overlap))
    table = rows.reshape((1, len(overlap), PAIR_COLUMNS))
    for c in range(len(overlap)):
        first, second = radii[c, 0], radii[c, 1]
        bodies = Bodies(stiffness[c], 0.0, first * second / (first + second), first, second, 0.0)
        numbers = numbers_of(table, np.int64(0), c)
        k[c] = chosen.stiffness(scheme.normal, numbers.normal, max(overlap[c], 0.0), bodies)
        normal[c] = chosen.normal_force(scheme.normal, overlap[c], 0.0, k[c], 0.0)
        normal[c] -= chosen.pull(scheme.cohesion, numbers.cohesion, overlap[c], bodies)
    return k, normal


@kernel
def pulls(radius, rows, scheme):
    """Pull of a cohesion that does not depend on the overlap [N], (c,): R (c,) [m], ``rows`` (c, columns) and
    ``scheme`` as in ``at_rest``."""
    out = np.empty(len(radius))
    table = rows.reshape((1, len(radius), PAIR_COLUMNS))
    for c in range(len(radius)):
        bodies = Bodies(0.0, 0.0, radius[c], radius[c], radius[c], 0.0)
        out[c] = chosen.pull(scheme.cohesion, numbers_of(table, np.int64(0), c).cohesion, 0.0, bodies)
    return out
