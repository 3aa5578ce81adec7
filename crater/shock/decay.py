"""How the shock weakened with distance: the isobaric core and the power of the decay beyond it.

    P(r) = P_0                 r < r_c
    P(r) = P_0 (r / r_c)^-n    r >= r_c

r is the first distance of the matter from the point of contact, P the largest pressure that it felt: medians over
shells of even width in log r, wider where particles are few, of the layer that was hit, within ``CONE`` of the
vertical (nearer to the surface rarefactions weaken the shock). P_0, r_c and n by least squares in the logarithms, from
the contact to the first shell below ``LEAST`` of the largest median (elastic waves, and what numerical viscosity made
of weak ones), or to the bottom of the layer. Errors: leaving out one of ``SECTORS`` in azimuth after the other
(jackknife).

A projectile of few particles smears the core out (``crater.results.soundness``).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from crater.ground.datum import Datum
from matter.errors import InputError
from matter.particles import Particles

CONE = np.radians(50.0)
STEP = 1.2
"""Least ratio of the radii of neighbouring shells."""
FEWEST, LEAST, SHELLS = 8, 3e-3, 5
"""Fewest particles in a shell, least pressure over the largest, fewest shells."""
SECTORS = 12


class Decay(NamedTuple):
    """P_0 [Pa], r_c [m] and n."""

    pressure: float
    radius: float
    exponent: float


def facts(last: Particles, ground: Datum, projectile_radius: float) -> dict[str, Any]:
    """What ``measures.json`` says of it: the three values with their errors, r_c in projectile radii too, and the
    shells; ``last`` is the last snapshot of the shock stage, ``ground`` the undisturbed datum.

    Raises ``InputError`` where the snapshot lacks a field or too few shells are left.
    """
    last.need("initial_position", "peak_pressure", "layer")
    first = ground.local(last.initial_position) - (0.0, 0.0, ground.radius if ground.is_sphere else 0.0)
    away = np.linalg.norm(first, axis=1)
    mine = (last.layer == last.layer.max()) & (-first[:, 2] > np.cos(CONE) * away)
    away, peak = away[mine], last.peak_pressure[mine]
    sector = np.floor((np.arctan2(first[mine, 1], first[mine, 0]) / (2.0 * np.pi) % 1.0) * SECTORS).astype(int)
    r, P, count = shells(away, peak)
    best = fit(r, P)
    others = []
    for k in range(SECTORS):
        try:
            others.append(fit(*shells(away[sector != k], peak[sector != k])[:2]))
        except InputError:
            continue
    less = np.log(np.array(others))
    scatter = np.sqrt((SECTORS - 1) / SECTORS * ((less - less.mean(axis=0)) ** 2).sum(axis=0))
    sigma = [float(value * part) for value, part in zip(best, scatter)]
    return {
        "core_pressure_Pa": {"value": best.pressure, "sigma": sigma[0]},
        "core_radius_m": {"value": best.radius, "sigma": sigma[1]},
        "core_radius_over_projectile": best.radius / projectile_radius,
        "exponent": {"value": best.exponent, "sigma": sigma[2]},
        "to_m": float(r[-1]),
        "shells": {"radius_m": r.tolist(), "pressure_Pa": P.tolist(), "particles": count.tolist()},
    }


def shells(away: np.ndarray, peak: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radii [m], median pressures [Pa] and numbers of particles of the shells, nearest first: each as thick as it
    takes to hold ``FEWEST``. Raises ``InputError`` where fewer than ``SHELLS`` are left."""
    order = np.argsort(away)
    r, P = away[order], peak[order]
    found, begun = [], 0
    gap = np.flatnonzero(r[FEWEST:] > STEP * r[FEWEST - 1 : -1])  # the layer on the body's far side
    r = r[: gap[0] + FEWEST] if len(gap) else r
    while begun + FEWEST <= len(r):
        end = max(begun + FEWEST, int(np.searchsorted(r, STEP * r[begun])))
        found.append((np.exp(np.log(r[begun:end]).mean()), np.median(P[begun:end]), end - begun))
        begun = end
    if found:
        radius, pressure, count = np.array(found).T
        low = np.flatnonzero(pressure < LEAST * pressure.max())
        end = int(low[0]) if len(low) else len(radius)
        if end >= SHELLS:
            return radius[:end], pressure[:end], count[:end].astype(int)
    raise InputError(f"fewer than {SHELLS} shells of {FEWEST} particles below the impact hold the shock")


def fit(r: np.ndarray, P: np.ndarray) -> Decay:
    """The three values through shells of radii ``r`` [m] and pressures ``P`` [Pa]."""
    x, y = np.log(r), np.log(P)
    best = (np.inf, Decay(np.nan, np.nan, np.nan))
    for core in np.linspace(x[0], x[-3], 200):
        beyond = np.maximum(x - core, 0.0)
        design = np.column_stack([np.ones(len(x)), -beyond])
        (level, n), *_ = np.linalg.lstsq(design, y, rcond=None)
        miss = float(((design @ (level, n) - y) ** 2).sum())
        if miss < best[0]:
            best = miss, Decay(float(np.exp(level)), float(np.exp(core)), float(n))
    return best[1]
