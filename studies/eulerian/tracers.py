"""Massless markers that move with the matter and keep the largest pressure that it felt."""

from __future__ import annotations

from matter.compilation.jit import kernel
from studies.eulerian.godunov import RHO, VR, VZ, P


@kernel
def carry(position, peak, state, bottom, h, dt):
    """Moves the markers at ``position`` (n, 2: r, z) [m] by ``dt`` [s] and raises their ``peak`` (n,) [Pa].

    Pressure and velocity are linear between the middles of cells, the velocity weighted by density so that empty cells
    have no say. ``bottom``: z of the lowest face [m]; ``h``: size of a cell [m]. Markers outside stay as they are.
    """
    nr, nz = state.shape[0], state.shape[1]
    for marker in range(len(peak)):
        x, y = position[marker, 0] / h - 0.5, (position[marker, 1] - bottom) / h - 0.5
        if x >= nr - 1 or y < 0.0 or y >= nz - 1:
            continue
        x = max(x, 0.0)
        i, k = int(x), int(y)
        mass, across, along, pressure = 0.0, 0.0, 0.0, 0.0
        for a in range(2):
            for b in range(2):
                weight = (x - i if a else 1.0 - x + i) * (y - k if b else 1.0 - y + k)
                cell = state[i + a, k + b]
                mass += weight * cell[RHO]
                across += weight * cell[RHO] * cell[VR]
                along += weight * cell[RHO] * cell[VZ]
                pressure += weight * cell[P]
        peak[marker] = max(peak[marker], pressure)
        if mass > 0.0:
            position[marker, 0] = max(position[marker, 0] + dt * across / mass, 0.0)
            position[marker, 1] += dt * along / mass
