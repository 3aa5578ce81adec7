"""Peak pressure of an ice ball on ice at 18.234 km/s against the planar limit, for both sets of numerics.

    python studies/sph_peak_pressure.py [--json] [--size N] [--threads T] [--only TEXT]

The whole stage on weightless ground; N is the number of spacings along the ball's radius. The planar limit is 111 GPa
(both Hugoniots from ``sph.shock_states.hugoniot``): a particle that has seen more has been overshot.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from matter.case.body import Impact, Layer, Projectile, Target
from matter.compilation import jit
from matter.files import snapshot
from sph import stage
from sph.materials.rows import collect
from sph.shock_states import hugoniot
from sph.stepping.numerics import SETS

RADIUS, SPEED = 1000.0, 18234.0


def settings(spacings: float, **changes) -> stage.Settings:
    """The ball's radius over the spacing is ``spacings``; until the shock has run through the ball."""
    spacing, end = RADIUS / spacings, 0.18
    values = dict(
        target=Target(layers=(Layer(name="ground", material="ice", thickness=2.5 * RADIUS),), shape="half_space",
        width=5.0 * RADIUS),
        impact=Impact(speed=SPEED, angle_from_vertical=0.0, projectile=Projectile(material="ice", radius=RADIUS),
        expected_transient_diameter=4.0 * RADIUS),
        spacing_at_impact=spacing, spacing_far=3.0 * spacing, fine_radius=1.5 * RADIUS, growth=0.2,
        contact_refinement=1.0, contact_radius=1.5 * spacing,
        first_step=1e-7 * spacing, end_time=end, snapshot_interval=end, history_interval=end / 3.0, sides="free",
        floor="free",
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
    for name, fraction in (
        ("ball_median_Pa", 0.5),
        ("ball_nine_tenths_Pa", 0.9),
    ):  # that this share of its mass (equal particles) did not pass
        peaks[name] = float(np.quantile(last.peak_pressure[ball], fraction))
    return {"particles": len(ball), **peaks, "wall_s": time.perf_counter() - begun}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--size", type=float, default=6.0)
    parser.add_argument("--threads", type=int, default=None)
    parser.add_argument("--only", default="", help="rows whose name holds this text")
    options = parser.parse_args(arguments)
    jit.set_threads(options.threads)
    limit = hugoniot.behind(*hugoniot.solid(collect(("ice",)).rows, 0), 0.5 * SPEED).P
    result: dict[str, object] = {"spacings": options.size, "planar_Pa": limit}
    print(f"planar limit {limit / 1e9:.1f} GPa")
    for name in SETS:
        if options.only not in name:
            continue
        row = measured(options.size, numerics=name)
        result[name] = row
        peaks = ", ".join(
            f"{key.removesuffix('_Pa').replace('_', ' ')} {value / 1e9:.1f}"
            for key, value in row.items()
            if key.endswith("_Pa")
        )
        print(f"{name}: {peaks} GPa, {row['particles']:.0f} particles, {row['wall_s']:.0f} s", flush=True)
    if options.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
