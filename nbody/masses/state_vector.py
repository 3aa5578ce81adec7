"""The state vector of a particle, y = (x, y, z, v_x, v_y, v_z) [m, m/s], and what loops ask of it again and again."""

from __future__ import annotations

from matter.compilation.jit import law

X, Y, Z, VX, VY, VZ = range(6)
POSITION, VELOCITY = slice(0, 3), slice(3, 6)


@law
def distance2(y):
    """|x|^2 [m^2]."""
    return y[X] * y[X] + y[Y] * y[Y] + y[Z] * y[Z]


@law
def speed2(y):
    """|v|^2 [m^2/s^2]."""
    return y[VX] * y[VX] + y[VY] * y[VY] + y[VZ] * y[VZ]


@law
def r_dot_v(y):
    """x.v [m^2/s]: negative on the way in."""
    return y[X] * y[VX] + y[Y] * y[VY] + y[Z] * y[VZ]
