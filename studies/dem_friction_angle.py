"""The friction angle of grains over friction mu and shape beta: a map, the friction for 30 deg, a second seed, and the
tilted bed.

    python studies/dem_friction_angle.py [--out docs/results/dem_friction_angle] [--part map|find|tilt|all] [--shape
    0.4]

Every measurement is kept where ``dem.friction_angle`` keeps them, so the script goes on where it was stopped. One
measurement takes one to two minutes of one core, a tilt three; the whole script some 50 minutes.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from dem import friction_angle
from dem.contact_settings import Contact, GrainLaw

FRICTIONS = (0.0, 0.15, 0.3, 0.5, 0.8)
SHAPES = (0.0, 0.2, 0.4, 0.8)
WANTED = 30.0


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


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/results/dem_friction_angle"))
    parser.add_argument("--part", choices=("map", "find", "tilt", "all"), default="all")
    parser.add_argument("--shape", type=float, default=0.4)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.part in ("find", "all"):
        find(options.out, options.shape)
    if options.part in ("tilt", "all"):
        tilt(options.out)
    if options.part in ("map", "all"):
        draw_map(options.out)


if __name__ == "__main__":
    main()
