"""Bulk behaviour of the grains against experiments: column collapse, hopper, heap, and a carved bowl in random and in
hexagonal packing.

    python studies/dem_bulk.py [--out docs/results/dem_bulk] [--part column|hopper|heap|bowl|pictures|all] [--grains
    4000] [--size 1.0]

Each part writes its JSON as it goes and skips what is there already, so the script goes on where it was stopped.
``--size`` multiplies the radius of the columns (grains with its cube). On one core: columns 5 minutes, hoppers 4, heap
1, bowls 1 for 4,000 grains (as N^1.3).
"""

from __future__ import annotations

import argparse
import functools
import json
import time
from pathlib import Path

import numpy as np

from dem.beds import stage
from dem.contact.settings import Contact, GrainLaw
from matter.case.body import Impact, Target
from matter.files import snapshot
from studies.granular import bulk_flows, carved_bowl, collapsed_column

CONTACT = Contact(steps_per_contact=20)
COLUMNS = ((0.5, 32.0), (1.0, 22.0), (2.0, 16.0), (3.0, 14.0), (5.0, 12.0))
BEADS = Contact(steps_per_contact=20, shell=GrainLaw(shape=0.0))
"""Grains of the hopper: spheres without rolling resistance, for which Beverloo's constants stand; the others block a
hole of 8 d."""
HOPPER = (12.0, 16.0)
"""Radius and height of its filling [d]."""
HOLES = (8.0, 10.0, 12.0, 14.0)
SOFT = Contact(steps_per_contact=20, static_overlap=0.1)
"""Grains of the bowls: overlaps at the floor of 0.005 radii, and a step more than twice as long as with
``CONTACT``."""
BOWL_RADIUS, GRAVITY, DENSITY = 20.0, 1.0, 1500.0
CAVITY = (8.0, 12.0)
"""Radius and depth [m] of the cavity in a bowl of 20 m: a rim slope of 72 deg. One of 9 and 8 m (61 deg), too, stands
as it was carved at 4,000 grains."""


class Kept:
    """A table of results in a JSON file, written after every entry."""

    def __init__(self, path: Path):
        self.path = path
        self.rows: dict[str, dict] = json.loads(path.read_text()) if path.is_file() else {}

    def make(self, name: str, function) -> dict:
        """The entry ``name``, made by ``function()`` when it is missing."""
        if name not in self.rows:
            begin = time.process_time()
            self.rows[name] = {**function()._asdict(), "cpu_s": round(time.process_time() - begin, 1)}
            self.path.write_text(json.dumps(self.rows, indent=1))
        print(
            name,
            {
                k: round(v, 4) if isinstance(v, float) else v
                for k, v in self.rows[name].items()
                if not isinstance(v, list)
            },
            flush=True,
        )
        return self.rows[name]


def columns(out: Path, size: float) -> None:
    """Run-out over aspect ratio."""
    kept = Kept(out / "column.json")
    for aspect, radius in COLUMNS:
        made = functools.partial(collapsed_column.column, aspect, radius * size, CONTACT)
        kept.make(f"a={aspect:g} r0={radius * size:g}", made)


def hoppers(out: Path) -> None:
    """Rate over the diameter of the hole, and the exponent of (D - k d) for k from 1.0 to 2.0."""
    kept = Kept(out / "hopper.json")
    full = functools.cache(lambda: bulk_flows.filling(*HOPPER, BEADS))
    rows = [
        kept.make(f"D={hole:g}", lambda hole=hole: bulk_flows.hopper(hole, full(), HOPPER[0], BEADS)) for hole in HOLES
    ]
    hole, rate = np.array([row["hole"] for row in rows]), np.array([row["rate"] for row in rows])
    for k in (1.0, 1.4, 2.0):
        print(f"k = {k}: exponent {np.polyfit(np.log(hole - k), np.log(rate), 1)[0]:.2f}")
    slope, offset = np.polyfit(hole, rate**0.4, 1)
    print(
        f"exponent 2.5: k = {-offset / slope:.2f}, C = {slope**2.5 / np.mean([row['fraction'] for row in rows]):.2f}"
    )


def heap(out: Path) -> None:
    """The angle of repose."""
    Kept(out / "heap.json").make("R=19", lambda: bulk_flows.heap(19.0, CONTACT))


def bowls(out: Path, grains: int, work: Path, packings: tuple[str, ...]) -> None:
    """The carved bowl in both packings, or one."""
    kept = Kept(out / f"bowl_{grains}.json")
    for packing in packings:
        kept.make(packing, lambda packing=packing: one_bowl(packing, grains, work))
    if len(kept.rows) == 2:
        draw_bowls(kept.rows, out / f"bowl_{grains}.png", grains)


def one_bowl(packing: str, grains: int, work: Path) -> carved_bowl.Relaxed:
    """Settle, carve, relax; what was begun in the folder ``work`` goes on."""
    layer = {"name": "soil", "material": "basalt", "thickness": BOWL_RADIUS}
    target = Target.model_validate({"layers": [layer], "shape": "half_sphere", "gravity": GRAVITY})
    shot = {"material": "basalt", "radius": 0.1}
    impact = Impact.model_validate(
        {"speed": 2000.0, "angle_from_vertical": 0.0, "projectile": shot, "expected_transient_diameter": 18.0}
    )
    spread = 0.15 if packing == "rcp" else 0.0
    settings = stage.Settings(
        target=target, impact=impact, contact=SOFT, count=grains, arc_radius=BOWL_RADIUS, shape="bowl",
        packing=packing, radius_spread=spread,
        headroom_fraction=0.1,
    )  # fmt: skip
    run = work / f"bowl_{packing}_{grains}"
    for name in ("2_sph", "3_bed", "relax"):
        (run / name).mkdir(parents=True, exist_ok=True)
    heights = [-BOWL_RADIUS, -1e-3 * BOWL_RADIUS]
    ground = {
        "frame": "plane", "shape": "half_sphere", "depth_m": BOWL_RADIUS, "half_width_m": BOWL_RADIUS,
        "surface_gravity_m_s2": GRAVITY,
        "layers": [{"name": "soil", "material": "basalt", "bottom_m": -BOWL_RADIUS, "top_m": 0.0}],
        "profile": {"height_m": heights, "density_kg_m3": [DENSITY] * 2,
        "pressure_Pa": [-DENSITY * GRAVITY * h for h in heights], "layer": [0, 0]},
    }  # fmt: skip
    (run / "2_sph" / "target.json").write_text(json.dumps(ground))
    if not (run / "3_bed" / "bed.vtkhdf").is_file():
        begin = time.process_time()
        stage.run(settings, run, run / "3_bed")
        print(f"settled: {time.process_time() - begin:.0f} s of CPU", flush=True)
    report = json.loads((run / "3_bed" / "bed_report.json").read_text())
    print(
        {k: report[k] for k in ("grains", "packing_fraction", "coordination_number_bulk", "weight_carried", "steps")},
        flush=True,
    )
    bed = snapshot.read(run / "3_bed" / "bed.vtkhdf")
    return carved_bowl.relax(bed, SOFT, GRAVITY, *CAVITY, out=run / "relax")


def draw_bowls(rows: dict[str, dict], path: Path, grains: int) -> None:
    """Both profiles."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for name, colour in (("rcp", "#b5651d"), ("hcp", "#2f6f9f")):
        row = rows[name]
        axes.plot(row["ring"], row["before"], ":", color=colour, lw=1.0)
        axes.plot(
            row["ring"],
            row["after"],
            "o-",
            color=colour,
            ms=3,
            label=f"{name}: steepest {row['slope_deg']:.1f} deg (carved {row['slope_before_deg']:.0f})",
        )
    axes.axhline(0.0, color="k", lw=0.5)
    axes.set_aspect("equal")
    axes.set_xlabel("distance from the axis [m]")
    axes.set_ylabel("height of the surface [m]")
    axes.set_title(f"Carved bowl of {grains:,} grains, before (dotted) and after", fontsize=10)
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.02, 1.0))  # beside the curves, which fill the box
    figure.savefig(path, dpi=110)


def draw_flows(out: Path) -> None:
    """Columns and hoppers against the experiments."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    rows = list(json.loads((out / "column.json").read_text()).values())
    a = np.linspace(0.3, 6.0, 200)
    left.plot(a, np.where(a < 1.7, 1.24 * a, 1.6 * np.sqrt(a)), "k-", label="Lube et al. 2004")
    left.fill_between(
        a, *(q * np.where(a < 1.7, 1.24 * a, 1.6 * np.sqrt(a)) for q in (0.85, 1.15)), color="k", alpha=0.1, lw=0
    )
    left.plot([r["aspect"] for r in rows], [r["runout"] for r in rows], "o", color="#b5651d", label="grains")
    left.set_xlabel("aspect ratio h / r$_0$")
    left.set_ylabel("run-out (r$_\\infty$ - r$_0$) / r$_0$")
    left.legend(frameon=False)
    rows = list(json.loads((out / "hopper.json").read_text()).values())
    hole = np.linspace(6.0, 16.0, 100)
    right.plot(
        hole,
        bulk_flows.beverloo(hole, float(np.mean([r["fraction"] for r in rows]))),
        "k-",
        label="Beverloo, C = 0.58, k = 1.4",
    )
    right.plot([r["hole"] for r in rows], [r["rate"] for r in rows], "o", color="#b5651d", label="grains")
    right.set_xlabel("hole D / d")
    right.set_ylabel("rate [$\\rho$ d$^3$ (g/d)$^{1/2}$]")
    right.legend(frameon=False)
    figure.savefig(out / "flows.png", dpi=110)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/results/dem_bulk"))
    parser.add_argument("--part", choices=("column", "hopper", "heap", "bowl", "pictures", "all"), default="all")
    parser.add_argument("--grains", type=int, default=4000)
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--packing", choices=("rcp", "hcp"), help="one bowl only")
    parser.add_argument(
        "--work", type=Path, default=Path("runs/dem_bulk"), help="where bowls keep what they need to go on"
    )
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.part in ("column", "all"):
        columns(options.out, options.size)
    if options.part in ("hopper", "all"):
        hoppers(options.out)
    if options.part in ("heap", "all"):
        heap(options.out)
    if options.part in ("bowl", "all"):
        bowls(options.out, options.grains, options.work, (options.packing,) if options.packing else ("rcp", "hcp"))
    if options.part in ("pictures", "all"):
        draw_flows(options.out)


if __name__ == "__main__":
    main()
