"""Which law files, and which sections of a material's file, a run leaves idle: what its bibliography need not name."""

from __future__ import annotations

from pathlib import Path

from sph.damage import growth
from sph.eos import dispatch as eos
from sph.materials import Materials
from sph.porosity import crush
from sph.porosity import dispatch as porosity
from sph.strength import dispatch as strength

ROOM = Path(__file__).parent


def idle_sources(materials: Materials) -> set[Path]:
    """Files of equations of state, yield, growth, porosity and crush curves that none of the ``materials`` takes."""
    rows = materials.rows
    porous = {int(kind) for kind in rows.porosity if kind > 0}
    crushed = {int(curve) for curve, kind in zip(rows.crush, rows.porosity) if kind == porosity.P_ALPHA}
    idle = _others("eos", eos.LAWS, {int(kind) for kind in rows.eos})
    idle |= _others("strength", strength.LAWS, {int(kind) for kind in rows.strength} | {strength.NONE})
    idle |= _others("damage", tuple(f"growth_{name}" for name in growth.LAWS), {int(kind) for kind in rows.growth})
    idle |= _others("porosity", porosity.LAWS, porous | {porosity.NONE})
    idle |= _others("porosity", tuple(f"crush_{name}" for name in crush.LAWS), crushed)
    if not crushed:
        idle |= {ROOM / "porosity" / "crush.py"}
    if not porous:
        idle |= {ROOM / "porosity" / f"{name}.py" for name in ("dispatch", "compaction_damage")}
    return idle


def _others(folder: str, names: tuple[str, ...], taken: set[int]) -> set[Path]:
    return {ROOM / folder / f"{name}.py" for number, name in enumerate(names) if number not in taken}


def idle_sections(materials: Materials) -> set[tuple[str, str]]:
    """(material, section) of values that belong to laws which this material does not take."""
    rows, idle = materials.rows, set()
    for i, name in enumerate(materials.names):
        taken = {eos.LAWS[rows.eos[i]], strength.LAWS[rows.strength[i]], porosity.LAWS[rows.porosity[i]]}
        taken |= {f"crush_{crush.LAWS[rows.crush[i]]}"} if rows.porosity[i] == porosity.P_ALPHA else set()
        taken |= {"weibull"} if rows.flawed[i] else set()
        sections = {*eos.LAWS, *strength.LAWS, *porosity.LAWS, *(f"crush_{curve}" for curve in crush.LAWS), "weibull"}
        idle |= {(name, section) for section in sections - taken}
    return idle
