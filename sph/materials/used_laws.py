"""Which law files, and which sections of a material's file, a run leaves idle: what its bibliography need not name."""

from __future__ import annotations

from pathlib import Path

from sph.materials.families import FAMILIES
from sph.materials.rows import Materials, taken
from sph.porosity import crush
from sph.porosity import dispatch as porosity

ROOM = Path(__file__).parent.parent


def idle_sources(materials: Materials) -> set[Path]:
    """Files of laws that none of the ``materials`` takes."""
    kinds = [taken(materials.rows, i) for i in range(len(materials.names))]
    idle: set[Path] = set()
    for family in FAMILIES:
        idle |= family.idle_files({kind[family.key] for kind in kinds})
    if all(kind[crush.FAMILY.key] < 0 for kind in kinds):
        idle |= {ROOM / "porosity" / "crush.py"}
    if not any(materials.rows.flawed):
        idle |= {ROOM / "damage" / "grady_kipp.py"}
    if not materials.inertial:
        idle |= {ROOM / "strength" / "inertial_friction.py"}
    if not materials.vibrate:
        idle |= {ROOM / "strength" / "block_model.py"}
    if all(kind[porosity.FAMILY.key] == 0 for kind in kinds):
        idle |= {ROOM / "porosity" / f"{name}.py" for name in ("dispatch", "compaction_damage")}
    return idle


def idle_sections(materials: Materials) -> set[tuple[str, str]]:
    """(material, section) of values that belong to laws which this material does not take."""
    idle = set()
    for i, name in enumerate(materials.names):
        kinds = taken(materials.rows, i)
        used = {family.title(law) for family in FAMILIES if (law := family.module(kinds[family.key])) is not None}
        used |= {"weibull"} if materials.rows.flawed[i] else set()
        sections = {title for family in FAMILIES for title in family.titles} | {"weibull"}
        idle |= {(name, section) for section in sections - used}
    return idle
