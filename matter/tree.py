"""Self-gravity by an octree with quadrupoles, walked by groups (Barnes & Hut 1986; Barnes 1990).

    g_i = sum_j G m_j x_ij / (r^2 + eps_ij^2)^(3/2),   eps_ij^2 = (eps_i^2 + eps_j^2) / 2     (pairs: exactly antisymmetric)
    node: monopole and traceless quadrupole about its centre of mass, with its mean eps^2, taken when (l + d) / theta < D

with l the edge of the node's cell, d the distance of its centre of mass from the cell's centre and D the distance from the nearest point of the group's
bounding sphere. A group of neighbouring particles shares one walk and one interaction list, which is then summed in vectorised loops.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.jit import kernel, parallel_kernel, prange

G = 6.6743e-11  # CODATA 2018 [m^3/(kg s^2)]

_LEAF = 16
_GROUP = 64
_DEPTH = 21


class Tree(NamedTuple):
    """Nodes in depth-first order; the particles of node k are ``first[k]:last[k]`` of the sorted arrays, ``skip[k]`` is the next node after its subtree."""

    order: np.ndarray
    first: np.ndarray
    last: np.ndarray
    skip: np.ndarray
    leaf: np.ndarray
    edge: np.ndarray
    centre: np.ndarray
    moment: np.ndarray  # (nodes, 11): centre of mass, mass, quadrupole xx xy xz yy yz zz, mean eps^2
    group: np.ndarray  # nodes that are walked as one group


@kernel
def _morton(position, low, scale, key):
    for i in range(len(position)):
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
    """Split the sorted keys into nodes, depth first; returns the numbers of nodes and groups, or -1 when there is no room."""
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
def _moments(nodes, position, mass, eps2, first, last, skip, leaf, moment):
    """Mass, centre of mass, traceless quadrupole and mean eps^2 of every node, children before parents; turns ``skip`` from parent into next node."""
    for k in range(nodes):
        for c in range(11):
            moment[k, c] = 0.0
    for k in range(nodes - 1, -1, -1):
        if leaf[k]:
            for i in range(first[k], last[k]):
                moment[k, 3] += mass[i]
                moment[k, 10] += mass[i] * eps2[i]
                for a in range(3):
                    moment[k, a] += mass[i] * position[i, a]
        for a in range(3):
            moment[k, a] /= max(moment[k, 3], 1e-300)
        moment[k, 10] /= max(moment[k, 3], 1e-300)
        parent = skip[k]
        if parent >= 0:
            moment[parent, 3] += moment[k, 3]
            moment[parent, 10] += moment[k, 3] * moment[k, 10]
            for a in range(3):
                moment[parent, a] += moment[k, 3] * moment[k, a]
    for k in range(nodes - 1, -1, -1):
        if leaf[k]:
            for i in range(first[k], last[k]):
                _add_quadrupole(moment, k, mass[i], position[i, 0], position[i, 1], position[i, 2])
        parent = skip[k]
        if parent >= 0:
            for c in range(4, 10):
                moment[parent, c] += moment[k, c]
            _add_quadrupole(moment, parent, moment[k, 3], moment[k, 0], moment[k, 1], moment[k, 2])
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
    moment[k, 4] += m * (3.0 * dx * dx - r2)
    moment[k, 5] += m * 3.0 * dx * dy
    moment[k, 6] += m * 3.0 * dx * dz
    moment[k, 7] += m * (3.0 * dy * dy - r2)
    moment[k, 8] += m * 3.0 * dy * dz
    moment[k, 9] += m * (3.0 * dz * dz - r2)


def build(position: np.ndarray, mass: np.ndarray, softening: np.ndarray) -> Tree:
    """The octree of particles at ``position`` (n, 3) [m] with ``mass`` (n,) [kg] and ``softening`` (n,) [m].

    Building costs about 1 % of a walk, so build anew for every evaluation.
    """
    n = len(position)
    low, high = position.min(axis=0), position.max(axis=0)
    edge0 = float((high - low).max()) * (1.0 + 1e-9) + 1e-300
    key = np.empty(n, dtype=np.uint64)
    _morton(position, low, (1 << _DEPTH) / edge0, key)
    order = np.argsort(key, kind="stable")
    key = key[order]
    room = n // 2 + 256
    while True:
        first, last, skip = (np.empty(room, dtype=np.int64) for _ in range(3))
        leaf, edge, centre = np.empty(room, dtype=np.bool_), np.empty(room), np.empty((room, 3))
        group = np.empty(room, dtype=np.int64)
        nodes, groups = _nodes(key, low, edge0, first, last, skip, leaf, edge, centre, group)
        if nodes >= 0:
            break
        room *= 2
    moment = np.empty((nodes, 11))
    _moments(nodes, position[order], mass[order], softening[order] ** 2, first, last, skip, leaf, moment)
    return Tree(order, first[:nodes], last[:nodes], skip[:nodes], leaf[:nodes], edge[:nodes], centre[:nodes], moment, group[:groups])


_LIST = 2048  # interaction lists are summed and emptied whenever they are full


@kernel(fastmath=True)
def _sum_nodes(i, x, y, z, eps2, nodes, count, out):
    ax, ay, az, depth = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        dx, dy, dz = nodes[0, k] - x[i], nodes[1, k] - y[i], nodes[2, k] - z[i]
        inv = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz + 0.5 * (eps2[i] + nodes[10, k]))
        inv2 = inv * inv
        inv3 = inv * inv2
        inv5 = inv3 * inv2
        qx = nodes[4, k] * dx + nodes[5, k] * dy + nodes[6, k] * dz
        qy = nodes[5, k] * dx + nodes[7, k] * dy + nodes[8, k] * dz
        qz = nodes[6, k] * dx + nodes[8, k] * dy + nodes[9, k] * dz
        # phi = -m/r - Q:xx / (2 r^5);  g = -grad phi with x from particle to node
        quadrupole = (qx * dx + qy * dy + qz * dz) * inv5
        radial = nodes[3, k] * inv3 + 2.5 * quadrupole * inv2
        depth += nodes[3, k] * inv + 0.5 * quadrupole
        ax += radial * dx - qx * inv5
        ay += radial * dy - qy * inv5
        az += radial * dz - qz * inv5
    out[i, 0] += ax
    out[i, 1] += ay
    out[i, 2] += az
    out[i, 3] += depth


@kernel(fastmath=True)
def _sum_particles(i, x, y, z, eps2, near, count, out):
    ax, ay, az, depth = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        dx, dy, dz = near[0, k] - x[i], near[1, k] - y[i], near[2, k] - z[i]
        # the tiny addend keeps a particle's pull on itself finite (it is zero) where there is no softening
        s2 = dx * dx + dy * dy + dz * dz + 0.5 * (eps2[i] + near[4, k]) + 1e-30
        inv = 1.0 / np.sqrt(s2)
        well = near[3, k] * inv
        pull = well * (inv * inv)
        depth += well
        ax += pull * dx
        ay += pull * dy
        az += pull * dz
    out[i, 0] += ax
    out[i, 1] += ay
    out[i, 2] += az
    out[i, 3] += depth


@parallel_kernel(fastmath=True)
def _walk(theta, x, y, z, mass, eps2, first, last, skip, leaf, edge, centre, moment, group, out):
    nodes_total = len(first)
    for g in prange(len(group)):
        nodes, near = np.empty((11, _LIST)), np.empty((5, _LIST))
        a, b = first[group[g]], last[group[g]]
        cx, cy, cz = 0.0, 0.0, 0.0
        for i in range(a, b):
            cx += x[i]
            cy += y[i]
            cz += z[i]
            out[i, 0], out[i, 1], out[i, 2], out[i, 3] = 0.0, 0.0, 0.0, 0.0
        cx, cy, cz = cx / (b - a), cy / (b - a), cz / (b - a)
        radius2 = 0.0
        for i in range(a, b):
            radius2 = max(radius2, (x[i] - cx) ** 2 + (y[i] - cy) ** 2 + (z[i] - cz) ** 2)
        radius = np.sqrt(radius2)
        far_count, near_count, k = 0, 0, 0
        while k < nodes_total:
            ox, oy, oz = moment[k, 0] - centre[k, 0], moment[k, 1] - centre[k, 1], moment[k, 2] - centre[k, 2]
            size = edge[k] + np.sqrt(ox * ox + oy * oy + oz * oz)
            dx, dy, dz = moment[k, 0] - cx, moment[k, 1] - cy, moment[k, 2] - cz
            distance = np.sqrt(dx * dx + dy * dy + dz * dz) - radius
            if distance * theta > size:
                for c in range(11):
                    nodes[c, far_count] = moment[k, c]
                far_count += 1
                k = skip[k]
            elif leaf[k]:
                for j in range(first[k], last[k]):
                    near[0, near_count], near[1, near_count], near[2, near_count] = x[j], y[j], z[j]
                    near[3, near_count], near[4, near_count] = mass[j], eps2[j]
                    near_count += 1
                    if near_count == _LIST:
                        for i in range(a, b):
                            _sum_particles(i, x, y, z, eps2, near, near_count, out)
                        near_count = 0
                k = skip[k]
            else:
                k += 1
            if far_count == _LIST:
                for i in range(a, b):
                    _sum_nodes(i, x, y, z, eps2, nodes, far_count, out)
                far_count = 0
        for i in range(a, b):
            _sum_nodes(i, x, y, z, eps2, nodes, far_count, out)
            _sum_particles(i, x, y, z, eps2, near, near_count, out)


def gravity(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, theta: float = 0.5) -> np.ndarray:
    """Gravitational acceleration (n, 3) [m/s^2] of particles on each other.

    Parameters
    ----------
    position (n, 3) [m], mass (n,) [kg], softening (n,) [m] Plummer lengths eps_i, theta opening angle (smaller is more accurate).

    The sum over a tree is not exactly antisymmetric: see ``remove_net_force``.
    """
    return np.ascontiguousarray(G * _sums(position, mass, softening, theta)[:, :3])


def _sums(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, theta: float) -> np.ndarray:
    """Acceleration and minus the potential of every particle (n, 4), both over G; the particle's own well is included."""
    tree = build(position, mass, softening)
    x, y, z = (np.ascontiguousarray(position[tree.order, axis]) for axis in range(3))
    out = np.empty((len(mass), 4))
    _walk(
        theta, x, y, z, mass[tree.order], softening[tree.order] ** 2,
        tree.first, tree.last, tree.skip, tree.leaf, tree.edge, tree.centre, tree.moment, tree.group, out,
    )  # fmt: skip
    result = np.empty_like(out)
    result[tree.order] = out
    return result


@parallel_kernel(fastmath=True)
def _direct_potential(x, y, z, mass, eps2, out):
    n = len(x)
    for i in prange(n):
        total = 0.0
        for j in range(n):
            dx, dy, dz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
            total += mass[j] / np.sqrt(dx * dx + dy * dy + dz * dz + 0.5 * (eps2[i] + eps2[j]) + 1e-30)
        out[i] = total - mass[i] / np.sqrt(eps2[i] + 1e-30)


def potential_energy(position: np.ndarray, mass: np.ndarray, softening: np.ndarray, theta: float = 0.0) -> float:
    """The gravitational energy [J]: by the direct sum over all pairs, O(n^2), so that what a tree gets wrong shows in the total; with an opening
    angle ``theta`` > 0 by the tree (at 0.3 to 3e-6)."""
    if theta > 0.0:
        own = mass / np.sqrt(softening**2 + 1e-30)
        return float(-0.5 * G * np.dot(mass, _sums(position, mass, softening, theta)[:, 3] - own))
    x, y, z = (np.ascontiguousarray(position[:, axis]) for axis in range(3))
    out = np.empty(len(mass))
    _direct_potential(x, y, z, mass, softening**2, out)
    return float(-0.5 * G * np.dot(mass, out))


def remove_net_force(acceleration: np.ndarray, position: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, float]:
    """Take the net force and torque out of an acceleration field by one rigid correction a + b x (r - r_c).

    a and b solve the 6x6 system sum m (a + b x r') = F, sum m r' x (a + b x r') = T about the centre of mass r_c (where it splits into two of 3x3).

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
