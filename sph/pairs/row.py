"""Columns of the rows that loops over pairs read: one row a particle, and behind them those of its images.

``row`` (n, 16) is filled by ``sph.stepping.state`` and turned by ``sph.pairs.start_volumes``; ``extra`` (n, 16, or 8
without the tensor) holds what some schemes add to it.
"""

X, Y, Z, SUPPORT, VOLUME = range(5)
"""Position [m], support radius h [m], m / rho [m^3]; what sums of the kernel alone read lies in the first cache
line."""
VX, VY, VZ = range(5, 8)
RHO_INVERSE, SOUND = 8, 9
"""1 / rho [m^3/kg], speed [m/s] of a compression wave: of sound, while pores close of the compaction wave."""
XX, XY, XZ, YY, YZ, ZZ = range(10, 16)
"""Effective total stress sigma [Pa]."""
WIDTH = 16

SLOPE = 0
"""Extra row: first of the six columns of E [1/s], xx xy xz yy yz zz (``sph.viscosity.reconstructed``)."""
VISCOSITY_FRACTION = 6
"""Extra row: fraction of the artificial viscosity (``sph.viscosity.switch``)."""
BODY = 6
"""Extra row, in the column of ``VISCOSITY_FRACTION``: whose the particle is and how full its neighbourhood
(``sph.pairs.body_contact``)."""
ENERGY = 7
"""Extra row: specific energy u [J/kg] (``sph.pairs.conductivity``)."""
TENSOR = 7
"""Extra row: first of the nine columns of sigma B [Pa], by rows (``sph.pairs.gradients``)."""
NARROW = 8
"""Width of extra rows without that tensor, and of a row's first cache line."""
