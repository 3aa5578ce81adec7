"""Grains that escape from a body, and the momentum that it keeps: beta at the end of the collapse, by the rule of
the shock stage (``sph.outcome.escaping``).

    a grain leaves:  v^2 / 2 > -phi(x)  and  v . x > 0        about the centre of mass, in its motion
    dP = p - sum of m v over what leaves                     momentum that stays, p that of the projectile
    beta = dP . N / (p . N)                                  N normal of the surface at the site

phi is that of all moving grains (by the tree); of a grain that has left the run, and of what the handoff has put into
its list, that of the body as a point at the origin, at the position where it left. Where the body has a companion,
what leaves is out of the run from the Hill sphere on (``dem.collapse.flight``) and counts with the velocity that it
has there: beyond, its momentum is exchanged with the companion. The momentum that is found in the grains that stay is
given beside it (``beta_of_the_body``): both agree as far as momentum was kept since the impact.

Source: Cheng et al. 2023, Nature 616, 457, eq. 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dem.contact.columns import RADIUS
from dem.grains.assembly import Assembly
from dem.grains.self_gravity import SOFTENING
from matter.constants import G
from matter.geometry import tree

SOURCES = ("Cheng2023",)
THETA = 0.3


def escapes(bed: Assembly) -> np.ndarray:
    """(n,) whether each grain leaves the body, or has left it, for good."""
    k = np.arange(len(bed.X)) < bed.moving
    m, x, v = bed.mass, bed.position, bed.velocity
    drift = m @ v / m.sum()
    here = np.arange(len(bed.X)) < (bed.active or bed.moving)
    centre = m[here] @ x[here] / max(float(m[here].sum()), 1e-300)
    position = np.where(k[:, None], x - centre, x)
    well = G * float(m[here].sum()) / np.maximum(np.linalg.norm(position, axis=1), 1e-300)
    if np.count_nonzero(k) > 1:
        well[k] = tree.minus_potential(
            np.ascontiguousarray(x[k]), np.ascontiguousarray(m[k]), SOFTENING * bed.X[k, RADIUS], THETA
        )
    speed = v - drift
    fast = 0.5 * np.einsum("ij,ij->i", speed, speed) > well
    return np.asarray(fast & (np.einsum("ij,ij->i", speed, position) > 0.0))


def report(bed: Assembly, shot: Mapping[str, Any] | None, block: np.ndarray | None = None) -> dict[str, Any]:
    """For the report: mass [kg] and momentum [kg m/s] of what leaves and of what stays, and of the blocks
    (number, mass, momentum) among what leaves where ``block`` (n,) says which grains are some; beta where the start
    says what the projectile brought (``shot``: its momentum and the normal of the site)."""
    away = escapes(bed)
    lost = bed.mass[away] @ bed.velocity[away]
    body = bed.mass[~away] @ bed.velocity[~away]
    found: dict[str, Any] = {
        "mass_kg": float(bed.mass[away].sum()),
        "grains": int(np.count_nonzero(away)),
        "momentum_kg_m_s": lost.tolist(),
        "momentum_of_the_body_kg_m_s": body.tolist(),
    }
    if block is not None:
        mine = away & (block >= 0)
        found["blocks"] = {
            "number": int(np.count_nonzero(mine)),
            "mass_kg": float(bed.mass[mine].sum()),
            "momentum_kg_m_s": (bed.mass[mine] @ bed.velocity[mine]).tolist(),
        }
    if shot is None:
        return found
    brought, normal = (np.array(shot[name], dtype=float) for name in ("momentum_kg_m_s", "normal"))
    stays, along = brought - lost, float(brought @ normal)
    return found | {
        "momentum_that_stays_kg_m_s": stays.tolist(),
        "beta": float(stays @ normal / along),
        "beta_of_the_body": float(body @ normal / along),
        "beta_vector": (stays / np.linalg.norm(brought)).tolist(),
        "normal": normal.tolist(),
    }
