"""Which law damage grows by: four published ones and the default, on the same flaws (``sph.damage.grady_kipp``).

=============  ==============================================  ========================
``cube_root``  n_act^(1/3) c_g / R_s, capped by n_act / n      the default
``single``     c_g / R_s                                       Benz & Jutzi 2007
``linear``     n_act c_g(D) / h, capped by n_act / n           miluphcuda
``weibull``    [fitted n(eps)]^(1/3) c_g / h                   OpenSPH
``fraction``   (n_act / n) c_g / R_s, capped by n_act / n      Spheral
=============  ==============================================  ========================

They differ by up to the number of flaws of a particle (some tens) in how fast rock breaks; published comparisons with Nakamura & Fujiwara's fragments
used one each.
"""

from matter.jit import law
from sph.damage import growth_cube_root, growth_fraction, growth_linear, growth_single, growth_weibull

LAWS = ("cube_root", "single", "linear", "weibull", "fraction")
CUBE_ROOT, SINGLE, LINEAR, WEIBULL, FRACTION = range(5)


@law
def counted(kind, active, total, strain, least, most):
    """How many flaws count as active, and of how many, as floats: ``active`` of ``total`` are open at the strain ``strain``; the weakest opens at ``least``,
    the strongest at ``most``."""
    if kind == WEIBULL:
        return growth_weibull.active(strain, least, most, float(total)), float(total)
    return float(active), float(total)


@law
def cap(kind, active, total):
    """The largest D^(1/3) that the active flaws can bring."""
    if kind == CUBE_ROOT:
        return growth_cube_root.cap(active, total)
    if kind == SINGLE:
        return growth_single.cap(active, total)
    if kind == LINEAR:
        return growth_linear.cap(active, total)
    if kind == WEIBULL:
        return growth_weibull.cap(active, total)
    return growth_fraction.cap(active, total)


@law
def rate(kind, active, total, crack_speed, radius, support):
    """d(D^(1/3))/dt [1/s] with c_g [m/s] (for ``linear`` that of the damaged material), R_s and h [m]."""
    if kind == CUBE_ROOT:
        return growth_cube_root.rate(active, total, crack_speed, radius)
    if kind == SINGLE:
        return growth_single.rate(active, total, crack_speed, radius)
    if kind == LINEAR:
        return growth_linear.rate(active, total, crack_speed, support)
    if kind == WEIBULL:
        return growth_weibull.rate(active, total, crack_speed, support)
    return growth_fraction.rate(active, total, crack_speed, radius)
