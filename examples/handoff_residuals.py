"""Where a handoff lost or gained motion: python examples/handoff_residuals.py RUN [picture.png]

Reads RUN/4_handoff: momentum by octant and by shell before the correction (handoff.json), and the velocity difference
cell by cell (residuals.h5) on a map seen from above: distance along the datum against azimuth, and against depth.
"""

import json
import sys
from pathlib import Path

import matplotlib
import numpy as np

from matter.files import archive

matplotlib.use("Agg")
from matplotlib import pyplot as plt

out = Path(sys.argv[1]) / "4_handoff"
record = json.loads((out / "handoff.json").read_text())
cells = {
    name.removeprefix("cells/"): values
    for name, values in archive.read(out / "residuals.h5")[0].items()
    if name.startswith("cells/")
}
local = {row["region"]: row for row in record["local_momentum"]}

figure, axes = plt.subplots(2, 2, figsize=(12, 9), layout="constrained")
octants = [[f"octant x{x}y{y}z{z}" for x in "-+" for y in "-+"] for z in "+-"]
values = np.array([[100.0 * local[name]["relative"] if name in local else np.nan for name in row] for row in octants])
shown = axes[0, 0].imshow(values, cmap="YlOrRd", vmin=0.0, vmax=5.0)
for i, row in enumerate(octants):
    for j, name in enumerate(row):
        fraction = f"{100.0 * local[name]['share']:.0f} % of it" if name in local else "nothing"
        axes[0, 0].text(
            j,
            i,
            f"{name.removeprefix('octant ')}\n{values[i, j]:.2f} %\n{fraction}",
            ha="center",
            va="center",
            fontsize=9,
        )
axes[0, 0].set(
    xticks=[], yticks=[0, 1], yticklabels=["upper", "lower"], title="|dp| / sum m|v| by octant, raw; share of sum m|v|"
)
figure.colorbar(shown, ax=axes[0, 0], label="% (limit 5)")

shells = [
    local[name]
    for name in sorted((name for name in local if name.startswith("shell")), key=lambda name: int(name.split()[1]))
]
axes[0, 1].bar(
    [row["region"].split()[1] for row in shells], [100.0 * row["relative"] for row in shells], color="#3182bd"
)
axes[0, 1].axhline(5.0, color="#c0262d", lw=1)
axes[0, 1].set(
    xlabel="shell around the impact, each with an eighth of sum m|v|",
    ylabel="|dp| / sum m|v| [%], raw",
    title="by shell",
)

off = np.linalg.norm(cells["after"] - cells["before"], axis=1)
rms = np.sqrt(np.sum(cells["mass"] * np.sum(cells["before"] ** 2, axis=1)) / cells["mass"].sum())
position, unit, name = cells["centre"], *((1e3, "km") if np.ptp(cells["centre"]) > 1e4 else (1.0, "m"))
distance, azimuth = (
    np.hypot(position[:, 0], position[:, 1]) / unit,
    np.degrees(np.arctan2(position[:, 1], position[:, 0])),
)
order = np.argsort(off)
for panel, height, label in (
    (axes[1, 0], azimuth, "azimuth [deg]"),
    (axes[1, 1], position[:, 2] / unit, f"z [{name}]"),
):
    dots = panel.scatter(
        distance[order],
        height[order],
        c=off[order] / rms,
        s=12,
        cmap="viridis",
        vmin=0.0,
        vmax=float(np.percentile(off / rms, 99)),
    )
    figure.colorbar(dots, ax=panel, label="|dv| / rms v of the source")
    panel.set(
        xlabel=f"distance from the axis [{name}]",
        ylabel=label,
        title="velocity after against before, cell by cell (corrected)",
    )
picture = sys.argv[2] if len(sys.argv) > 2 else "handoff_residuals.png"
figure.savefig(picture, dpi=110)
print(
    f"{len(off)} cells: |dv| {np.median(off):.3g} m/s median, {np.percentile(off, 99):.3g} m/s 99 %, rms v {rms:.3g} "
    f"m/s; {picture}"
)
