"""Ejecta as grains: every source particle outside the compact material becomes one sphere with its mass, position and
velocity.

* radius: the volume mass / density at the bed's packing fraction, so that ejecta that lands fills as much room as the
  bed does; density counts as half of that of packed matter at least, with ``loosened = "shrunk"`` as all of it; shrunk
  down to half of that where it would overlap; where that is not enough the grain is moved to the nearest free position
  around it;
* stiffness: scaled with mass (never above the bed's own), so that the contact time of a light grain, and with it the
  step, stays;
* ``state``: 0 in contact search; 1 ballistic, when much lighter than a bed grain or when no free position was found; 2
  booked only, beyond escape or beside the bed's domain. About a body of any shape ``fate`` says by two-body flight
  (``handoff.source.two_body``, about the compact matter's centre and in its motion) what becomes of each; booked are
  those that escape, orbit, or come back later than ``until``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains.domain import Domain
from handoff.domains.whole_body import WholeBody
from handoff.source import free_flight, two_body
from handoff.source.cloud_surface import SPARSEST, Rules, reference_density
from handoff.source.hydrostatic import Column
from matter.particles import Particles

_LIGHT = 0.1
_SHRINK = 0.5
_MOVES = np.concatenate([np.arange(0.1, 1.0, 0.1), np.arange(1.0, 6.01, 0.25)])  # radii
_DIRECTIONS = 64
IN_CONTACT, BALLISTIC, BOOKED = 0, 1, 2


@dataclass(frozen=True)
class Ejecta:
    """Arrays over the ejecta (e,): ``source`` is the index in the source; ``moved`` is how far each was moved to fit
    [m], ``shrunk`` counts smaller ones; ``fate`` is one of ``two_body.FATES`` (all ``returns`` where no body of any
    shape is flown about)."""

    source: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    mass: np.ndarray
    density: np.ndarray
    radius: np.ndarray
    state: np.ndarray
    moved: np.ndarray
    shrunk: int
    fate: np.ndarray

    def mass_by_state(self) -> Mapping[str, float]:
        """Mass [kg] of the ejecta by what becomes of them."""
        names = {"in contact search": IN_CONTACT, "ballistic": BALLISTIC, "booked only": BOOKED}
        return {name: float(self.mass[self.state == code].sum()) for name, code in names.items()}

    def mass_by_fate(self) -> Mapping[str, float]:
        """Mass [kg] of the ejecta by what becomes of them in free flight about a body of any shape."""
        return {name: float(self.mass[self.fate == code].sum()) for code, name in enumerate(two_body.FATES)}


def from_source(
    source: Particles,
    ejecta: np.ndarray,
    bed: Particles,
    packing: float,
    domain: Domain,
    column: Column,
    until: float = math.inf,
    rules: Rules = Rules(),  # noqa: B008  (frozen)
) -> Ejecta:
    """Grains for the source particles ``ejecta`` (indices) above the carved ``bed``; ``packing`` is the bed's packing
    fraction, ``until`` [s] (after the impact) when the collapse ends at the latest; the ``rules`` say what becomes of
    dilated matter."""
    position, velocity = source.position[ejecta].copy(), source.velocity[ejecta].copy()
    mass = source.mass[ejecta]
    least = 1.0 if rules.loosened == "shrunk" else SPARSEST
    density = np.maximum(source.density[ejecta], least * reference_density(source)[ejecta])
    if "widening" in source:  # what flies is as large as on the body
        density /= source.widening[ejecta]
    radius = np.cbrt(3.0 * packing * mass / (4.0 * np.pi * density))
    frame = domain.frame
    up = frame.up(position)
    state = np.zeros(len(ejecta), dtype=np.int8)
    state[mass < _LIGHT * float(np.min(bed.mass))] = BALLISTIC
    fate = _fates(source, ejecta, domain, column, until)
    escaping = fate != two_body.RETURNS
    if not isinstance(domain, WholeBody):
        escaping = past_edge(position, domain) | free_flight.escapes(domain, column, position, velocity)
    state[escaping] = BOOKED
    nominal = radius.copy()
    position, radius, state = _fitted(position, radius, state, up, bed)
    moved = np.linalg.norm(position - source.position[ejecta], axis=1)
    return Ejecta(
        ejecta,
        position,
        velocity,
        mass,
        density,
        radius,
        state,
        moved,
        int(np.count_nonzero(radius < 0.999 * nominal)),
        fate,
    )


def _fates(source: Particles, ejecta: np.ndarray, domain: Domain, column: Column, until: float) -> np.ndarray:
    """What becomes of the ``ejecta`` (indices) about a body of any shape, (e,); elsewhere all return."""
    fate = np.full(len(ejecta), two_body.RETURNS, dtype=np.int8)
    if not isinstance(domain, WholeBody) or len(ejecta) == 0:
        return fate
    compact = np.ones(len(source), dtype=bool)
    compact[ejecta] = False
    mass = source.mass[compact]
    centre, drift = (mass @ values[compact] / mass.sum() for values in (source.position, source.velocity))
    position = source.position[ejecta]
    surface = np.linalg.norm(domain.frame.foot(position) - centre, axis=1)
    left = until - float(source.attributes.get("time", 0.0))
    return two_body.fate(
        free_flight.strength(column), position - centre, source.velocity[ejecta] - drift, surface, left
    )


def past_edge(position: np.ndarray, domain: Domain) -> np.ndarray:
    """Whether a point lies beside or below the domain (above it is still over the bed); never where grains are a
    whole body."""
    if isinstance(domain, WholeBody):
        return np.zeros(len(position), dtype=bool)
    frame = domain.frame
    foot = position - (frame.height(position)[:, None]) * frame.up(position)
    below = domain.depth_inside(foot) <= 0.0
    floor = frame.height(position) < frame.height(domain.even_points(np.zeros((1, 3))))[0]
    return below | floor


def _gap(position: np.ndarray, tree: cKDTree, radius: np.ndarray) -> np.ndarray:
    """Distance [m] from each point to the nearest surface among the spheres of ``tree``."""
    near = min(8, tree.n)
    distance, which = tree.query(position, k=near)
    return np.min(distance.reshape(-1, near) - radius[which.reshape(-1, near)], axis=1)


def _around(up: np.ndarray) -> np.ndarray:
    """Even directions over the sphere about each vertical ``up`` (n, 3), steepest first: (directions, n, 3)."""
    number = np.arange(_DIRECTIONS) + 0.5
    z, turn = 1.0 - 2.0 * number / _DIRECTIONS, np.pi * (1.0 + np.sqrt(5.0)) * number
    aside = np.cross(up, np.where(np.abs(up[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]))
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    other = np.cross(up, aside)
    flat = np.sqrt(1.0 - z**2)
    x, y = (flat * np.cos(turn))[:, None, None], (flat * np.sin(turn))[:, None, None]
    return x * aside + y * other + z[:, None, None] * up


def _fitted(position, radius, state, up, bed) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radii and positions without overlap among grains of state 0 and with the bed; grains that fit nowhere become
    ballistic."""
    tree = cKDTree(bed.position)
    nominal = radius.copy()
    active = np.flatnonzero(state == IN_CONTACT)
    radius[active] = np.minimum(radius[active], _gap(position[active], tree, bed.radius))
    crowded = active[radius[active] < _SHRINK * nominal[active]]
    start = position.copy()
    for distance in _MOVES:
        if len(crowded) == 0:
            break
        trial = start[crowded] + distance * nominal[crowded, None] * _around(up[crowded])
        room = _gap(trial.reshape(-1, 3), tree, bed.radius).reshape(trial.shape[:2])
        free = room >= _SHRINK * nominal[crowded]
        first = np.argmax(free, axis=0)
        fits = free[first, np.arange(len(crowded))]
        position[crowded[fits]] = trial[first[fits], np.flatnonzero(fits)]
        radius[crowded[fits]] = np.minimum(nominal[crowded[fits]], room[first[fits], np.flatnonzero(fits)])
        crowded = crowded[~fits]
    state[crowded] = BALLISTIC
    active = np.flatnonzero(state == IN_CONTACT)
    for _ in range(20):
        overlap, one, other = _overlapping(position, radius, active)
        if len(overlap) == 0:
            break
        distance = radius[one] + radius[other] - overlap
        factor = distance / (radius[one] + radius[other])
        # each grain yields in proportion; a hair less, so that rounding leaves no contact
        scale = np.ones(len(radius))
        np.minimum.at(scale, one, factor * (1.0 - 1e-9))
        np.minimum.at(scale, other, factor * (1.0 - 1e-9))
        radius *= scale
        small = active[radius[active] < _SHRINK * nominal[active]]
        state[small] = BALLISTIC
        active = np.flatnonzero(state == IN_CONTACT)
    ballistic = state != IN_CONTACT
    radius[ballistic] = nominal[ballistic]
    return position, radius, state


def _overlapping(
    position: np.ndarray, radius: np.ndarray, active: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Overlaps [m] (> 0) among the active grains, and the two grains of each."""
    if len(active) < 2:
        return np.empty(0), np.empty(0, dtype=int), np.empty(0, dtype=int)
    pairs = cKDTree(position[active]).query_pairs(2.0 * float(radius[active].max()), output_type="ndarray")
    one, other = active[pairs[:, 0]], active[pairs[:, 1]]
    overlap = radius[one] + radius[other] - np.linalg.norm(position[one] - position[other], axis=1)
    hit = overlap > 0.0
    return overlap[hit], one[hit], other[hit]
