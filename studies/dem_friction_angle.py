"""The friction angle of grains over friction mu and shape beta: a map, the friction for 30 deg, a second seed, and the
tilted bed.

    python studies/dem_friction_angle.py [--out docs/results/dem_friction_angle] [--shape 0.4]
        [--part map|find|tilt|rate|fraction|all]

Every measurement is kept where ``dem.trials.friction_angle`` keeps them, so the script goes on where it was stopped.
One measurement takes one to two minutes of one core, a tilt three; the whole script some 50 minutes.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from dem.contact.settings import Contact, GrainLaw
from dem.trials import friction_angle

FRICTIONS = (0.0, 0.15, 0.3, 0.5, 0.8)
SHAPES = (0.0, 0.2, 0.4, 0.8)
WANTED = 30.0
DIMORPHOS = 0.302
"""mu_s of ``cases/dart_dimorphos``."""
LOOSE = (0.0, 0.1, 0.2, 0.269, 0.302, 0.4, 0.5, 0.55, 0.75)
"""mu_s at which the solid fraction of loose beds is measured."""
INERTIAL = (None, 0.03, 0.1, 0.3, 0.6, 1.0, 3.0)


def law(friction: float, shape: float) -> Contact:
    """The default law of solid grains with another friction and shape."""
    return Contact(shell=GrainLaw(friction=friction, shape=shape))


def draw_map(out: Path) -> None:
    """Measure what is missing, write ``map.json`` and ``map.png``."""
    rows = []
    for friction in FRICTIONS:
        for shape in (
            SHAPES if friction > 0.0 else SHAPES[:1]
        ):  # without friction there is no rolling resistance either
            begin = time.process_time()
            found = friction_angle.measure(law(friction, shape), "shear", seed=1)
            rows.append({"friction": friction, "shape": shape, **found})
            print(f"mu {friction:4.2f} beta {shape:4.2f}: {found['angle_deg']:6.2f} +- {found['error_deg']:.2f} deg, "
                  f"fraction {found['fraction']:.3f}, "
                  f"{found['coordination']:.2f} contacts ({time.process_time() - begin:.0f} "
                  f"s)", flush=True)  # fmt: skip
            (out / "map.json").write_text(json.dumps(rows, indent=1))
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for shape in SHAPES:
        line = [row for row in rows if row["shape"] == shape or row["friction"] == 0.0]
        axes.errorbar(
            [r["friction"] for r in line],
            [r["angle_deg"] for r in line],
            [r["error_deg"] for r in line],
            fmt="o-",
            capsize=3,
            label=f"{shape:g}",
        )
    axes.axhline(WANTED, color="k", lw=0.6, ls="--")
    axes.set_xlabel("friction mu_s")
    axes.set_ylabel("friction angle in steady shear [deg]")
    axes.legend(title="shape beta", frameon=False)
    figure.savefig(out / "map.png", dpi=110)


def find(out: Path, shape: float) -> None:
    """The friction for 30 deg, then its angle on a seed that had no part in finding it."""
    friction, fitted, error = friction_angle.friction_for(WANTED, law(0.5, shape))
    found = {"friction": friction, "shape": shape, "fitted_deg": fitted, "fitted_error_deg": error}
    print(json.dumps(found), flush=True)
    found["second_seed"] = friction_angle.measure(law(friction, shape), "shear", seed=7)
    print(json.dumps(found, indent=1), flush=True)
    (out / "find.json").write_text(json.dumps(found, indent=1))


def tilt(out: Path) -> None:
    """The tilted bed at the friction that ``find`` found."""
    found = json.loads((out / "find.json").read_text())
    contact = law(found["friction"], found["shape"])
    found["tilt"] = friction_angle.measure(contact, "tilt", seed=1, begin=WANTED - 10.0)
    print(json.dumps(found["tilt"], indent=1), flush=True)
    (out / "find.json").write_text(json.dumps(found, indent=1))


def draw_rate(out: Path) -> None:
    """Steady shear from slow to fast: ``rate.json`` and ``rate.png``, with the law that fits
    (``sph.strength.inertial_friction``)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from scipy.optimize import curve_fit

    rows = []
    for number in INERTIAL:
        options = {} if number is None else {"inertial": number}
        rows.append(friction_angle.measure(law(DIMORPHOS, 0.4), "shear", seed=1, **options))
        print({name: round(value, 4) for name, value in rows[-1].items()}, flush=True)
        (out / "rate.json").write_text(json.dumps(rows, indent=1))
    number, angle, error, fraction = (
        np.array([row[name] for row in rows]) for name in ("inertial", "angle_deg", "error_deg", "fraction")
    )
    mu = np.tan(np.radians(angle))
    (I0, ratio), _ = curve_fit(
        lambda I, half, most: 1.0 + (most - 1.0) * I / (I + half), number, mu / mu[0], (0.3, 1.7),
        sigma=np.maximum(np.radians(error), 0.003),
    )  # fmt: skip
    print(f"mu(I) / mu_s = 1 + {ratio - 1.0:.3f} / (1 + {I0:.3f} / I), largest departure "
          f"{np.abs(mu / mu[0] - 1.0 - (ratio - 1.0) * number / (number + I0)).max():.3f}")  # fmt: skip
    figure = Figure(figsize=(6, 4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.errorbar(number, mu, np.radians(error) * (1.0 + mu**2), fmt="o", capsize=3, label="shear stress over normal")
    line = np.logspace(-3, 1, 200)
    axes.plot(line, mu[0] * (1.0 + (ratio - 1.0) * line / (line + I0)), lw=1, label=f"mu(I), I0 = {I0:.2f}")
    axes.plot(number, fraction, "s-", ms=4, lw=0.8, color="0.4", label="share of space filled")
    axes.set(xscale="log", xlabel="inertial number I", ylim=(0.2, 0.95), title=f"friction {DIMORPHOS}, shape 0.4")
    axes.legend(frameon=False)
    figure.savefig(out / "rate.png", dpi=90)


def draw_fraction(out: Path, shape: float) -> None:
    """The solid fraction that loose beds take (``friction_angle.loose_fraction``) over friction, two seeds:
    ``fraction.json`` and ``fraction.png``."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = []
    for friction in LOOSE:
        for seed in (1, 2):
            begin = time.process_time()
            found = friction_angle.loose(law(friction, shape), seed)
            rows.append({"friction": friction, "shape": shape, "seed": seed, **found})
            print(
                f"mu {friction:5.3f} seed {seed}: {found['fraction']:.4f}, {found['coordination']:.2f} contacts, "
                f"{found['mohr_coulomb_deg']:.1f} deg ({time.process_time() - begin:.0f} s)",
                flush=True,
            )
            (out / "fraction.json").write_text(json.dumps(rows, indent=1))
    figure = Figure(figsize=(6, 4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for seed in (1, 2):
        line = [row for row in rows if row["seed"] == seed]
        axes.plot([r["friction"] for r in line], [r["fraction"] for r in line], "o-", ms=4, label=f"seed {seed}")
    axes.set(xlabel="friction mu_s", ylabel="solid fraction in steady shear", title=f"shape {shape:g}")
    axes.legend(frameon=False)
    figure.savefig(out / "fraction.png", dpi=90)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/results/dem_friction_angle"))
    parser.add_argument("--part", choices=("map", "find", "tilt", "rate", "fraction", "all"), default="all")
    parser.add_argument("--shape", type=float, default=0.4)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.part in ("find", "all"):
        find(options.out, options.shape)
    if options.part in ("tilt", "all"):
        tilt(options.out)
    if options.part in ("map", "all"):
        draw_map(options.out)
    if options.part in ("rate", "all"):
        draw_rate(options.out)
    if options.part in ("fraction", "all"):
        draw_fraction(options.out, options.shape)


if __name__ == "__main__":
    main()
