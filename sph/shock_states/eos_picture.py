"""``python -m sph.eos tillotson basalt``: the Hugoniot of a material, and its cold curve, as a picture and a table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from sph.eos import dispatch
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.shock_states import hugoniot, law_figure

SPEEDS = (10, 50, 100, 200, 300, 500, 750, 1000, 1500, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 10000)


def draw_hugoniot(law: str, name: str, axes: Any) -> str:
    """Left: shock speed against particle speed. Right: pressure against density on the Hugoniot and cold."""
    rows = collect((name,), {name: Choice.model_validate({"eos": law, "porosity": "none"})}).rows
    pressure, rest = hugoniot.solid(rows, 0)
    if dispatch.modulus(rows.eos[0], rows.eos_row[0]) == 0.0:  # a gas has no cold state
        rest = rest._replace(u=1e5, P=pressure(rest.rho, 1e5))
    states = []
    for speed in SPEEDS:
        try:
            first, *_, last = 2 * hugoniot.waves(pressure, rest, float(speed))
            states.append(last._replace(shock_speed=first.shock_speed))
        except (
            ValueError
        ):  # Murnaghan: energy does not enter, and beyond some speed no state obeys the jump conditions
            break
    up, us, rho, P = (np.array([getattr(s, key) for s in states]) for key in ("v", "shock_speed", "rho", "P"))
    axes[0].plot(up / 1e3, us / 1e3, ".-")
    axes[0].set(xlabel="particle speed [km/s]", ylabel="shock speed [km/s]")
    grid = np.linspace(0.6, max(1.2, rho.max() / rest.rho), 400) * rest.rho
    axes[1].plot(rho, P / 1e9, ".-", label="Hugoniot")
    axes[1].plot(
        grid,
        [dispatch.pressure_and_derivatives(rows.eos[0], rows.eos_row[0], r, 0.0)[0] / 1e9 for r in grid],
        label="cold (u = 0)",
    )
    axes[1].axhline(-rows.tension[0] / 1e9, color="grey", lw=0.8, ls=":", label="tension cut")
    axes[1].set(
        xlabel="density [kg/m$^3$]",
        ylabel="pressure [GPa]",
        ylim=(min(-0.05 * P.max() / 1e9, -rows.tension[0] / 1e9), None),
    )
    axes[1].legend()
    lines = [f"{'up m/s':>8} {'us m/s':>10} {'rho kg/m3':>10} {'P GPa':>10} {'u MJ/kg':>10}"]
    lines += [f"{s.v:8.0f} {s.shock_speed:10.1f} {s.rho:10.1f} {s.P / 1e9:10.4g} {s.u / 1e6:10.4g}" for s in states]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    return law_figure.command(
        "eos", "Hugoniot and cold curve of a material.", dispatch.FAMILY.names, draw_hugoniot, arguments
    )


if __name__ == "__main__":
    sys.exit(main())
