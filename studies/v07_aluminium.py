"""Aluminium into aluminium at 7 km/s (V07): craters in a soft and a hard plate at two resolutions, beside those of
Cour-Palais's equation. Runs ``cases/pierazzo_2008_aluminum``; what is done is not made again.

    python studies/v07_aluminium.py [--out runs] [--results docs/results/v07_aluminium] [--variants]

The depth is that of the last snapshot below the undisturbed surface (``crater.measures.measure``). The equation
(Cour-Palais in Christiansen 2003, NASA TP-2003-210788; d in cm, v and c in km/s, BHN the Brinell hardness):

    depth = 5.24 d^(19/18) BHN^(-1/4) (rho_p / rho_t)^(1/2) (v / c)^(2/3) cm

``--variants`` adds runs at the coarse size that change one thing of the soft plate each, to see what the depth hangs
on; verdicts do not use them.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from matter.files import archive, snapshot

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from studies import case_runs

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "cases" / "pierazzo_2008_aluminum"
TOLERANCE = 0.15
PLATES = {"1100-O": (23.0, "", "coarse"), "6061-T6": (95.0, "hard", "hard_coarse")}
"""Brinell hardness, and the presets of the fine and the coarse size."""
SIZES = ("10 to the ball's radius", "7 to the ball's radius")
VARIANTS = {"7, ground of that spacing to 6 mm only": ("sph.fine_radius=6 mm",)}
"""What each changes of the coarse run into the soft plate."""
WHY = {
    "1100-O": "5 % deeper at 10 than at 7: on the edge of what was asked",
    "6061-T6": "6 % deeper at 10 than at 7",
}
"""Beside the verdicts: of the runs that were kept."""


def cour_palais(hardness: float, diameter: float = 0.635, speed: float = 7.0, sound: float = 5.1) -> float:
    """Depth [cm] of a crater by an aluminium ball in aluminium: ``diameter`` [cm], ``speed`` and ``sound`` [km/s]."""
    return 5.24 * diameter ** (19 / 18) * hardness**-0.25 * (speed / sound) ** (2 / 3)


def measured(run: Path) -> dict[str, Any]:
    """Depth [m] with its error at the end and in time, apparent diameter, particles of a run."""
    last = json.loads((run / "6_crater" / "measures.json").read_text())["late_sph"]
    with (run / "6_crater" / "time_series.csv").open() as file:
        rows = [row for row in csv.DictReader(line for line in file if line[0] != "#") if row["depth_m"]]
    report = json.loads((run / "2_sph" / "stage_report.json").read_text())
    return {
        "run": run, "depth": last["depth_m"]["value"], "sigma": last["depth_m"]["sigma"],
        "diameter": last["diameter_apparent_m"]["value"], "time": last["time_s"]["value"],
        "times": [float(row["time_s"]) for row in rows], "depths": [float(row["depth_m"]) for row in rows],
        "particles": len(snapshot.read(run / "2_sph" / "last.vtkhdf", ("mass",))),
        "energy": report["drift_over_projectile"]["energy_J"],
    }  # fmt: skip


def made(arguments: tuple[str, ...], out: Path) -> dict[str, Any]:
    """A run of the case with these arguments, measured."""
    code, folder = case_runs.run(CASE, (*arguments, "--threads", "1"), out)
    if code or folder is None:
        raise SystemExit(code or 1)
    return measured(folder)


def verdicts(found: dict[tuple[str, str], dict[str, Any]]) -> dict[str, Any]:
    """V07, one row a plate and size."""
    rows = []
    for (plate, size), run in found.items():
        wanted = cour_palais(PLATES[plate][0])
        off = 100.0 * run["depth"] / wanted - 1.0
        met = abs(off) <= TOLERANCE
        rows.append(
            {
                "id": "V07",
                "ours": f"{plate}: {100.0 * run['depth']:.2f} +- {100.0 * run['sigma']:.2f} cm ({100 * off:+.0f} %)",
                "verdict": "met" if met else "not met",
                "resolution": f"{run['particles']:,} particles, {size}",
                "why": WHY[plate],
            }
        )
    return {"resolution": "", "verdicts": rows}


def table(found: dict[tuple[str, str], dict[str, Any]], varied: dict[str, dict[str, Any]]) -> str:
    """All runs in one table."""
    lines = [
        "| plate | spacings | depth [cm] | wanted | off | depth / diameter | deepest in time [cm] | energy |",
        "|---" * 8 + "|",
    ]
    soft = [(("1100-O", name), run) for name, run in varied.items()]
    for (plate, size), run in [*found.items(), *soft]:
        wanted = cour_palais(PLATES[plate][0])
        lines.append(
            f"| {plate} | {size} | {100 * run['depth']:.2f} +- {100 * run['sigma']:.2f} | {wanted:.2f} | "
            f"{100 * (100 * run['depth'] / wanted - 1):+.0f} % | {run['depth'] / run['diameter']:.2f} | "
            f"{100 * max(run['depths']):.2f} | {100 * run['energy']:+.1f} % |"
        )
    return "\n".join(lines) + "\n"


def picture(found: dict[tuple[str, str], dict[str, Any]], path: Path) -> None:
    """Depth in time beside the equation and its tolerance, and both craters at the fine size in section."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(12.0, 3.9), layout="constrained")
    for color, (plate, (hardness, *_)) in zip(("C0", "C3"), PLATES.items()):
        wanted = 10.0 * cour_palais(hardness)
        axes[0].axhspan(wanted * (1 - TOLERANCE), wanted * (1 + TOLERANCE), color=color, alpha=0.12, lw=0)
        axes[0].axhline(wanted, color=color, lw=0.8, ls=":")
        for style, size in zip(("-", "--"), SIZES):
            run = found[plate, size]
            label = f"{plate}, {size.split()[0]} to the radius"
            axes[0].plot(1e6 * np.array(run["times"]), 1e3 * np.array(run["depths"]), style, color=color, label=label)
    axes[0].set(xlabel="t [µs]", ylabel="depth below the surface [mm]", ylim=(0, 22))
    axes[0].legend(fontsize=7)
    for panel, (plate, (hardness, *_)) in zip(axes[1:], PLATES.items()):
        particles = snapshot.read(found[plate, SIZES[0]]["run"] / "2_sph" / "last.vtkhdf")
        # half of a particle's own spacing from the plane: they grow coarse with depth
        spacing = np.cbrt(particles.mass / particles.density)
        cut = (np.abs(particles.position[:, 1]) < 0.6 * spacing) & (particles.position[:, 2] > -0.03)
        x, kelvin, size = 1e3 * particles.position[cut], particles.temperature[cut], 1e3 * spacing[cut]
        dots = panel.scatter(
            x[:, 0], x[:, 2], c=kelvin, s=12.0 * size**2, lw=0, cmap="inferno", vmin=293.0, vmax=933.0
        )
        angle, wanted = np.linspace(np.pi, 2.0 * np.pi, 100), 10.0 * cour_palais(hardness)
        panel.plot(wanted * np.cos(angle), wanted * np.sin(angle), "c", lw=0.9)
        panel.set(xlim=(-25, 25), ylim=(-25, 15), aspect="equal", xlabel="mm")
        panel.set_title(f"{plate}, {1e6 * found[plate, SIZES[0]]['time']:.0f} µs", fontsize=9)
    figure.colorbar(dots, ax=axes[2], shrink=0.8, label="temperature [K], up to melting")
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> int:
    """Exit code 0, or that of the run that failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs"))
    parser.add_argument("--results", type=Path, default=ROOT / "docs" / "results" / "v07_aluminium")
    parser.add_argument("--variants", action="store_true")
    given = parser.parse_args()
    found = {
        (plate, size): made(("--preset", preset) if preset else (), given.out)
        for plate, (_, *presets) in PLATES.items()
        for size, preset in zip(SIZES, presets)
    }
    changed = VARIANTS if given.variants else {}
    varied = {
        name: made(("--preset", "coarse", *case_runs.sets(*values)), given.out) for name, values in changed.items()
    }
    given.results.mkdir(parents=True, exist_ok=True)
    archive.write_text(given.results / "verdicts.json", json.dumps(verdicts(found), indent=1) + "\n")
    archive.write_text(given.results / "table.md", table(found, varied))
    picture(found, given.results / "depths.png")
    print(table(found, varied))
    return 0


if __name__ == "__main__":
    sys.exit(main())
