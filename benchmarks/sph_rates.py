"""Speed of the shock stage without gravity: list, state, pairs, step limit and update, full physics, about 60
neighbours.

    python benchmarks/sph_rates.py [--json] [--size N] [--threads T] [--snapshot FILE] [--porous] [--numerics NAME]
    python benchmarks/sph_rates.py --compare --threads 1 --size 30000
        # the pair loop and a whole step of both sets of numerics, in turns

A disordered block of three materials (basalt, water, ice) with strength, damage and explicit flaws, or the particles
of a run's snapshot (``2_sph/snap_0006.vtkhdf``) with the materials that it names. ``--porous``: P-alpha in the ice
(alpha0 = 1.1). A neighbour visit is a directed pair inside the support, counted once per evaluation of the forces.
``--compare`` takes CPU time and the least of many short turns: what else runs on the machine counts little.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from pathlib import Path

import numpy as np

from matter.compilation import jit
from matter.files import snapshot
from sph.bodies import seeding
from sph.bodies import target as bodies
from sph.bodies.particle_cloud import Cloud
from sph.materials.rows import Materials, collect
from sph.materials.settings import Choice
from sph.stepping import timestep
from sph.stepping.environment import Environment
from sph.stepping.integrator import Integrator
from sph.stepping.numerics import SETS, Numerics

ALPHA0, FIRST_STEP = 1.1, 0.02
POROUS_ICE = {"ice": Choice(porosity="p_alpha", p_alpha={"alpha0": ALPHA0})}


def cloud_of(size: int, porous: bool) -> tuple[Cloud, Materials]:
    """A cube of jittered particles, 1 km apart, h for about 60 neighbours."""
    side = round(size ** (1 / 3))
    rng = np.random.default_rng(1)
    position = np.stack(np.meshgrid(*(np.arange(side),) * 3, indexing="ij"), axis=-1).reshape(-1, 3) + rng.uniform(
        -0.25, 0.25, (side**3, 3)
    )
    material = np.minimum((3 * position[:, 2] / side).astype(np.int32).clip(0), 2)
    materials = collect(("basalt", "water", "ice"), POROUS_ICE if porous else None)
    rho = materials.rho0[material] * rng.uniform(1.0, 1.02, len(position))
    body = bodies.Body(
        (position - 0.5 * side) * 1e3,
        rho * 1e9,
        rho,
        np.full(len(position), 2.43e3),
        material.astype(np.int32),
        material.astype(np.int32),
    )
    cloud = Cloud.from_bodies(body)
    cloud.velocity[:] = rng.normal(size=cloud.velocity.shape) * 20.0
    _open_pores(cloud, materials, porous)
    seeding.seed_flaws(cloud, materials, 1)
    return cloud, materials


def cloud_of_snapshot(path: Path, porous: bool) -> tuple[Cloud, Materials]:
    """The particles of a snapshot, in the order of the file's identities mixed up once: what a run leaves sorted is
    sorted anew."""
    shot = snapshot.read(path)
    names = tuple(shot.attributes["materials"])
    materials = collect(names, POROUS_ICE if porous else None)
    body = bodies.Body(
        shot.position,
        shot.mass,
        shot.density,
        shot.smoothing_length,
        shot.material.astype(np.int32),
        shot.layer.astype(np.int32),
    )
    cloud = Cloud.from_bodies(body)
    cloud.velocity[:], cloud.specific_energy[:] = shot.velocity, shot.specific_energy
    cloud.stress[:], cloud.root_damage[:] = shot.deviatoric_stress[:, :5], np.cbrt(shot.damage)
    del body, shot
    _open_pores(cloud, materials, porous)
    seeding.seed_flaws(cloud, materials, 1)
    return cloud, materials


def _open_pores(cloud: Cloud, materials: Materials, porous: bool) -> None:
    """Ice with pores: of the same volume, lighter by alpha0."""
    if not porous:
        return
    ice = cloud.material == materials.names.index("ice")
    cloud.mass[ice] /= ALPHA0
    cloud.density[ice] /= ALPHA0
    cloud.distention[ice] = cloud.initial_distention[ice] = ALPHA0


def begin(cloud: Cloud, materials: Materials, numerics: str) -> Integrator:
    """The first steps."""
    integrator = Integrator(cloud, materials, 1e7, Numerics(numerics=numerics), Environment(self_gravity=False))
    integrator.start()
    for _ in range(3):
        integrator.step_limit.dt = 0.0
        integrator.step(min(integrator.next_step(1e9), FIRST_STEP))
    return integrator


def compared(size: int, porous: bool, turns: int = 15) -> dict[str, dict[str, float]]:
    """CPU time [ns] a neighbour visit of the pair loop alone and of a whole step, the least over turns that alternate
    between the sets; same clouds."""
    found = {name: begin(*cloud_of(size, porous), name) for name in SETS}
    least = {name: {"pair_loop_ns": np.inf, "step_ns": np.inf} for name in SETS}
    for _ in range(turns):
        for name, i in found.items():
            visits = int(i.cloud.neighbours.sum())
            begun = time.process_time()
            i.forces.sum_over_pairs(i.cloud, i.rows, True, i.neighbourhood.pairs, i.damping)
            between = time.process_time()
            i.step(1e-3)
            for key, seconds in (("pair_loop_ns", between - begun), ("step_ns", time.process_time() - between)):
                least[name][key] = min(least[name][key], 1e9 * seconds / visits)
    return least


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--size", type=int, default=200_000)
    parser.add_argument("--threads", type=int, default=None)
    parser.add_argument("--snapshot", type=Path, default=None)
    parser.add_argument("--porous", action="store_true")
    parser.add_argument("--numerics", choices=SETS, default=Numerics().numerics)
    parser.add_argument("--compare", action="store_true", help="both sets of numerics, in turns")
    options = parser.parse_args()
    threads = jit.set_threads(options.threads)
    if options.compare:
        costs = compared(options.size, options.porous)
        for name, cost in costs.items():
            print(
                f"{name:16s} {cost['pair_loop_ns']:.1f} ns a visit in the pair loop, {cost['step_ns']:.1f} in the "
                f"whole step"
            )
        if options.json:
            print(json.dumps(costs))
        return
    begin(*cloud_of(2000, options.porous), options.numerics)  # libraries and compiled kernels are no particle's memory
    if options.snapshot:
        snapshot.read(options.snapshot, only=("neighbours",))  # nor is the library that reads it
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    cloud, materials = (
        cloud_of_snapshot(options.snapshot, options.porous)
        if options.snapshot
        else cloud_of(options.size, options.porous)
    )
    integrator = begin(cloud, materials, options.numerics)
    steps, visits, builds = 20, 0, integrator.neighbourhood.builds
    begun = time.perf_counter()
    for _ in range(steps):
        integrator.step(integrator.next_step(1e9))
        visits += int(cloud.neighbours.sum())
    wall = time.perf_counter() - begun
    n = len(cloud)
    result = {
        "particles": n,
        "threads": threads,
        "mean_neighbours": float(cloud.neighbours.mean()),
        "particle_steps_per_s": n * steps / wall,
        "neighbour_visits_per_s": visits / wall,
        "list_builds_per_step": (integrator.neighbourhood.builds - builds) / steps,
        "bytes_per_particle": (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 / n,
        "limited_by": timestep.REASONS[int(np.argmax(integrator.step_limit.counts))],
    }
    for name, value in result.items():
        print(f"{name:24s} {value:.6g}" if not isinstance(value, str) else f"{name:24s} {value}")
    if options.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
