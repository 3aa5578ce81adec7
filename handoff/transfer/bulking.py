"""Grains that stand for dilated matter, at the size that this matter has when it is packed again.

Cohesionless ground bears no tension: where a flow parts it, as about a hollow in weak gravity, its density falls to
0.5 ... 0.9 of what it is packed. A grain of the settled bed at its full size would keep that dilated volume for ever,
and would touch its neighbours where the flow still has room to converge. So with ``[handoff] loosened = "shrunk"``

    s  = sum_p V_p rho_p / rho_ref,p  /  sum_p V_p
    r' = r max(s, s_min)^(1/3)   where s < 1 - ``NOISE``,   r' = r elsewhere

r, r' : radius of the grain in the bed and at the start [m]; its position, mass, velocity and k_n stay
V_p   : what the particle p has of the volume that the grain stands for [m^3]
rho_p : density of the particle as its room is counted (``surface.counted_density``) [kg/m^3]; rho_ref,p that of its
        material with the pores it has: crushed matter counts against what it was crushed to. Of a material not known
        here: of the grain's undisturbed layer
s_min : ``surface.SPARSEST``: sparser matter is ejecta, or counted at that, so that no grain is made smaller than 0.79
        of itself

The grain then holds m = s V rho_ref in the fraction s of its volume: its own density is that of a grain of undilated
matter, its moment of inertia 2 m r'^2 / 5. A grain never grows. Contacts that open are forgotten; in those that stay
the springs shrink as the overlap does, so that each stays as far from its Coulomb limit as it was.

Source: this project's own; measured in docs/results/sci_ryugu/settled.csv.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from handoff.domains.domain import Domain
from handoff.source.cloud_surface import SPARSEST
from handoff.transfer.force_network import OFFSET
from handoff.transfer.mapping import Overlap
from matter.errors import InputError
from matter.particles import Particles

NOISE = 0.02
"""Loosening that counts for none: a random packing is known no better, and undisturbed ground scatters by less."""
_SPRINGS = slice(0, OFFSET)
"""Tangential, rolling and twisting springs in ``contacts/history``."""


def packed_fraction(
    density: np.ndarray, reference: np.ndarray, cells: Overlap, near: np.ndarray, undisturbed: np.ndarray | None
) -> np.ndarray:
    """s (k,): fraction of its volume that the matter of each grain takes when packed.

    ``density`` and ``reference`` (n,) [kg/m^3] of the compact particles, 0 where the material is not known: then the
    grains' ``undisturbed`` density (k,) counts; ``cells`` of grains and particles, ``near`` (k,) the nearest particle
    of each grain, for those without a point. Raises ``InputError`` where neither density is known.
    """
    if undisturbed is None and not np.all(reference > 0.0):
        raise InputError(
            '[handoff] loosened = "shrunk" needs the density of packed matter: the source holds a material that is '
            "not known here, and the bed carries no field 'density'"
        )

    def fraction(particle: np.ndarray, grain: np.ndarray) -> np.ndarray:
        packed = reference[particle]
        if undisturbed is not None:
            packed = np.where(packed > 0.0, packed, undisturbed[grain])
        return density[particle] / packed

    total = np.bincount(
        cells.grain, weights=cells.weight * fraction(cells.particle, cells.grain), minlength=len(cells.grains)
    )
    some = cells.per_grain > 0.0
    return np.where(some, total / np.where(some, cells.per_grain, 1.0), fraction(near, np.arange(len(near))))


def radius_factor(fraction: np.ndarray) -> np.ndarray:
    """r' / r (k,) of grains whose matter takes this ``fraction`` of its volume when packed."""
    return np.where(fraction < 1.0 - NOISE, np.cbrt(np.clip(fraction, SPARSEST, 1.0)), 1.0)


def contacts_kept(
    tables: Mapping[str, np.ndarray], before: Particles, radius: np.ndarray, region: Domain
) -> dict[str, np.ndarray]:
    """The contact ``tables`` of the grains ``before`` once their radii are ``radius`` (k,) [m]: without the contacts
    that open, with smaller springs in the others of smaller grains.

    A grain's contact with a wall ends where it no longer reaches the nearest wall.
    """
    kept, smaller = dict(tables), radius < before.radius
    if not smaller.any():
        return kept
    order = np.argsort(before.identity)

    def indices(identity: np.ndarray) -> np.ndarray:
        return order[np.searchsorted(before.identity, identity, sorter=order)]

    if len(tables.get("contacts/pair", ())):
        pair, history = tables["contacts/pair"], tables["contacts/history"].copy()
        one, other = indices(pair[:, 0]), indices(pair[:, 1])
        distance = np.linalg.norm(before.position[one] - before.position[other], axis=1)
        was = before.radius[one] + before.radius[other] + _offset(history) - distance
        now = was - (before.radius - radius)[one] - (before.radius - radius)[other]
        changed = smaller[one] | smaller[other]
        stays = ~changed | (now > 0.0)
        history[:, _SPRINGS] *= np.where(changed & stays, now / np.maximum(was, 1e-300), 1.0)[:, None]
        kept |= {"contacts/pair": pair[stays], "contacts/history": history[stays]}
    if len(tables.get("contacts/wall_pair", ())):
        pair, history = tables["contacts/wall_pair"], tables["contacts/wall_history"]
        grain = indices(pair[:, 0])
        reaches = radius[grain] + _offset(history) > region.wall_depth(before.position[grain])
        stays = ~smaller[grain] | reaches
        kept |= {"contacts/wall_pair": pair[stays], "contacts/wall_history": history[stays]}
    return kept


def _offset(history: np.ndarray) -> np.ndarray:
    return history[:, OFFSET] if history.shape[1] > OFFSET else np.zeros(len(history))
