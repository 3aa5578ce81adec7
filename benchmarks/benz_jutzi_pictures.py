"""Pictures of the runs beside Benz & Jutzi (2007) (``benz_jutzi.py``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from benz_jutzi_runs import ESCAPE, VISCOSITY, Runs, label, transferred, viscosity

from matter import snapshot


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
        figure, axes = plt.subplots(1, 2 if case == "deep_impact" else 3, figsize=(11 if case == "deep_impact" else 15, 5.2), layout="constrained")
        for row in rows:
            words = f"{label(row)}, {100 * row['spacing_m'] * 2 ** (1 / 6):.0f} cm"
            pen = {"color": "0.4" if row["light"] else colour[row["alpha0"]], "ls": ("-", "--", ":", "-.")[fines.index(row["spacing_m"]) % 4]}
            if row["curve"].split(" ")[0] in ("soft", "hard", "weak") or row["intact"] or row["following"] or viscosity(row) != VISCOSITY:
                pen |= {"lw": 0.7, "alpha": 0.7}
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
            axes[0].set(xlabel="v [m/s]", ylabel="M(v_z > v) at 50 ms [kg]; circles: published", ylim=(10, None))
            axes[1].set(xlabel="distance from the impact point [m]", ylabel="distention at 50 ms, below the ground")
        else:
            axes[0].set(xlabel="t [ms]", ylabel="1 + P_ejecta / P_projectile, v_z > 1 m/s")
            axes[1].set(xlabel="t [ms]", ylabel="M(v_z > 1 m/s) [kg]")
            axes[2].set(xlabel="depth below the impact [m]", ylabel="peak pressure [GPa]")
        figure.legend(handles=axes[0].get_lines()[: len(rows)], fontsize=7, loc="outside lower center", ncols=4)
        figure.savefig(out / name, dpi=110)
        plt.close(figure)


def slices(folder: Path, runs: Runs, out: Path) -> None:
    """The source's Figures 1 and 2: vertical velocity at the end in slices through the plane of flight, and the distention of alpha0 = 3."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = [row for alpha0 in (1.0, 1.5, 3.0) if (fine := runs.spacings("deep_impact")) and (row := runs.get("deep_impact", alpha0, fine[0]))]
    rows += [row for alpha0 in (1.0, 1.5, 3.0) if (fine := runs.spacings("momentum_transfer")) and (row := runs.get("momentum_transfer", alpha0, fine[0]))]
    if not rows:
        return
    figure, axes = plt.subplots(2, len(rows), figsize=(4.2 * len(rows), 7), squeeze=False, layout="constrained")
    for column, row in enumerate(rows):
        run = next(path for path in folder.rglob(row["run"]) if (path / "2_sph").is_dir())
        particles = snapshot.read(run / "2_sph" / "last.vtkhdf")
        cut = np.abs(particles.position[:, 1]) < 0.5 * particles.smoothing_length
        x, limit, top = particles.position[cut], 2.0 if row["case"] == "deep_impact" else 1.0, row["counted_kg"] and axes[0, column]
        reach = float(particles.attributes["target_depth_m"])
        dots = 1.5 * particles.smoothing_length[cut] / reach * 20.0
        shown = top.scatter(x[:, 0], x[:, 2], c=particles.velocity[cut, 2], s=dots, cmap="coolwarm", vmin=-3 * limit, vmax=3 * limit, lw=0)
        figure.colorbar(shown, ax=top, label="v_z [m/s]", shrink=0.7)
        what = particles.distention[cut] if row["alpha0"] > 1.0 else particles.density[cut]
        shown = axes[1, column].scatter(x[:, 0], x[:, 2], c=what, s=dots, cmap="viridis", lw=0)
        figure.colorbar(shown, ax=axes[1, column], label="distention" if row["alpha0"] > 1.0 else "density [kg/m^3]", shrink=0.7)
        top.set_title(f"{row['case'].replace('_', ' ')}, {label(row)}, {1e3 * row['end_s']:.0f} ms", fontsize=9)
        for panel in axes[:, column]:
            panel.set(xlim=(-reach, reach), ylim=(-reach, 0.6 * reach), aspect="equal")
    figure.savefig(out / "slices.png", dpi=90)
    plt.close(figure)
