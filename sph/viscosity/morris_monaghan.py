"""Viscosity that comes with compression and fades behind it (Morris & Monaghan 1997, J. Comput. Phys. 136, 41; source
bounded as by Rosswog et al. 2000).

    df/dt = (1 - f) max(-div v, 0) - (f - f_least) / tau,   tau = hbar / (0.2 c),   hbar = h / 2;
    a pair takes (f_i + f_j) / 2 of Pi

f is the fraction of alpha and beta alike (the source has beta = 2 alpha throughout). f_least = 0.05 is its alpha = 0.1
where ours is 2. f begins there: what has not been compressed flows with a twentieth of the viscosity.

One step is taken implicitly, f <- (f + dt (S + f_least / tau)) / (1 + dt (S + 1 / tau)): f stays between f_least and 1
for any step.
"""

from matter.compilation.jit import law

SOURCES = ("MorrisMonaghan1997", "Rosswog2000")

START = LEAST = 0.05


@law
def next_fraction(before, dt, divergence, c, h):
    """f after the step ``dt`` [s], from that ``before``, div v [1/s], the speed of sound c [m/s] and the support
    radius h [m]."""
    source = max(-divergence, 0.0)
    fading = 0.4 * c / h
    return (before + dt * (source + fading * LEAST)) / (1.0 + dt * (source + fading))
