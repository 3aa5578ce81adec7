"""A law with a known answer for tests of the inversion: the crater of Hayabusa2's shot by its sensitivities.

    D = 13.46 m e^(-0.0117 (phi / deg - 30)) (rho / (1,227 kg/m^3))^-0.394 f(Y),    f = (1 + (Y / Y*)^1.205)^-0.170

f is Holsapple's interpolation between gravity and strength as the project's law has it (``crater_size``,
``expected_crater``), with Y* = 0.60 Pa for this shot; the rest was measured on the chain (sci_ryugu). Priors of
Ryugu's friction angle, cohesion and density.
"""

import numpy as np

from pipeline.case.prior_table import Prior
from pipeline.inverse.posterior import Observed

PRIORS = {
    "friction_angle": Prior(distribution="normal", mean="30 deg", sd="5 deg"),
    "cohesion": Prior(distribution="log_uniform", low="1 mPa", high="100 Pa"),
    "density": Prior(distribution="normal", mean="1190 kg/m^3", sd="100 kg/m^3"),
}
MU, Y_STAR = 0.41, 0.60


def log_diameter(theta):
    """ln of D [m] (n,) at friction angle [rad], cohesion [Pa] and density [kg/m^3] (n, 3)."""
    angle, cohesion, density = np.degrees(theta[:, 0]), theta[:, 1], theta[:, 2]
    held = 1.0 + (cohesion / Y_STAR) ** (0.5 * (2.0 + MU))
    strength = -MU / (2.0 + MU) * np.log(held)
    return np.log(13.46) - 0.0117 * (angle - 30.0) - 0.394 * np.log(density / 1227.0) + strength


def exactly(theta):
    """The law as a model without an emulator."""
    return log_diameter(theta)[:, None], np.zeros((len(theta), 1))


def observed(value=14.5, sigma=0.8, chain=0.6 / 14.5, discrepancy=0.0):
    return [Observed("diameter_apparent_m", "m", value, sigma, sigma, chain, discrepancy)]
