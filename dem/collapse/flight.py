"""Which grains take part in the contact search, which fly, and which have left for good."""

from __future__ import annotations

import numpy as np

from dem.beds.bed_walls import Domain
from dem.beds.whole_body_bed import WholeBody, bound
from dem.contact.columns import RADIUS, TOUCHING
from dem.grains.assembly import ACTIVE, BALLISTIC, LEFT, Assembly
from matter.geometry.ground_region import Upright

EVERY = 10
"""Steps between two looks."""
ESCAPE_RADII = 1.5
"""A grain faster than escape is booked beyond this many radii of the body; slower ones may come back."""
BODY_RADII = 10.0
"""The same of a whole body, whose grains attract each other, or its Hill radius: what is booked pulls no longer."""
CHANGES = (
    (LEFT, "through_the_side"), (BALLISTIC, ""), (LEFT, "escaped"), (LEFT, "landed_outside"), (ACTIVE, "")
)  # fmt: skip
"""What a grain can be due for: its next state, and why it leaves."""


def look(bed: Assembly, domain: Domain | WholeBody) -> None:
    """Move grains between the contact search, free flight and the books (at a full step).

    The *shell* is the highest touching grain or the top of the domain, whichever is higher, and two radii more: above
    it a grain without contact flies ballistically (gravity, and collisions by ``flight_collisions``), and comes back
    into the search before it can reach the shell again. Booked are grains on an escape orbit, grains that come down
    beside the domain or across its side, and grains that have gone through its side. Beyond the side the ground goes
    on: a sphere that comes down on the wall's upper edge lies on both, and would be in the wall by up to its radius at
    once.
    """
    changed = _due(bed, domain)
    if not changed.any():
        return
    by_identity = dict(zip(bed.identity[changed > 0].tolist(), changed[changed > 0].tolist()))
    for code, (state, reason) in enumerate(CHANGES, 1):
        wanted = [identity for identity, number in by_identity.items() if number == code]
        if wanted:
            bed.change_states(np.isin(bed.identity, wanted), state, reason)


def _due(bed: Assembly, domain: Domain | WholeBody) -> np.ndarray:
    """(n,) which of ``CHANGES`` each grain is due for, counted from 1; 0 for none."""
    flat = isinstance(domain, Upright)
    position = bed.position - _centre(bed) if isinstance(domain, WholeBody) else bed.position
    distance = bed.position[:, 2] if flat else np.linalg.norm(position, axis=1)
    touching = np.zeros(len(bed.X), dtype=bool)
    first, second, _ = bed.touching()
    touching[first] = touching[second] = True
    touching |= np.any(bed.wall_history[:, : len(bed.walls), TOUCHING] != 0.0, axis=1)
    largest = float(bed.X[:, RADIUS].max())
    top = float(np.max((distance + bed.X[:, RADIUS])[touching], initial=domain.top))
    shell = top + 2.0 * largest
    outward = bed.velocity[:, 2] > 0.0 if flat else np.einsum("ij,ij->i", position, bed.velocity) > 0.0
    outside = domain.outside(bed.position)
    speed2 = np.einsum("ij,ij->i", bed.velocity, bed.velocity)
    if isinstance(domain, WholeBody):
        stays, far = bound(bed, distance), min(BODY_RADII, domain.hill_radius / domain.datum)
    else:
        stays, far = 0.5 * speed2 + bed.gravity.potential(bed.position) < 0.0, ESCAPE_RADII
    active, flying = bed.state == ACTIVE, bed.state == BALLISTIC
    reach = 2.0 * EVERY * bed.dt * np.sqrt(speed2) + 2.0 * largest

    aside = active & outside & (distance < domain.top)
    across = (
        ~outside
        & (domain.side_depth(bed.position) < bed.X[:, RADIUS])
        & ~outward
        & (distance >= domain.top)
        & (distance < domain.top + reach)
    )
    launched = active & ~touching & ~aside & (((distance - bed.X[:, RADIUS] > shell) & outward) | outside)
    # under uniform gravity nothing escapes
    escaped = np.zeros(len(flying), dtype=bool) if flat else flying & ~stays & (distance > far * domain.datum)
    past_side = flying & outside & ~outward & (distance < domain.top)
    past_side |= flying & (distance < domain.floor)
    past_side |= across & (flying | (active & ~touching))
    back = flying & ~outside & ~outward & (distance < shell + reach)
    if back.any():
        back &= _free(bed, np.flatnonzero(back), distance > shell)
    due = np.where(aside, 1, 0) + np.where(launched, 2, 0) + np.where(escaped, 3, 0) + np.where(past_side, 4, 0)
    return due + np.where(back & ~past_side, 5, 0)


def _centre(bed: Assembly) -> np.ndarray:
    """Centre of mass (3,) [m] of the grains in the contact search, of all that move where none is."""
    k = slice(0, bed.active or bed.moving)
    return np.asarray(bed.mass[k] @ bed.position[k] / bed.mass[k].sum())


def _free(bed: Assembly, candidates: np.ndarray, above: np.ndarray) -> np.ndarray:
    """Mask of the candidates that can be put among the grains of the search: in none of these, nor in a candidate that
    was taken before.

    Two that flew at one position from the start may share it still; springs would throw them apart with an energy that
    nothing had given them. One that has sunk below the shell (``above`` false) has no time left: its contacts begin
    unloaded where contacts have offsets (``Assembly.change_states``); elsewhere it may overlap by a tenth of the
    smaller radius.
    """
    from scipy.spatial import cKDTree

    position, radius = bed.position, bed.X[:, RADIUS]
    taken = np.arange(len(bed.X)) < bed.active
    tree = cKDTree(np.concatenate([position[: bed.active], position[candidates]]))
    index = np.concatenate([np.arange(bed.active), candidates])
    largest = float(radius.max())
    late = np.inf if bed.scheme.offset else 0.1
    mask = np.zeros(len(bed.X), dtype=bool)
    for i in candidates:
        near = index[tree.query_ball_point(position[i], radius[i] + largest)]
        near = near[taken[near] & (near != i)]
        overlap = radius[near] + radius[i] - np.linalg.norm(position[near] - position[i], axis=1)
        allowed = 0.0 if above[i] else late
        mask[i] = taken[i] = not np.any(overlap > allowed * np.minimum(radius[near], radius[i]))
    return mask


def damp(bed: Assembly, domain: Domain | WholeBody) -> None:
    """Set the damping of the outermost grains for where they are now; what flies is not damped."""
    drag = domain.drag(bed.position)
    drag[bed.active :] = 0.0
    if isinstance(domain, Upright):
        drag[bed.position[:, 2] > domain.top] = 0.0
    else:
        drag[np.einsum("ij,ij->i", bed.position, bed.position) > domain.top**2] = 0.0
    bed.drag[:] = drag
