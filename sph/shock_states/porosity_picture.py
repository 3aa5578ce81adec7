"""``python -m sph.porosity p_alpha pumice``: how the pores of a material close, slowly and by shocks, as a picture and
a table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.porosity import dispatch
from sph.shock_states import compaction_wave, law_figure

SPEEDS = (50, 100, 200, 300, 400, 500, 750, 1000, 1500, 2000, 3000, 5000)


def draw_crush_curve(law: str, name: str, axes: Any) -> str:
    """Left: distention against pressure, cold and slow. Right: pressure and distention behind a piston."""
    rows = collect((name,), {name: Choice.model_validate({"porosity": law})}).rows
    grid = np.geomspace(1e3, 3e9, 400)
    row = (rows.porosity[0], rows.pores[0], rows.crush[0], rows.crush_row[0], rows.eos[0], rows.eos_row[0])
    rests = [dispatch.at_pressure(*row, P)[1] for P in grid]
    axes[0].semilogx(grid, rests)
    axes[0].set(xlabel="pressure [Pa]", ylabel="distention")
    waves = [compaction_wave.driven(rows, 0, float(speed)) for speed in SPEEDS]
    axes[1].loglog(SPEEDS, [w.front.P / 1e9 for w in waves], ".-")
    axes[1].set(xlabel="piston speed [m/s]", ylabel="pressure behind the front [GPa]")
    lines = [f"{'up m/s':>8} {'us m/s':>10} {'rho kg/m3':>10} {'P GPa':>10} {'alpha':>8} {'precursor m/s':>14}"]
    for w in waves:
        first = f"{w.precursor.shock_speed:14.1f}" if w.precursor else f"{'-':>14}"
        lines.append(
            f"{w.front.v:8.0f} {w.front.shock_speed:10.1f} {w.front.rho:10.1f} {w.front.P / 1e9:10.4g} "
            f"{w.distention:8.4f} {first}"
        )
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    return law_figure.command(
        "porosity",
        "Crush curve and compaction waves of a material.",
        dispatch.FAMILY.names[1:],
        draw_crush_curve,
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())
