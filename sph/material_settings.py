"""What a case may change of a material: ``[sph.materials.<name>]``.

    [sph.materials.basalt]
    strength = "drucker_prager"
    porosity = "p_alpha"
    predamaged = true

    [sph.materials.basalt.p_alpha]
    alpha0 = 1.5

Keys choose laws; tables named after a law change single values of the material's own section, or bring the whole section where the material has none.
"""

from __future__ import annotations

import typing
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from matter import material
from matter.body import Model
from matter.errors import InputError
from matter.quantity import Unit

Values = dict[str, str | float | list[str | float]]


class Choice(Model):
    """The laws of one material and values of their parameters; what is left out is as in the material's file."""

    eos: Literal["tillotson", "murnaghan", "ideal_gas"] | None = None
    """Equation of state (``sph/eos``)."""
    strength: Literal["none", "von_mises", "drucker_prager", "collins"] | None = None
    """Yield law (``sph/strength``)."""
    porosity: Literal["none", "p_alpha", "strain_alpha"] | None = None
    """Law of the pores (``sph/porosity``)."""
    crush: Literal["quadratic", "two_power", "table"] | None = None
    """Crush curve of ``porosity = "p_alpha"``."""
    crush_form: Literal["pressure", "density"] | None = None
    """Whether crushing goes by the pressure of the particle or by its density alone."""
    damage: Literal["none", "cube_root", "single", "linear", "weibull", "fraction"] | None = None
    """How damage grows from flaws (``sph/damage``)."""
    predamaged: bool = False
    """Whether the material is fully damaged (D = 1) from the start."""
    tillotson: Values | None = None
    """Values of the equation of state ``tillotson``."""
    murnaghan: Values | None = None
    """Values of the equation of state ``murnaghan``."""
    ideal_gas: Values | None = None
    """Values of the ideal gas."""
    elastic: Values | None = None
    """Elastic moduli."""
    tension: Values | None = None
    """The largest tension that the intact material bears."""
    von_mises: Values | None = None
    """Values of the yield law ``von_mises``."""
    drucker_prager: Values | None = None
    """Values of the yield law ``drucker_prager``."""
    collins: Values | None = None
    """Values of the yield law ``collins`` (rock, intact and broken)."""
    weibull: Values | None = None
    """Weibull distribution of flaws."""
    p_alpha: Values | None = None
    """Values of the P-alpha law of the pores."""
    strain_alpha: Values | None = None
    """Values of the epsilon-alpha law of the pores."""
    crush_quadratic: Values | None = None
    """Values of the crush curve ``quadratic``."""
    crush_two_power: Values | None = None
    """Values of the crush curve ``two_power``."""
    crush_table: Values | None = None
    """Points of the crush curve ``table``."""


AS_PUBLISHED = Choice()


def law_of(name: str, family: str, default: str, choice: Choice = AS_PUBLISHED) -> str:
    """The law that a material takes in a family (``"strength"``): the case's, the file's, or the default."""
    return getattr(choice, family) or material.choices(name).get(family, default)


def has_section(name: str, title: str, choice: Choice = AS_PUBLISHED) -> bool:
    """Whether the material's file or the case has the section."""
    return title in material.load(name) or bool(getattr(choice, title, None))


def parameters(law: type, name: str, title: str, choice: Choice = AS_PUBLISHED) -> Any:
    """The validated ``Parameters`` of a law for the material ``name``; raises ``InputError`` saying what does not fit."""
    changes: Mapping[str, Any] = getattr(choice, title, None) or {}
    content = dict(material.section(name, title)) if title in material.load(name) or not changes else {}
    faults = [f"{key}: the unit is missing" for key in changes if _lacks_unit(law, key, changes[key])]
    try:
        made: Any = TypeAdapter(law).validate_python({**content, **changes})
    except ValidationError as reason:
        faults += [f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in reason.errors()]
    if faults:
        raise InputError(f"material {name!r}, [{title}]: {'; '.join(faults)}")
    return made


def _has_unit(annotation: Any) -> bool:
    return any(isinstance(item, Unit) or _has_unit(item) for item in (*typing.get_args(annotation), *getattr(annotation, "__metadata__", ())))


def _lacks_unit(law: type, key: str, value: Any) -> bool:
    hint = typing.get_type_hints(law, include_extras=True).get(key)
    return _has_unit(hint) and any(not isinstance(item, str) for item in (value if isinstance(value, list) else [value]))
