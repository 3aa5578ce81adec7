"""Where two bodies touch: a block and the ground about it, or another block; the projectile and what it strikes.

**Blocks.** A pair across the surface of a block passes on compression and the shear that goes with it, and no tension:

    F_ij = 0 where  r . (sigma_i + sigma_j) . r > 0     (r the way between the two)

Matter on its own side bears what its material bears. The gap that opens where such a pair parts is no expansion of
either: their velocity gradients see the partner move along. Otherwise a block in ground that flies apart would be
stretched, and drawn together, by what it does not touch.

**The projectile.** A kernel feels the other body across the gap before the two touch. Counted as any other pair, that
approach compresses both by the half of the neighbourhood that a surface lacks: plates of aluminium that come together
at 5 km/s end with 1.6 times the pressure of the planar limit in the layers at the contact and 0.3 spacings too far
apart, at 500 m/s with twice the limit and 0.6. So there is no tension either, and

* the approach compresses as far as the gap has closed, while the projectile goes in. The neighbourhood is full to

      f_i = -(1 / 3 eta_i) sum_j V0_j r_ij dW/dr (r_ij, h_ij) / (the same sum in a lattice),

  2/3 of it at a surface without a partner; the velocity gradient and the viscosity count the least of what both
  partners' f allow (``approach_fraction``: nothing below ``GAP``, all of it from ``CLOSED`` on);
* parting expands what is compressed (P_i > 0), and no further than what surrounds it fills: beyond f_i = ``CROWDED``
  the density would fall below what the positions say.

Once the projectile is in (``ends``), every approach counts: no neighbourhood is full in loosened ground, so the rest
of the projectile would pass through it unbraked. A projectile of fewer than ``RESOLVED`` spacings to its radius
fills no neighbourhood: it counts as ground. (As a body of its own, copper of a third of a spacing flew into Ryugu's
ground: a hole of 43.7 m^3 for 34.1. Against a grid code, ``studies/porous_impact.py``, balls of two spacings do better
as bodies of their own, of one worse.)

Where force and velocity gradient count a different part of a pair, the difference of their work is heat: momentum and
total energy are kept as in any pair.

Each particle says whose it is: the number of its material in the ground, ``PROJECTILE`` more in the projectile, -1 - b
in block b. Layers of the ground, and parts of a projectile, have no surface between them. Heat (``conductivity``)
flows within one material of one body.
"""

from __future__ import annotations

import math

import numpy as np

from matter.compilation.jit import law, parallel_kernel, prange

GAP, CLOSED = 0.90, 0.98
"""How full a neighbourhood is from which on an approach counts, and from which on all of it. Plates whose gap is 0.25
spacings have 0.9."""
CROWDED, OVERFULL = 1.1, 1.3
"""How full a neighbourhood is from which on parting counts less, and from which on not at all."""
RESOLVED = 1.5
"""Spacings to a projectile's radius, of its own and of the finest ground, from which on it is a body of its own."""
LASTS = 2.0
"""How long a projectile goes in, over the time in which it would cover its diameter."""
PROJECTILE = 1024
_SCALE = 2.0  # of the approach_fraction in the fraction of a code, which stays below 1


@law
def surface(one, other):
    """1 between two bodies, else 0; ``one`` and ``other`` whose the partners are."""
    different = one != other and (min(one, other) < 0.0 or (one >= PROJECTILE) != (other >= PROJECTILE))
    return 1.0 if different else 0.0


@law
def struck(one, other):
    """1 between the projectile and another body, else 0."""
    return 1.0 if (one >= PROJECTILE) != (other >= PROJECTILE) else 0.0


@law
def approach_fraction(filled):
    """The fraction of an approach that compresses, of how full the neighbourhood is."""
    x = min(max((filled - GAP) / (CLOSED - GAP), 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


@law
def parting_fraction(filled, pressure):
    """The fraction of a parting that expands at this ``pressure`` [Pa], by how full the neighbourhood is."""
    return min(max((OVERFULL - filled) / (OVERFULL - CROWDED), 0.0), 1.0) if pressure > 0.0 else 0.0


@law
def pressed(across, along):
    """What of the stress a pair passes on: none in tension ``across`` a surface; ``along`` r . (sigma_i + sigma_j) . r
    [Pa m^2]."""
    return 1.0 - across if along > 0.0 else 1.0


@law
def strained(approaching, closed, parting, passed):
    """What of a pair's velocity the gradient of particle i sees: as far as its gap has ``closed`` where it is
    ``approaching``, else the fraction ``parting`` of what is pressed."""
    return closed if approaching else passed * parting


@law
def code(body, filled):
    """Whose a particle is and the ``approach_fraction`` of its neighbourhood, in one number for the pair loop."""
    return body + approach_fraction(filled) / _SCALE


@law
def body_of(number):
    """Whose the particle of this ``code`` is."""
    return math.floor(number)


@law
def approach_of(number, body):
    """The ``approach_fraction`` in a ``code`` of this ``body``."""
    return _SCALE * (number - body)


def resolved(position: np.ndarray, spacing: np.ndarray, projectile: np.ndarray) -> bool:
    """Whether the ``projectile`` (n,) is a body of its own, by the first positions (n, 3) and spacings (n,) [m]. Its
    radius is that of a ball of its extent in height, which vertical mirrors leave whole."""
    if not projectile.any() or projectile.all():
        return False
    coarsest = max(float(np.median(spacing[projectile])), float(spacing[~projectile].min()))
    radius = math.sqrt(5.0) * float(position[projectile, 2].std())
    return radius >= RESOLVED * coarsest


def ends(diameter: float, speed: float, away: float) -> float:
    """When the projectile is in [s]: its ``diameter``, ``speed``, and how far ``away`` it starts; SI."""
    return (away + LASTS * diameter) / speed


def bodies(material: np.ndarray, block: np.ndarray, projectile: np.ndarray) -> np.ndarray:
    """Whose each particle is (n,), from its material and its block (n,; without blocks empty), and whether it is a
    projectile's that is a body of its own."""
    whose = np.where(projectile, material + PROJECTILE, material)
    return np.where(block >= 0, -1 - block, whose) if len(block) else whose


@parallel_kernel
def write(body, filled, column):
    """Fill the ``column`` (n,) with the codes of particles of a ``body`` (n,) whose neighbourhoods are so ``filled``
    (n,)."""
    for i in prange(len(body)):
        column[i] = code(body[i], filled[i])
