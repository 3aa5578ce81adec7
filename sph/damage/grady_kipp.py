"""Grady-Kipp fragmentation with explicit Weibull flaws (Benz & Asphaug 1994, 1995).

The number of flaws per volume that activate below the strain eps is n(eps) = k eps^m. Active flaws grow cracks at c_g
= 0.4 c_p (c_p the longitudinal wave speed), and damage with them by one of the laws of ``sph.damage.growth``. The
local strain is eps = sigma_max / E, with the largest principal tensile stress before damage and Young's modulus E = 9
K mu / (3 K + mu); in a porous material stress and strain are those of the matrix.
"""

import math
from typing import NamedTuple

import numpy as np

from matter.case.quantity import NumberDensity
from matter.compilation.jit import law

SOURCES = ("BenzAsphaug1994", "BenzAsphaug1995", "LawnWilshaw1975")

CRACK_SPEED = 0.4  # of the longitudinal wave speed: Lawn & Wilshaw 1975, as used by Benz & Asphaug 1994
_PIECE = 1 << 16  # flaws, or particles, handled at a time
KEPT = 32
"""Flaws of a particle that are kept where not all are."""


class Parameters(NamedTuple):
    """k [1/m^3] and m of the Weibull distribution."""

    k: NumberDensity
    m: float


@law
def largest_principal(sxx, sxy, sxz, syy, syz, pressure):
    """The largest eigenvalue [Pa] of S - P 1 for a trace-free S (trigonometric solution of the cubic)."""
    szz = -sxx - syy
    J2 = 0.5 * (sxx * sxx + syy * syy + szz * szz) + sxy * sxy + sxz * sxz + syz * syz
    if J2 <= 0.0:
        return -pressure
    J3 = sxx * (syy * szz - syz * syz) - sxy * (sxy * szz - syz * sxz) + sxz * (sxy * syz - syy * sxz)
    cosine = 1.5 * math.sqrt(3.0) * J3 / (J2 * math.sqrt(J2))
    angle = math.acos(min(max(cosine, -1.0), 1.0)) / 3.0
    return 2.0 * math.sqrt(J2 / 3.0) * math.cos(angle) - pressure


def expected(volumes: np.ndarray) -> float:
    """About how many flaws ``flaws`` needs: (V / V_min) (ln n + 0.6), n the number of particles that are not much
    larger than the smallest."""
    return expected_among(volumes, np.ones(len(volumes)))


def expected_among(volumes: np.ndarray, number: np.ndarray) -> float:
    """The same for ``number`` particles of each of the ``volumes``."""
    least = float(volumes.min())
    fine = max(float(number[volumes < 1.5 * least].sum()), 1.0)
    return float((volumes * number).sum()) / least * (math.log(fine) + 0.6)


def flaws(volumes: np.ndarray, parameters: Parameters, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Seed the flaws of one material (Benz & Asphaug 1995, section 2.3).

    Flaw j = 1, 2, ... has the activation strain eps_j = (j / (k V))^(1/m), with V the whole volume of the material,
    and goes to a particle drawn with a probability proportional to its volume, until every particle has at least one.

    Parameters
    ----------
    volumes : solid volume of each particle [m^3] (without its pores), in order of identity.

    Returns
    -------
    start : (n + 1,) int64, the flaws of particle i are ``strains[start[i]:start[i + 1]]``
    strains : float32, ascending for each particle
    """
    count = len(volumes)
    if count == 0:
        return np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.float32)
    total = float(volumes.sum())
    cumulative = np.cumsum(volumes) / total
    owners, missing = [], np.ones(count, dtype=bool)
    while missing.any():
        drawn = np.empty(4 * count + 64, dtype=np.int32)
        for at in range(0, len(drawn), _PIECE):
            piece = drawn[at : at + _PIECE]
            piece[:] = np.minimum(np.searchsorted(cumulative, rng.random(len(piece))), count - 1)
        first = np.full(count, len(drawn), dtype=np.int32)
        np.minimum.at(first, drawn, np.arange(len(drawn), dtype=np.int32))
        needed = first[missing]
        missing &= first == len(drawn)
        owners.append(drawn if missing.any() else drawn[: needed.max() + 1].copy())
    del drawn, first, cumulative
    owner = np.concatenate(owners)
    del owners
    start = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=count))])
    order = np.argsort(owner, kind="stable")
    del owner
    strains = np.empty(len(order), dtype=np.float32)
    for at in range(0, len(order), _PIECE):  # in pieces, for the memory
        # (j / (k V))^(1/m) in logarithms: k V overflows nothing, but j / (k V) reaches 1e-57
        j = order[at : at + _PIECE] + 1
        strains[at : at + _PIECE] = np.exp((np.log(j) - math.log(parameters.k) - math.log(total)) / parameters.m)
    return start, strains


def weakest(
    volumes: np.ndarray, parameters: Parameters, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The flaws that ``flaws`` deals out, of a body so graded that large particles would get tens of thousands: of
    each particle the ``KEPT`` - 1 weakest, the strongest, and how many there are.

    With x = k eps^m, the flaws of a particle of volume V_i are a Poisson process of the rate V_i in x, which ends for
    all at the x at which the last particle gets its first,

        x_end = max_i E_i / V_i,    E_i exponential,    n_i = 1 + Poisson(V_i x_end - E_i)

    and so the weakest are sums of exponential numbers over V_i.

    Returns
    -------
    start : (n + 1,) int64, the flaws of particle i that are kept are ``strains[start[i]:start[i + 1]]``
    strains : float32, ascending for each particle
    total : (n,) float32, all its flaws
    """
    first = rng.exponential(size=len(volumes))
    end = float((first / volumes).max()) * volumes
    kept, totals = [], []
    for at in range(0, len(volumes), _PIECE):
        mine = slice(at, at + _PIECE)
        g = np.empty((len(volumes[mine]), KEPT))
        g[:, 0], g[:, 1:] = first[mine], rng.exponential(size=(len(g), KEPT - 1))
        np.cumsum(g[:, : KEPT - 1], axis=1, out=g[:, : KEPT - 1])
        last, most = g[:, KEPT - 2], end[mine]
        more = np.where(last < most, rng.poisson(np.maximum(most - last, 0.0)), 0)
        # the largest of so many between the last of the weakest and the end
        g[:, KEPT - 1] = last + (most - last) * rng.random(len(g)) ** (1.0 / np.maximum(more, 1))
        there = g <= most[:, None] * (1.0 + 1e-12)
        there[:, KEPT - 1] = more > 0
        totals.append(there[:, : KEPT - 1].sum(axis=1) + more)
        x = np.log(g) - np.log(volumes[mine])[:, None] - math.log(parameters.k)
        kept.append((there.sum(axis=1), np.exp(x / parameters.m).astype(np.float32)[there]))
    count = np.concatenate([number for number, _ in kept])
    start = np.concatenate([[0], np.cumsum(count)])
    return start, np.concatenate([strains for _, strains in kept]), np.concatenate(totals).astype(np.float32)


@law
def active(flaw_strain, first, last, total, strain):
    """How many of ``total`` flaws are open at ``strain``, of which ``flaw_strain[first:last]`` are kept: where others
    lie between the last two of these, their number rises as a power of the strain from the one to the other."""
    opened, held = 0, last - first
    while opened < held and flaw_strain[first + opened] < strain:
        opened += 1
    if opened == held:
        return float(total)
    if opened == held - 1 and total > held:
        weak, strong = flaw_strain[last - 2], flaw_strain[last - 1]
        return opened * (strain / weak) ** (math.log(total / opened) / math.log(strong / weak))
    return float(opened)
