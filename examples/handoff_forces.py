"""The contact forces that a handed-over bed starts with: python examples/handoff_forces.py RUN_or_SNAPSHOT
[picture.png]

Draws the contacts within one grain diameter of the impact plane, thicker and darker the more they carry, and the
spread of all forces.
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np

from handoff.transfer import force_network
from matter.files import snapshot

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

path = Path(sys.argv[1])
grains = snapshot.read(path / "4_handoff" / "start.vtkhdf" if path.is_dir() else path)
net = force_network.measure(grains)
fraction = net.force / net.mean
unit, name = (1e3, "km") if np.ptp(grains.position) > 1e4 else (1.0, "m")

figure, (cut, spread) = plt.subplots(2, 1, figsize=(12, 9), height_ratios=(2, 1), layout="constrained")
middle = 0.5 * (grains.position[net.one, 1] + grains.position[net.other, 1])
slice_contacts = np.flatnonzero(np.abs(middle) < 2.0 * grains.radius.mean())
slice_contacts = slice_contacts[np.argsort(fraction[slice_contacts])]  # the strongest on top
ends = (
    np.stack([grains.position[net.one[slice_contacts]], grains.position[net.other[slice_contacts]]], axis=1)[
        :, :, [0, 2]
    ]
    / unit
)
lines = cut.add_collection(
    LineCollection(
        ends,
        array=fraction[slice_contacts],
        cmap="inferno_r",
        clim=(0.0, 5.0),
        linewidths=np.clip(0.8 * fraction[slice_contacts], 0.2, 5.0),
    )
)
figure.colorbar(lines, ax=cut, label="force / mean")
cut.autoscale()
cut.set(
    aspect="equal",
    xlabel=f"x [{name}]",
    ylabel=f"z [{name}]",
    title=f"{len(net.force)} contacts of {net.grains} grains; mean force {net.mean:.3g} N",
)
spread.hist(fraction, bins=np.linspace(0.0, 12.0, 100), density=True, histtype="step")
spread.plot(ticks := np.linspace(0.0, 12.0, 50), np.exp(-ticks), ":", color="#999", label="exp(-f / mean)")
spread.set(yscale="log", xlabel="force / mean", ylabel="share of contacts")
spread.legend()
picture = sys.argv[2] if len(sys.argv) > 2 else "handoff_forces.png"
figure.savefig(picture, dpi=110)
print(
    f"{net.contacts_per_grain:.2f} contacts per grain, mean {net.mean:.4g} N, 99 % below {net.spread:.2f} means, "
    f"largest {fraction.max():.1f} means; {picture}"
)
