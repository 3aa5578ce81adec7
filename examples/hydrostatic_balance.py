"""Pressure of a relaxed body against a table of its profile: python examples/hydrostatic_balance.py RUN TABLE.csv

RUN is a run folder of a layered sphere, TABLE.csv has columns radius_m and pressure_Pa
(``tests/data/callisto_model2_relaxed.csv``; lines with # are comments). Particles nearer than a support to an
interface or to the surface are left out.
"""

import csv
import json
import sys
from pathlib import Path

import numpy as np

from matter.files import snapshot

run, path = Path(sys.argv[1]), Path(sys.argv[2])
rows = list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))
table = np.array([[float(row["radius_m"]), float(row["pressure_Pa"])] for row in rows])
table = table[np.argsort(table[:, 0])]
first = snapshot.read(snapshot.series(run / "2_sph")[0])
edges = np.array(
    [layer["outer_radius_m"] for layer in json.loads((run / "2_sph" / "target.json").read_text())["layers"]]
)
r = np.linalg.norm(first.position, axis=1)
far = (first.layer >= 0) & (np.abs(r[:, None] - edges).min(axis=1) > first.smoothing_length)
ratio = first.pressure[far] / np.interp(r[far], table[:, 0], table[:, 1])
print(
    f"{far.sum()} of {(first.layer >= 0).sum()} particles: P over the table's, rms deviation "
    f"{100 * np.sqrt(((ratio - 1.0) ** 2).mean()):.2f} %"
)
for low in np.arange(0.0, 1.0, 0.1):
    here = (r[far] >= low * edges[-1]) & (r[far] < (low + 0.1) * edges[-1])
    if here.sum() > 10:
        print(
            f"  {low:.1f} to {low + 0.1:.1f} R: mean {ratio[here].mean():.4f}, scatter {ratio[here].std():.4f} "
            f"({here.sum()})"
        )
