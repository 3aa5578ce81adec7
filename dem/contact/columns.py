"""Columns of the tables that the loops over grains, contacts and walls read and write. Columns 0 to 2 of positions,
velocities, forces are x, y, z (``PX`` ..., ``VX`` ...).

=========== ======================= ===================================================================================
table       shape                   columns
=========== ======================= ===================================================================================
``X``       (n, 4)                  position [m], ``RADIUS`` [m]
``V``       (n, 8)                  velocity [m/s] and spin (``WX`` ...) [rad/s] predicted for the full step, ``MASS``
                                    [kg], ``STIFFNESS`` k_n [N/m]
``W``       (n, 6)                  velocity and spin
``A``       (n, 6)                  acceleration [m/s^2] and angular acceleration (``WX`` ...)
``F``       (n, 6)                  force [N] and torque (``TX`` ...) [N m] of the contacts between grains
``E``       (n, 6)                  external force, and external torque about the origin, orbital and spin
``hist``    (contacts, 8 to 10)     the history of a contact, below; with walls (n, walls, 8 to 10)
``table``   (species, species, c)   the numbers of a contact, below; of walls (walls, species, c)
=========== ======================= ===================================================================================
"""

from __future__ import annotations

from dem.laws import dispatch

XYZ = slice(0, 3)
"""Position, velocity, acceleration or force in each of these tables."""
PX, PY, PZ, RADIUS = range(4)
VX, VY, VZ = 0, 1, 2
WX, WY, WZ = 3, 4, 5
TX, TY, TZ = 3, 4, 5
MASS, STIFFNESS = 6, 7

SLIP, ROLL, TWIST, TOUCHING = 0, 3, 6, 7
"""History: first column of the tangential spring [m] and of the rolling spring [rad], three each; twisting spring
[rad]; 0 apart, else 1 + what the last step has already given to this one (``dem.contact.edge_of_contact``)."""
HISTORY = 8
"""Columns of the history that every scheme has; the next are there by the scheme
(``dem.contact.contact_scheme.Scheme.history``)."""
REFERENCE_STIFFNESS = 8
"""History with springs of changing stiffness: the normal tangent stiffness to which they refer [N/m]."""
OFFSET, USUAL = 8, 9
"""History with offsets: what is added to the overlap [m], and the force that the normal spring carries for long [N]
(``dem.stiffness.change``)."""

DAMPING_N, DAMPING_T, FRICTION, SHAPE, ROLLING, TWISTING, RATIO = range(7)
"""Numbers of a contact: C_n and C_t over sqrt(k_n m), mu_s, beta, mu_r, mu_t, k_t / k_n; then the rows of the two laws
below."""
NORMAL = slice(RATIO + 1, RATIO + 1 + dispatch.NORMAL.width)
COHESION = slice(NORMAL.stop, NORMAL.stop + dispatch.COHESION.width)
"""Of them: what the normal law and cohesion read (``dem.laws.dispatch``)."""
PAIR_COLUMNS = COHESION.stop

DISSIPATED, EXCESS, DRAGGED, AT_WALLS = range(4)
"""Sums over the run (10,) [J]: dissipated in contacts, excess taken from returned grains, dissipated by drag and at
walls; then the two below."""
ALL_DISSIPATED, IMPULSE, ANGULAR_IMPULSE = slice(0, 4), slice(4, 7), slice(7, 10)
"""Of these sums: all that is dissipated; external impulse [kg m/s] and angular impulse [kg m^2/s]."""
SUMS = 10

GRAINS_REMOVED, MASS_REMOVED, MOMENTUM_REMOVED, ANGULAR_REMOVED, ENERGY_REMOVED = 0, 1, slice(2, 5), slice(5, 8), 8
"""Books of the grains that left, by reason (reasons, 9): number, mass, momentum, angular momentum, energy."""
BOOKS = 9
