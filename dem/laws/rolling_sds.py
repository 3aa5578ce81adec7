"""Rolling resistance: spring, dashpot and slider.

    M_r = k_r theta + C_r w_r,    |M_r| <= mu_r beta R |F_n|
    k_r = k_n (beta R)^2,  C_r = C_n (beta R)^2
    w_r = (w2 - w1) tangential part + (r2 - r1) / (2 r1 r2)  n x u_t

theta rolling spring [rad], the integral of the rolling rate w_r [rad/s] (Bagi & Kuhn 2004 for unequal spheres); M_r
acts on grain 1. The radii r stand where the sources have the distances l1, l2 of the centres from the plane of
contact: the same at first touch, but l2 passes through zero where a small grain, entered among large ones with an
overlap that counts for none (``OFFSET``), has its centre in that plane; the rate then has no bound. R = r1 r2 / (r1 +
r2) [m]; beta is the shape parameter (0 sphere, 1 strongly angular): a contact behaves like a disc of radius beta R. At
the limit the spring is only ever shortened to what carries it (pkdgrav instead leaves it as it was before the step;
the moment is the same). On a wall R is the radius of the grain and the second term of w_r is dropped, so that pure
sliding raises no moment.

Source: Zhang et al. 2017, Icarus 294, 98 (the four-component law); moments of Jiang et al. 2015, Comput. Geotech. 65,
147. LIGGGHTS: ``rolling_friction epsd3`` with rmu = mu_r beta and rollingStiffness = 1/mu_r^2; LAMMPS: ``rolling
sds``.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pydantic import Field

from dem.laws import tangential_spring
from matter.case.identity_fields import Follows

SOURCES = ("Zhang2017", "Jiang2015", "BagiKuhn2004")


Shape = Annotated[
    float, Field(ge=0.0, le=2.0, description="Shape parameter beta: 0 is a sphere, 1 is strongly angular.")
]


class Parameters(NamedTuple):
    """``shape``: beta; ``rolling``: mu_r."""

    shape: Shape = 0.4
    rolling: Annotated[float, Field(ge=0.0, le=5.0, description="Rolling friction, mu_r."), Follows()] = 1.05


RESTS_ON = (tangential_spring,)
"""Laws whose files act in this one."""

moment = tangential_spring.force
"""M_r and the spring after the test of the slider, that of the tangential force: rolling spring [rad] with this step's
increment, rolling rate [rad/s], k_r [N m], C_r [N m s] and the limit [N m] stand for its arguments."""
