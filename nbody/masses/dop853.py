"""Coefficients of the Runge-Kutta method of Dormand and Prince of order 8(5,3).

Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I (2nd ed. 1993), section II.10; the numbers are
scipy's. Most entries of the matrix are zero: ``COLUMNS[s, :COUNT[s]]`` lists the non-zero ones of stage s.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import DOP853

SOURCES = ("Hairer1993",)

STAGES = 12
A = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES])
B = np.ascontiguousarray(DOP853.B)
C = np.ascontiguousarray(DOP853.C[:STAGES])
E3 = np.ascontiguousarray(DOP853.E3)
E5 = np.ascontiguousarray(DOP853.E5)

COUNT = (A != 0.0).sum(axis=1)
COLUMNS = np.zeros((STAGES, STAGES), dtype=np.int64)
for _stage in range(STAGES):
    COLUMNS[_stage, : COUNT[_stage]] = np.flatnonzero(A[_stage])
