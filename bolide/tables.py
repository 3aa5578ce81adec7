"""What the project knows without a run: materials, and crater sizes by scaling laws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from matter.errors import InputError

if TYPE_CHECKING:
    import pandas


class Materials(Mapping[str, Mapping[str, Mapping[str, Any]]]):
    """Every material by name: its sections by the law that uses them, values in SI.

    >>> materials["ice"]["tillotson"]["rho0"]
    917.0
    >>> "basalt" in materials
    True
    """

    def __getitem__(self, name: str) -> Mapping[str, Mapping[str, Any]]:
        from matter.case import material

        if name not in material.names():
            raise KeyError(f"no material {name!r} (known: {', '.join(material.names())})")
        return material.load(name)

    def __iter__(self) -> Iterator[str]:
        from matter.case import material

        return iter(material.names())

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __repr__(self) -> str:
        return f"bolide.materials: {', '.join(self)}"


materials = Materials()
"""Every material by name."""


def scaling(
    projectile: str,
    radius: float | str,
    speed: float | str,
    target: str,
    gravity: float | str,
    angle_from_vertical: float | str = 0.0,
    ground: str | None = None,
) -> pandas.DataFrame:
    """Transient apparent diameter by scaling laws (``crater.scaling.crater_size``), a row per law.

    ``projectile`` and ``target`` are names of materials, taken with the pores that their files give them; ``radius``,
    ``speed``, ``gravity`` and the angle are SI numbers or texts with units; ``ground``: only the laws for ``fluid``,
    ``rock`` or ``sand``. Raises ``InputError``.

    >>> table = scaling("ice", "50 km", "18 km/s", target="ice", gravity="1.24 m/s^2", ground="fluid")
    >>> (table["diameter_m"] / 1e3).round().astype(int).to_dict()
    {'zahnle_2003': 607, 'collins_2005': 656, 'schmidt_housen_water': 770}
    """
    import pandas

    from crater.scaling import crater_size as laws
    from matter.case import at_rest, quantity

    def si(value: float | str, unit: str, what: str) -> float:
        try:
            return quantity.parse(value, unit) if isinstance(value, str) else float(value)
        except ValueError as reason:
            raise InputError(f"{what}: {reason}") from None

    if ground is not None and ground not in laws.GROUNDS:
        raise InputError(f"no ground {ground!r} (there are {', '.join(laws.GROUNDS)})")
    event = laws.ImpactEvent(
        si(radius, "m", "radius"), si(speed, "m/s", "speed"), si(angle_from_vertical, "rad", "angle_from_vertical"),
        si(gravity, "m/s^2", "gravity"),
        at_rest.of_file(projectile).bulk, at_rest.of_file(target).bulk,
    )  # fmt: skip
    diameters = {
        name: size for name, size in laws.diameters(event).items() if ground is None or name in laws.GROUNDS[ground]
    }
    table = pandas.DataFrame(
        {"law": [laws.NAMES[name] for name in diameters], "diameter_m": list(diameters.values())},
        index=pandas.Index(list(diameters), name="name"),
    )
    table.attrs["units"] = {"diameter_m": "m"}
    return table
