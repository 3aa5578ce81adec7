"""Which smoothing kernel the sums take, chosen by ``kind``; a kernel's file defines ``kernel`` and
``gradient_factor``.

In a loop that is compiled for a ``sph.pairs.scheme.Scheme`` the choice is a constant and costs nothing.
"""

from matter.compilation.law_family import Family
from sph.kernels import cubic_spline, wendland

FAMILY = Family("kernel", "kernel of the SPH sums", (cubic_spline, wendland))

kernel = FAMILY.choose("kernel", "r, h", rows=False, about="W [1/m^3] at distance r [m] for the support radius h [m].")
gradient_factor = FAMILY.choose(
    "gradient_factor",
    "r, h",
    rows=False,
    about="(1/r) dW/dr [1/m^5]: the gradient is this times the separation vector. Finite at r = 0, zero beyond the "
    "support.",
)
