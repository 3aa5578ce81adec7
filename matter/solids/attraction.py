"""Attraction of a solid body of even density at a position on it, inside or outside: that of the polyhedron itself.

    a = G rho ( sum_f omega_f (n_f . r_f) n_f  -  sum_e L_e E_e r_e )

over faces f with the outward normal n_f and edges e, with r the way from the position to any point of face or edge,
omega_f the solid angle under which a face is seen (signed), L_e = ln((a + b + l) / (a + b - l)) for an edge of the
length l whose ends are at the distances a and b, and E_e = n_A n_A^e + n_B n_B^e of its two faces, n^e the outward
normal of the edge in the plane of its face.

Source: Werner & Scheeres 1997, Celest. Mech. Dyn. Astron. 65, 313, eqs. 14 and 15.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from matter.constants import G
from matter.solids.solid import Solid

SOURCES = ("WernerScheeres1997",)


class _Sides(NamedTuple):
    """Every side of every triangle: its two corners ``start`` and ``end`` (m, 3, 3) [m], and its outward normal
    ``out`` (m, 3, 3) in the plane of the triangle; ``normal`` (m, 3) of the triangles."""

    start: np.ndarray
    end: np.ndarray
    out: np.ndarray
    normal: np.ndarray


@lru_cache(maxsize=2)
def _sides(solid: Solid) -> _Sides:
    start = solid.vertices[solid.triangles]
    end = np.roll(start, -1, axis=1)
    double = np.cross(start[:, 1] - start[:, 0], start[:, 2] - start[:, 0])
    size = np.linalg.norm(double, axis=1)
    whole = size > 1e-12 * size.max()
    start, end, normal = start[whole], end[whole], double[whole] / size[whole][:, None]
    along = end - start
    out = np.cross(along, normal[:, None, :])
    return _Sides(start, end, out / np.linalg.norm(out, axis=2)[..., None], normal)


def attraction_at(solid: Solid, position: np.ndarray) -> np.ndarray:
    """Attraction (3,) [m/s^2 per kg/m^3] at a ``position`` (3,) [m] about the centre of mass of a ``solid``, for a
    density of 1 kg/m^3."""
    start, end, out, normal = _sides(solid)
    first, second = start - position, end - position
    a, b = np.linalg.norm(first, axis=2), np.linalg.norm(second, axis=2)
    length = np.linalg.norm(end - start, axis=2)
    # on an edge the logarithm grows without bound, and what it is multiplied by is zero there
    reach = np.log((a + b + length) / np.maximum(a + b - length, 1e-12 * length))
    by_sides = np.einsum("fe,fe->f", reach, np.einsum("fei,fei->fe", out, first))
    p, q, s = first[:, 0], first[:, 1], first[:, 2]
    over = np.einsum("ij,ij->i", p, np.cross(q, s))
    under = a[:, 0] * a[:, 1] * a[:, 2]
    for one, two, far in ((p, q, a[:, 2]), (q, s, a[:, 0]), (s, p, a[:, 1])):
        under = under + np.einsum("ij,ij->i", one, two) * far
    seen = 2.0 * np.arctan2(over, under)
    # a position in the plane of a face sees it from both sides: no part of the way to it is along the normal
    by_faces = seen * np.einsum("ij,ij->i", normal, p)
    return np.asarray(G * ((by_faces - by_sides) @ normal))
