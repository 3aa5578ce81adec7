"""Friction angle, cohesion and solid fraction of grains of the default contact law in steady shear, as measured.

Steady shear (``dem.trials.steady_shear``) at beta = 0.4, e_n = e_t = 0.55, mu_r = 1.05, mu_t = 1.3: angle by principal
stresses. Between the points the line stands for a search of some minutes; at 0.8 the angle has saturated. Their errors
are 0.1 to 0.7 deg (docs/results/dem_friction_angle).
"""

from __future__ import annotations

import math

import numpy as np

MEASURED = ((0.15, 23.13), (0.269, 30.0), (0.302, 31.0), (0.5, 34.46))
"""mu_s and the angle [deg]."""
LOOSE = (
    (0.269, 666.6667, 0.5717231527173133),
    (0.269, 3333.3333, 0.5658392489593477),
    (0.302, 1666.6667, 0.5616167464838975),
    (0.5, 1666.6667, 0.5285025191570071),
)
"""mu_s, stiffness k_n / (P d) and solid fraction, +- 0.002, of the shipped cases (``friction_angle.loose``, seed 1).
To measure one takes three quarters of a minute. All digits: a bed then has the same bits on every machine."""
LEAST, STEEPEST = MEASURED[0][1], MEASURED[-1][1]
COHESION_LEFT = 0.0085
"""Cohesion of the grains in shear over the pull ``cohesion`` of ``zhang`` between them: (tau - tau_0) / c at c of 1,
3, 10 and 30 times the normal stress is 0.0107, 0.0082, 0.0081 and 0.0085, each +- 0.006, 0.002, 0.0006 and 0.0002
(mu_s = 0.269, inertial number 0.02). Zhang et al. 2018, ApJ 857, 15, have some 0.01."""


def friction(angle_deg: float) -> float | None:
    """mu_s for an angle [deg]; None outside what was measured."""
    frictions, angles = np.array(MEASURED).T
    if not angles[0] <= angle_deg <= angles[-1]:
        return None
    return round(float(np.interp(angle_deg, angles, frictions)), 4)


def loose_fraction(friction: float, stiffness: float) -> float | None:
    """Solid fraction in steady shear; None where it was not measured."""
    for known, springs, fraction in LOOSE:
        if math.isclose(friction, known, rel_tol=1e-6) and math.isclose(stiffness, springs, rel_tol=1e-6):
            return fraction
    return None
