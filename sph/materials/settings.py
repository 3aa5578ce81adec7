"""What a case may change of a material: ``[sph.materials.<name>]``.

    [sph.materials.basalt]
    strength = "drucker_prager"
    porosity = "p_alpha"
    predamaged = true

    [sph.materials.basalt.p_alpha]
    alpha0 = 1.5

Keys choose laws; tables named after a law change single values of the material's own section, or bring the whole
section where the material has none.
"""

from __future__ import annotations

import difflib
import typing
from collections.abc import Mapping
from functools import cache
from typing import Any, Literal

from pydantic import Field, TypeAdapter, ValidationError, create_model

from matter.case import material
from matter.case.body import Model
from matter.case.identity_fields import Follows
from matter.case.quantity import Unit
from matter.errors import InputError
from sph.materials.families import FAMILIES

Values = dict[str, str | float | list[str | float]]


class CommonChoice(Model):
    """Keys of a material that a case may set whatever the laws are."""

    predamaged: bool = False
    """Whether the material is fully damaged (D = 1) from the start."""
    elastic: Values | None = None
    """Shear and bulk modulus."""
    tension: Values | None = None
    """The largest tension that the intact material bears: ``cut``."""
    block_model: Values | None = None
    """Friction that broken rock loses while it shakes: ``gamma_eta``, ``gamma_beta``, ``c_vib``, ``v_max``, ``t_off``
    (``sph.strength.block_model``)."""
    inertial_friction: Values | None = None
    """Grains whose friction grows with the rate of strain: ``grain_diameter``, ``I0``, ``ratio``
    (``sph.strength.inertial_friction``)."""
    melting: Values | None = None
    """The ``energy`` at which strength is gone."""
    thermal: Values | None = None
    """Heat capacity, temperature at rest, melting temperature (``sph.materials.temperature``)."""
    weibull: Values | None = None
    """Weibull parameters k and m of the flaws."""


def _laws() -> dict[str, Any]:
    """A key for each family, and a table of values for each of its laws that has any."""
    fields: dict[str, Any] = {}
    for family in FAMILIES:
        names: Any = Literal.__getitem__(family.names)
        about = f"{family.called.capitalize()}; by default the one in the material's file."
        if not family.by_values:
            fields[family.key] = (names | None, Field(None, description=about))
        for title in family.titles:
            fields[title] = (
                Values | None,
                Field(
                    None,
                    description=f"Values of the {family.called} ``{title}`` instead of those in the material's file.",
                ),
            )
    return fields


Choice: type[CommonChoice] = create_model(
    "Choice", __base__=CommonChoice, __doc__="The laws of one material and values of their parameters.", **_laws()
)
"""The laws of one material and values of their parameters; what is left out is as in the material's file."""

AS_PUBLISHED = Choice()


def law_of(name: str, family: str, default: str, choice: CommonChoice = AS_PUBLISHED) -> str:
    """The law that a material takes in a family (``"strength"``): the case's, the file's, or the default."""
    return getattr(choice, family, None) or material.choices(name).get(family, default)


def has_section(name: str, title: str, choice: CommonChoice = AS_PUBLISHED) -> bool:
    """Whether the material's file or the case has the section."""
    return title in material.load(name) or bool(getattr(choice, title, None))


def parameters(law: type, name: str, title: str, choice: CommonChoice = AS_PUBLISHED) -> Any:
    """The validated ``Parameters`` of a law for the material ``name``; raises ``InputError`` saying what does not
    fit."""
    changes: Mapping[str, Any] = getattr(choice, title, None) or {}
    content = _of_file(name, title) if title in material.load(name) or not changes else {}
    values = {**content, **changes}
    faults = [f"{key}: the unit is missing" for key, value in values.items() if _lacks_unit(law, key, value)]
    faults += [f"{key}: {_SAID_BY[key]} says it, not a key here" for key in _following(law) & {*values}]
    try:
        values = _validator(law).validate_python(values)
    except ValidationError as reason:
        faults += [_worded(law, e) for e in reason.errors()]
    if faults:
        raise InputError(f"material {name!r}, [{title}]: {'; '.join(faults)}")
    return values


_SAID_BY = {"melt_energy": "[melting] energy", "temperature": "[thermal] temperature"}


@cache
def _following(law: type) -> set[str]:
    """The values of a law that other tables of the material say."""
    hints = typing.get_type_hints(law, include_extras=True)
    return {key for key, hint in hints.items() if Follows() in getattr(hint, "__metadata__", ())}


@cache
def _validator(law: type) -> TypeAdapter[Any]:
    """Building one takes ten times as long as what it then does, and a case asks for each a hundred times."""
    return TypeAdapter(law)


def _of_file(name: str, title: str) -> dict[str, Any]:
    """A section of the material's file, its values as the texts that stand there: the law says whether a unit is one
    of theirs."""
    texts = material.written(name, title)
    return {key: value if key == "file" else texts[key] for key, value in material.section(name, title).items()}


def _worded(law: type, entry: Any) -> str:
    key = ".".join(map(str, entry["loc"]))
    names = list(getattr(law, "_fields", getattr(law, "model_fields", ())))
    match entry["type"]:
        case "missing" | "missing_argument":
            return f"{key} is missing"
        case "extra_forbidden" | "unexpected_keyword_argument":
            near = difflib.get_close_matches(key, names, n=1)
            return f"{key}: unknown{f', did you mean {near[0]!r}?' if near else ''} (known: {', '.join(names)})"
        case "value_error":
            return f"{key}: {entry['ctx']['error']}"
        case "float_parsing":
            return f"{key}: {entry['input']!r} is not a plain number, which it has to be (no unit)"
        case _:
            return f"{key}: {entry['msg']}"


def _has_unit(annotation: Any) -> bool:
    return any(
        isinstance(item, Unit) or _has_unit(item)
        for item in (*typing.get_args(annotation), *getattr(annotation, "__metadata__", ()))
    )


def _lacks_unit(law: type, key: str, value: Any) -> bool:
    hint = typing.get_type_hints(law, include_extras=True).get(key)
    return _has_unit(hint) and any(
        not isinstance(item, str) for item in (value if isinstance(value, list) else [value])
    )
