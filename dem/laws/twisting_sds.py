"""Twisting resistance: spring, dashpot and slider about the contact normal.

    M_t = k_q phi + C_q w_t,    |M_t| <= mu_t mu_s beta R |F_n|
    k_q = 2 k_t (beta R)^2,  C_q = 2 C_t (beta R)^2,  w_t = (w2 - w1) . n

phi twisting spring [rad]; M_t acts on grain 1 along the normal n (from 1 to 2). Symbols as in ``rolling_sds``.
At the limit the spring is only ever shortened to what carries it.

Source: Zhang et al. 2017, Icarus 294, 98; Jiang et al. 2015, Comput. Geotech. 65, 147. LIGGGHTS has no independent
twisting spring; LAMMPS: ``twisting sds`` with k_twist = 2 k_t (beta R)^2 and mu_twist = mu_t mu_s beta R.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pydantic import Field

from matter.compilation.jit import law

SOURCES = ("Zhang2017", "Jiang2015")


class Parameters(NamedTuple):
    """``twisting``: mu_t."""

    twisting: Annotated[float, Field(ge=0.0, le=5.0, description="Twisting friction, mu_t.")] = 1.3


@law
def moment(angle, rate, stiffness, damping, limit):
    """Moment [N m] and spring [rad] after the test of the slider; returns (M, phi)."""
    m = stiffness * angle + damping * rate
    return max(-limit, min(limit, m)), max(-limit / stiffness, min(limit / stiffness, angle))
