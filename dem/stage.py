"""Stage 5: the collapse of the carved bed, as grains in contact, from the handoff until the profile stops changing."""

from __future__ import annotations

from pathlib import Path

import numba
import numpy as np

from dem import used_contact_laws
from dem.beds import patch, settling
from dem.beds.flat_ground import FlatGround, ground_of
from dem.beds.grain_packing import FRACTION
from dem.beds.layered_body import LayeredBody
from dem.beds.solid_body import SolidBody, is_solid
from dem.collapse import external, whole_body_collapse
from dem.collapse.collapse_run import Collapse
from dem.contact.grain_solid import elastic
from dem.engines import program
from dem.settings import Settings
from dem.trials import friction_angle
from matter.case import at_rest
from matter.files import checkpoint, snapshot
from matter.solids.placed import PATCH
from matter.wording import readable

GRAIN_STEPS_PER_S = 2.2e6
"""Grain steps per second of one thread in a collapse, with lists, looks and output (busy AVX-512 machine; 3.4e6 on a
quiet one)."""
ENGINE_GRAIN_STEPS_PER_S = 0.6e6
"""The same of LAMMPS or LIGGGHTS, per rank (65,000 grains; gravity by formula and walls cost as much as the
contacts)."""
TIME_STEP_S = 0.9
"""Time step of the quick Valhalla bed, for the prediction only."""
EJECTA_SHORTEN = 0.77
"""Time step of a collapse over that of its bed: light ejecta ask for a shorter one (0.78 at Valhalla)."""
APPROACH = 0.6
"""Fastest approach of neighbouring grains at a handoff, over sqrt(g D) (2.5 cm/s of 4.2 for the impactor on Ryugu)."""
BODY_APPROACH = 2.8
"""The same on a body of any shape (9.8 cm/s of 3.5 on an ellipsoid of 110 m, 12 s after the impact)."""

idle_sources = used_contact_laws.of_collapse


def _raised(settings: Settings) -> float | None:
    """Expected step [s] in springs for the speeds handed over (``dem.stiffness.stiffening``), at most the bed's; None
    where springs stay, or nothing is known."""
    target, impact, asked = settings.target, settings.impact, settings.springs_for
    if (
        not (settings.bed_step and settings.bed_radius and target and impact and settings.contact.linear)
        or asked == "bed"
    ):
        return None
    if asked == "auto" and not (target.flat or target.solid) and not _for_weight(settings):
        return None
    fall = np.sqrt(at_rest.surface_gravity(target, settings.densities) * impact.expected_transient_diameter)
    speed = (BODY_APPROACH if target.solid else APPROACH) * fall if asked == "auto" else asked
    contact = settings.contact
    step = (
        np.pi
        / np.sqrt(2.0 * contact.stiffness_factor)
        * contact.static_overlap
        * settings.bed_radius
        / speed
        / contact.steps_per_contact
    )
    return float(min(step, settings.bed_step))


def _for_weight(settings: Settings) -> bool:
    """Whether the step of a bed of a layered sphere is that of softer springs than its material's own."""
    assert settings.target is not None and settings.bed_step is not None and settings.bed_radius is not None
    name = settings.target.layers[-1].material
    own = at_rest.densities_at_rest(name, settings.densities)
    mass = own.bulk / FRACTION * 4.0 / 3.0 * np.pi * settings.bed_radius**3
    stiff = 2.0 * elastic(name, own.solid)[0] * settings.bed_radius
    contact = settings.contact
    return bool(settings.bed_step > np.pi * np.sqrt(0.5 * mass / stiff) / contact.steps_per_contact)


def steps(settings: Settings) -> float:
    """Expected number of steps: ejecta at their softest still shorten the bed's step by a quarter (measured on
    Valhalla's beds)."""
    dt = (
        _raised(settings)
        or settings.bed_step
        or TIME_STEP_S * (20_000 / settings.grains) ** (1.0 / 3.0) / np.sqrt(settings.contact.stiffness_factor)
    )
    dt *= EJECTA_SHORTEN * settings.step_factor
    if not settings.bed_step:
        dt *= 30 / settings.contact.steps_per_contact
    return float((0.85 * settings.end_time + 0.15 * settings.latest_time) / dt)


def predict(settings: Settings) -> dict[str, float]:
    """Wall time with warm kernels [s], memory and disk [bytes]; the step is that of the bed where it is known, else of
    Valhalla's scaled to ``grains``.

    Raises ``InputError`` when the engine's program is not installed.
    """
    n = settings.bed_grains or 0.65 * settings.grains  # without the headroom
    shots = (0.85 * settings.end_time + 0.15 * settings.latest_time) / settings.snapshot_interval
    native = settings.engine == "native"
    if not native:
        program.find(settings.engine)
    rate = (
        GRAIN_STEPS_PER_S * settling.threads_for(settings.grains)
        if native
        else ENGINE_GRAIN_STEPS_PER_S * settings.ranks
    )
    wall = 2.0 + n * steps(settings) / rate + 1e-5 * n * shots
    return {
        "wall_s": wall,
        "memory_bytes": 2.5e8 + 3000.0 * n,
        "disk_bytes": 94.0 * n * (shots + 4),
        "checkpoint_bytes": 720.0 * n,
    }


def explain(settings: Settings) -> list[str]:
    """What the cost follows from, in words."""
    n = settings.bed_grains or 0.65 * settings.grains
    return [
        f"{n:,.0f} grains, {steps(settings):,.0f} steps to end_time = {readable.clock(settings.end_time)} (at most to "
        f"latest_time = "
        f"{readable.clock(settings.latest_time)}): the step follows from the contacts' stiffness and "
        f"steps_per_contact = {settings.contact.steps_per_contact}"
    ]


def threads(settings: Settings) -> int:
    """Threads that the bits of a collapse may depend on (they do from 10,000 grains on)."""
    return numba.get_num_threads() if settings.engine == "native" else 1


def run(settings: Settings, inputs: Path, out: Path) -> None:
    """Run the collapse: ``snap_*.vtkhdf``, ``history.csv``, ``last.vtkhdf``, ``stage_report.json`` in ``out``.

    Raises ``InputError`` when an input file is missing or incomplete, ``UnphysicalState`` when grains overlap beyond
    the limit (the snapshots until then stay), ``Unsound`` at the end when a balance is broken.
    """
    inputs, out = Path(inputs), Path(out)
    settings = settings.model_copy(update={"contact": friction_angle.resolved(settings.contact)})
    start, target = snapshot.read(inputs / "4_handoff" / "start.vtkhdf"), inputs / "2_sph" / "target.json"
    facts, whole = start.attributes.get(PATCH), is_solid(target)
    ground: SolidBody | LayeredBody | FlatGround
    if whole and facts is not None:
        ground = patch.ground_of(facts)
    elif whole:
        whole_body_collapse.check(settings)
        ground = SolidBody.read(target, settings.target)
    else:
        ground = ground_of(target)
    if settings.engine != "native":
        assert not isinstance(ground, SolidBody)
        external.run(settings, start, ground, out)
        return
    collapse = Collapse(settings, start, ground, out)
    saved = checkpoint.newest(out)
    if saved is not None:
        collapse.restore(*saved)
    collapse.advance()
    collapse.finish()
