"""The octree of a cloud of particles: nodes in depth-first order of the Morton keys, with their moments.

Each node holds its mass, its traceless quadrupole and its mean eps^2 about its centre of mass; nodes of at most
``_GROUP`` particles are the groups that share a walk (``matter.geometry.tree``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.compilation.jit import kernel, parallel_kernel, prange

# columns of a node's moments, after its centre of mass: mass, traceless quadrupole, mean eps^2
MASS, XX, XY, XZ, YY, YZ, ZZ, EPS2, WIDTH = range(3, 12)

_LEAF = 24  # particles
_GROUP = 128
_DEPTH = 21  # levels, of 3 bits of a key each


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
    """What positions and masses are counted in: a ``length`` [m] and a ``total`` mass [kg], about a ``middle`` (3,)
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
