"""Friction that rock loses while its blocks shake: the block model of acoustic fluidisation (Wuennemann & Ivanov 2003,
Planet. Space Sci. 51, 831; after Melosh & Ivanov 1999, Annu. Rev. Earth Planet. Sci. 27, 385).

    v_vib <- max(v_vib, min(c_vib |v|, v_max))       while a shock closes in on the matter (div v < 0) and t <= t_off
    dv_vib/dt = -v_vib / T_dec,    T_dec = gamma_beta a / 5 km/s
    p_vib = min(P, rho c v_vib)
    sqrt(J2) <= min(Y(P), Y(P - D^2 p_vib) + rho eta g),    eta = gamma_eta a 5 km/s,    g = sqrt(2 E':E')

v_vib [m/s] the speed of the vibration, a [m] the radius of the projectile, |v| the speed of the matter in the frame in
which the target rests, c [m/s] its speed of sound at rest, D its damage (only broken rock has blocks), Y the yield law
of the material, eta [m^2/s] a kinematic viscosity, g [1/s] the shear rate (E' deviator of the rate of strain of the
evaluation before): a Bingham fluid while p_vib lasts, the rock as it was afterwards and never stronger than that. The
energy of the vibration is taken from nowhere: the model has no balance for it.

The papers were not at hand. What is above follows from what could be read: an input file of iSALE with the viscosity
and decay time that it makes of gamma_eta and gamma_beta (288,000 m^2/s of 0.008 and 165.6 s of 115 for a = 7.2 km,
hence the 5 km/s), and SALEc, an open code after iSALE, for the order of the steps, for t_off as the end of the
shaking's growth (not of the shaking), D^2 and the limit of p_vib by P. SALEc stops p_vib below v_vib = 1 m/s and above
P = 25 GPa and measures the rate of shear by sqrt(E':E' / 2), half of g: none of these is taken here.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.quantity import PositiveSpeed, PositiveTime
from matter.compilation.jit import law

SOURCES = ("WuennemannIvanov2003", "MeloshIvanov1999")
SCALE = 5000.0
"""The speed [m/s] in T_dec and eta: of every material, so that published gammas mean the same here."""
SQRT3 = 1.7320508075688772


class Parameters(NamedTuple):
    """gamma_eta and gamma_beta of viscosity and decay; c_vib, v_max (largest v_vib) and t_off (end of its growth) with
    the values of iSALE's input files."""

    gamma_eta: Annotated[float, Field(ge=0)]
    gamma_beta: Annotated[float, Field(gt=0)]
    c_vib: Annotated[float, Field(gt=0, le=1)] = 0.1
    v_max: PositiveSpeed = 200.0
    t_off: PositiveTime = 16.0


class Row(NamedTuple):
    """What the compiled loops read; ``c_vib`` 0 where a material has no such law. ``decay_time`` [s] and ``viscosity``
    [m^2/s] are those of a projectile of 1 m until ``sized``; ``sound`` c [m/s]."""

    c_vib: float
    v_max: float
    t_off: float
    decay_time: float
    viscosity: float
    sound: float


C_VIB, V_MAX, T_OFF, DECAY_TIME, VISCOSITY, SOUND = range(6)
"""Columns of a row."""
WIDTH = 6
XX, XY, XZ, YY, YZ, ZZ = range(6)
"""Columns of a rate of strain."""


def row(p: Parameters, sound: float) -> Row:
    """The row of a material whose speed of sound at rest is ``sound`` [m/s]."""
    return Row(p.c_vib, p.v_max, p.t_off, p.gamma_beta / SCALE, p.gamma_eta * SCALE, sound)


@law
def next_speed(v_vib, dt, time, speed, closing, c_vib, v_max, t_off, decay_time):
    """v_vib [m/s] at the ``time`` [s], after a step of ``dt`` [s], of matter that moves at ``speed`` [m/s] and is
    ``closing`` in on itself or not."""
    v_vib *= math.exp(-dt / decay_time)
    if closing and time <= t_off:
        v_vib = max(v_vib, min(c_vib * speed, v_max))
    return v_vib


@law
def pressure(v_vib, P, rho, sound):
    """p_vib [Pa] under a pressure P [Pa]; 0 in tension."""
    return max(min(P, rho * sound * v_vib), 0.0)


@law
def viscous(rate, rho, viscosity):
    """What flow adds to the limit of sqrt(3 J2) [Pa], sqrt(3) rho eta g, at a ``rate`` (6,) of strain [1/s]: xx xy xz
    yy yz zz."""
    third = (rate[XX] + rate[YY] + rate[ZZ]) / 3.0
    xx, yy, zz = rate[XX] - third, rate[YY] - third, rate[ZZ] - third
    squares = xx * xx + yy * yy + zz * zz + 2.0 * (rate[XY] * rate[XY] + rate[XZ] * rate[XZ] + rate[YZ] * rate[YZ])
    return SQRT3 * rho * viscosity * math.sqrt(2.0 * squares)
