"""The materials of one run as arrays that compiled loops read: one row per material, zero where a law does not apply."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter, ValidationError

from matter import material
from matter.errors import InputError
from sph.damage import grady_kipp
from sph.eos import tillotson
from sph.strength import von_mises


def parameters(law: type, name: str, title: str) -> Any:
    """The validated ``Parameters`` of a law for the material ``name``; raises ``InputError`` saying what does not fit."""
    try:
        return TypeAdapter(law).validate_python(material.section(name, title))
    except ValidationError as reason:
        details = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in reason.errors())
        raise InputError(f"material {name!r}, [{title}]: {details}") from None


class Rows(NamedTuple):
    """What the compiled loops read; (m,) or (m, k) arrays over the materials."""

    tillotson: np.ndarray  # (m, 10)
    shear: np.ndarray  # shear modulus [Pa]
    von_mises: np.ndarray  # (m, 2)
    tension: np.ndarray  # the tension that the intact material bears [Pa], >= 0
    young: np.ndarray  # Young's modulus [Pa]
    crack_speed: np.ndarray  # [m/s]
    flawed: np.ndarray  # 1 where damage applies


@dataclass(frozen=True)
class Materials:
    """Names of the materials of a run and their rows."""

    names: tuple[str, ...]
    rows: Rows

    @property
    def tillotson(self) -> np.ndarray:
        return self.rows.tillotson

    def index(self, name: str) -> int:
        return self.names.index(name)


def collect(names: tuple[str, ...]) -> Materials:
    """Rows for the materials ``names``. Sections that a material lacks mean: no shear, no yield, no flaws, no tension."""
    count = len(names)
    rows = Rows(
        tillotson=np.zeros((count, 10)),
        shear=np.zeros(count),
        von_mises=np.ones((count, 2)),
        tension=np.zeros(count),
        young=np.zeros(count),
        crack_speed=np.zeros(count),
        flawed=np.zeros(count),
    )
    for i, name in enumerate(names):
        sections = material.load(name)
        rows.tillotson[i] = parameters(tillotson.Parameters, name, "tillotson")
        elastic = material.section(name, "elastic")
        shear, bulk = elastic["shear_modulus"], elastic["bulk_modulus"]
        rows.shear[i] = shear
        rows.von_mises[i] = parameters(von_mises.Parameters, name, "von_mises") if "von_mises" in sections else (0.0, 1.0)
        rows.tension[i] = material.section(name, "tension")["cut"] if "tension" in sections else 0.0
        rows.young[i] = 9.0 * bulk * shear / (3.0 * bulk + shear)
        rows.crack_speed[i] = grady_kipp.CRACK_SPEED * math.sqrt((bulk + 4.0 / 3.0 * shear) / rows.tillotson[i, 0])
        rows.flawed[i] = 1.0 if "weibull" in sections else 0.0
    return Materials(names, rows)


def weibull(name: str) -> grady_kipp.Parameters:
    """The Weibull parameters of a material."""
    return parameters(grady_kipp.Parameters, name, "weibull")
