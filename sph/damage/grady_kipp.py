"""Grady-Kipp fragmentation with explicit Weibull flaws (Benz & Asphaug 1994, 1995).

The number of flaws per volume that activate below the strain eps is n(eps) = k eps^m. Active flaws grow cracks at c_g = 0.4 c_p (c_p the longitudinal
wave speed), and damage with them by one of the laws of ``sph.damage.growth``. The local strain is eps = sigma_max / E, with the largest principal
tensile stress before damage and Young's modulus E = 9 K mu / (3 K + mu); in a porous material stress and strain are those of the matrix.
"""

import math
from typing import NamedTuple

import numpy as np

from matter.jit import law
from matter.quantity import NumberDensity

SOURCES = ("BenzAsphaug1994", "BenzAsphaug1995", "LawnWilshaw1975")

CRACK_SPEED = 0.4  # of the longitudinal wave speed: Lawn & Wilshaw 1975, as used by Benz & Asphaug 1994
_PIECE = 1 << 16  # flaws handled at a time
_PARTICLES = 1 << 12  # particles handled at a time


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
    """About how many flaws ``flaws`` needs: (V / V_min) (ln n + 0.6), n the number of particles that are not much larger than the smallest."""
    least = float(volumes.min())
    return float(volumes.sum()) / least * (math.log(np.count_nonzero(volumes < 1.5 * least)) + 0.6)


def weakest(volumes: np.ndarray, parameters: Parameters, most: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The weakest flaws of each particle, where all of them are too many: some ``most`` in all, the same number in every large particle.

    Flaws at random places are a Poisson process in each particle: the j-th weakest of a volume V activates at eps = (S_j / (k V))^(1/m), S_j a sum of j
    exponential deviates of mean one. Particles that ``flaws`` would give fewer keep their expected number. What is left out activates at strains at which
    a particle's weakest flaws broke it before. Arguments and results as for ``flaws``.
    """
    least = float(volumes.min())
    wanted = np.maximum(volumes / least * (math.log(np.count_nonzero(volumes < 1.5 * least)) + 0.6), 1.0)
    low, high = 1.0, float(wanted.max())
    for _ in range(60):  # the number that every large particle keeps
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.minimum(wanted, middle).sum() <= most else (low, middle)
    count = np.ceil(np.minimum(wanted, low)).astype(np.int64)
    start = np.concatenate([[0], np.cumsum(count)])
    strains = np.empty(int(start[-1]), dtype=np.float32)
    for first in range(0, len(volumes), _PARTICLES):
        last = min(first + _PARTICLES, len(volumes))
        begin = start[first]
        sums = np.cumsum(rng.standard_exponential(int(start[last] - begin)))
        before = np.concatenate([[0.0], sums])[start[first:last] - begin]  # what the particles before it took
        own = np.maximum(sums - np.repeat(before, count[first:last]), 1e-300)
        logs = np.log(own) - math.log(parameters.k) - np.log(np.repeat(volumes[first:last], count[first:last]))
        strains[begin : start[last]] = np.exp(logs / parameters.m)
    return start, strains


def flaws(volumes: np.ndarray, parameters: Parameters, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Seed the flaws of one material (Benz & Asphaug 1995, section 2.3).

    Flaw j = 1, 2, ... has the activation strain eps_j = (j / (k V))^(1/m), with V the whole volume of the material, and goes to a particle
    drawn with a probability proportional to its volume, until every particle has at least one.

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
