"""Stage 2: the impact as shock physics, from a layered body in balance to the end of the simulated time.

Phases: ``relax`` (no strength, damped, energy held: the particles settle on the hydrostatic profile), then ``impact``
(everything on). Leaves ``target.json``, snapshots with a series index, ``history.csv``, ``last.vtkhdf`` and
``stage_report.json``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from matter import progress
from matter.blocks import block_file, placing
from matter.case.body import Target
from matter.files import archive, checkpoint
from sph import cost_prediction
from sph.bodies import ground as grounds
from sph.bodies import rubble, solid_target
from sph.bodies import target as bodies
from sph.kernels import dispatch as kernels
from sph.materials import used_laws
from sph.materials.rows import Materials
from sph.outcome import stage_report
from sph.settings import Settings
from sph.simulation import Simulation
from sph.stepping import sides_and_floor

BLOCK_FILES = ("../matter/blocks/ellipsoids", "../matter/blocks/placing", "../matter/blocks/size_laws")
"""Files that a target without blocks does not take."""
RECONSTRUCTED_FILES = (
    "pairs/smoothing", "pairs/start_volumes", "pairs/length_terms", "viscosity/reconstructed",
)  # fmt: skip
"""Files that ``numerics = "monaghan"`` does not take."""


def idle_sources(settings: Settings) -> set[Path]:
    """Law files that this run does not take: its bibliography leaves out what only they cite."""
    chosen = {
        **dict.fromkeys(RECONSTRUCTED_FILES, settings.reconstructed),
        **{f"kernels/{name}": settings.kernel == name for name in kernels.FAMILY.names},
        "pairs/gradients": settings.gradients == "corrected",
        "pairs/lattice_gradients": settings.gradients == "normalised",
        "pairs/conductivity": settings.scheme.conducting, "stepping/late": settings.late is not None,
        **dict.fromkeys(BLOCK_FILES, bool(settings.target.blocks)),
        "../matter/geometry/tree": settings.target.attracts,
        "viscosity/morris_monaghan": settings.viscosity_switch == "morris_monaghan",
    }  # fmt: skip
    return (
        used_laws.idle_sources(settings.chosen_materials())
        | sides_and_floor.idle_files(settings)
        | {used_laws.ROOM / f"{name}.py" for name, taken in chosen.items() if not taken}
    )


def idle_sections(settings: Settings) -> set[tuple[str, str]]:
    """Sections (material, title) of material files that this run does not take."""
    return used_laws.idle_sections(settings.chosen_materials())


def predict(settings: Settings) -> dict[str, float]:
    """Wall time [s] (warm kernels, the threads in use), memory and disk [bytes] of this stage, and the sizes that the
    stages after it go by."""
    return cost_prediction.predict(settings)


def explain(settings: Settings) -> list[str]:
    """What the particles are and what the cost follows from, in words."""
    return cost_prediction.explain(settings)


def target_facts(settings: Settings) -> dict[str, Any]:
    """What ``target.json`` will hold. Raises ``InputError`` where the target finds no balance."""
    if settings.target.solid:
        return _with_blocks(_of_solid(settings), settings)
    balance = grounds.hydrostatic if settings.target.flat else bodies.hydrostatic
    materials = settings.chosen_materials()
    return _with_blocks(_facts(settings.target, balance(settings.target, materials=materials), materials), settings)


def _with_blocks(facts: dict[str, Any], settings: Settings) -> dict[str, Any]:
    """The facts, and a hash of ``blocks.h5`` where there is one: a bed is known by ``target.json``, and must have the
    same blocks."""
    found = placing.of_target(settings.target)
    if found is None:
        return facts
    blocks = rubble.listed(settings.target, settings.chosen_materials(), found, settings.zones)
    return {**facts, block_file.DIGEST: block_file.digest(blocks)}


def _of_solid(settings: Settings) -> dict[str, Any]:
    materials = settings.chosen_materials()
    return solid_target.target_json(
        settings.target, float(materials.bulk_density[materials.index(settings.target.layers[0].material)])
    )


def _facts(target: Target, column: bodies.Profile | grounds.Ground, materials: Materials) -> dict[str, Any]:
    return (
        grounds.target_json(target, column)
        if isinstance(column, grounds.Ground)
        else bodies.target_json(target, column, materials)
    )


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Run or resume the stage in the folder ``out``; ``inputs`` is not read: what the encounters have chosen stands in
    ``settings.impact``.

    Raises ``InputError`` (no balance), ``UnphysicalState`` (particle, position, time, values), ``Stopped``.
    """
    job = Simulation(settings, Path(out))
    relaxation = settings.relaxation_time if job.phase == "relax" else 0.0
    report = progress.Progress("sph", job.work(relaxation + settings.end_time))
    archive.write_text(
        job.out / "target.json",
        json.dumps(
            _with_blocks(
                _of_solid(settings) if settings.target.solid else _facts(settings.target, job.column, job.materials),
                settings,
            ),
            indent=1,
        ),
    )
    saved = checkpoint.newest(job.out)
    if saved is None:
        job.begin()
    else:
        job.restore(*saved)
    report.start = job.work((0.0 if job.phase == "relax" else relaxation) + job.integrator.time)
    if job.phase == "relax":
        job.relax(report)
    job.follow_impact(report, relaxation)
    job.finish()
    archive.write_json(job.out / "stage_report.json", stage_report.stage_summary(job))
    checkpoint.keep_last(job.out)
