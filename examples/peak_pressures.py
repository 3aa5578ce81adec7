"""Peak pressure against distance below an impact: python examples/peak_pressures.py 2_sph/last.vtkhdf [picture.png]

Target particles within 30 degrees of straight down, in shells about the impact point a fifth of the projectile's
radius a thick: the median, the 10th and 90th percentile of the highest pressure that they have seen. The core is the
largest median, the exponent n of P ~ r^-n a straight line over 1.5 to 4 a.
"""

import json
import sys
from itertools import pairwise

import numpy as np

from matter.files import snapshot

shot = snapshot.read(sys.argv[1])
first, peak = shot.initial_position, shot.peak_pressure
ball = shot.layer < 0
a = 0.5 * float(np.ptp(first[ball], axis=0).mean())  # somewhat short: centres of particles
top = 0.0 if shot.attributes["frame"] == "plane" else float(shot.attributes["target_radius_m"])
r = np.linalg.norm(first - (0.0, 0.0, top), axis=1)
below = ~ball & ((top - first[:, 2]) > np.cos(np.radians(30.0)) * r)
edges = a * np.arange(0.2, 6.0, 0.2)
rows = []
for low, high in pairwise(edges):
    here = peak[below & (r >= low) & (r < high)]
    if len(here) >= 5:
        rows.append((0.5 * (low + high) / a, *np.percentile(here, (50.0, 10.0, 90.0)), len(here)))
table = np.array(rows)
far = (table[:, 0] > 1.5) & (table[:, 0] < 4.0)
slope, offset = np.polyfit(np.log(table[far, 0]), np.log(table[far, 1]), 1)
for row in table:
    print(
        f"r = {row[0]:4.1f} a   {row[1] / 1e9:8.2f} GPa   ({row[2] / 1e9:.2f} to {row[3] / 1e9:.2f}; {row[4]:.0f} "
        f"particles)"
    )
found = {
    "radius_m": a, "particles": len(shot.mass), "core_GPa": float(table[:, 1].max() / 1e9),
    "largest_GPa": float(peak[below].max() / 1e9),
    "core_90th_percentile_GPa": float(table[np.argmax(table[:, 1]), 3] / 1e9), "exponent": float(-slope),
    "ball_median_GPa": float(np.median(peak[ball]) / 1e9),
}  # fmt: skip
print(json.dumps(found))
if len(sys.argv) > 2:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.fill_between(table[:, 0], table[:, 2] / 1e9, table[:, 3] / 1e9, alpha=0.3)
    axes.loglog(table[:, 0], table[:, 1] / 1e9, "o-", ms=3)
    axes.loglog(table[far, 0], np.exp(offset) * table[far, 0] ** slope / 1e9, "k--", lw=0.8, label=f"r^-{-slope:.2f}")
    axes.set(xlabel="distance from the impact point / projectile's radius", ylabel="peak pressure [GPa]")
    axes.set_xticks([0.3, 0.5, 1.0, 2.0, 4.0], ["0.3", "0.5", "1", "2", "4"])
    axes.minorticks_off()
    axes.legend(frameon=False)
    figure.savefig(sys.argv[2], dpi=110)
