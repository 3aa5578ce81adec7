"""One step of a test particle in the field of Jupiter, the Sun and the moons.

Frame: barycentre of Jupiter and its moons. With s the Sun, x_J and x_m Jupiter and moons (from the shared ephemeris),

    a = GM_sun [ (s - x)/|s - x|^3 - (1 + 3/2 q/(GM |s|^2)) s/|s|^3 ] + GM_J (x_J - x)/|x_J - x|^3 + sum_m GM_m (x_m -
    x)/|x_m - x|^3.

Far from the moons their pull and Jupiter's reflex are replaced by one central mass and the quadrupole of rings,

    J2-like: a = -GM x / r^3 - (3/2) q r^-5 [ x (1 - 5 z^2/r^2), y (1 - 5 z^2/r^2), z (3 - 5 z^2/r^2) ],  q = sum_m
    GM_m a_m^2 / 2,

which leaves a field without the moons' periods, so that steps can be long.
"""

from __future__ import annotations

from matter.compilation.jit import law
from nbody.masses.dop853 import COLUMNS, COUNT, E3, E5, STAGES, A, B, C
from nbody.masses.ephemeris import body_position
from nbody.masses.state_vector import VX, VY, VZ, distance2, speed2


@law
def field(t, x, y, z, near, orbits):
    """Acceleration (x, y, z) [m/s^2] at time ``t``; ``near``: moons one by one, else rings of quadrupole
    ``orbits.ring`` = q."""
    gm, ring = orbits.gm, orbits.ring
    sx, sy, sz = body_position(orbits.polynomial, orbits.interval, 0, t)
    dx, dy, dz = sx - x, sy - y, sz - z
    d2 = dx * dx + dy * dy + dz * dz
    s2 = sx * sx + sy * sy + sz * sz
    wd = gm[0] / (d2 * d2**0.5)
    total = gm[1]
    for m in range(2, gm.shape[0]):
        total += gm[m]
    # the Sun pulls the rings of the moons along: 90 m after a year
    ws = gm[0] / (s2 * s2**0.5) * (1.0 + 1.5 * ring / (total * s2))
    ax, ay, az = wd * dx - ws * sx, wd * dy - ws * sy, wd * dz - ws * sz
    if near:
        jx, jy, jz = 0.0, 0.0, 0.0
        for m in range(orbits.polynomial.shape[1] - 1):
            mx, my, mz = body_position(orbits.polynomial, orbits.interval, m + 1, t)
            g = gm[m + 2]
            jx -= g * mx
            jy -= g * my
            jz -= g * mz
            dx, dy, dz = mx - x, my - y, mz - z
            d2 = dx * dx + dy * dy + dz * dz
            w = g / (d2 * d2**0.5)
            ax += w * dx
            ay += w * dy
            az += w * dz
        dx, dy, dz = jx / gm[1] - x, jy / gm[1] - y, jz / gm[1] - z
        d2 = dx * dx + dy * dy + dz * dz
        w = gm[1] / (d2 * d2**0.5)
        return ax + w * dx, ay + w * dy, az + w * dz
    r2 = x * x + y * y + z * z
    w = total / (r2 * r2**0.5)
    k = 1.5 * ring / (r2 * r2 * r2**0.5)
    f = 5.0 * z * z / r2
    return ax - x * (w + k * (1.0 - f)), ay - y * (w + k * (1.0 - f)), az - z * (w + k * (3.0 - f))


@law
def swing(t, y, sign, orbits):
    """Add (``sign`` +1) or take off (-1) the moons' short-period part of the velocity in ``y`` (6,), quadrupole order.

    The part of the field that turns with a moon (2 psi = twice its longitude minus the particle's, rate 2n) shakes the
    particle by

        dv = 3/4 GM_m a^2 R/(n r^5) (sin 2psi e_R - cos 2psi e_phi) - 15/8 GM_m a^2 R^2/(n r^7) sin 2psi x.

    The averaged far field moves the mean velocity, v - dv: switching without this kick costs up to 1 km after a year.
    """
    gm = orbits.gm
    r2 = distance2(y)
    rho = (y[0] * y[0] + y[1] * y[1]) ** 0.5 + 1e-300
    cosine, sine = y[0] / rho, y[1] / rho
    r5 = r2 * r2 * r2**0.5
    for m in range(orbits.polynomial.shape[1] - 1):
        mx, my, _ = body_position(orbits.polynomial, orbits.interval, m + 1, t)
        a2 = mx * mx + my * my
        g = sign * gm[m + 2] * a2 / (gm[1] / (a2 * a2**0.5)) ** 0.5
        c, s = (mx * cosine + my * sine), (my * cosine - mx * sine)
        cos2, sin2 = (c * c - s * s) / a2, 2.0 * c * s / a2
        k = 0.75 * g * rho / r5
        q = -1.875 * g * rho * rho / (r5 * r2) * sin2
        y[VX] += k * (sin2 * cosine + cos2 * sine) + q * y[0]
        y[VY] += k * (sin2 * sine - cos2 * cosine) + q * y[1]
        y[VZ] += q * y[2]


@law
def step(t, y, h, near, orbits, kx, kv, new):
    """One DOP853 step of length ``h`` from ``y`` (6,) into ``new``; kv[0] holds the acceleration at (t, y).

    Returns the weighted error norm: positions against |x|, velocities against |v|.
    """
    kx[0, 0], kx[0, 1], kx[0, 2] = y[VX], y[VY], y[VZ]
    for s in range(1, STAGES):
        x0, x1, x2, v0, v1, v2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for entry in range(COUNT[s]):
            j = COLUMNS[s, entry]
            a = A[s, j]
            x0 += a * kx[j, 0]
            x1 += a * kx[j, 1]
            x2 += a * kx[j, 2]
            v0 += a * kv[j, 0]
            v1 += a * kv[j, 1]
            v2 += a * kv[j, 2]
        kx[s, 0], kx[s, 1], kx[s, 2] = y[VX] + h * v0, y[VY] + h * v1, y[VZ] + h * v2
        kv[s, 0], kv[s, 1], kv[s, 2] = field(t + C[s] * h, y[0] + h * x0, y[1] + h * x1, y[2] + h * x2, near, orbits)
    ex5, ex3, ev5, ev3 = 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        x, v, x5, x3, v5, v3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for s in range(STAGES):
            x += B[s] * kx[s, d]
            v += B[s] * kv[s, d]
            x5 += E5[s] * kx[s, d]
            x3 += E3[s] * kx[s, d]
            v5 += E5[s] * kv[s, d]
            v3 += E3[s] * kv[s, d]
        new[d] = y[d] + h * x
        new[d + 3] = y[d + 3] + h * v
        ex5 += x5 * x5
        ex3 += x3 * x3
        ev5 += v5 * v5
        ev3 += v3 * v3
    r2 = distance2(new)
    w2 = max(speed2(new), 1.0)  # 1 m/s: a particle may stand still
    e5 = ex5 / r2 + ev5 / w2
    e3 = ex3 / r2 + ev3 / w2
    return h * e5 / (0.5 * (e5 + 0.01 * e3) + 1e-300) ** 0.5
