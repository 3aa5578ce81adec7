"""``python -m sph.strength collins granite``: the yield surface of a material, intact, half broken and broken, as a
picture and a table."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.shock_states import law_figure
from sph.strength import dispatch

PRESSURES = (0.0, 1e6, 1e7, 3e7, 1e8, 3e8, 1e9, 3e9)


def draw_yield_curve(law: str, name: str, axes: Any) -> str:
    """Left: sqrt(J2) at yield against pressure, cold. Right: its softening with specific energy at 1 GPa, intact."""
    rows = collect((name,), {name: Choice.model_validate({"strength": law})}).rows

    def limit(P: float, u: float, D: float) -> float:
        return dispatch.yield_stress(rows.strength[0], rows.strength_row[0], P, u, D) / math.sqrt(3.0)

    mixes = rows.mixes_damage[0] > 0
    grid = np.linspace(-0.2e9, 3e9, 400)
    for D in (0.0, 0.5, 1.0):
        axes[0].plot(
            grid / 1e9, [(1.0 if mixes else 1.0 - D) * limit(P, 0.0, D) / 1e9 for P in grid], label=f"D = {D:g}"
        )
    axes[0].set(xlabel="pressure [GPa]", ylabel=r"$\sqrt{J_2}$ at yield [GPa]")
    axes[0].legend()
    heat = np.linspace(0.0, 5e6, 200)
    axes[1].plot(heat / 1e6, [limit(1e9, u, 0.0) / 1e9 for u in heat])
    axes[1].set(xlabel="specific energy [MJ/kg]", ylabel=r"$\sqrt{J_2}$ at yield, 1 GPa, intact [GPa]")
    lines = [f"{'P MPa':>8} {'intact MPa':>12} {'broken MPa':>12}"]
    broken = 1.0 if mixes else 0.0
    lines += [
        f"{P / 1e6:8.0f} {limit(P, 0.0, 0.0) / 1e6:12.5g} {broken * limit(P, 0.0, 1.0) / 1e6:12.5g}" for P in PRESSURES
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    return law_figure.command(
        "strength", "Yield surface of a material.", dispatch.FAMILY.names[1:], draw_yield_curve, arguments
    )


if __name__ == "__main__":
    sys.exit(main())
