"""The velocity field before and after a handoff on the impact plane: python examples/handoff_velocity.py RUN
[picture.png]

Above, the source's compact particles; below, the grains; both as colours (speed) and arrows, with the surface that
carved the bed.
"""

import json
import sys
from pathlib import Path

import matplotlib
import numpy as np
import trimesh

from matter.files import archive, snapshot

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

run = Path(sys.argv[1])
out = run / "4_handoff"
record = json.loads((out / "handoff.json").read_text())
paths = snapshot.series(run / "2_sph") or [run / "2_sph" / "last.vtkhdf"]
times = np.array([snapshot.attributes(path)["time"] for path in paths])
source = snapshot.read(paths[int(np.argmin(np.abs(times - record["time_s"])))])
start = snapshot.read(out / "start.vtkhdf")
compact = archive.read(out / "residuals.h5")[0]["source/reason"] == 0
edge = np.asarray(
    trimesh.intersections.mesh_plane(trimesh.load(out / "surface.ply", process=False), [0, 1, 0], [0, 0, 0])
)[:, :, [0, 2]]

unit, name = (1e3, "km") if np.ptp(start.position) > 1e4 else (1.0, "m")
bed = start.position[: record["grains"]["kept"]][:, [0, 2]] if record["grains"]["kept"] else start.position[:, [0, 2]]
low, high = bed.min(axis=0), bed.max(axis=0) + 0.15 * np.ptp(bed[:, 1])
inside = np.all((source.position[:, [0, 2]] > low) & (source.position[:, [0, 2]] < high), axis=1)
thick = np.cbrt(source.mass / source.density)
before = np.flatnonzero(compact & inside & (np.abs(source.position[:, 1]) < thick))
after = np.flatnonzero(np.abs(start.position[:, 1]) < start.radius)
top = float(np.percentile(np.linalg.norm(source.velocity[before], axis=1), 99))

figure, axes = plt.subplots(2, 1, figsize=(12, 11), sharex=True, sharey=True, layout="constrained")
for panel, cloud, which, title in (
    (
        axes[0],
        source,
        before,
        f"source at {record['time_s']:.4g} s: compact particles within one spacing of the plane y = 0",
    ),
    (axes[1], start, after, "grains cut by the plane"),
):
    position, velocity = cloud.position[which] / unit, cloud.velocity[which]
    speed = np.linalg.norm(velocity, axis=1)
    arrows = panel.quiver(
        position[:, 0],
        position[:, 2],
        velocity[:, 0],
        velocity[:, 2],
        speed,
        cmap="viridis",
        clim=(0.0, top),
        scale=30.0 * top,
        width=0.0013,
    )
    panel.add_collection(LineCollection(edge / unit, colors="black", linewidths=0.9))
    panel.set(
        aspect="equal",
        title=title,
        ylabel=f"z [{name}]",
        xlim=(low[0] / unit, high[0] / unit),
        ylim=(low[1] / unit, high[1] / unit),
    )
axes[1].set_xlabel(f"x [{name}]")
figure.colorbar(arrows, ax=axes, label="speed [m/s]", shrink=0.6)
picture = sys.argv[2] if len(sys.argv) > 2 else "handoff_velocity.png"
figure.savefig(picture, dpi=110)
print(
    f"{len(before)} particles and {len(after)} grains on the plane; 99 % of the source below {top:.4g} m/s; {picture}"
)
