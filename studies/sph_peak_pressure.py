"""Peak pressure of an ice ball on ice at 18.234 km/s against the planar limit, for the weights of the sums and for fixed and following supports.

    python studies/sph_peak_pressure.py [--json] [--size N] [--threads T]

The whole stage on weightless ground; N is the number of spacings along the ball's radius. The planar limit is 111 GPa (both Hugoniots from
``sph.eos.hugoniot``): a particle that has seen more has been overshot.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from matter import jit, snapshot
from matter.body import Impact, Layer, Projectile, Target
from sph import stage
from sph.eos import hugoniot
from sph.materials import collect

RADIUS, SPEED = 1000.0, 18234.0


def settings(spacings: float, **changes) -> stage.Settings:
    """The ball's radius over the spacing is ``spacings``; until the shock has run through the ball."""
    spacing, end = RADIUS / spacings, 0.18
    values = dict(
        target=Target(layers=(Layer(name="ground", material="ice", thickness=2.5 * RADIUS),), shape="half_space", width=5.0 * RADIUS),
        impact=Impact(speed=SPEED, angle_from_vertical=0.0, projectile=Projectile(material="ice", radius=RADIUS), expected_transient_diameter=4.0 * RADIUS),
        spacing_at_impact=spacing, spacing_far=3.0 * spacing, fine_radius=1.5 * RADIUS, growth=0.2, contact_refinement=1.0, contact_radius=1.5 * spacing,
        first_step=1e-7 * spacing, end_time=end, snapshot_interval=end, history_interval=end / 3.0, sides="free", floor="free",
    )  # fmt: skip
    return stage.Settings(**(values | changes))


def measured(spacings: float, **changes) -> dict[str, float]:
    """Peak pressures [Pa] of target and ball, and the wall time [s]."""
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        stage.run(settings(spacings, **changes), out, out)
        last = snapshot.read(out / "last.vtkhdf")
    ball = last.layer < 0
    peaks = {"target_Pa": float(last.peak_pressure[~ball].max()), "ball_Pa": float(last.peak_pressure[ball].max())}
    return {"particles": len(ball), **peaks, "wall_s": time.perf_counter() - begun}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--size", type=float, default=6.0)
    parser.add_argument("--threads", type=int, default=None)
    options = parser.parse_args()
    jit.set_threads(options.threads)
    limit = hugoniot.behind(*hugoniot.solid(collect(("ice",)).rows, 0), 0.5 * SPEED).P
    result: dict[str, object] = {"spacings": options.size, "planar_Pa": limit}
    print(f"planar limit {limit / 1e9:.1f} GPa")
    for volumes in ("present", "start"):
        for smoothing in ("fixed", "density"):
            row = measured(options.size, volumes=volumes, smoothing=smoothing)
            result[f"{volumes}, {smoothing}"] = row
            print(f"{volumes:8s} {smoothing:8s} target {row['target_Pa'] / 1e9:6.1f} ball {row['ball_Pa'] / 1e9:6.1f} GPa, {row['particles']:.0f} particles")
    if options.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
