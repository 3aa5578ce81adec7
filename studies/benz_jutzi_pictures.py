"""Pictures of the runs beside Benz & Jutzi (2007) (``benz_jutzi.py``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from matter.files import snapshot
from studies.benz_jutzi_runs import DEFAULT_SET, ESCAPE, Runs, label, transferred


def pictures(runs: Runs, out: Path) -> None:
    """M(>v) and distention of Deep Impact, momentum and mass in time, shock against depth."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    colour = {1.0: "C0", 1.1: "C3", 1.5: "C1", 3.0: "C2"}
    for case, name in (("deep_impact", "ejected.png"), ("momentum_transfer", "momentum.png")):
        rows = [row for row in runs.rows if row["case"] == case]
        if not rows:
            continue
        fines = runs.spacings(case)
        figure, axes = plt.subplots(
            1,
            2 if case == "deep_impact" else 3,
            figsize=(11 if case == "deep_impact" else 14, 5.2),
            layout="constrained",
        )
        for row in rows:
            words = f"{label(row)}, {100 * row['spacing_m'] * 2 ** (1 / 6):.0f} cm".replace("alpha0", "α₀ =")
            pen = {
                "color": "0.4" if row["light"] else colour[row["alpha0"]],
                "ls": ("-", "--", ":", "-.")[fines.index(row["spacing_m"]) % 4],
            }
            if (
                row["curve"].split(" ")[0] in ("soft", "hard", "weak")
                or row["intact"]
                or row["set"] != DEFAULT_SET
                or row["odd"]
            ):
                # a band of thin lines under one name: which is which stands in tables.md
                pen |= {"lw": 0.6, "alpha": 0.55, "ls": "-"}
                words = "_nolegend_"
            t = 1e3 * np.array(row["series"]["time_s"])
            if case == "deep_impact":
                axes[0].loglog(row["speed_m_s"], row["mass_above_kg"], label=words, **pen)
                if row["alpha0"] > 1.0:
                    axes[1].plot(row["rings"]["radius_m"], row["rings"]["distention"], label=words, **pen)
            else:
                axes[0].plot(t, transferred(row, 1.0), label=words, **pen)
                axes[1].semilogy(t[1:], np.array(row["series"]["mass_kg"])[1:, ESCAPE.index(1.0)], **pen)
                axes[2].loglog(row["shells"]["depth_m"], 1e-9 * np.array(row["shells"]["peak_Pa"]), **pen)
        if case == "deep_impact":
            for x, y, c in ((2.0, 3.20e6, "C0"), (2.0, 0.52e6, "C1"), (2.0, 0.49e6, "C2")):
                axes[0].plot(x, y, "o", mfc="none", color=c, ms=8)
            axes[0].set(
                xlabel="vertical speed v [m/s]",
                ylabel="mass faster than v at 50 ms [kg]; circles: published",
                ylim=(10, None),
            )
            axes[1].set(xlabel="distance from the impact point [m]", ylabel="distention at 50 ms, below the ground")
        else:
            axes[0].set(xlabel="time [ms]", ylabel="momentum transferred / the projectile’s")
            axes[1].set(xlabel="time [ms]", ylabel="mass faster than 1 m/s [kg]")
            axes[2].set(xlabel="depth below the impact [m]", ylabel="peak pressure [GPa]")
        named = [line for line in axes[0].get_lines() if not line.get_label().startswith("_")]
        thin_line = plt.Line2D(
            [], [], color="0.5", lw=0.6, label="other crush curves, strengths, supports and viscosities"
        )
        figure.legend(handles=[*named, thin_line], fontsize=9, loc="outside lower center", ncols=4, frameon=False)
        figure.savefig(out / name, dpi=110)
        plt.close(figure)


def slices(folder: Path, runs: Runs, out: Path) -> None:
    """The source's Figures 1 and 2: vertical velocity at the end in slices through the plane of flight, and the
    distention of alpha0 = 3."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = [
        row
        for alpha0 in (1.0, 1.5, 3.0)
        if (fine := runs.spacings("deep_impact")) and (row := runs.get("deep_impact", alpha0, fine[0]))
    ]
    rows += [
        row
        for alpha0 in (1.0, 1.5, 3.0)
        if (fine := runs.spacings("momentum_transfer")) and (row := runs.get("momentum_transfer", alpha0, fine[0]))
    ]
    if not rows:
        return
    for case in dict.fromkeys(row["case"] for row in rows):
        mine = [row for row in rows if row["case"] == case]
        figure, axes = plt.subplots(len(mine), 2, figsize=(11, 3.6 * len(mine)), squeeze=False, layout="constrained")
        for pair, row in zip(axes, mine):
            run = next(path for path in folder.rglob(row["run"]) if (path / "2_sph").is_dir())
            _slice(figure, pair, row, snapshot.read(run / "2_sph" / "last.vtkhdf"))
        figure.savefig(out / f"slices_{case}.png", dpi=110)
        plt.close(figure)


def _slice(figure, pair, row: dict, particles) -> None:
    """Vertical velocity and distention (density of solid targets) in the plane of flight."""
    cut = np.abs(particles.position[:, 1]) < 0.5 * particles.smoothing_length
    x, limit = particles.position[cut], 6.0 if row["case"] == "deep_impact" else 3.0
    reach = float(particles.attributes["target_depth_m"])
    porous = row["alpha0"] > 1.0
    parts = (
        (particles.velocity[cut, 2], "vertical velocity [m/s]", dict(cmap="coolwarm", vmin=-limit, vmax=limit)),
        (
            particles.distention[cut] if porous else particles.density[cut],
            "distention" if porous else "density [kg/m³]",
            dict(cmap="viridis"),
        ),
    )
    for panel, (values, words, colours) in zip(pair, parts):
        shown = panel.scatter(
            x[:, 0], x[:, 2], c=values, s=30.0 * particles.smoothing_length[cut] / reach, lw=0, **colours
        )
        figure.colorbar(shown, ax=panel, label=words)
        panel.set(
            xlim=(-reach, reach), ylim=(-reach, 0.4 * reach), aspect="equal", xlabel="x, downrange [m]", ylabel="z [m]"
        )
    pair[0].set_title(f"{label(row).replace('alpha0', 'α₀ =')}, {1e3 * row['end_s']:.0f} ms", fontsize=10, loc="left")
