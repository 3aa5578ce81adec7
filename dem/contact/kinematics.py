"""How two bodies meet: overlap, normal, and the motion of their surfaces against each other. Conventions:
``dem.contact``."""

from __future__ import annotations

import math
from typing import NamedTuple

from matter.compilation.jit import law


class ContactKinematics(NamedTuple):
    """How two bodies meet: unit vector ``n`` from the first to the second, ``overlap`` [m], separation speed ``un``
    and slip velocity ``u`` in the contact plane [m/s], rolling rate ``r``, relative spin ``twist`` and mean ``spin``
    about n [rad/s]; ``curvature_difference`` (r2 - r1) / (2 r1 r2) [1/m], so that ``r`` - curvature_difference n x u
    is the part of it that a moment does work on."""

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
    curvature_difference: float


class Ball(NamedTuple):
    """A grain as a contact sees it: ``radius`` [m] and spin ``w`` [rad/s]."""

    radius: float
    wx: float
    wy: float
    wz: float


@law(
    inline="always"
)  # in the caller's own code, with its fastmath: compiled by itself, its sums would be arranged otherwise
def grain_kinematics(way, velocity, one, two, offset):
    """How two grains meet: their ``ContactKinematics``, and the lever arms l1, l2 [m].

    ``way`` (3) from the first centre to the second [m], ``velocity`` (3) of the second relative to the first [m/s],
    ``one`` and ``two`` ``Ball``; ``offset`` [m] is added to the overlap (``dem.stiffness.change``). Rolling rate:
    ``dem.laws.rolling_sds``.
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
    curvature_difference = 0.5 * (rj - ri) / (ri * rj)
    rx = px - twist * nx + curvature_difference * (ny * uz - nz * uy)
    ry = py - twist * ny + curvature_difference * (nz * ux - nx * uz)
    rz = pz - twist * nz + curvature_difference * (nx * uy - ny * ux)
    return (
        ContactKinematics(nx, ny, nz, overlap, un, ux, uy, uz, rx, ry, rz, twist, spin, curvature_difference),
        l1,
        l2,
    )


@law(forceinline=True)
def wall_kinematics(n, distance, velocity, ball, overlap):
    """How a grain meets a wall, which is body 2 and at rest: u = -v - d w x n.

    ``n`` (3) unit vector towards the wall, ``distance`` d [m] of the grain's centre, ``velocity`` (3) [m/s], ``ball``,
    ``overlap`` [m]. The rolling rate lacks its second term, so that pure sliding raises no moment.
    """
    nx, ny, nz = n
    _, wx, wy, wz = ball
    ux = -velocity[0] - distance * (wy * nz - wz * ny)
    uy = -velocity[1] - distance * (wz * nx - wx * nz)
    uz = -velocity[2] - distance * (wx * ny - wy * nx)
    un = ux * nx + uy * ny + uz * nz
    wn = wx * nx + wy * ny + wz * nz
    return ContactKinematics(
        nx,
        ny,
        nz,
        overlap,
        un,
        ux - un * nx,
        uy - un * ny,
        uz - un * nz,
        wn * nx - wx,
        wn * ny - wy,
        wn * nz - wz,
        -wn,
        wn,
        0.0,
    )
