"""Profiles through time of two finished shock stages of ``cases/complex_crater``, with and without the block model:
``profiles.png`` and ``measured.json``.

    python studies/complex_crater.py RUN_FLUIDISED RUN_PLAIN --out DIR [--times 20,60,...]

A run that is not finished is measured as far as it went.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from crater.ground.radial_profile import Profile
from crater.results import measurement_config
from matter.errors import InputError
from matter.files import archive, snapshot

TIMES = (20.0, 60.0, 100.0, 150.0, 200.0, 300.0, 400.0, 600.0)
NAMES = (
    "depth_m", "diameter_apparent_m", "diameter_rim_m", "rim_height_m", "depth_rim_to_floor_m", "volume_m3",
    "central_peak_m", "central_peak_diameter_m",
)  # fmt: skip
REACH = 80e3


def measured(run: Path, times: list[float]) -> tuple[list[dict[str, Any]], list[tuple[float, Profile]]]:
    """Rows of measures [SI] and profiles of the snapshots of ``run`` next to the ``times`` [s]; raises ``InputError``
    where there are none."""
    shots = {float(snapshot.attributes(path)["time"]): path for path in snapshot.series(run / "2_sph")}
    if not shots:
        raise InputError(f"{run}/2_sph holds no snapshot")
    chosen = {shots[min(shots, key=lambda t: abs(t - at))]: None for at in times}
    rows, profiles, before = [], [], None
    for path in chosen:
        particles = snapshot.read(path)
        known = measurement_config.of_snapshot(path, particles.attributes)
        if known is None:
            raise InputError(f"{path} does not say how it is measured")
        found = known.measured(particles, before := before or known.ground_before(), path.name)
        values = {name: found[name].value for name in NAMES}
        sigmas = {f"{name}_sigma": found[name].sigma for name in NAMES}
        time = float(particles.attributes["time"])
        shaking = float(particles.vibration[particles.layer >= 0].max()) if "vibration" in particles else 0.0
        rows.append({"time_s": time, **values, **sigmas, "largest_vibration_m_s": shaking})
        profiles.append((time, found.profile))
    return rows, profiles


def draw_profiles(sets: dict[str, list[tuple[float, Profile]]], out: Path) -> None:
    """Both runs' profiles, one panel each."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(len(sets), 1, figsize=(8.0, 6.4), sharex=True, sharey=True)
    for axes, (name, profiles) in zip(panels, sets.items()):
        for k, (time, profile) in enumerate(profiles):
            shown = profile.radius < REACH
            colour = plt.get_cmap("viridis")(0.92 * k / max(len(profiles) - 1, 1))
            axes.plot(profile.radius[shown] / 1e3, profile.height[shown] / 1e3, color=colour, label=f"{time:.0f} s")
        axes.axhline(0.0, color="0.6", lw=0.7)
        axes.set(title=name, ylabel="height [km]", xlim=(0.0, REACH / 1e3))
    panels[0].legend(ncols=2, fontsize=8, loc="lower right")
    panels[-1].set_xlabel("distance from the axis [km]")
    figure.tight_layout()
    figure.savefig(out / "profiles.png", dpi=110)
    plt.close(figure)


def main(arguments: list[str]) -> int:
    """Command line; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("fluidised", type=Path, help="run folder of --preset fluidised")
    parser.add_argument("plain", type=Path, help="run folder without a preset")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--times", default=",".join(f"{t:g}" for t in TIMES), help="seconds, with commas")
    chosen = parser.parse_args(arguments)
    times = [float(text) for text in chosen.times.split(",")]
    chosen.out.mkdir(parents=True, exist_ok=True)
    content, sets = {}, {}
    for key, name, run in (
        ("fluidised", "friction lost while the blocks shake", chosen.fluidised),
        ("plain", "friction as it is", chosen.plain),
    ):
        content[key], sets[name] = measured(run, times)
        for row in content[key]:
            said = {n: row[n] for n in ("time_s", *NAMES)}
            print(key, {n: None if v is None or not np.isfinite(v) else float(f"{v:.4g}") for n, v in said.items()})
    archive.write_json(chosen.out / "measured.json", content)
    draw_profiles(sets, chosen.out)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except InputError as reason:
        print(reason, file=sys.stderr)
        sys.exit(2)
