"""Newtonian gravity between a few point masses."""

from __future__ import annotations

from matter.compilation.jit import law


@law
def newton(x, gm, acceleration):
    """Accelerations a_i = sum_j G m_j (x_j - x_i) / |x_j - x_i|^3, shape (n, 3), into ``acceleration``."""
    n = x.shape[0]
    for i in range(n):
        acceleration[i, 0] = 0.0
        acceleration[i, 1] = 0.0
        acceleration[i, 2] = 0.0
    for i in range(n):
        for j in range(i + 1, n):
            dx = x[j, 0] - x[i, 0]
            dy = x[j, 1] - x[i, 1]
            dz = x[j, 2] - x[i, 2]
            d2 = dx * dx + dy * dy + dz * dz
            w = 1.0 / (d2 * d2**0.5)
            wj = gm[j] * w
            acceleration[i, 0] += wj * dx
            acceleration[i, 1] += wj * dy
            acceleration[i, 2] += wj * dz
            wi = gm[i] * w
            acceleration[j, 0] -= wi * dx
            acceleration[j, 1] -= wi * dy
            acceleration[j, 2] -= wi * dz
