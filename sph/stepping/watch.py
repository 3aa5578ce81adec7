"""Run-time sanity checks that abort a diverging run early.

energy   the total has grown by more than ``GAIN`` of the projectile's kinetic energy: no step of this scheme makes
         energy; particles have run through each other, or the step is too long. (With an edge that does work,
         ``PUSHED``. A loss is no sign of it: quiet layers take energy away.) Not after the switch to a late stage, in
         whose medium internal energy does not count.
step     ``IN_A_ROW`` steps one after another were below ``COLLAPSE`` of the largest: the run would not end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from matter.errors import UnphysicalState
from matter.wording import readable

GAIN, PUSHED, COLLAPSE, IN_A_ROW = 0.1, 1.0, 1e-5, 1000


class Watch:
    """Looks at the energy with every row of the history, and at every step. ``projectile_energy`` [J]; ``pushed``: an
    edge can do work."""

    def __init__(self, projectile_energy: float, pushed: bool) -> None:
        self.scale, self.most_gain = projectile_energy, PUSHED if pushed else GAIN
        self.longest, self.short = 0.0, 0

    def energy(self, rows: Sequence[Mapping[str, float | str]], late: bool) -> None:
        """Judge the newest of the ``rows`` (names of ``sph.stepping.history.COLUMNS``); ``late``: the late stage has
        begun.

        Raises ``UnphysicalState`` that says what, since when, and what helps.
        """
        if len(rows) < 2 or self.scale <= 0.0:
            return
        (now, gain), (then, before) = ((row["time_s"], self._gain(row, rows[0])) for row in (rows[-1], rows[-2]))
        if math.isfinite(gain) and (late or gain <= self.most_gain):
            return
        raise UnphysicalState(
            f"sph: unstable: at {readable.clock(float(now))} the total energy is {gain:.3g} times the projectile's "
            f"above that of the start (at {readable.clock(float(then))} {before:.3g}; limit {self.most_gain:g}). A "
            "smaller courant or a larger beta helps; the snapshots until then are kept"
        )

    def _gain(self, row: Mapping[str, float | str], first: Mapping[str, float | str]) -> float:
        return (float(row["total_J"]) - float(first["total_J"])) / self.scale

    def step(self, dt: float, time: float, why: str) -> None:
        """Count a step of ``dt`` [s], which ``why`` limits. Raises ``UnphysicalState`` when it has collapsed."""
        self.longest = max(self.longest, dt)
        self.short = self.short + 1 if dt < COLLAPSE * self.longest else 0
        if self.short >= IN_A_ROW:
            raise UnphysicalState(
                f"sph: the step has fallen to {dt:.3g} s at {readable.clock(time)}, {dt / self.longest:.1g} of the "
                f"longest (limited by {why}), and stays there: the run would not end; snapshots until then are kept"
            )
