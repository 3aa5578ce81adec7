"""Alpha-shape of a particle cloud: the solid that the particles fill, its oriented surface, and which points lie
inside.

A tetrahedron of the Delaunay triangulation belongs to the shape when its circumradius is below ``factor`` times the
mean spacing of its four particles (Edelsbrunner & Muecke 1994, ACM Trans. Graphics 13, 43; a spacing of its own for
every particle serves graded clouds). The surface of the shape runs through the outermost particles, half a spacing
inside the matter that they stand for, so a shape can be ``offset`` outwards: every boundary triangle then carries a
prism, and the solid is the kept tetrahedra and the prisms.

Perfect lattices (five and more points on one sphere) have no unique triangulation: the points are joggled by 1e-6
spacings, with a fixed seed; the shape and its surface stand on the joggled points.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, QhullError, cKDTree

from matter.compilation.jit import one_blas_thread
from matter.errors import InputError
from matter.geometry import far_particles
from matter.geometry.tetrahedra import circumradius, components, fill_voids, in_prisms, tetrahedron_volume

SOURCES = ("EdelsbrunnerMucke1994",)

JOGGLE = 1e-6
_FLAT = 1e-3  # of a spacing: rms distance of the points from their best plane
_SEED = 7919
# faces of a tetrahedron: row k is opposite vertex k
_FACES = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
# three tetrahedra of the prism (a b c | A B C); with a < b < c neighbouring prisms split their common wall alike
_PRISM = np.array([[0, 1, 2, 5], [0, 1, 4, 5], [0, 3, 4, 5]])
_NEAR_PRISMS = (8, 32)
"""Prisms that are looked through for a point: the nearest few, then, where they leave it open, as many as matter."""
# the two factors of Taubin's filter, shrinking and growing in turn
_TAUBIN = (0.5, 0.53)


def _along_curve(position: np.ndarray) -> np.ndarray:
    """Order of points along a Morton curve of 1024 cells a side."""
    low, width = position.min(axis=0, initial=0.0), np.ptp(position, axis=0).max(initial=1e-300)
    cell = np.clip((position - low) / width * 1023.0, 0, 1023).astype(np.uint64)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cell = (cell | (cell << np.uint64(shift))) & np.uint64(mask)
    return np.argsort(cell @ np.array([1, 2, 4], dtype=np.uint64), kind="stable")


@dataclass(frozen=True)
class AlphaShape:
    """The kept tetrahedra of a triangulated cloud.

    ``points`` (n, 3) [m], ``spacing`` (n,) [m]; ``kept`` (t,) marks the tetrahedra of ``triangulation`` that belong to
    the shape, ``component`` (t,) numbers their pieces by decreasing volume (joined through faces; -1 outside the
    shape), ``voids_filled`` counts enclosed voids that were closed.
    """

    points: np.ndarray
    spacing: np.ndarray
    triangulation: Delaunay
    kept: np.ndarray
    component: np.ndarray
    component_volume: np.ndarray
    factor: float
    voids_filled: int = 0
    _shift: np.ndarray = field(default_factory=lambda: np.zeros(3), repr=False)
    _scale: float = 1.0

    @property
    def volume(self) -> float:
        """Volume of the kept tetrahedra [m^3]."""
        return float(self.component_volume.sum())

    @cached_property
    def members(self) -> np.ndarray:
        """(n,) component of each particle: the largest one that it is a vertex of, -1 for a particle outside the
        shape."""
        member = np.full(len(self.points), np.iinfo(np.int64).max)
        corners = self.triangulation.simplices[self.kept]
        np.minimum.at(member, corners.ravel(), np.repeat(self.component[self.kept], 4))
        return np.where(member == np.iinfo(np.int64).max, -1, member)

    def only(self, count: int = 1) -> AlphaShape:
        """The shape reduced to its ``count`` largest components."""
        chosen = self.kept & (self.component < count)
        return AlphaShape(
            self.points,
            self.spacing,
            self.triangulation,
            chosen,
            np.where(chosen, self.component, -1),
            self.component_volume[:count],
            self.factor,
            self.voids_filled,
            self._shift,
            self._scale,
        )

    def contains(self, position: np.ndarray) -> np.ndarray:
        """(m,) whether each point of ``position`` (m, 3) lies in a kept tetrahedron."""
        scaled = (np.asarray(position) - self._shift) / self._scale
        order = _along_curve(scaled)  # the search walks from the last tetrahedron found: short walks in turn
        simplex = np.empty(len(scaled), dtype=np.int64)
        simplex[order] = self.triangulation.find_simplex(scaled[order])
        return (simplex >= 0) & self.kept[simplex]

    @cached_property
    def _boundary(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Outward triangles (b, 3), their tetrahedra (b,) and the local number (b,) of the vertex opposite."""
        simplices, neighbours = self.triangulation.simplices, self.triangulation.neighbors
        outside = np.where(neighbours >= 0, ~self.kept[neighbours], True) & self.kept[:, None]
        owner, opposite = np.nonzero(outside)
        triangle = simplices[owner[:, None], _FACES[opposite]]
        a, b, c = (self.points[triangle[:, k]] for k in range(3))
        inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), self.points[simplices[owner, opposite]] - a) > 0.0
        triangle[inward] = triangle[inward][:, ::-1]
        return triangle, owner, opposite

    @property
    def triangles(self) -> np.ndarray:
        """Boundary triangles (b, 3), particle numbers in outward order."""
        return self._boundary[0]

    @cached_property
    def _manifold(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces (b, 3) on split vertices, and the particle (v,) behind each vertex.

        Where two parts of the solid touch in an edge or a corner only, the vertices are doubled, so that every edge
        joins exactly two faces and the surface is a closed orientable manifold.
        """
        triangle, owner, opposite = self._boundary
        count = len(triangle)
        start, end = triangle, np.roll(triangle, -1, axis=1)
        edges = np.sort(np.stack([start.ravel(), end.ravel()], axis=1), axis=1)
        order = np.lexsort((edges[:, 1], edges[:, 0]))
        ordered = edges[order]
        first = np.flatnonzero(np.r_[True, np.any(ordered[1:] != ordered[:-1], axis=1)])
        sizes = np.diff(np.r_[first, len(order)])
        simple = first[sizes == 2]
        pairs = [np.stack([order[simple], order[simple + 1]], axis=1)]
        at = {(int(t), int(k)): number for number, (t, k) in enumerate(zip(owner, opposite))}
        for begin, size in zip(first[sizes != 2], sizes[sizes != 2]):
            pairs.append(
                self._paired_through_the_solid(order[begin : begin + size], edges[order[begin]], owner, opposite, at)
            )
        pair = np.concatenate(pairs)
        # the two ends of a shared edge are the same surface vertex on both faces
        face, side = np.divmod(pair, 3)
        corner = 3 * face + side, 3 * face + (side + 1) % 3
        same = triangle.ravel()[corner[0][:, 0]] == triangle.ravel()[corner[0][:, 1]]
        left = np.r_[corner[0][:, 0], corner[1][:, 0]]
        right = np.r_[
            np.where(same, corner[0][:, 1], corner[1][:, 1]), np.where(same, corner[1][:, 1], corner[0][:, 1])
        ]
        links = coo_matrix((np.ones(len(left), dtype=np.int8), (left, right)), shape=(3 * count, 3 * count))
        number, label = connected_components(links, directed=False)
        particle = np.empty(number, dtype=np.int64)
        particle[label] = triangle.ravel()
        return label.reshape(count, 3), particle

    def _paired_through_the_solid(self, half_edges, edge, owner, opposite, at) -> np.ndarray:
        """Pairs of half-edges of one crowded edge that bound the same wedge of kept tetrahedra."""
        simplices, neighbours = self.triangulation.simplices, self.triangulation.neighbors
        by_face = {int(half) // 3: int(half) for half in half_edges}
        pairs = []
        while by_face:
            face, half = by_face.popitem()
            tetrahedron, entry = int(owner[face]), int(opposite[face])
            while True:
                corners = simplices[tetrahedron]
                way = next(k for k in range(4) if k != entry and corners[k] != edge[0] and corners[k] != edge[1])
                following = int(neighbours[tetrahedron, way])
                if following < 0 or not self.kept[following]:
                    break
                entry = int(np.flatnonzero(neighbours[following] == tetrahedron)[0])
                tetrahedron = following
            pairs.append((half, by_face.pop(at[(tetrahedron, way)])))
        return np.array(pairs, dtype=np.int64)

    def surface(self, distance: np.ndarray | float = 0.0, smoothing: np.ndarray | int = 0):
        """The boundary as a ``trimesh.Trimesh``, vertices moved outwards along their normals by ``distance`` (scalar
        or (n,)) [m].

        ``smoothing`` passes (one number, or (n,) per particle) of Taubin's filter (1995, SIGGRAPH; it keeps the
        volume) then take out the roughness of single particles.
        """
        import trimesh

        faces, particle = self._manifold
        mesh = trimesh.Trimesh(self.points[particle], faces, process=False, validate=False)
        if np.any(distance):
            step = np.broadcast_to(distance, (len(self.points),))[particle]
            mesh = trimesh.Trimesh(
                mesh.vertices + step[:, None] * self._vertex_normals, faces, process=False, validate=False
            )
        passes, done = np.broadcast_to(smoothing, (len(self.points),))[particle], 0
        for level in np.unique(passes[passes > 0]):
            operator = trimesh.smoothing.laplacian_calculation(mesh, pinned_vertices=np.flatnonzero(passes < level))
            trimesh.smoothing.filter_taubin(
                mesh, *_TAUBIN, iterations=2 * int(level - done), laplacian_operator=operator
            )
            done = level
        return mesh

    @cached_property
    def _vertex_normals(self) -> np.ndarray:
        """Outward unit normals (v, 3): angle-weighted face normals, averaged once with the neighbouring vertices."""
        import trimesh

        faces, particle = self._manifold
        # in units of a spacing: the library drops the normals of triangles below some 1e-14 m^2
        unit = 2.0 ** np.floor(np.log2(np.median(self.spacing)))
        mesh = trimesh.Trimesh(self.points[particle] / unit, faces, process=False, validate=False)
        normal = np.array(mesh.vertex_normals)
        edges = mesh.edges_unique
        total = normal * 2.0
        for one, other in ((0, 1), (1, 0)):
            np.add.at(total, edges[:, one], normal[edges[:, other]])
        length = np.linalg.norm(total, axis=1)
        return np.where(length[:, None] > 1e-12, total / np.maximum(length, 1e-300)[:, None], normal)

    def offset(self, distance: np.ndarray | float, smoothing: np.ndarray | int = 0) -> OffsetShape:
        """The solid grown outwards by ``distance`` (scalar or one per particle) [m], its surface smoothed as in
        ``surface``."""
        return OffsetShape(
            self, np.broadcast_to(np.asarray(distance, dtype=float), (len(self.points),)).copy(), smoothing
        )


@dataclass(frozen=True)
class OffsetShape:
    """An alpha-shape and the prisms that stand ``distance`` (n,) [m] high on its boundary."""

    shape: AlphaShape
    distance: np.ndarray
    smoothing: np.ndarray | int = 0

    @cached_property
    def mesh(self):
        """The outer surface as a ``trimesh.Trimesh``."""
        return self.shape.surface(self.distance, self.smoothing)

    @property
    def volume(self) -> float:
        """Volume enclosed by the outer surface [m^3] (divergence theorem; overlapping prisms count once more)."""
        return float(self.mesh.volume)

    @cached_property
    def _prisms(self) -> tuple[np.ndarray, np.ndarray, cKDTree, np.ndarray]:
        """Per prism tetrahedron: origin (p, 3, 3), inverse edge matrix (p, 3, 3, 3); tree of prism centres; reach of
        each."""
        faces, particle = self.shape._manifold
        inner, outer = self.shape.points[particle], np.asarray(self.mesh.vertices)
        faces = np.sort(faces, axis=1)
        corners = np.concatenate([inner[faces], outer[faces]], axis=1)
        tetrahedra = corners[:, _PRISM]
        edges = np.moveaxis(tetrahedra[:, :, 1:] - tetrahedra[:, :, :1], -1, -2)
        determinant = np.linalg.det(edges)
        size = np.max(np.abs(edges), axis=(-1, -2)) ** 3
        flat = np.abs(determinant) <= 1e-12 * size
        edges = np.where(flat[..., None, None], np.eye(3), edges)
        inverse = np.where(flat[..., None, None], np.nan, np.linalg.inv(edges))
        centre = corners.mean(axis=1)
        reach = np.max(np.linalg.norm(corners - centre[:, None], axis=-1), axis=1)
        return tetrahedra[:, :, 0], inverse, cKDTree(centre), reach

    def contains(self, position: np.ndarray) -> np.ndarray:
        """(m,) whether each point of ``position`` (m, 3) lies in the grown solid."""
        position = np.asarray(position, dtype=float)
        inside = self.shape.contains(position)
        if not np.any(self.distance > 0.0):
            return inside
        origin, inverse, tree, reach = self._prisms
        furthest = np.nextafter(float(reach.max()), np.inf)
        reach = np.append(reach, -1.0)  # of the entry that stands for no neighbour
        open_ = np.flatnonzero(~inside)
        for begin in range(0, len(open_), 50_000):
            rows = open_[begin : begin + 50_000]
            for near in sorted({min(count, tree.n) for count in _NEAR_PRISMS}):
                distance, candidates = (
                    array.reshape(len(rows), near)
                    for array in tree.query(position[rows], k=near, distance_upper_bound=furthest)
                )
                hit = np.zeros(len(rows), dtype=np.bool_)
                in_prisms(position[rows], distance, candidates, reach, origin, inverse, hit)
                inside[rows[hit]] = True
                rows = rows[~hit & np.isfinite(distance[:, -1])]  # of these a further prism may hold
                if len(rows) == 0:
                    break
        return inside


def alpha_shape(
    points: np.ndarray, spacing: np.ndarray | float, factor: float = 1.5, fill_below: np.ndarray | float = 0.0
) -> AlphaShape:
    """Alpha-shape of a cloud.

    Parameters
    ----------
    points : (n, 3) particle centres [m].
    spacing : local particle spacing [m], one or (n,): (mass / density)^(1/3) of each particle.
    factor : alpha in spacings; a tetrahedron stays when its circumradius is below ``factor`` times the mean spacing of
        its corners. A perfect lattice needs 0.87 (cubic) or 0.80 (close-packed), a disordered one about 1.2.
    fill_below : enclosed voids smaller than this volume [m^3] are filled, one or (n,): that of the points around it.

    Raises ``InputError`` for fewer than four points, points in one plane, values that are not finite, a cloud too wide
    to be triangulated (``far_particles``), or an empty shape.
    """
    points = np.ascontiguousarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
        raise InputError(f"an alpha-shape needs at least four points in space, got an array of shape {points.shape}")
    spacing = np.broadcast_to(np.asarray(spacing, dtype=float), (len(points),)).copy()
    if not np.all(np.isfinite(points)) or not np.all(np.isfinite(spacing)) or np.any(spacing <= 0.0):
        raise InputError("an alpha-shape needs finite positions and positive spacings")
    if not factor > 0.0:
        raise InputError(f"alpha must be a positive multiple of the spacing, got {factor}")
    near = far_particles.drawn_near(points, spacing, factor)
    shift, scale = near.mean(axis=0), float(np.ptp(near, axis=0).max())
    spread = np.sqrt(max(float(np.linalg.eigvalsh(np.cov((near - shift).T))[0]), 0.0))
    if spread < _FLAT * float(np.median(spacing)):
        raise InputError("the points lie in one plane or on one line: they enclose no volume")
    joggle = np.random.default_rng(_SEED).uniform(-JOGGLE, JOGGLE, points.shape) * spacing[:, None]
    points = points + joggle
    try:
        triangulation = Delaunay((near + joggle - shift) / scale)
    except (QhullError, ValueError) as reason:
        raise InputError(f"the points span no tetrahedra ({str(reason).splitlines()[0]})") from None
    with one_blas_thread():  # a threaded BLAS takes 100 times longer over these 3 x 3 matrices
        triangulation.transform  # noqa: B018  (computed once, kept by scipy)
    simplices = triangulation.simplices
    corners = points[simplices]
    kept = circumradius(corners) < factor * spacing[simplices].mean(axis=1)
    if not np.any(kept):
        raise InputError(f"the alpha-shape is empty: no tetrahedron has a circumradius below {factor} spacings")
    volume = tetrahedron_volume(corners)
    limit = np.broadcast_to(np.asarray(fill_below, dtype=float), (len(points),))[simplices].mean(axis=1)
    filled = fill_voids(triangulation.neighbors, kept, volume / limit, 1.0) if np.all(limit > 0.0) else 0
    component, component_volume = components(triangulation.neighbors, kept, volume)
    return AlphaShape(points, spacing, triangulation, kept, component, component_volume, factor, filled, shift, scale)
