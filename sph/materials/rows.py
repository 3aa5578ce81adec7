"""The materials of one run as arrays that compiled loops read: one row per material, zero where a law does not
apply."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from matter.case.at_rest import AtRest
from matter.case.quantity import PositivePressure, Pressure, SpecificEnergy
from matter.compilation.law_family import Family
from matter.errors import InputError
from sph.damage import grady_kipp, growth
from sph.eos import dispatch as eos
from sph.materials import temperature
from sph.materials.families import FAMILIES
from sph.materials.settings import AS_PUBLISHED, CommonChoice, has_section, law_of, parameters
from sph.porosity import crush
from sph.porosity import dispatch as porosity
from sph.porosity.matrix import Matrix
from sph.strength import block_model, drucker_prager, inertial_friction
from sph.strength import dispatch as strength


class Elastic(NamedTuple):
    """Shear and bulk modulus [Pa]."""

    shear_modulus: Annotated[Pressure, Field(ge=0)]
    bulk_modulus: PositivePressure


class Tension(NamedTuple):
    """The largest tension that the intact material bears [Pa]."""

    cut: Annotated[Pressure, Field(ge=0)]


class Melting(NamedTuple):
    """The specific energy at which strength is gone [J/kg]."""

    energy: Annotated[SpecificEnergy, Field(gt=0)]


class Rows(NamedTuple):
    """What the compiled loops read; (m,) or (m, k) arrays over the materials."""

    eos: np.ndarray  # number of the law in its family, sph.eos.dispatch
    eos_row: np.ndarray  # (m, width of the family, or what a table of theirs needs), rho0 first
    rho0: np.ndarray  # density of the solid at rest [kg/m^3]
    least_c2: np.ndarray  # floor of the squared sound speed [m^2/s^2]
    shear: np.ndarray  # shear modulus [Pa]
    bulk: np.ndarray  # bulk modulus [Pa]
    strength: np.ndarray  # number of the law in sph.strength.dispatch
    strength_row: np.ndarray  # (m, width)
    inertial: np.ndarray  # (m, 3), sph.strength.inertial_friction; diameter 0 where friction does not go by the rate
    vibration: np.ndarray  # (m, 6), sph.strength.block_model; c_vib 0 where rock does not shake
    mixes_damage: np.ndarray  # 1 where damage stands in the yield stress, 0 where it takes the shear stress as a whole
    tension: np.ndarray  # the tension that the intact material bears [Pa], >= 0
    # specific energy at which that tension is gone [J/kg], that of the strength; infinite where nothing says it
    melt: np.ndarray
    boils: np.ndarray  # specific energy [J/kg] from which on it bears neither shear nor tension; infinite: none
    young: np.ndarray  # Young's modulus [Pa]
    crack_speed: np.ndarray  # [m/s]
    growth: np.ndarray  # number of the law in sph.damage.growth, 0 where nothing breaks
    flawed: np.ndarray  # 1 where flaws are seeded
    porosity: np.ndarray  # number of the law in sph.porosity.dispatch
    pores: np.ndarray  # (m, width), alpha0 first
    alpha0: np.ndarray  # initial distention, 1 without pores
    crush: np.ndarray  # number of the law in sph.porosity.crush
    crush_row: np.ndarray  # (m, width)
    thermal: np.ndarray  # (m, width), sph.temperature; of its head alone where no material needs a cold curve


@dataclass(frozen=True)
class Materials:
    """Names of the materials of a run, their rows, and what the case changed of them."""

    names: tuple[str, ...]
    rows: Rows
    choices: Mapping[str, CommonChoice]

    @property
    def rho0(self) -> np.ndarray:
        """Density of the solid at rest [kg/m^3], (m,)."""
        return self.rows.rho0

    @property
    def bulk_density(self) -> np.ndarray:
        """Density at rest with its pores, rho0 / alpha0 [kg/m^3], (m,)."""
        return self.rows.rho0 / self.rows.alpha0

    @property
    def at_rest(self) -> dict[str, AtRest]:
        """Both densities of each material at rest, by its name."""
        return {
            name: AtRest(solid=float(solid), bulk=float(bulk))
            for name, solid, bulk in zip(self.names, self.rho0, self.bulk_density)
        }

    @property
    def porous(self) -> bool:
        """Whether any material has pores."""
        return bool((self.rows.alpha0 > 1.0).any())

    @property
    def harden(self) -> bool:
        """Whether the yield law of any material goes by plastic strain."""
        return any(strength.FAMILY.having("HARDENS")[kind] for kind in self.rows.strength)

    @property
    def inertial(self) -> bool:
        """Whether the friction of any material goes by the rate of strain."""
        return bool((self.rows.inertial[:, inertial_friction.DIAMETER] > 0.0).any())

    @property
    def vibrate(self) -> bool:
        """Whether any material loses friction while it shakes."""
        return bool((self.rows.vibration[:, block_model.C_VIB] > 0.0).any())

    def hit_by(self, radius: float) -> Materials:
        """The materials with decay time and viscosity of the vibration for a projectile of ``radius`` [m]."""
        sized = self.rows.vibration.copy()
        sized[:, [block_model.DECAY_TIME, block_model.VISCOSITY]] *= radius
        return replace(self, rows=self.rows._replace(vibration=sized))

    def decay(self) -> dict[str, dict[str, float]]:
        """Decay time of the vibration [s] and speed of sound at rest [m/s] of each material that shakes, by name."""
        table = self.rows.vibration
        return {
            name: {"decay_time_s": float(row[block_model.DECAY_TIME]), "sound_m_s": float(row[block_model.SOUND])}
            for name, row in zip(self.names, table)
            if row[block_model.C_VIB] > 0.0
        }

    def index(self, name: str) -> int:
        """The number of a material in the tables."""
        return self.names.index(name)

    def weibull(self, name: str) -> grady_kipp.Parameters:
        """The Weibull parameters of a material; raises ``InputError`` where it has none."""
        return parameters(grady_kipp.Parameters, name, "weibull", self.choices.get(name, AS_PUBLISHED))

    def loose(self, name: str) -> drucker_prager.Parameters | None:
        """Friction angle and cohesion of a material that yields as soil does; None of any other."""
        if strength.FAMILY.names[self.rows.strength[self.index(name)]] != "drucker_prager":
            return None
        return parameters(drucker_prager.Parameters, name, "drucker_prager", self.choices.get(name, AS_PUBLISHED))

    def predamaged(self, name: str) -> bool:
        """Whether the material is broken from the start."""
        return self.choices.get(name, AS_PUBLISHED).predamaged


def collect(names: tuple[str, ...], choices: Mapping[str, CommonChoice] | None = None) -> Materials:
    """Rows for the materials ``names``, changed as ``choices`` says. Sections that a material lacks mean: no shear, no
    yield, no flaws, no tension.

    Raises ``InputError`` for an unknown material or law, for values that do not fit, and for a change of a material
    that is not there.
    """
    choices = choices or {}
    for name in choices:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1)
            raise InputError(
                f"material {name!r} is not used in this run{f'; did you mean {near[0]!r}?' if near else ''} (it has "
                f"{', '.join(names)})"
            )
    count = len(names)
    whole = {"eos", "strength", "mixes_damage", "growth", "porosity", "crush"}
    wide = {
        "eos_row": eos.FAMILY,
        "strength_row": strength.FAMILY,
        "pores": porosity.FAMILY,
        "crush_row": crush.FAMILY,
    }
    warm = any(has_section(name, "thermal", choices.get(name, AS_PUBLISHED)) for name in names)
    rows = Rows(
        *(
            np.zeros((count, wide[f].width) if f in wide else count, dtype=np.int64 if f in whole else np.float64)
            for f in Rows._fields
        )
    )
    bulk = [_bulk(name, choices.get(name, AS_PUBLISHED)) for name in names]
    rows = rows._replace(
        thermal=np.zeros((count, temperature.WIDTH if warm else temperature.HEAD)),
        inertial=np.zeros((count, inertial_friction.WIDTH)),
        vibration=np.zeros((count, block_model.WIDTH)),
    )
    if (widest := max(len(numbers) for _, _, numbers in bulk)) > eos.FAMILY.width:
        rows = rows._replace(eos_row=np.zeros((count, widest)))
    for i, name in enumerate(names):
        choice = choices.get(name, AS_PUBLISHED)
        _fill_bulk(rows, i, name, choice, *bulk[i])
        _fill_strength(rows, i, name, choice)
        _fill_friction(rows, i, name, choice)
        _fill_heat(rows, i, name, choice)
        _fill_damage(rows, i, name, choice)
        _fill_pores(rows, i, name, choice)
        _refuse_idle(rows, i, name, choice)
    return Materials(names, rows, choices)


def _chosen(name: str, family: Family, default: str, choice: CommonChoice) -> int:
    """The number of the law that a material takes in a family."""
    law = law_of(name, family.key, default, choice)
    if law not in family.names:
        raise InputError(f"material {name!r}: {family.key} is {law!r}, which is none of {', '.join(family.names)}")
    return family.names.index(law)


def _values(name: str, family: Family, kind: int, choice: CommonChoice) -> Any:
    """The validated parameters of a material's law; raises ``InputError`` for values that do not fit together."""
    module: Any = family.module(kind)
    values = parameters(module.Parameters, name, family.title(module), choice)
    _refuse(name, family.title(module), family.fault(kind, values))
    return values


def _bulk(name: str, choice: CommonChoice) -> tuple[int, Any, Sequence[float]]:
    """Number, values and row of a material's equation of state."""
    kind = _chosen(name, eos.FAMILY, "tillotson", choice)
    values = _values(name, eos.FAMILY, kind, choice)
    if hasattr(values, "temperature"):  # of a table: at rest matter is as warm as [thermal] says
        values = values._replace(temperature=_thermal(name, choice).temperature)
    return kind, values, eos.FAMILY.row(kind, values)


def _thermal(name: str, choice: CommonChoice) -> temperature.Parameters:
    given = has_section(name, "thermal", choice)
    return parameters(temperature.Parameters, name, "thermal", choice) if given else temperature.Parameters()


def _fill_bulk(
    rows: Rows, i: int, name: str, choice: CommonChoice, kind: int, values: Any, numbers: Sequence[float]
) -> None:
    rows.eos[i] = kind
    _put(rows.eos_row[i], numbers)
    rows.rho0[i] = values.rho0
    rows.least_c2[i] = 0.01 * eos.modulus(kind, rows.eos_row[i]) / values.rho0
    elastic = parameters(Elastic, name, "elastic", choice)
    shear, bulk = elastic.shear_modulus, elastic.bulk_modulus
    rows.shear[i], rows.bulk[i] = shear, bulk
    rows.young[i] = 9.0 * bulk * shear / (3.0 * bulk + shear)
    rows.crack_speed[i] = grady_kipp.CRACK_SPEED * math.sqrt((bulk + 4.0 / 3.0 * shear) / values.rho0)
    rows.tension[i] = parameters(Tension, name, "tension", choice).cut if has_section(name, "tension", choice) else 0.0
    rows.boils[i] = getattr(values, "Eiv", math.inf)


def _fill_strength(rows: Rows, i: int, name: str, choice: CommonChoice) -> None:
    default = "von_mises" if has_section(name, "von_mises", choice) else "none"
    kind = rows.strength[i] = _chosen(name, strength.FAMILY, default, choice)
    rows.mixes_damage[i] = strength.FAMILY.having("MIXES_DAMAGE")[kind]
    melts = has_section(name, "melting", choice)
    rows.melt[i] = parameters(Melting, name, "melting", choice).energy if melts else math.inf
    if kind > 0:
        values = _values(name, strength.FAMILY, kind, choice)._replace(melt_energy=float(rows.melt[i]))
        _put(rows.strength_row[i], strength.FAMILY.row(kind, values))


def _fill_friction(rows: Rows, i: int, name: str, choice: CommonChoice) -> None:
    """What friction grows by and what it is lost by."""
    law, rubs = strength.FAMILY.names[rows.strength[i]], strength.FAMILY.having("RUBS")[rows.strength[i]]
    for title in ("inertial_friction", "block_model"):
        if has_section(name, title, choice) and not rubs:
            _refuse(name, title, f"strength = {law!r} has no friction")
    if has_section(name, "inertial_friction", choice):
        _put(rows.inertial[i], parameters(inertial_friction.Parameters, name, "inertial_friction", choice))
    if has_section(name, "block_model", choice):
        sound = math.sqrt(eos.modulus(rows.eos[i], rows.eos_row[i]) / rows.rho0[i])
        values = parameters(block_model.Parameters, name, "block_model", choice)
        _put(rows.vibration[i], block_model.row(values, sound))


def _fill_heat(rows: Rows, i: int, name: str, choice: CommonChoice) -> None:
    """Temperature; where it decides about melting, strength and tension go by its fraction of the way there."""
    kind = int(rows.eos[i])
    if has_section(name, "thermal", choice):
        values = _thermal(name, choice)
        lacking = values.heat_capacity == 0.0 and not temperature.knows(kind)
        _refuse(name, "thermal", "heat_capacity is missing" if lacking else temperature.fault(values))
        rows.thermal[i] = temperature.row(values, kind, rows.eos_row[i], rows.rho0[i], rows.tension[i])
        if rows.thermal[i, temperature.SPAN] > 0.0:
            rows.melt[i], rows.boils[i] = 1.0, math.inf
            if (law := int(rows.strength[i])) > 0:
                values = _values(name, strength.FAMILY, law, choice)._replace(melt_energy=1.0)
                _put(rows.strength_row[i], strength.FAMILY.row(law, values))
    elif temperature.knows(kind):
        rows.thermal[i, temperature.HOW] = temperature.OWN


def _fill_damage(rows: Rows, i: int, name: str, choice: CommonChoice) -> None:
    default = "cube_root" if has_section(name, "weibull", choice) else "none"
    rows.growth[i] = _chosen(name, growth.FAMILY, default, choice)
    rows.flawed[i] = 1.0 if rows.growth[i] > 0 and has_section(name, "weibull", choice) else 0.0
    if rows.flawed[i]:
        parameters(grady_kipp.Parameters, name, "weibull", choice)


def _fill_pores(rows: Rows, i: int, name: str, choice: CommonChoice) -> None:
    kind = rows.porosity[i] = _chosen(name, porosity.FAMILY, "none", choice)
    rows.alpha0[i] = rows.pores[i, 0] = 1.0
    if kind == 0:
        return
    values = _values(name, porosity.FAMILY, kind, choice)
    bulk, onset = eos.modulus(rows.eos[i], rows.eos_row[i]), 0.0
    if porosity.FAMILY.having("CRUSHES")[kind]:
        given = [n for n, title in zip(crush.FAMILY.names, crush.FAMILY.titles) if getattr(choice, title)]
        curve = rows.crush[i] = (
            crush.FAMILY.kind(given[0]) if given else _chosen(name, crush.FAMILY, "quadratic", choice)
        )
        _put(rows.crush_row[i], crush.FAMILY.row(curve, _values(name, crush.FAMILY, curve, choice)))
        onset = crush.onset(curve, rows.crush_row[i])
    try:
        _put(rows.pores[i], porosity.FAMILY.row(kind, values, Matrix(rows.rho0[i], bulk, onset)))
    except ValueError as reason:
        _refuse(name, porosity.FAMILY.names[kind], str(reason))
    rows.alpha0[i] = values.alpha0


def _put(row: np.ndarray, numbers: Sequence[float]) -> None:
    row[: len(numbers)] = numbers


def _refuse(name: str, title: str, fault: str) -> None:
    if fault:
        raise InputError(f"material {name!r}, [{title}]: {fault}")


def taken(rows: Rows, i: int) -> dict[str, int]:
    """The number of the law that material ``i`` takes in each family, -1 in a family that it has no use for."""
    crushes = porosity.FAMILY.having("CRUSHES")[rows.porosity[i]]
    kinds = (rows.eos[i], rows.strength[i], rows.porosity[i], rows.crush[i] if crushes else -1, rows.growth[i])
    return {family.key: int(kind) for family, kind in zip(FAMILIES, kinds)}


def _refuse_idle(rows: Rows, i: int, name: str, choice: CommonChoice) -> None:
    """Values for a law that the material does not take would change nothing: most likely the choice of the law was
    forgotten."""
    kinds = taken(rows, i)
    for family in FAMILIES:
        chosen = family.names[kinds[family.key]] if kinds[family.key] >= 0 else "none"
        for module in family.laws:
            title = family.title(module)
            if title.removeprefix(family.prefix) != chosen and getattr(choice, title, None):
                raise InputError(f"material {name!r}: [{title}] is given, but {family.key} is {chosen!r}")
    if choice.weibull and rows.growth[i] == 0:
        raise InputError(f"material {name!r}: [weibull] is given, but damage is 'none'")
