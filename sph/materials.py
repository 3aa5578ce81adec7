"""The materials of one run as arrays that compiled loops read: one row per material, zero where a law does not apply."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from matter.errors import InputError
from matter.quantity import PositivePressure, Pressure
from sph.damage import grady_kipp, growth
from sph.eos import dispatch as eos
from sph.material_settings import AS_PUBLISHED, Choice, has_section, law_of, parameters
from sph.porosity import crush, crush_table, p_alpha, strain_alpha
from sph.porosity import dispatch as porosity
from sph.strength import dispatch as strength
from sph.strength import drucker_prager


class Elastic(NamedTuple):
    """Shear and bulk modulus [Pa]."""

    shear_modulus: Annotated[Pressure, Field(ge=0)]
    bulk_modulus: PositivePressure


class Tension(NamedTuple):
    """The largest tension that the intact material bears [Pa]."""

    cut: Annotated[Pressure, Field(ge=0)]


class Rows(NamedTuple):
    """What the compiled loops read; (m,) or (m, k) arrays over the materials."""

    eos: np.ndarray  # index into sph.eos.dispatch.LAWS
    eos_row: np.ndarray  # (m, 10), rho0 first
    rho0: np.ndarray  # density of the solid at rest [kg/m^3]
    least_c2: np.ndarray  # floor of the squared sound speed [m^2/s^2]
    shear: np.ndarray  # shear modulus [Pa]
    bulk: np.ndarray  # bulk modulus [Pa]
    strength: np.ndarray  # index into sph.strength.dispatch.LAWS
    strength_row: np.ndarray  # (m, 6)
    tension: np.ndarray  # the tension that the intact material bears [Pa], >= 0
    young: np.ndarray  # Young's modulus [Pa]
    crack_speed: np.ndarray  # [m/s]
    growth: np.ndarray  # index into sph.damage.growth.LAWS, -1 where nothing breaks
    flawed: np.ndarray  # 1 where flaws are seeded
    porosity: np.ndarray  # index into sph.porosity.dispatch.LAWS
    pores: np.ndarray  # (m, 5), alpha0 first
    alpha0: np.ndarray  # initial distention, 1 without pores
    crush: np.ndarray  # index into sph.porosity.crush.LAWS
    crush_row: np.ndarray  # (m, 65)


@dataclass(frozen=True)
class Materials:
    """Names of the materials of a run, their rows, and what the case changed of them."""

    names: tuple[str, ...]
    rows: Rows
    choices: Mapping[str, Choice]

    @property
    def rho0(self) -> np.ndarray:
        """Density of the solid at rest [kg/m^3], (m,)."""
        return self.rows.rho0

    @property
    def bulk_density(self) -> np.ndarray:
        """Density at rest with its pores, rho0 / alpha0 [kg/m^3], (m,)."""
        return self.rows.rho0 / self.rows.alpha0

    @property
    def porous(self) -> bool:
        """Whether any material has pores."""
        return bool((self.rows.alpha0 > 1.0).any())

    def index(self, name: str) -> int:
        return self.names.index(name)

    def weibull(self, name: str) -> grady_kipp.Parameters:
        """The Weibull parameters of a material; raises ``InputError`` where it has none."""
        return parameters(grady_kipp.Parameters, name, "weibull", self.choices.get(name, AS_PUBLISHED))

    def predamaged(self, name: str) -> bool:
        """Whether the material is broken from the start."""
        return self.choices.get(name, AS_PUBLISHED).predamaged


def collect(names: tuple[str, ...], choices: Mapping[str, Choice] | None = None) -> Materials:
    """Rows for the materials ``names``, changed as ``choices`` says. Sections that a material lacks mean: no shear, no yield, no flaws, no tension.

    Raises ``InputError`` for an unknown material or law, for values that do not fit, and for a change of a material that is not there.
    """
    choices = choices or {}
    for name in choices:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1)
            raise InputError(f"no part of this run is of {name!r}{f'; did you mean {near[0]!r}?' if near else ''} (it has {', '.join(names)})")
    count = len(names)
    whole = {"eos", "strength", "growth", "porosity", "crush"}
    wide = {"eos_row": eos.WIDTH, "strength_row": strength.WIDTH, "pores": porosity.WIDTH, "crush_row": crush.WIDTH}
    rows = Rows(*(np.zeros((count, wide[f]) if f in wide else count, dtype=np.int64 if f in whole else np.float64) for f in Rows._fields))
    for i, name in enumerate(names):
        choice = choices.get(name, AS_PUBLISHED)
        _fill_bulk(rows, i, name, choice)
        _fill_strength(rows, i, name, choice)
        _fill_damage(rows, i, name, choice)
        _fill_pores(rows, i, name, choice)
        _refuse_idle(rows, i, name, choice)
    return Materials(names, rows, choices)


def _chosen(name: str, family: str, laws: tuple[str, ...], default: str, choice: Choice) -> int:
    law = law_of(name, family, default, choice)
    if law not in laws:
        raise InputError(f"material {name!r}: {family} is {law!r}, which is none of {', '.join(laws)}")
    return laws.index(law)


def _fill_bulk(rows: Rows, i: int, name: str, choice: Choice) -> None:
    kind = rows.eos[i] = _chosen(name, "eos", eos.LAWS, "tillotson", choice)
    values = parameters(eos.PARAMETERS[kind], name, eos.LAWS[kind], choice)
    rows.eos_row[i, : len(values)] = values
    rows.rho0[i] = values.rho0
    rows.least_c2[i] = 0.01 * eos.modulus(kind, rows.eos_row[i]) / values.rho0
    elastic = parameters(Elastic, name, "elastic", choice)
    shear, bulk = elastic.shear_modulus, elastic.bulk_modulus
    rows.shear[i], rows.bulk[i] = shear, bulk
    rows.young[i] = 9.0 * bulk * shear / (3.0 * bulk + shear)
    rows.crack_speed[i] = grady_kipp.CRACK_SPEED * math.sqrt((bulk + 4.0 / 3.0 * shear) / values.rho0)
    rows.tension[i] = parameters(Tension, name, "tension", choice).cut if has_section(name, "tension", choice) else 0.0


def _fill_strength(rows: Rows, i: int, name: str, choice: Choice) -> None:
    default = "von_mises" if has_section(name, "von_mises", choice) else "none"
    kind = rows.strength[i] = _chosen(name, "strength", strength.LAWS, default, choice)
    law = strength.PARAMETERS[kind]
    if law is None:
        return
    values = parameters(law, name, strength.LAWS[kind], choice)
    if isinstance(values, drucker_prager.Parameters):
        values = drucker_prager.cone(values)
    elif strength.LAWS[kind] == "collins" and values.limiting_strength <= values.cohesion:
        raise InputError(f"material {name!r}, [collins]: limiting_strength must be above cohesion")
    rows.strength_row[i, : len(values)] = values


def _fill_damage(rows: Rows, i: int, name: str, choice: Choice) -> None:
    default = growth.LAWS[growth.CUBE_ROOT] if has_section(name, "weibull", choice) else "none"
    rows.growth[i] = _chosen(name, "damage", ("none", *growth.LAWS), default, choice) - 1
    rows.flawed[i] = 1.0 if rows.growth[i] >= 0 and has_section(name, "weibull", choice) else 0.0
    if rows.flawed[i]:
        parameters(grady_kipp.Parameters, name, "weibull", choice)


def _fill_pores(rows: Rows, i: int, name: str, choice: Choice) -> None:
    kind = rows.porosity[i] = _chosen(name, "porosity", porosity.LAWS, "none", choice)
    rows.alpha0[i] = rows.pores[i, 0] = 1.0
    if kind == porosity.STRAIN_ALPHA:
        strain = parameters(strain_alpha.Parameters, name, "strain_alpha", choice)
        _refuse(name, "strain_alpha", strain_alpha.fault(strain))
        rows.pores[i, : len(strain)] = strain
        rows.alpha0[i] = strain.alpha0
    elif kind == porosity.P_ALPHA:
        given = parameters(p_alpha.Parameters, name, "p_alpha", choice)
        curve = rows.crush[i] = _chosen(name, "crush", crush.LAWS, "quadratic", choice)
        module, title = crush.MODULES[curve], f"crush_{crush.LAWS[curve]}"
        values = parameters(module.Parameters, name, title, choice)
        _refuse(name, title, module.fault(values))
        row = crush_table.row(values) if curve == crush.TABLE else values
        rows.crush_row[i, : len(row)] = row
        form = p_alpha.FORMS[_chosen(name, "crush_form", p_alpha.FORMS, "pressure", choice)]
        try:
            rows.pores[i] = p_alpha.pores(given, form, rows.rho0[i], eos.modulus(rows.eos[i], rows.eos_row[i]), crush.onset(curve, rows.crush_row[i]))
        except ValueError as reason:
            _refuse(name, "p_alpha", str(reason))
        rows.alpha0[i] = given.alpha0


def _refuse(name: str, title: str, fault: str) -> None:
    if fault:
        raise InputError(f"material {name!r}, [{title}]: {fault}")


def _refuse_idle(rows: Rows, i: int, name: str, choice: Choice) -> None:
    """Values for a law that the material does not take would change nothing: most likely the choice of the law was forgotten."""
    chosen = {"eos": eos.LAWS[rows.eos[i]], "strength": strength.LAWS[rows.strength[i]], "porosity": porosity.LAWS[rows.porosity[i]]}
    chosen["crush"] = crush.LAWS[rows.crush[i]] if rows.porosity[i] == porosity.P_ALPHA else "none"
    families = [("eos", eos.LAWS, ""), ("strength", strength.LAWS, ""), ("porosity", porosity.LAWS, ""), ("crush", crush.LAWS, "crush_")]
    for family, laws, prefix in families:
        for law in laws:
            if law != chosen[family] and getattr(choice, prefix + law, None):
                raise InputError(f"material {name!r}: [{prefix}{law}] is given, but {family} is {chosen[family]!r}")
    if choice.weibull and rows.growth[i] < 0:
        raise InputError(f"material {name!r}: [weibull] is given, but damage is 'none'")
