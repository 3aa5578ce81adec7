"""Which law damage grows by: four published ones and the default, on the same flaws (``sph.damage.grady_kipp``).

=============  ==============================================  ========================
``cube_root``  n_act^(1/3) c_g / R_s, capped by n_act / n      the default
``single``     c_g / R_s                                       Benz & Jutzi 2007
``linear``     n_act c_g(D) / h, capped by n_act / n           miluphcuda
``weibull``    [fitted n(eps)]^(1/3) c_g / h                   OpenSPH
``fraction``   (n_act / n) c_g / R_s, capped by n_act / n      Spheral
=============  ==============================================  ========================

They differ by up to the number of flaws of a particle (some tens) in how fast rock breaks; published comparisons with
Nakamura & Fujiwara's fragments used one each.
"""

from matter.compilation.law_family import Family
from sph.damage import growth_cube_root, growth_fraction, growth_linear, growth_single, growth_weibull

LAWS = (growth_cube_root, growth_single, growth_linear, growth_weibull, growth_fraction)
FAMILY = Family("damage", "law by which damage grows", LAWS, prefix="growth_", none=True)

counted = FAMILY.choose(
    "counted",
    "opened, total, strain, least, most",
    otherwise="float(opened), float(total)",
    rows=False,
    about="How many flaws count as active, and of how many, as floats: ``opened`` of ``total`` are open at the strain "
    "``strain``; the weakest opens at "
    "``least``, the strongest at ``most``.",
)
cap = FAMILY.choose(
    "cap", "active, total", otherwise="0.0", rows=False, about="The largest D^(1/3) that the active flaws can bring."
)
crack_speed = FAMILY.choose(
    "crack_speed",
    "at_rest, bulk, shear, rho, D",
    otherwise="at_rest",
    rows=False,
    about="c_g [m/s] of a material that has ``at_rest`` whole, from its moduli [Pa], density [kg/m^3] and damage.",
)
rate = FAMILY.choose(
    "rate",
    "active, total, crack_speed, radius, support",
    otherwise="0.0",
    rows=False,
    about="d(D^(1/3))/dt [1/s] with c_g [m/s], the radius R_s [m] of the particle's volume and its support h [m].",
)
