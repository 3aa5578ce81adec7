"""What every settled bed leaves: ``bed_report.json``, ``bed.png`` and ``bed.vtkhdf``, and whether it rests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dem.beds.settings import Settings
from dem.contact.columns import MASS, RADIUS, STIFFNESS
from dem.contact.settings import SPECIES
from dem.grains.assembly import Assembly
from matter.errors import Unsound
from matter.files import archive, checkpoint, snapshot
from matter.wording import drawing

RESIDUAL_SPEED = 1e-3
"""Largest rms speed of a settled bed over sqrt(g r)."""
DAMPED_LAYERS = 3.0
"""Width of the damped layer at the side, in mean grain diameters (of flat ground those at the edge)."""


def wave_speed(bed: Assembly) -> float:
    """The largest 2 r sqrt(k / m) of a grain [m/s]: how fast a push runs along a chain of its like."""
    return float(np.max(2.0 * bed.X[:, RADIUS] * np.sqrt(bed.V[:, STIFFNESS] / bed.V[:, MASS])))


def leave(
    bed: Assembly,
    settings: Settings,
    report: dict[str, Any],
    out: Path,
    draw: Callable[[Path], None],
    where: Callable[[], str] = str,
    fields: Mapping[str, np.ndarray] | None = None,
    **attributes: Any,
) -> None:
    """Write report, picture (``draw`` does it into a path) and grains. The ``attributes`` of the snapshot are
    ``frame``, ``materials``, ``domain`` and what else this kind of bed has to say; ``fields`` are further
    ones of the grains, in the order of their identities.

    Raises ``Unsound``, with ``where`` behind it, for a bed that does not rest: all files are written by then.
    """
    known = {
        "time": 0.0,
        "stage": "bed",
        "species": list(SPECIES),
        "contact": {**settings.contact.as_attribute(), "dt_s": bed.dt, "wave_speed_m_s": wave_speed(bed)},
        "packing_fraction": report["packing_fraction"],
        "coordination_number": report["coordination_number"],
        "residual_speed_over_sqrt_g_r": report["free_run_speed_over_sqrt_g_r"],
        "mean_radius_m": bed.mean_radius,
    }
    archive.write_json(out / "bed_report.json", report)
    if drawing.possible("the bed"):
        draw(out / "bed.png")
    grains = bed.particles(known | attributes)
    for name, values in (fields or {}).items():
        grains[name] = values
    snapshot.write(grains, out / "bed.vtkhdf")
    checkpoint.keep_last(out)
    moving = max(report["residual_speed_over_sqrt_g_r"]["rms"], report["free_run_speed_over_sqrt_g_r"])
    if not moving <= RESIDUAL_SPEED:
        raise Unsound(
            f"bed: the rms speed is still {moving:.3g} sqrt(g r) after {report['steps']:.0f} steps (limit "
            f"{RESIDUAL_SPEED:g}){where()}"
        )
