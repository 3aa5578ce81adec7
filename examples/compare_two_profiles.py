"""Lay two crater profiles over each other: python examples/compare_two_profiles.py A B [picture.png]

A and B are run folders, profile.csv files or observed names (thesis_980km, sci_ryugu, ...).
"""

import sys

import numpy as np

from crater import compare
from crater.plot import draw_comparison

if len(sys.argv) < 3:
    sys.exit("usage: python examples/compare_two_profiles.py A B [picture.png]")
first, second = (compare.load(item) for item in sys.argv[1:3])
for crater in (first, second):
    for name, (value, minus, plus) in crater.values.items():
        print(f"{crater.name:<30} {name:<24} {value:.4g} +{plus:.2g} -{minus:.2g}")
if first.profile is not None and second.profile is not None:
    difference = compare.profile_difference(first.profile, second.profile)
    print(f"RMS difference {difference['rms_m']:.4g} m, {difference['rms_over_depth']:.3f} of the depth, inside {difference['to_m']:.4g} m")
    common = np.linspace(difference["from_m"], difference["to_m"], 9)
    for r in common:
        heights = [np.interp(r, c.profile.radius, c.profile.height) for c in (first, second)]
        print(f"  r = {r:12.4g} m   {heights[0]:12.4g} m {heights[1]:12.4g} m")
if len(sys.argv) > 3:
    draw_comparison([first, second], sys.argv[3])
