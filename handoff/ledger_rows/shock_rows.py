"""Rows of the ledger on what the shock has left in the source, and on the time of the handoff."""

from __future__ import annotations

import numpy as np

from handoff.domains import domain
from handoff.ledger import LIMITS, Ledger
from handoff.source import shock
from handoff.source.handoff_time import Choice
from handoff.source.hydrostatic import Column
from handoff.transfer.handed import Handoff
from matter.particles import Particles
from matter.wording import readable


def enter(ledger: Ledger, handoff: Handoff, source: Particles, region: domain.Domain, column: Column) -> None:
    """What the shock has left in the compact matter: its pressure, and the energy that is stored in it."""
    left = shock.residual(source, region, column)
    if left is None:
        for name in ("residual_pressure_over_bulk_modulus", "elastic_over_kinetic_energy"):
            ledger.skip(name, "not_measured", "the source carries no field 'pressure'")
        return
    here = handoff.compact.indices[handoff.compact.fraction > 0.5]
    pressure = left.pressure[here]
    fronts = shock.over_support(source.position[here], pressure)
    weight = shock.by_weight(
        source.select(handoff.compact.indices), handoff.compact.fraction, handoff.carving.size.radius, column
    )
    ledger.measure(
        "residual_pressure_over_bulk_modulus",
        float(np.max(fronts)),
        f"mean over a kernel's support; single particles: largest {np.max(pressure):.3g}, 99 % below "
        f"{np.percentile(pressure, 99):.3g}, median {np.median(pressure):.3g}; weight, rho g R, alone does "
        f"{weight.pressure:.3g}",
        bound=max(LIMITS["residual_pressure_over_bulk_modulus"].limit, weight.pressure),
    )
    elastic = float(np.sum(left.elastic[handoff.compact.indices] * handoff.compact.fraction))
    moving = handoff.moving[0]
    note = (
        f"{elastic:.4e} J over {moving:.4e} J, both of the compact matter inside the domain; weight alone stores "
        f"{weight.energy:.4e} J"
    )
    moves = moving > 1e-12 * handoff.sums.before.kinetic
    ledger.measure(
        "elastic_over_kinetic_energy",
        elastic / moving if moves else 0.0,
        note,
        bound=max(LIMITS["elastic_over_kinetic_energy"].limit, weight.energy / moving if moves else 0.0),
    )


def time_row(ledger: Ledger, handoff: Handoff, time: float, choice: Choice | None, column: Column) -> None:
    """The row on the time of the handoff over the crater's own; T from the largest cavity of the series, or from this
    cavity.

    Where the rule chose the time because its window is empty, no moment meets this limit: the row is waived with that
    reason, and what the time decides is shown by the rows of the sensitivity.
    """
    volume = max(
        [handoff.carving.size.volume] + ([row.volume for row in choice.series[: choice.deepest + 1]] if choice else [])
    )
    if volume <= 0.0:
        ledger.skip("t_handoff_over_T_crater_max", "not_applicable", "there is no cavity")
        return
    crater = 0.8 * float(np.sqrt(np.cbrt(volume) / column.surface_gravity))
    note = f"handed over at {readable.clock(time)}, T = {readable.clock(crater)}" + (
        f"; {choice.reason}" if choice else "; time given"
    )
    if choice is not None and choice.window_is_empty:
        waive = {
            "t_handoff_over_T_crater_max": "the shock is still there at 0.1 T, so that no time has both behind it",
            **ledger.waive,
        }
        ledger = Ledger(waive, ledger.rows)
    ledger.measure("t_handoff_over_T_crater_max", time / crater, note)
