"""The same settled bed with the same carved bowl, collapsed by this project, LAMMPS and LIGGGHTS: the profiles side by
side.

    python studies/dem_engines.py RUN [--out FOLDER] [--ranks N] [--seconds T]

RUN is a run folder with ``2_sph/target.json`` and a settled bed (``run_case cases/valhalla_980km --preset tiny --until
bed``). Into the bed a paraboloid is carved (350 km wide, 260 km deep, its rim moving outwards and up at 150 m/s) and
left to collapse for T seconds (2400). LIGGGHTS has no twisting spring: its run is compared with one of our own
without. All runs start without contact history. The grain noise is what a change of the time step by a tenth does to
our own run. Writes ``profiles.csv``, ``profiles.png`` and ``table.json``, and prints the table.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

BOWL, DEPTH, SPEED = 350e3, 260e3, 150.0
RING = 3.0  # width of a ring of the profile, in mean radii


def carve(run: Path, out: Path) -> None:
    """Write ``out`` as a run folder whose handoff is the carved bed."""
    import numpy as np

    from matter.files import snapshot
    from matter.geometry.ground_region import Cone
    from matter.particles import Particles

    bed = snapshot.read(run / "3_bed" / "bed.vtkhdf")
    domain = Cone.of_attribute(bed.attributes["domain"])
    distance = np.linalg.norm(bed.position, axis=1)
    arc = domain.datum * domain.polar_angle(bed.position)
    height = distance - domain.datum
    keep = np.where(arc < BOWL, height < -DEPTH * (1.0 - (arc / BOWL) ** 2), height < 0.0)
    start = bed.select(keep)
    flat = np.hypot(start.position[:, 0], start.position[:, 1])
    outward = (
        np.column_stack([start.position[:, :2] / flat[:, None], np.zeros(len(start))])
        + start.position / distance[keep][:, None]
    )
    start["velocity"] = SPEED * np.exp(-(((arc[keep] - BOWL) / 1e5) ** 2))[:, None] * outward
    for name in ("2_sph", "4_handoff"):
        (out / name).mkdir(parents=True)
    (out / "2_sph" / "target.json").write_bytes((run / "2_sph" / "target.json").read_bytes())
    snapshot.write(
        Particles(dict(start), {**bed.attributes, "time": 0.0, "stage": "handoff"}), out / "4_handoff" / "start.vtkhdf"
    )


def profile(folder: Path, width: float):
    """Mean height of the surface [m] in rings of ``width`` [m] about the axis, from the last snapshot, and the mean
    radius."""
    import numpy as np

    from matter.files import snapshot
    from matter.geometry.ground_region import Cone

    last = snapshot.read(folder / "last.vtkhdf")
    domain = Cone.of_attribute(last.attributes["domain"])
    x = last.position[last["state"] == 0]
    top = np.linalg.norm(x, axis=1) + last.radius[last["state"] == 0] - domain.datum
    radius = float(last.radius.mean())
    flat = 2.0 * domain.datum * np.sin(0.5 * domain.polar_angle(x)) / np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-9)
    column = np.floor(x[:, :2] * flat[:, None] / (2.0 * radius)).astype(int)
    _, of = np.unique(column, axis=0, return_inverse=True)
    of = of.reshape(-1)
    height = np.full(of.max() + 1, -np.inf)
    np.maximum.at(height, of, top)
    where = np.zeros((len(height), 2))
    where[of] = (column + 0.5) * 2.0 * radius
    ring = (np.hypot(where[:, 0], where[:, 1]) / width).astype(int)
    # the outermost rings lie under the edge of the cone
    count = int(0.85 * domain.half_angle * domain.datum / width)
    return np.array([height[ring == k].mean() for k in range(count)]), radius


def main() -> None:
    """Run what is installed and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--out", type=Path, default=Path("docs/results/dem_engines"))
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=2400.0)
    given = parser.parse_args()
    import numpy as np

    from dem import stage
    from dem.contact.settings import Contact, GrainLaw
    from dem.engines import deviations, program
    from matter.errors import InputError

    common = {
        "end_time": given.seconds,
        "latest_time": given.seconds,
        "accept": tuple(deviations.SENTENCES),
        "ranks": given.ranks,
    }
    full, untwisted = Contact(), Contact(shell=GrainLaw(twisting=0.0))
    runs = {
        "native": stage.Settings(contact=full, **common),
        "native, step x 0.9": stage.Settings(contact=full, step_factor=0.9, **common),
        "native, no twist": stage.Settings(contact=untwisted, **common),
        "lammps": stage.Settings(contact=full, engine="lammps", **common),
        "lammps, no twist": stage.Settings(contact=untwisted, engine="lammps", **common),
        "liggghts, no twist": stage.Settings(contact=untwisted, engine="liggghts", **common),
    }
    beside = {
        "native, step x 0.9": "native",
        "native, no twist": "native",
        "lammps": "native",
        "lammps, no twist": "native, no twist",
        "liggghts, no twist": "native, no twist",
    }
    found, table = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        folder_path = Path(folder) / "run"
        carve(given.run, folder_path)
        for name, settings in runs.items():
            out = Path(folder) / name.replace(" ", "_")
            out.mkdir()
            begin = time.perf_counter()
            try:
                if settings.engine != "native":
                    program.find(settings.engine)
                stage.run(settings, folder_path, out)
            except InputError as reason:
                print(f"{name}: left out ({reason})")
                continue
            wall = time.perf_counter() - begin
            report = json.loads((out / "stage_report.json").read_text())
            heights, radius = profile(out, RING * report_radius(folder_path))
            found[name] = heights
            table[name] = {
                "wall_s": round(wall, 1), "steps": report["steps"], "grains": report["grains"],
                "floor_km": round(float(heights[:2].mean()) / 1e3, 2),
                "rim_km": round(float(np.nanmax(heights)) / 1e3, 2), "overlap_max": round(report["overlap_max"], 3),
                "engine": report.get("engine"),
            }  # fmt: skip
            other = beside.get(name)
            if other in found:
                table[name]["beside"] = other
                table[name]["rms_radii"] = round(float(np.sqrt(np.nanmean((heights - found[other]) ** 2)) / radius), 3)
                table[name]["mean_radii"] = round(float(np.nanmean(heights - found[other]) / radius), 3)
            row = table[name]
            print(
                f"{name:22} wall {row['wall_s']:7.1f} s  floor {row['floor_km']:8.2f} km  rim {row['rim_km']:7.2f} km "
                f" "
                f"rms {row.get('rms_radii', 0.0):6.3f} r  mean {row.get('mean_radii', 0.0):6.3f} r  beside "
                f"{row.get('beside', '-')}",
                flush=True,
            )
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "table.json").write_text(json.dumps(table, indent=1) + "\n")
    width = RING * radius
    columns = np.column_stack([(np.arange(len(next(iter(found.values())))) + 0.5) * width, *found.values()])
    np.savetxt(
        given.out / "profiles.csv",
        columns,
        delimiter=",",
        fmt="%.6g",
        header="arc_m," + ",".join(n.replace(", ", " ") for n in found),
        comments="",
    )
    draw_profiles(found, width, given.out / "profiles.png")


def draw_profiles(found: dict, width: float, path: Path) -> None:
    """The profiles in one picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    figure, axes = plt.subplots(figsize=(8.0, 4.0), layout="constrained")
    styles = {
        "native": "k-",
        "native, step x 0.9": "k:",
        "native, no twist": "0.5",
        "lammps": "C0o",
        "lammps, no twist": "C0s",
        "liggghts, no twist": "C1^",
    }
    for name, heights in found.items():
        style = styles[name]
        at = (np.arange(len(heights)) + 0.5) * width / 1e3
        if style == "0.5":
            axes.plot(at, heights / 1e3, color=style, label=name)
        else:
            axes.plot(at, heights / 1e3, style, label=name, mfc="none")
    axes.set_xlabel("distance from the axis along the datum [km]")
    axes.set_ylabel("mean height of the surface [km]")
    axes.legend()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report_radius(folder_path: Path) -> float:
    """Mean radius of the grains [m]."""
    from matter.files import snapshot

    return float(snapshot.read(folder_path / "4_handoff" / "start.vtkhdf").radius.mean())


if __name__ == "__main__":
    main()
