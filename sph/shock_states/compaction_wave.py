"""The waves that a piston drives into porous material: one shock, or an elastic precursor and a compaction front
behind it.

Jump conditions as in ``sph.shock_states.hugoniot``, with the porous pressure P(rho, u) of a material that is loaded
from its rest. The precursor brings the material to its elastic limit P = Pe; where a single shock would be slower than
it, the two run apart (Jutzi, Benz & Michel 2008, section 5.1).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sph.materials.rows import Rows
from sph.porosity import crush, dispatch
from sph.shock_states.hugoniot import State, behind


class Waves(NamedTuple):
    """The state behind the precursor (None: a single shock), the state behind the front, and its distention."""

    precursor: State | None
    front: State
    distention: float

    @property
    def fastest(self) -> float:
        """Speed of the first wave [m/s]."""
        return self.front.shock_speed if self.precursor is None else self.precursor.shock_speed


def loading(rows: Rows, m: int) -> tuple[Callable[[float, float], float], Callable[[float, float], float], State]:
    """P(rho, u) and distention(rho, u) of material ``m`` loaded from rest, and its state at rest."""
    from sph.eos import dispatch as eos

    def distention(rho: float, u: float) -> float:
        law = (rows.porosity[m], rows.pores[m], rows.crush[m], rows.crush_row[m], rows.eos[m], rows.eos_row[m])
        return dispatch.compact(*law, rho, u, rows.alpha0[m], True)[0]

    def pressure(rho: float, u: float) -> float:
        a = distention(rho, u)
        return eos.pressure_and_derivatives(rows.eos[m], rows.eos_row[m], a * rho, u)[0] / a

    return pressure, distention, State(float(rows.rho0[m] / rows.alpha0[m]), 0.0, 0.0, 0.0)


def elastic_limit(rows: Rows, m: int) -> State:
    """The state behind a precursor of material ``m`` (of a law with a crush curve): P = Pe, reached by a shock from
    rest."""
    pressure, _, rest = loading(rows, m)
    P = crush.onset(rows.crush[m], rows.crush_row[m])
    low, high = rest.rho, 1.5 * rest.rho
    for _ in range(100):
        rho = 0.5 * (low + high)
        if pressure(rho, 0.5 * P * (1.0 / rest.rho - 1.0 / rho)) < P:
            low = rho
        else:
            high = rho
    volume_drop = 1.0 / rest.rho - 1.0 / rho
    v = float(np.sqrt(P * volume_drop))
    return State(rho, 0.5 * P * volume_drop, P, v, P / (rest.rho * v))


def driven(rows: Rows, m: int, velocity: float) -> Waves:
    """What a piston of ``velocity`` [m/s] drives into material ``m`` at rest."""
    pressure, distention, rest = loading(rows, m)
    if dispatch.FAMILY.having("CRUSHES")[rows.porosity[m]] and rows.alpha0[m] > 1.0:
        limit = elastic_limit(rows, m)
        if velocity > limit.v:
            single = behind(pressure, rest, velocity)
            if single.shock_speed < limit.shock_speed:
                front = behind(pressure, limit, velocity)
                return Waves(limit, front, distention(front.rho, front.u))
    front = behind(pressure, rest, velocity)
    return Waves(None, front, distention(front.rho, front.u))
