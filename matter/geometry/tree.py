"""Self-gravity by an octree with quadrupoles (``matter.geometry.octree``), walked by groups (Barnes & Hut 1986; Barnes
1990).

    g_i = sum_j G m_j x_ij / (r^2 + eps_ij^2)^(3/2),   eps_ij^2 = (eps_i^2 + eps_j^2) / 2
        (pairs exactly antisymmetric)
    node: monopole and traceless quadrupole about its centre of mass, with its mean eps^2,
        taken when (l + d) / theta < D

with l the edge of the node's cell, d the distance of its centre of mass from the cell's centre and D the distance from
the nearest point of the group's bounding sphere. A group of neighbouring particles shares one walk and one interaction
list, which is then summed in vectorised loops, in single precision where the tree's own error hides it (0.78 -> 0.50
core-s per evaluation of 300,000 particles).
"""

from __future__ import annotations

import math

import numpy as np

from matter.compilation.jit import kernel, parallel_kernel, prange
from matter.constants import G
from matter.geometry.octree import EPS2, MASS, WIDTH, XX, XY, XZ, YY, YZ, ZZ, build

SOURCES = ("BarnesHut1986", "Barnes1990")

# columns of a near particle in an interaction list, after its position: mass, eps^2 / 2
NEAR_MASS, NEAR_EPS2 = 3, 4

ONE, WIDE, TINY, ZERO = range(4)
"""The ``numbers`` of a walk (4,), in its precision: 1, 5/2, a tiny one and 0."""
_LIST = 2048  # interaction lists are summed and emptied whenever they are full
_APART = 16  # so that columns do not lie a power of two apart, where all share one set of a cache (a fifth slower)
_SINGLE = 0.1  # from this opening angle on, the tree's own error hides that of single precision


@kernel(fastmath=True)
def _collect(k, radius, cx, cy, cz, particles, tree, reach, nodes, near):
    """Go on with a walk at node k until it ends or the lists of far ``nodes`` (11, .) and ``near`` particles (5, .)
    are full.

    ``reach`` is (l + d) / theta of every node. Places in the lists are relative to the group's centre. Returns the
    next node and both lengths.
    """
    x, y, z, mass, half_eps2 = particles.x, particles.y, particles.z, particles.mass, particles.eps2
    first, last, skip, leaf, moment = tree.first, tree.last, tree.skip, tree.leaf, tree.moment
    far_count, near_count, room = 0, 0, near.shape[1]
    while k < len(first) and far_count < _LIST:
        dx, dy, dz = moment[k, 0] - cx, moment[k, 1] - cy, moment[k, 2] - cz
        away = reach[k] + radius
        if dx * dx + dy * dy + dz * dz > away * away:
            nodes[0, far_count], nodes[1, far_count], nodes[2, far_count] = dx, dy, dz
            for c in range(MASS, WIDTH):
                nodes[c, far_count] = moment[k, c]
            far_count += 1
            k = skip[k]
        elif leaf[k]:
            if near_count + last[k] - first[k] > room:
                break
            for j in range(first[k], last[k]):
                near[0, near_count], near[1, near_count], near[2, near_count] = x[j] - cx, y[j] - cy, z[j] - cz
                near[NEAR_MASS, near_count], near[NEAR_EPS2, near_count] = mass[j], half_eps2[j]
                near_count += 1
            k = skip[k]
        else:
            k += 1
    return k, far_count, near_count


@kernel(fastmath=True)
def _pull_nodes(px, py, pz, half_eps2, nodes, count, numbers):
    """Sum of g over far nodes, in the precision of ``numbers``."""
    one, wide = numbers[ONE], numbers[WIDE]
    ax, ay, az = numbers[ZERO], numbers[ZERO], numbers[ZERO]
    for k in range(count):
        dx, dy, dz = nodes[0, k] - px, nodes[1, k] - py, nodes[2, k] - pz
        inv = one / math.sqrt(dx * dx + dy * dy + dz * dz + half_eps2 + nodes[EPS2, k])
        inv2 = inv * inv
        inv3 = inv * inv2
        inv5 = inv3 * inv2
        qx = nodes[XX, k] * dx + nodes[XY, k] * dy + nodes[XZ, k] * dz
        qy = nodes[XY, k] * dx + nodes[YY, k] * dy + nodes[YZ, k] * dz
        qz = nodes[XZ, k] * dx + nodes[YZ, k] * dy + nodes[ZZ, k] * dz
        # phi = -m/r - Q:xx / (2 r^5);  g = -grad phi with x from particle to node
        radial = nodes[MASS, k] * inv3 + wide * (qx * dx + qy * dy + qz * dz) * inv5 * inv2
        ax += radial * dx - qx * inv5
        ay += radial * dy - qy * inv5
        az += radial * dz - qz * inv5
    return ax, ay, az


@kernel(fastmath=True)
def _pull_particles(px, py, pz, half_eps2, near, count, numbers):
    """Sum of g over particles, in the precision of ``numbers``; the tiny addend keeps a particle's pull on itself
    finite (it is zero)."""
    one, tiny = numbers[ONE], numbers[TINY]
    ax, ay, az = numbers[ZERO], numbers[ZERO], numbers[ZERO]
    for k in range(count):
        dx, dy, dz = near[0, k] - px, near[1, k] - py, near[2, k] - pz
        inv = one / math.sqrt(dx * dx + dy * dy + dz * dz + half_eps2 + near[NEAR_EPS2, k] + tiny)
        pull = near[NEAR_MASS, k] * (inv * inv * inv)
        ax += pull * dx
        ay += pull * dy
        az += pull * dz
    return ax, ay, az


@kernel(fastmath=True)
def _well(px, py, pz, half_eps2, nodes, far_count, near, near_count, numbers):
    """Sum of minus the potential over far nodes and near particles."""
    one, tiny = numbers[ONE], numbers[TINY]
    depth = numbers[ZERO]
    for k in range(far_count):
        dx, dy, dz = nodes[0, k] - px, nodes[1, k] - py, nodes[2, k] - pz
        inv = one / math.sqrt(dx * dx + dy * dy + dz * dz + half_eps2 + nodes[EPS2, k])
        inv2 = inv * inv
        qx = nodes[XX, k] * dx + nodes[XY, k] * dy + nodes[XZ, k] * dz
        qy = nodes[XY, k] * dx + nodes[YY, k] * dy + nodes[YZ, k] * dz
        qz = nodes[XZ, k] * dx + nodes[YZ, k] * dy + nodes[ZZ, k] * dz
        depth += nodes[MASS, k] * inv + (qx * dx + qy * dy + qz * dz) * (inv * inv2 * inv2) / (one + one)
    for k in range(near_count):
        dx, dy, dz = near[0, k] - px, near[1, k] - py, near[2, k] - pz
        depth += near[NEAR_MASS, k] / math.sqrt(dx * dx + dy * dy + dz * dz + half_eps2 + near[NEAR_EPS2, k] + tiny)
    return depth


@kernel(fastmath=True)
def _sum_group(a, b, wanted, particles, tree, reach, room, numbers, out):
    """Forces (``wanted`` 3) or potentials (1) of the particles a ... b - 1, which share one walk; ``particles.eps2``
    is halved."""
    x, y, z, half_eps2 = particles.x, particles.y, particles.z, particles.eps2
    nodes = np.empty((WIDTH, _LIST + _APART), dtype=numbers.dtype)
    near = np.empty((NEAR_EPS2 + 1, room + _APART), dtype=numbers.dtype)
    own = np.empty((4, b - a), dtype=numbers.dtype)
    cx, cy, cz = 0.0, 0.0, 0.0
    for i in range(a, b):
        cx += x[i]
        cy += y[i]
        cz += z[i]
    cx, cy, cz = cx / (b - a), cy / (b - a), cz / (b - a)
    radius2 = 0.0
    for i in range(a, b):
        own[0, i - a], own[1, i - a], own[2, i - a], own[3, i - a] = x[i] - cx, y[i] - cy, z[i] - cz, half_eps2[i]
        radius2 = max(radius2, (x[i] - cx) ** 2 + (y[i] - cy) ** 2 + (z[i] - cz) ** 2)
        for c in range(wanted):
            out[i, c] = 0.0
    k = np.int64(0)  # a bare 0 is a type of its own, for which the walk would be compiled once more
    while k < len(tree.first):
        k, far_count, near_count = _collect(k, math.sqrt(radius2), cx, cy, cz, particles, tree, reach, nodes, near)
        for i in range(a, b):
            px, py, pz, soft = own[0, i - a], own[1, i - a], own[2, i - a], own[3, i - a]
            if wanted == 1:
                out[i, 0] += _well(px, py, pz, soft, nodes, far_count, near, near_count, numbers)
            else:
                ax, ay, az = _pull_nodes(px, py, pz, soft, nodes, far_count, numbers)
                bx, by, bz = _pull_particles(px, py, pz, soft, near, near_count, numbers)
                out[i, 0] += ax + bx
                out[i, 1] += ay + by
                out[i, 2] += az + bz


@parallel_kernel
def _walk(wanted, particles, tree, reach, room, numbers, out):
    for g in prange(len(tree.group)):
        a, b = tree.first[tree.group[g]], tree.last[tree.group[g]]
        _sum_group(a, b, wanted, particles, tree, reach, room, numbers, out)


def gravity(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, theta: float = 0.5) -> np.ndarray:
    """Gravitational acceleration (n, 3) [m/s^2] of particles on each other.

    Parameters
    ----------
    position (n, 3) [m], mass (n,) [kg], softening (n,) [m] Plummer lengths eps_i,
    theta opening angle (smaller is more accurate).

    The sum over a tree is not exactly antisymmetric: see ``remove_net_force``.
    """
    return _sums(position, mass, softening, theta, 3)


def _sums(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, theta: float, wanted: int) -> np.ndarray:
    """Acceleration (``wanted`` 3) or minus the potential (1; the particle's own well included) of every particle, (n,
    wanted).

    Sums run in units of the body's size and mass and about the group's centre, where single precision keeps them to
    1e-6.
    """
    middle = position.mean(axis=0)
    away = position - middle
    length = float(np.sqrt(np.einsum("ij,ij->i", away, away)).mean()) or 1.0
    total = float(mass.sum()) or 1.0
    tree, particles = build(position, mass, softening, middle, length, total)
    moment = tree.moment
    moment[:, EPS2] *= 0.5
    particles.eps2[:] *= 0.5
    reach = (tree.edge + np.sqrt(((moment[:, :3] - tree.centre) ** 2).sum(axis=1))) / theta
    room = max(_LIST, int((tree.last - tree.first)[tree.leaf].max(initial=0)))
    single = wanted == 3 and theta >= _SINGLE
    numbers = np.array([1.0, 2.5, 1e-20 if single else 1e-30, 0.0], dtype=np.float32 if single else np.float64)
    out, result = np.empty((len(mass), wanted)), np.empty((len(mass), wanted))
    _walk(wanted, particles, tree, reach, room, numbers, out)
    _unsorted(tree.order, out, G * total / length ** (2 if wanted == 3 else 1), result)
    return result


@parallel_kernel
def _unsorted(order, values, factor, out):
    for k in prange(len(order)):
        for c in range(values.shape[1]):
            out[order[k], c] = factor * values[k, c]


@parallel_kernel(fastmath=True)
def _direct_potential(x, y, z, mass, eps2, out):
    n = len(x)
    for i in prange(n):
        total = 0.0
        for j in range(n):
            dx, dy, dz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
            total += mass[j] / math.sqrt(dx * dx + dy * dy + dz * dz + 0.5 * (eps2[i] + eps2[j]) + 1e-30)
        out[i] = total - mass[i] / math.sqrt(eps2[i] + 1e-30)


def potential_energy(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, theta: float = 0.0) -> float:
    """The gravitational energy [J] of softened particles: by the direct sum over all pairs, O(n^2), so that what a
    tree gets wrong shows in the total; with an opening angle ``theta`` > 0 by the tree (at 0.3 to 3e-6).
    """
    if theta > 0.0:
        return float(-0.5 * np.dot(mass, minus_potential(position, mass, softening, theta)))
    x, y, z = (np.ascontiguousarray(position[:, axis]) for axis in range(3))
    out = np.empty(len(mass))
    _direct_potential(x, y, z, mass, softening**2, out)
    return float(-0.5 * G * np.dot(mass, out))


def minus_potential(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, theta: float) -> np.ndarray:
    """Minus the potential (n,) [J/kg] of all others at every particle, by the tree with an opening angle ``theta``."""
    return np.asarray(_sums(position, mass, softening, theta, 1)[:, 0] - G * mass / softening)


def remove_net_force(acceleration: np.ndarray, position: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, float]:
    """Take the net force and torque out of an acceleration field by one rigid correction a + b x (r - r_c).

    a and b solve the 6x6 system sum m (a + b x r') = F, sum m r' x (a + b x r') = T about the centre of mass r_c
    (where it splits into two of 3x3).

    Returns the corrected field (n, 3) and the largest correction relative to the rms of the field.
    """
    total = mass.sum()
    relative = position - (mass @ position) / total
    weighted = mass[:, None] * acceleration
    a = weighted.sum(axis=0) / total
    torque = np.cross(relative, weighted).sum(axis=0)
    r2 = np.einsum("ij,ij->i", relative, relative)
    inertia = np.eye(3) * (mass @ r2) - np.einsum("i,ij,ik->jk", mass, relative, relative)
    b = np.linalg.lstsq(inertia, torque, rcond=None)[0]
    correction = a + np.cross(b, relative)
    rms = float(np.sqrt((mass @ np.einsum("ij,ij->i", acceleration, acceleration)) / total))
    size = float(np.sqrt(np.einsum("ij,ij->i", correction, correction).max()))
    return acceleration - correction, size / max(rms, 1e-300)
