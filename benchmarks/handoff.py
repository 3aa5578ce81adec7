"""Time and memory of a handoff: a synthetic source with a bowl and a curtain onto a synthetic bed, ledger included.

``python benchmarks/handoff.py [--json] [--size N] [--threads T]``; ``--size`` is the number of source particles (a
third as many grains stay).
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import time
from pathlib import Path

import numpy as np

# run as a script, this file would stand in for the package of the same name
sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != Path(__file__).resolve().parent]


def lattice(radius: float, low: float, high: float, spacing: float, disorder: float, seed: int) -> np.ndarray:
    """A disordered cubic lattice in an upright cylinder."""
    rng = np.random.default_rng(seed)
    n = int(radius / spacing) + 1
    m = int((high - low) / spacing)
    x, y, z = np.meshgrid(np.arange(-n, n + 1), np.arange(-n, n + 1), np.arange(m) + 0.5, indexing="ij")
    points = spacing * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1) + [0.0, 0.0, low]
    points += rng.normal(0.0, disorder * spacing, points.shape)
    return points[np.hypot(points[:, 0], points[:, 1]) < radius]


def source_and_bed(size: int):
    """A source of about ``size`` particles with a hemispherical cavity of radius 1, and a bed whose domain holds a
    third of it."""
    from matter.particles import Particles

    spacing = (np.pi * 2.6**2 * 2.4 / size) ** (1.0 / 3.0)
    points = lattice(2.6, -2.4, 0.0, spacing, 0.15, 1)
    points = points[np.linalg.norm(points, axis=1) > 1.0]
    curtain = lattice(1.5, 0.5, 0.9, 2.0 * spacing, 0.1, 2)
    position = np.concatenate([points, curtain])
    distance = np.maximum(np.linalg.norm(position, axis=1), 0.3)
    velocity = position / distance[:, None] ** 4
    velocity[len(points) :, 2] += 30.0
    n = len(position)
    source = Particles(
        {
            "identity": np.arange(n), "position": position, "velocity": velocity, "mass": np.full(n,
            1000.0 * spacing**3),
            "density": np.full(n, 1000.0), "smoothing_length": np.full(n, 2.0 * spacing), "material": np.zeros(n),
        },
        {"time": 1.0, "materials": ["ice"]},
    )  # fmt: skip
    grain_spacing = (np.pi * 1.9**2 * 2.0 / (size / 3.0)) ** (1.0 / 3.0)
    grains = lattice(1.9, -1.9, 0.4, grain_spacing, 0.05, 3)
    m = len(grains)
    radius = 0.45 * grain_spacing * np.random.default_rng(4).uniform(0.85, 1.15, m)
    bed = Particles(
        {
            "identity": np.arange(m), "position": grains, "velocity": np.zeros((m, 3)),
            "angular_velocity": np.zeros((m, 3)),
            "mass": np.full(m, 1000.0 * grain_spacing**3), "radius": radius, "material": np.zeros(m),
            "species": np.zeros(m),
            "headroom": grains[:, 2] > 0.0, "density": np.full(m, 1000.0), "stiffness": np.full(m, 1e6),
        },
        {
            "frame": "plane", "materials": ["ice"], "species": ["shell"], "residual_speed_over_sqrt_g_r": 0.0,
            "domain": {"radius_m": 1.9, "floor_m": -1.9, "datum_m": 0.0, "top_m": 0.4},
        },
    )  # fmt: skip
    return source, bed


def main() -> None:
    """Run once and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--size", type=int, default=300_000)
    parser.add_argument("--threads", type=int, default=None)
    options = parser.parse_args()
    if options.threads:
        os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = str(options.threads)
    from handoff import stage
    from handoff.source import hydrostatic

    source, bed = source_and_bed(options.size)
    column = hydrostatic.uniform(1.0, 1000.0, 2.0)
    begun, used = time.perf_counter(), time.process_time()
    start, ledger = stage.hand_over(source, bed, column=column)
    seconds, work = time.perf_counter() - begun, time.process_time() - used
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(
        f"{len(source)} particles, {len(bed)} grains in the bed, {len(start)} at the start: {seconds:.1f} s "
        f"({work:.1f} core-s), {peak / 1e9:.2f} GB"
    )
    print(f"beyond the limit: {', '.join(ledger.failures) or 'nothing'}")
    if options.json:
        result = {
            "seconds": seconds,
            "core_seconds": work,
            "peak_bytes": peak,
            "particles": len(source),
            "grains": len(start),
        }
        print(json.dumps(result))


if __name__ == "__main__":
    main()
