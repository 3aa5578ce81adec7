"""Measure a crater in any cloud of points: python examples/measure_a_cloud.py points.xyz [plane|sphere]

The file holds x y z [m] per line; spacing is taken from the points themselves. For snapshots of this project use the
command measure_crater.
"""

import sys

import numpy as np

from crater.measures.measure import measure
from crater.pages.report import as_text
from matter.particles import Particles

points = np.loadtxt(sys.argv[1], usecols=(0, 1, 2))
found = measure(Particles({"position": points}), sys.argv[2] if len(sys.argv) > 2 else "plane")
print(as_text(found))
for name, row in found.notes.get("by_method", {}).items():
    print(f"  {name:<8}", "  ".join(f"{key} {value:.4g}" for key, value in row.items()))
