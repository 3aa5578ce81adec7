"""Which files of this room a run leaves idle: what its bibliography need not name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dem.contact.settings import Contact
from dem.laws.dispatch import FAMILIES

ROOM = Path(__file__).parent
ATTRACTION = ROOM.parent / "matter" / "solids" / "attraction.py"
OF_BODIES = {
    ROOM.parent / "matter" / "geometry" / "tree.py",
    ROOM / "grains" / "tide.py",
    ROOM / "beds" / "slopes.py",
    ATTRACTION,
}
"""What only a whole body takes, or a patch of one: gravity between grains (``dem.grains.self_gravity``), tide, slopes;
the attraction at a site."""
SHAKING = ROOM / "laws" / "shaken_friction.py"
"""Taken where the shock stage hands over ground that shakes; that stage then names the same sources."""
PACKING = ("beds/grain_packing.py", "beds/loose_packing.py", "beds/relaxation.py")
"""What only the making of a bed takes."""


def _laws(contact: Contact) -> set[Path]:
    """Contact laws that are not taken, and the shear cell where no friction angle is asked for."""
    taken = {law.__file__ for module in contact.laws() for law in (module, *getattr(module, "RESTS_ON", ()))}
    idle = {
        Path(str(module.__file__)) for family in FAMILIES for module in family.laws if module.__file__ not in taken
    }
    idle.add(SHAKING)
    return idle | (set((ROOM / "trials").glob("*.py")) if contact.friction_angle is None else set())


def of_bed(settings: Any) -> set[Path]:
    """What a bed made with ``settings`` (``dem.beds.stage``) leaves idle."""
    idle = _laws(settings.contact)
    if settings.target.solid and not settings.on_patch:
        # slopes of the whole are held against the friction angle, which is measured
        idle -= set((ROOM / "trials").glob("*.py"))
        idle |= {ROOM / "beds" / "grain_packing.py", ROOM / "beds" / "loose_packing.py", ATTRACTION}
        return idle | (set() if settings.target.companion else {ROOM / "grains" / "tide.py"})
    idle |= OF_BODIES - {ATTRACTION} if settings.on_patch else OF_BODIES
    if settings.packing == "loose":
        return idle - set((ROOM / "trials").glob("*.py"))  # its solid fraction is measured
    idle.add(ROOM / "beds" / "loose_packing.py")
    return idle | ({ROOM / "beds" / "grain_packing.py"} if settings.packing.startswith("hcp") else set())


def of_collapse(settings: Any) -> set[Path]:
    """What a collapse with ``settings`` (``dem.stage``) leaves idle."""
    idle = _laws(settings.contact) | OF_BODIES | {ROOM / name for name in PACKING}
    return idle | {ROOM / "engines" / f"{engine}.py" for engine in ("lammps", "liggghts") if settings.engine != engine}
