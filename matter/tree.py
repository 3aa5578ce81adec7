"""Self-gravity by an octree with quadrupoles, walked by groups (Barnes & Hut 1986; Barnes 1990).

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
from typing import NamedTuple

import numpy as np

from matter.constants import G
from matter.jit import kernel, parallel_kernel, prange

SOURCES = ("BarnesHut1986", "Barnes1990")


# columns of a node's moments, after its centre of mass: mass, traceless quadrupole, mean eps^2; of a near particle,
# after its place: mass, eps^2 / 2
MASS, XX, XY, XZ, YY, YZ, ZZ, EPS2, WIDTH = range(3, 12)
NEAR_MASS, NEAR_EPS2 = 3, 4

_LEAF = 24
_GROUP = 128
_DEPTH = 21


class Tree(NamedTuple):
    """Nodes in depth-first order; the particles of node k are ``first[k]:last[k]`` of the sorted arrays, ``skip[k]``
    is the next node after its subtree."""

    order: np.ndarray
    first: np.ndarray
    last: np.ndarray
    skip: np.ndarray
    leaf: np.ndarray
    edge: np.ndarray
    centre: np.ndarray
    moment: np.ndarray  # (nodes, WIDTH): centre of mass, mass, quadrupole, mean eps^2
    group: np.ndarray  # nodes that are walked as one group


@parallel_kernel
def _morton(position, low, scale, key):
    for i in prange(len(position)):
        code = np.uint64(0)
        for axis in range(3):
            c = np.uint64(min(max(int((position[i, axis] - low[axis]) * scale), 0), (1 << _DEPTH) - 1))
            c = (c | (c << np.uint64(32))) & np.uint64(0x1F00000000FFFF)
            c = (c | (c << np.uint64(16))) & np.uint64(0x1F0000FF0000FF)
            c = (c | (c << np.uint64(8))) & np.uint64(0x100F00F00F00F00F)
            c = (c | (c << np.uint64(4))) & np.uint64(0x10C30C30C30C30C3)
            c = (c | (c << np.uint64(2))) & np.uint64(0x1249249249249249)
            code |= c << np.uint64(axis)
        key[i] = code


@kernel
def _nodes(key, low, edge0, first, last, skip, leaf, edge, centre, group):
    """Split the sorted keys into nodes, depth first; returns the numbers of nodes and groups, or -1 when there is no
    room."""
    stack_first, stack_last = np.empty(8 * _DEPTH + 8, np.int64), np.empty(8 * _DEPTH + 8, np.int64)
    stack_level, stack_parent = np.empty(8 * _DEPTH + 8, np.int64), np.empty(8 * _DEPTH + 8, np.int64)
    stack_first[0], stack_last[0], stack_level[0], stack_parent[0] = 0, len(key), 0, -1
    top, nodes, groups = 1, 0, 0
    while top > 0:
        top -= 1
        a, b, level, parent = stack_first[top], stack_last[top], stack_level[top], stack_parent[top]
        if nodes >= len(first):
            return -1, 0
        me = nodes
        nodes += 1
        first[me], last[me], skip[me] = a, b, parent  # skip holds the parent until the tree is complete
        edge[me] = edge0 / (1 << level)
        corner = key[a]
        for axis in range(3):
            c = np.int64(0)
            for bit in range(level):
                shift = np.uint64(3 * (_DEPTH - 1 - bit) + axis)
                c = 2 * c + np.int64((corner >> shift) & np.uint64(1))
            centre[me, axis] = low[axis] + (c + 0.5) * edge[me]
        # a group is a node of at most _GROUP particles whose parent is larger (or the root)
        if b - a <= _GROUP and (parent < 0 or last[parent] - first[parent] > _GROUP):
            group[groups] = me
            groups += 1
        leaf[me] = b - a <= _LEAF or level >= _DEPTH
        if leaf[me]:
            continue
        shift = np.uint64(3 * (_DEPTH - 1 - level))
        end = b
        for child in range(7, -1, -1):  # pushed last to first, so that the first child comes next in depth-first order
            lo, hi = a, end
            while lo < hi:
                middle = (lo + hi) // 2
                if np.int64((key[middle] >> shift) & np.uint64(7)) < child:
                    lo = middle + 1
                else:
                    hi = middle
            if lo < end:
                stack_first[top], stack_last[top], stack_level[top], stack_parent[top] = lo, end, level + 1, me
                top += 1
            end = lo
    return nodes, groups


@kernel
def _moments(nodes, particles, first, last, skip, leaf, moment):
    """Mass, centre of mass, traceless quadrupole and mean eps^2 of every node, children before parents; turns ``skip``
    from parent into next node."""
    x, y, z, mass, eps2 = particles.x, particles.y, particles.z, particles.mass, particles.eps2
    for k in range(nodes):
        for c in range(WIDTH):
            moment[k, c] = 0.0
    for k in range(nodes - 1, -1, -1):
        if leaf[k]:
            for i in range(first[k], last[k]):
                moment[k, MASS] += mass[i]
                moment[k, EPS2] += mass[i] * eps2[i]
                moment[k, 0] += mass[i] * x[i]
                moment[k, 1] += mass[i] * y[i]
                moment[k, 2] += mass[i] * z[i]
        for a in range(3):
            moment[k, a] /= max(moment[k, MASS], 1e-300)
        moment[k, EPS2] /= max(moment[k, MASS], 1e-300)
        parent = skip[k]
        if parent >= 0:
            moment[parent, MASS] += moment[k, MASS]
            moment[parent, EPS2] += moment[k, MASS] * moment[k, EPS2]
            for a in range(3):
                moment[parent, a] += moment[k, MASS] * moment[k, a]
    for k in range(nodes - 1, -1, -1):
        if leaf[k]:
            for i in range(first[k], last[k]):
                _add_quadrupole(moment, k, mass[i], x[i], y[i], z[i])
        parent = skip[k]
        if parent >= 0:
            for c in range(XX, ZZ + 1):
                moment[parent, c] += moment[k, c]
            _add_quadrupole(moment, parent, moment[k, MASS], moment[k, 0], moment[k, 1], moment[k, 2])
    for k in range(nodes):
        lo, hi = k + 1, nodes  # the subtree of k ends at the first later node that begins at or after last[k]
        while lo < hi:
            middle = (lo + hi) // 2
            if first[middle] >= last[k]:
                hi = middle
            else:
                lo = middle + 1
        skip[k] = lo


@kernel
def _add_quadrupole(moment, k, m, x, y, z):
    dx, dy, dz = x - moment[k, 0], y - moment[k, 1], z - moment[k, 2]
    r2 = dx * dx + dy * dy + dz * dz
    moment[k, XX] += m * (3.0 * dx * dx - r2)
    moment[k, XY] += m * 3.0 * dx * dy
    moment[k, XZ] += m * 3.0 * dx * dz
    moment[k, YY] += m * (3.0 * dy * dy - r2)
    moment[k, YZ] += m * 3.0 * dy * dz
    moment[k, ZZ] += m * (3.0 * dz * dz - r2)


class Sorted(NamedTuple):
    """Places x, y, z, masses and eps^2 in the order of the tree, in units of a length and a mass about a middle; each
    (n,)."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    mass: np.ndarray
    eps2: np.ndarray


class Units(NamedTuple):
    """What places and masses are counted in: a ``length`` [m] and a ``total`` mass [kg], about a ``middle`` (3,)
    [m]."""

    middle: np.ndarray
    length: float
    total: float


@parallel_kernel
def _sorted(order, position, mass, softening, units, x, y, z, m, eps2):
    middle, length, total = units.middle, units.length, units.total
    for k in prange(len(order)):
        i = order[k]
        x[k] = (position[i, 0] - middle[0]) / length
        y[k] = (position[i, 1] - middle[1]) / length
        z[k] = (position[i, 2] - middle[2]) / length
        m[k] = mass[i] / total
        eps2[k] = (softening[i] / length) ** 2


def build(
    position: np.ndarray,
    mass: np.ndarray,
    softening: np.ndarray,
    middle: np.ndarray | None = None,
    length: float = 1.0,
    total: float = 1.0,
) -> tuple[Tree, Sorted]:
    """The octree of particles at ``position`` (n, 3) [m] with ``mass`` (n,) [kg] and ``softening`` (n,) [m], and the
    particles in its order.

    Tree and particles are in units of ``length`` and ``total`` mass about ``middle``. Building costs about 5 % of a
    walk, so build anew for every evaluation.
    """
    n = len(position)
    middle = np.zeros(3) if middle is None else middle
    low, high = position.min(axis=0), position.max(axis=0)
    edge0 = float((high - low).max()) * (1.0 + 1e-9) + 1e-300
    key = np.empty(n, dtype=np.uint64)
    _morton(position, low, (1 << _DEPTH) / edge0, key)
    order = np.argsort(key)
    particles = Sorted(*(np.empty(n) for _ in Sorted._fields))
    _sorted(order, position, mass, softening, Units(middle, length, total), *particles)
    key = key[order]
    room = n // 2 + 256
    while True:
        first, last, skip = (np.empty(room, dtype=np.int64) for _ in range(3))
        leaf, edge, centre = np.empty(room, dtype=np.bool_), np.empty(room), np.empty((room, 3))
        group = np.empty(room, dtype=np.int64)
        nodes, groups = _nodes(
            key, (low - middle) / length, edge0 / length, first, last, skip, leaf, edge, centre, group
        )
        if nodes >= 0:
            break
        room *= 2
    moment = np.empty((nodes, WIDTH))
    _moments(nodes, particles, first, last, skip, leaf, moment)
    return Tree(
        order,
        first[:nodes],
        last[:nodes],
        skip[:nodes],
        leaf[:nodes],
        edge[:nodes],
        centre[:nodes],
        moment,
        group[:groups],
    ), particles


_LIST = 2048  # interaction lists are summed and emptied whenever they are full
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
    """Sum of g over far nodes, in the precision of ``numbers`` (1, 5/2, tiny)."""
    one, wide = numbers[0], numbers[1]
    ax, ay, az = numbers[3], numbers[3], numbers[3]
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
    one, tiny = numbers[0], numbers[2]
    ax, ay, az = numbers[3], numbers[3], numbers[3]
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
    one, tiny = numbers[0], numbers[2]
    depth = numbers[3]
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
    nodes, near = np.empty((WIDTH, _LIST), dtype=numbers.dtype), np.empty((NEAR_EPS2 + 1, room), dtype=numbers.dtype)
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
    k = 0
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

    Parameters ---------- position (n, 3) [m], mass (n,) [kg], softening (n,) [m] Plummer lengths eps_i, theta opening
    angle (smaller is more accurate).

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
        own = G * mass / softening
        return float(-0.5 * np.dot(mass, _sums(position, mass, softening, theta, 1)[:, 0] - own))
    x, y, z = (np.ascontiguousarray(position[:, axis]) for axis in range(3))
    out = np.empty(len(mass))
    _direct_potential(x, y, z, mass, softening**2, out)
    return float(-0.5 * G * np.dot(mass, out))


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
