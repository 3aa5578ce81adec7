"""Artificial viscosity of reconstructed velocity jumps: what smooth flow explains of a pair's approach is taken off
before ``sph.viscosity`` sees it.

With x = x_i - x_j, v = v_i - v_j, h the mean support, hbar = h / 2, c the mean sound speed, and E the symmetric
velocity gradient of the evaluation before,

    e_i = x.E_i.x,   e_j = x.E_j.x
    phi = [max(0, 4 e_i e_j) / (e_i + e_j)^2]^4           limiter: 1 where both sides agree, 0 where their signs differ
    M   = 1 / (1 + (mu / (m0 c))^2),  mu = hbar min(v.x, 0) / (x^2 + 0.01 hbar^2),  m0 = 0.3
        pairs that meet near the speed of sound keep their jump
    D   = 1 for r/h >= q_c,  else [max(0, 1 - ((q_c - r/h) / 0.2)^2)]^4
        what has come closer than a mean spacing, q_c = spacing / support, keeps it too
    s   = max(v.x, v.x - phi D M (e_i + e_j) / 2)             replaces v.x in mu; the heat keeps the true v.x

Van Leer's limiter of linear reconstruction (Frontiere, Raskin & Owen 2017, J. Comput. Phys. 332, 160; Rosswog 2020,
Mon. Not. R. Astron. Soc. 498, 4230) to the fourth power: in condensed matter, where a shock is weak against c, the
first power takes the front's own viscosity away. s is symmetric in the pair and never below v.x, so that momentum and
total energy are exact and every pair heats. Rigid rotation has E = 0. A first step, without E, is Monaghan's.
"""

from matter.compilation.jit import fast_max, law

SOURCES = ("Frontiere2017", "Rosswog2020")
MACH = 0.3
WIDTH = 0.2
TINY = 1e-200
SMOOTH = 0.1
"""What is left of the viscosity in the smooth flow of a crater: 0.05 to 0.12 by its heat, in lattices jittered by 0 to
0.25 spacings."""


@law
def jump(vx, e_i, e_j, r, r2, h, c, near):
    """s [m^2/s] from v.x, e_i and e_j [m^2/s], r = |x| [m], r^2, the mean support h [m], the mean sound speed c [m/s]
    and ``near`` = q_c."""
    total = e_i + e_j
    agreement = fast_max(4.0 * e_i * e_j, 0.0) / (total * total + TINY)
    agreement *= agreement
    half = 0.5 * h
    mu = min(vx, 0.0) * half / (r2 + 0.01 * half * half)
    slow = MACH * MACH * c * c
    close = fast_max(near - r / h, 0.0) / WIDTH
    room = fast_max(1.0 - close * close, 0.0)
    room *= room
    fraction = agreement * agreement * room * room * slow / (slow + mu * mu + TINY)
    return fast_max(vx, vx - 0.5 * fraction * total)
