"""Lay two crater profiles over each other: python examples/compare_two_profiles.py A B [picture.png]

A and B are run folders, profile.csv files or observed names (thesis_980km, sci_ryugu, ...). Like is set against like:
a run shows its transient crater beside an observed transient one, its final crater beside a final one.
"""

import sys

import numpy as np

from crater.comparison import craters
from crater.pages import compare
from crater.pictures.plot import draw_comparison

if len(sys.argv) < 3:
    sys.exit("usage: python examples/compare_two_profiles.py A B [picture.png]")
(first, second, *_), said = craters.chosen([craters.holdings(item) for item in sys.argv[1:3]])
print(said)
for crater in (first, second):
    for name, (value, minus, plus) in crater.values.items():
        print(f"{crater.label:<50} {name:<24} {value:.4g} +{plus:.2g} -{minus:.2g}")
if first.profile is not None and second.profile is not None:
    difference = compare.profile_difference(first.profile, second.profile)
    print(
        f"RMS difference {difference['rms_inside_m']:.4g} m, {difference['rms_over_depth']:.3f} of the depth, inside "
        f"{difference['inside_m']:.4g} m"
    )
    print(f"largest difference {difference['largest_m']:.4g} m, at {difference['largest_at_m']:.4g} m from the axis")
    common = np.linspace(difference["from_m"], difference["to_m"], 9)
    for r in common:
        heights = [np.interp(r, c.profile.radius, c.profile.height) for c in (first, second)]
        print(f"  r = {r:12.4g} m   {heights[0]:12.4g} m {heights[1]:12.4g} m")
if len(sys.argv) > 3:
    draw_comparison([first, second], sys.argv[3])
