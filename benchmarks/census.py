"""Speed of the n-body census: entries into Callisto's Hill sphere per second, fast path, weighted estimator, and as
published.

    python benchmarks/census.py [--json] [--size PARTICLES] [--threads T]

``fast`` counts entries; ``tube`` effective ones, (sum w)^2 / sum w^2; ``rkck`` gives the cost of a particle followed
to the end, as in the thesis. The last line printed with ``--json`` is one object; its ``entries_per_s`` is that of
``mode``, ``fast``.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from matter.compilation.jit import set_threads
from nbody.census import census
from nbody.integrators import rkck
from nbody.population import conditions, encounters

PUBLISHED_ENTRIES = 11703  # at Callisto, Winter 2017, table 4


def rate(integrator: str, blocks: int, threads: int) -> dict[str, float]:
    """Wall time of ``blocks`` units of work on ``threads`` threads, kernels warm."""
    population = conditions.population("literal")
    request = census.Request("callisto", population, integrator, 1, 12345)
    system = census.jovian("callisto")
    census.WORKERS[integrator](system, request, 10_000)  # compiled

    def timed(number: int) -> tuple[census.Block, float]:
        before = time.thread_time()
        return census.WORKERS[integrator](system, request, number), time.thread_time() - before

    began = time.perf_counter()
    with ThreadPoolExecutor(threads) as pool:
        done, cpu = zip(*pool.map(timed, range(blocks)))
    wall = time.perf_counter() - began
    entries = census.effective_entries(request, system, encounters.join([block.table for block in done]))
    particles = blocks * conditions.CHUNK
    return {
        "entries_per_s": entries / wall,
        "microseconds_per_particle": 1e6 * wall / particles,
        "cpu_microseconds_per_particle": 1e6 * sum(cpu) / particles,
        "entries_per_particle": entries / particles,
        "published_census_s": PUBLISHED_ENTRIES / (entries / wall),
        "particles": particles,
        "published_census_cpu_s": PUBLISHED_ENTRIES * sum(cpu) / entries,
        "wall_s": wall,
    }


def literal(count: int) -> dict[str, float]:
    """Cost of a particle integrated as published, one thread."""
    population, system = conditions.population("literal"), census.jovian("callisto")
    batch = conditions.batch(system, population, 12345, 0)
    rkck.run(system, batch.part(0, 2), population.duration, 1, screened=False, to_the_end=True)
    began, cpu = time.perf_counter(), time.thread_time()
    flights = rkck.run(system, batch.part(2, 2 + count), population.duration, 1, screened=False, to_the_end=True)
    return {
        "milliseconds_per_particle": 1e3 * (time.perf_counter() - began) / count,
        "cpu_milliseconds_per_particle": 1e3 * (time.thread_time() - cpu) / count,
        "steps_per_particle": float(np.mean(flights.ends[:, 1])),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument(
        "--size", type=int, default=32 * conditions.CHUNK, help="particles for fast; tube takes a quarter"
    )
    parser.add_argument("--threads", type=int, default=None)
    given = parser.parse_args()
    threads = set_threads(given.threads)
    blocks = max(1, round(given.size / conditions.CHUNK))
    fast, tube = rate("fast", blocks, threads), rate("tube", max(1, blocks // 4), threads)
    published = literal(40)
    for name, numbers in (("fast", fast), ("tube", tube)):
        print(
            f"{name}: {numbers['microseconds_per_particle']:.1f} us per particle on {threads} threads "
            f"({numbers['cpu_microseconds_per_particle']:.1f} us of one core), {numbers['entries_per_s']:.1f} "
            f"entries/s, "
            f"the published census ({PUBLISHED_ENTRIES} entries) in {numbers['published_census_s']:.0f} s"
        )
    print(
        f"rkck: {published['milliseconds_per_particle']:.2f} ms per particle to the end "
        f"({published['cpu_milliseconds_per_particle']:.2f} ms of one core), {published['steps_per_particle']:.0f} "
        f"steps"
    )
    if given.json:
        result = {"entries_per_s": fast["entries_per_s"], "mode": "fast", "threads": threads}
        print(json.dumps({**result, "fast": fast, "tube": tube, "rkck": published}))


if __name__ == "__main__":
    main()
