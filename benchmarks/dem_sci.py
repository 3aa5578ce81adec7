"""The late stage of a small impact on Ryugu: native with every economy switched on, against fixed stiffness on
LIGGGHTS.

    python benchmarks/dem_sci.py --out runs/dem_sci            # bed, then the native run: goes on where it was stopped
    python benchmarks/dem_sci.py --out runs/dem_sci --rates
        # afterwards, on a quiet machine: steps per second of both, and the ratio
    python benchmarks/dem_sci.py --out runs/small --grains 4000 --duration 60 --fixed
        # springs that stay as they are: to compare with

A bowl of 22 m radius (10,000 grains unless told otherwise, bulk density 1190 kg/m^3) under 1.2e-4 m/s^2 has the flow
of Maxwell's Z-model (Z = 3): 1 m/s at the centre, u_r = 1 m/s (``CORE`` / r)^3 farther out, u_theta = u_r sin(theta) /
(1 + cos(theta)), theta from straight down (Maxwell 1977, eqs 1-2). Followed for 600 s.

The bed settles in springs for its weight; the collapse begins in springs that 1 m/s overlaps by 1 % of a radius
(``springs_for``). The native run has following stiffness and free flight; LIGGGHTS steps what the
native engine still has in its search, with the step of the start, in stretches at four times.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from dem import stage
from dem.beds import bed_walls
from dem.beds import stage as bed_stage
from dem.collapse import external
from dem.contact.gravity import Field
from dem.contact.settings import Contact
from dem.engines import program
from dem.engines.scene import Plan, Scene
from dem.grains.assembly import Assembly
from dem.stiffness.stiffening import springs_for
from matter.case.body import Impact, Target
from matter.errors import Stopped
from matter.files import snapshot
from matter.geometry.ground_region import Upright
from matter.particles import Particles

BOWL, GRAVITY, DENSITY, SPEED = 22.0, 1.2e-4, 1190.0, 1.0
CORE = 2.2
"""Distance from the centre [m] within which the flow has its largest speed."""
CONTACT = Contact(static_overlap=0.01)
STRETCHES = (0.0, 10.0, 60.0, 300.0)
SKINS, STEPS, WARM, ROUNDS = (0.02, 0.05, 0.1, 0.25), 300, 50, 3


def settled(grains: int, run: Path) -> Particles:
    """The settled bed without its headroom."""
    layer = {"name": "soil", "material": "basalt", "thickness": BOWL}
    target = Target.model_validate({"layers": [layer], "shape": "half_sphere", "gravity": GRAVITY})
    shot = {"material": "copper", "radius": 0.065}
    impact = Impact.model_validate(
        {"speed": 2000.0, "angle_from_vertical": 0.0, "projectile": shot, "expected_transient_diameter": 14.5}
    )
    settings = bed_stage.Settings(
        target=target,
        impact=impact,
        contact=CONTACT,
        count=grains,
        arc_radius=BOWL,
        shape="bowl",
        headroom_fraction=0.0,
    )
    for name in ("2_sph", "3_bed", "4_handoff", "5_dem"):
        (run / name).mkdir(parents=True, exist_ok=True)
    heights = [-BOWL, -1e-3 * BOWL]
    ground = {
        "frame": "plane", "shape": "half_sphere", "depth_m": BOWL, "half_width_m": BOWL,
        "surface_gravity_m_s2": GRAVITY,
        "layers": [{"name": "soil", "material": "basalt", "bottom_m": -BOWL, "top_m": 0.0}],
        "profile": {"height_m": heights, "density_kg_m3": [DENSITY] * 2,
        "pressure_Pa": [-DENSITY * GRAVITY * h for h in heights], "layer": [0, 0]},
    }  # fmt: skip
    (run / "2_sph" / "target.json").write_text(json.dumps(ground))
    if not (run / "3_bed" / "bed.vtkhdf").is_file():
        bed_stage.run(settings, run, run / "3_bed")
    bed = snapshot.read(run / "3_bed" / "bed.vtkhdf")
    below = bed.select(bed.headroom == 0)
    below.tables.update(bed.tables)
    return below


def flow(position: np.ndarray) -> np.ndarray:
    """Velocity [m/s] (n, 3) of the Z-model about the origin."""
    r = np.maximum(np.linalg.norm(position, axis=1), 1e-9)
    across = np.hypot(position[:, 0], position[:, 1])
    outward = np.divide(
        position[:, :2], across[:, None], out=np.zeros((len(position), 2)), where=across[:, None] > 0.0
    )
    cos, sin = -position[:, 2] / r, across / r
    radial = SPEED * np.minimum(1.0, CORE / r) ** 3
    turning = radial * sin / (1.0 + cos)  # towards larger theta: up and outwards
    # at the surface both are equal: half the square of the speed each
    velocity = np.empty((len(position), 3))
    velocity[:, :2] = (radial * sin + turning * cos)[:, None] * outward
    velocity[:, 2] = -radial * cos + turning * sin
    return velocity


def settings(duration: float, economies: bool = True) -> stage.Settings:
    """The collapse of this benchmark."""
    return stage.Settings(
        contact=CONTACT, end_time=duration, latest_time=duration, snapshot_interval=10.0, history_interval=2.0,
        still_interval=duration,
        stiffness="following" if economies else "fixed", springs_for=SPEED,
    )  # fmt: skip


def run_native(grains: int, duration: float, run: Path, economies: bool = True) -> None:
    """Bed, flow, collapse; ``clock.json`` adds up the seconds of every part of it."""
    if (run / "5_dem" / "stage_report.json").is_file():
        return
    bed = settled(grains, run)
    bed["velocity"] = flow(bed.position)
    bed.attributes.update(time=0.0, stage="handoff")
    snapshot.write(bed, run / "4_handoff" / "start.vtkhdf")
    kept = run / "clock.json"
    clock = json.loads(kept.read_text()) if kept.is_file() else {"wall_s": 0.0, "cpu_s": 0.0}
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        stage.run(settings(duration, economies), run, run / "5_dem")
    finally:
        clock = {
            "wall_s": clock["wall_s"] + time.perf_counter() - wall,
            "cpu_s": clock["cpu_s"] + time.process_time() - cpu,
        }
        kept.write_text(json.dumps(clock))


def at(run: Path, moment: float) -> Particles:
    """The snapshot nearest to ``moment`` [s], without grains that have left or fly, or came back into another, which
    springs of full stiffness throw."""
    paths = list(snapshot.series(run / "5_dem"))
    times = [float(snapshot.read(path).attributes["time"]) for path in paths]
    grains = snapshot.read(paths[int(np.argmin(np.abs(np.array(times) - moment)))])
    if "state" in grains:
        grains = grains.select(grains.state == 0)
    pairs = cKDTree(grains.position).query_pairs(2.0 * float(grains.radius.max()), output_type="ndarray")
    r1, r2 = grains.radius[pairs[:, 0]], grains.radius[pairs[:, 1]]
    deep = r1 + r2 - np.linalg.norm(
        grains.position[pairs[:, 0]] - grains.position[pairs[:, 1]], axis=1
    ) > 0.02 * np.minimum(r1, r2)
    keep = np.ones(len(grains), dtype=bool)
    keep[pairs[deep, 0]] = False
    return grains.select(keep)


def liggghts_rate(grains: Particles, box: Upright, dt: float, skin: float, ranks: int) -> float:
    """Steps per second of LIGGGHTS on these grains, by its own clock."""
    scene = Scene(
        grains, CONTACT, bed_walls.walls(box)[:1], Field.constant((0.0, 0.0, -GRAVITY)), dt, 1.1 * BOWL, skin=skin
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        external.ENGINES["liggghts"].write(scene, Plan(WARM + STEPS, STEPS, dumps=False, settle=WARM), path, "in.deck")
        if program.start("liggghts", "in.deck", ranks, path, "log").wait() != 0:
            raise SystemExit(f"liggghts: {program.complaint(path, 'log')}")
        seconds = re.findall(rb"Loop time of ([0-9.e+-]+)", (path / "log").read_bytes())
    return STEPS / float(seconds[-1])


def native_rate(grains: Particles, box: Upright, threads: int) -> float:
    """Steps per second of the native engine on the same grains, fixed stiffness."""
    bed = Assembly(
        grains, CONTACT, bed_walls.walls(box), Field.constant((0.0, 0.0, -GRAVITY)), threads=threads, skin=0.3
    )
    for _ in range(WARM):
        bed.step()
    begin = time.perf_counter()
    for _ in range(STEPS):
        bed.step()
    return STEPS / (time.perf_counter() - begin)


def rates(run: Path, ranks: int) -> dict:
    """Both engines at the four times; the hours of a whole run at fixed stiffness, and what the native run took."""
    start = snapshot.read(run / "4_handoff" / "start.vtkhdf")
    box = Upright.of_attribute(start.attributes["domain"])
    start["stiffness"] = start.stiffness * springs_for(SPEED, start, CONTACT, sphere=False).factor
    stiff, dt = float(start.stiffness.mean()), CONTACT.time_step(start)
    report = json.loads((run / "5_dem" / "stage_report.json").read_text())
    duration = float(snapshot.read(run / "5_dem" / "last.vtkhdf").attributes["time"])
    kept = run / "stretches.json"
    rows = json.loads(kept.read_text()) if kept.is_file() else []
    for moment in [t for t in STRETCHES if t < duration][len(rows) :]:
        grains = at(run, moment)
        grains["stiffness"] = np.full(len(grains), stiff)
        inside = np.linalg.norm(grains.position, axis=1) < 1.09 * BOWL
        grains = grains.select(inside)
        skin = max(SKINS, key=lambda s, grains=grains: liggghts_rate(grains, box, dt, s, ranks))
        peer = statistics.median(liggghts_rate(grains, box, dt, skin, ranks) for _ in range(ROUNDS))
        own = statistics.median(native_rate(grains, box, ranks) for _ in range(ROUNDS))
        rows.append(
            {
                "time_s": moment,
                "grains": len(grains),
                "liggghts_steps_per_s": peer,
                "skin_radii": skin,
                "native_fixed_steps_per_s": own,
            }
        )
        print(rows[-1], flush=True)
        kept.write_text(json.dumps(rows))
    # the time between two stretches goes at the mean of their costs
    edges = [*(row["time_s"] for row in rows), duration]
    cost = [1.0 / row["liggghts_steps_per_s"] for row in rows]
    cost.append(cost[-1])
    peer_s = sum(0.5 * (cost[k] + cost[k + 1]) * (edges[k + 1] - edges[k]) / dt for k in range(len(rows)))
    clock = json.loads((run / "clock.json").read_text())
    return {
        "grains": len(start), "duration_s": duration, "dt_fixed_s": dt, "steps_fixed": duration / dt,
        "steps_native": report.get("steps"), "ranks": ranks,
        "stretches": rows, "liggghts_hours": peer_s / 3600.0, "native_hours": clock["wall_s"] / 3600.0,
        "native_cpu_hours": clock["cpu_s"] / 3600.0,
        "times_faster": peer_s / clock["wall_s"], "times_faster_by_cpu": peer_s * ranks / clock["cpu_s"],
    }  # fmt: skip


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--grains", type=int, default=10_000)
    parser.add_argument("--duration", type=float, default=600.0, help="simulated seconds")
    parser.add_argument("--rates", action="store_true", help="time both engines on the snapshots of the finished run")
    parser.add_argument("--fixed", action="store_true", help="springs that stay as they are")
    parser.add_argument("--ranks", type=int, default=0, help="0: all cores")
    given = parser.parse_args()
    if given.rates:
        found = rates(given.out, given.ranks or len(os.sched_getaffinity(0)))
        (given.out / "dem_sci.json").write_text(json.dumps(found, indent=1))
        print(json.dumps(found, indent=1))
        return
    try:
        run_native(given.grains, given.duration, given.out, not given.fixed)
    except Stopped:
        print("stopped: the same command goes on")


if __name__ == "__main__":
    main()
