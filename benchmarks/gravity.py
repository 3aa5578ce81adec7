"""Speed and error of the tree gravity.

python benchmarks/gravity.py [--json] [--size N] [--threads T]
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

from matter.compilation import jit
from matter.geometry import tree


def main() -> None:
    """Measure and print: seconds per evaluation (median of 5), rms error against the direct sum at 400 particles."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--size", type=int, default=300_000)
    parser.add_argument("--threads", type=int, default=None)
    parser.add_argument("--theta", type=float, default=0.5)
    options = parser.parse_args()
    threads = jit.set_threads(options.threads)
    rng = np.random.default_rng(1)
    n = options.size
    x = rng.normal(size=(n, 3))
    x *= (2.1e6 * rng.random(n) ** (1 / 3) / np.linalg.norm(x, axis=1))[:, None]
    m = rng.uniform(0.9, 1.1, n) * 8.5e22 / n
    eps = np.full(n, 0.5 * (4 / 3 * np.pi / n) ** (1 / 3) * 2.1e6)
    g = tree.gravity(x, m, eps, options.theta)
    times = []
    for _ in range(5):
        begun = time.perf_counter()
        tree.gravity(x, m, eps, options.theta)
        times.append(time.perf_counter() - begun)
    picked = rng.integers(0, n, 400)
    exact = np.empty((len(picked), 3))
    for k, i in enumerate(picked):
        d = x - x[i]
        exact[k] = tree.G * (m / ((d**2).sum(axis=1) + eps[i] ** 2) ** 1.5) @ d
    error = np.sqrt(((g[picked] - exact) ** 2).sum(axis=1).mean() / (exact**2).sum(axis=1).mean())
    result = {
        "particles": n,
        "threads": threads,
        "theta": options.theta,
        "seconds_per_evaluation": float(np.median(times)),
        "rms_relative_error": float(error),
    }
    for name, value in result.items():
        print(f"{name:24s} {value:.6g}")
    if options.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
