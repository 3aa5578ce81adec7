"""Pictures of ejecta: mass above a speed, and where they were launched."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from crater.drawing.figure import BLUE, GREEN, OCHRE, figure, grid, save
from crater.results.findings import Findings
from matter.wording import readable


def draw_ejecta(findings: Findings, path: Path) -> None:
    """M(>v) of what flies, with the power laws for sand and water."""
    curve = findings.ejected.faster_than
    fig = figure(6.6, 4.6)
    axis = fig.add_subplot()
    speed, mass = np.array(curve["speed_m_s"]), np.array(curve["mass_kg"])
    some = mass > 0.0
    axis.loglog(
        speed[some], mass[some], "o-", color=BLUE, markersize=3, label=f"this run, {readable.clock(curve['time_s'])}"
    )
    for (name, law), colour in zip(curve["housen_holsapple_2011_kg"].items(), (OCHRE, GREEN)):
        axis.loglog(speed, law, "--", color=colour, linewidth=1.0, label=f"Housen & Holsapple 2011, {name}")
    if some.any():
        axis.set_ylim(0.3 * mass[some].min(), 5.0 * mass.max())
    axis.set(xlabel="speed v [m/s]", ylabel="mass faster than v [kg]")
    axis.legend(frameon=False, fontsize=8)
    grid(axis)
    save(fig, path)


def draw_launches(findings: Findings, path: Path) -> None:
    """Speed and angle of ejecta against where they left the ground, with the law of dry sand and the fit."""
    row = findings.ejected.launch
    fig = figure(6.6, 6.0)
    speed, angle = fig.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    x, rim = np.array(row["x_over_a"]), row["apparent_radius_m"] / findings.settings.impact.projectile.radius
    mu, factor = (readable.measured(row[name]["value"], row[name]["sigma"]) for name in ("mu", "C1"))
    words = f"this run: mu = {mu}, C1 = {factor}"
    speed.loglog(x, row["v_over_U"], "o-", color=BLUE, markersize=4, label=words)
    speed.loglog(x, row["sand_v_over_U"], "--", color=OCHRE, label="Housen & Holsapple 2011, dry sand: 0.41, 0.55")
    speed.set_ylabel("launch speed / normal impact speed")
    angle.semilogx(x, row["angle_deg"], "o-", color=BLUE, markersize=4)
    angle.axhspan(35.0, 55.0, color=OCHRE, alpha=0.15)
    angle.set(xlabel="distance from the axis / projectile's radius", ylabel="launch angle [deg]", ylim=(0.0, 90.0))
    for axis in (speed, angle):
        axis.axvline(rim, color="black", linewidth=0.8, linestyle=":")
        grid(axis)
    ticks = [t for t in (1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24) if x.min() * 0.95 <= t <= max(x.max(), rim) * 1.05]
    angle.set_xticks(ticks, [f"{t:g}" for t in ticks])
    angle.minorticks_off()
    speed.legend(frameon=False, fontsize=8)
    save(fig, path)
