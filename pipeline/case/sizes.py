"""``--size``: how many particles and grains a run aims at, whatever the case says of its resolution; everything else
stays as the case has it."""

from __future__ import annotations

from typing import Any

from matter.errors import InputError
from pipeline.case import stages

SIZES = {"quick": 20_000, "standard": 300_000, "fine": 1_400_000}
"""Minutes, hours and days on two cores."""
NUMBER = {"sph": "particles", "bed": "count"}
"""The key of each stage that holds the number."""
RESOLUTION = {
    "sph": (
        "spacing_at_impact", "spacing_far", "fine_radius", "growth", "contact_refinement", "contact_radius",
        "projectile_particles", "edge_width",
    ),
    "bed": (),
}  # fmt: skip
"""Keys that a size replaces: they would fix the number of particles, or belong to another one."""


def at_size(document: dict[str, Any], size: str) -> dict[str, Any]:
    """The document of a case at a size: its own resolution taken out, the numbers put in. Raises ``InputError`` for an
    unknown size."""
    if size not in SIZES:
        raise InputError(f"no size {size!r}{stages.nearest(size, list(SIZES))} (there are {', '.join(SIZES)})")
    document = dict(document)
    for stage, key in NUMBER.items():
        table = document.get(stage, {})
        if stage == "bed" and not table:  # its table would ask for the stage: the default is that of the size
            continue
        if isinstance(table, dict):
            document[stage] = {
                **{name: value for name, value in table.items() if name not in RESOLUTION[stage]},
                key: SIZES[size],
            }
    return document
