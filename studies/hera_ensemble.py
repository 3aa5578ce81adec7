"""The samples of a forecast whose runs are an ensemble (``cases/dart_dimorphos/ensemble.toml``), for
``studies.hera_forecast``.

Every measure of the runs is a Gaussian process (``pipeline.inverse.emulator``) of x = ln density, friction, ln
cohesion, ln crush onset, slope of the site, fitted to the members: of two fidelities where the shock stage has the
measure too,

    ln y(x) = S(x) + R(x),     S: ln y after the shock stage, of all members;  R: ln (y at the end / y after the shock
                               stage), of those that ran the whole chain

and of the whole chain alone otherwise. Each member has its own draw of particles and grains and its own time of the
handoff. Their scatter is the nugget of the process, and every sample gets a random deviation from it. What no member
varies stands as a factor (spacecraft, blocks, finer size, second hour, shape of before) with its reason in
``<name>_inputs.toml``:

    beta_n - 1 = y f_spacecraft f_blocks f_numerics,      M dv . t = p c_t (1 + kappa (beta_n - 1))

Class: reshaped with the chance of a logistic regression on ln (width of the hollow), of the members that have one or
the other class, ``neither`` with Jeffreys' chance of the others.
"""

from __future__ import annotations

import csv
import functools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from matter.case import quantity
from pipeline.inverse.emulator import Emulator, LeftOut
from studies import hera_forecast as forecast

PARAMETERS = ("density", "friction", "cohesion", "crush_onset", "slope")
"""Factors that the members draw too, and their columns there."""
DRAWN = ("bulk_density", "friction_angle", "cohesion", "crush_onset", "impact.angle_from_vertical")
LOGARITHMIC = (True, False, True, True, False)
LEAST = 12
"""Members without which no process of five parameters is fitted."""
Row = Mapping[str, str]


class Process(NamedTuple):
    """A measure of the members; ``parts``: S and R, or the process of the whole chain alone."""

    name: str
    parts: tuple[Emulator, ...]

    def sampled(self, x: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """y (m,) at x (m, 5), ``normal`` (m,) standard deviations off the mean."""
        found = [part.predict(x) for part in self.parts]
        mean, sd = sum(one for one, _ in found), np.sqrt(sum(one**2 for _, one in found))
        return np.asarray(np.exp(mean + sd * normal))

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """Each part with every member left out in turn."""
        return tuple(part.left_out() for part in self.parts)


class Members(NamedTuple):
    """The members that are done: ``x`` (n, 5), and a column (n,) of each measure, NaN where a member has none."""

    x: np.ndarray
    columns: Mapping[str, np.ndarray]
    classes: list[str]
    failed: int

    def process(self, name: str, whole: np.ndarray, shock: np.ndarray | None = None) -> Process:
        """The process of a measure at the end of the chain, ``whole`` (n,), and after the shock stage."""
        with np.errstate(invalid="ignore"):
            values = [whole] if shock is None else [shock, whole / shock]
            parts = []
            for one in values:
                has = one > 0.0
                if has.sum() < LEAST:
                    raise ValueError(f"{name}: {has.sum()} members have it, {LEAST} are needed")
                parts.append(Emulator(self.x[has], np.log(one[has]), np.zeros(has.sum())))
        return Process(name, tuple(parts))


def members(file: Path) -> Members:
    """The members of a sweep's ``table.csv`` that are done."""
    with file.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    done = [row for row in rows if row["state"] == "done"]
    x = np.array([[_si(row[name]) for name in DRAWN] for row in done])
    x[:, 4] = np.degrees(x[:, 4])
    x[:, 1] = np.degrees(x[:, 1])
    named = [name for name in done[0] if "/" in name]
    columns = {name: np.array([float(row[name]) if row[name] else np.nan for row in done]) for name in named}
    classes = [row.get("class") or "" for row in done]
    return Members(_scaled(x), columns, classes, sum(row["state"] == "failed" for row in rows))


def _si(text: str) -> float:
    return float(quantity.parse(text))


def _scaled(x: np.ndarray) -> np.ndarray:
    """Parameters (n, 5) as the processes take them."""
    return np.column_stack([np.log(x[:, k]) if log else x[:, k] for k, log in enumerate(LOGARITHMIC)])


def processes(made: Members) -> dict[str, Process]:
    """The process of every measure that the forecast takes from the members."""
    c = made.columns
    along = (c["body/beta_along_track"] - 1.0) / (c["body/beta_normal"] - 1.0)
    return {
        one.name: one
        for one in (
            made.process("excess", c["body/beta_normal"] - 1.0, c["shock/beta_normal"] - 1.0),
            made.process("track", along),
            made.process("mass_left", c["body/escaping_mass_kg"], c["shock/escaping_mass_kg"]),
            made.process("hollow", c["body/hollow_across_m"]),
            made.process("deepest", -c["body/height_change_lowest_m"]),
            made.process("resurfaced", c["body/resurfaced_share"]),
            made.process("a_over_b", c["body/axis_ratio_a_over_b"]),
            made.process("a_over_c", c["body/axis_ratio_a_over_c"]),
        )
    }


def classifier(made: Members) -> tuple[float, float, float]:
    """Chance that a hollow of the width D is called reshaped, 1 / (1 + exp(-(a + b ln D))): a and b; and that a member
    is called neither that nor a crater."""
    from sklearn.linear_model import LogisticRegression

    wide = made.columns["body/hollow_across_m"]
    known = [k for k, word in enumerate(made.classes) if word in ("crater", "reshaped") and wide[k] > 0.0]
    reshaped = np.array([made.classes[k] == "reshaped" for k in known])
    classed = sum(map(bool, made.classes))
    neither = (classed - sum(word in ("crater", "reshaped") for word in made.classes) + 0.5) / (classed + 1.0)
    if reshaped.all() or not reshaped.any():  # no width tells them apart: Jeffreys' chance for all
        p = (reshaped.sum() + 0.5) / (len(reshaped) + 1.0)
        return math.log(p / (1.0 - p)), 0.0, neither
    x = np.log(wide[known])
    middle, spread = float(x.mean()), float(x.std())
    line = LogisticRegression(C=10.0).fit(((x - middle) / spread)[:, None], reshaped)
    slope = float(line.coef_[0, 0]) / spread
    return float(line.intercept_[0]) - slope * middle, slope, neither


def fitted(file: Path) -> tuple[Members, dict[str, Process]]:
    """The members of a table and their processes, fitted once for the same content."""
    return _fitted(file, file.read_bytes())


@functools.lru_cache(maxsize=1)
def _fitted(file: Path, content: bytes) -> tuple[Members, dict[str, Process]]:
    found = members(file)
    return found, processes(found)


def samples(given: Mapping[str, Any], file: Path) -> forecast.Samples:
    """The factors, the members' measures at them, and what follows, before any observation."""
    found, by = fitted(file)
    body, f = given["body"], forecast.factors(given, {})
    x = _scaled(np.column_stack([f[name] for name in PARAMETERS]))
    y = {name: one.sampled(x, f[f"scatter_{name}"]) for name, one in by.items()}
    rho, volume = f["density"], f["volume"]
    excess = y["excess"] * f["spacecraft"] * f["blocks"] * f["numerics"]
    thrown = f["spacecraft"] ** given["spacecraft_power"]  # of the mass, by the two spacecraft runs of v0
    mass_left = y["mass_left"] * thrown * f["late_mass"] * f["handoff_mass"] * f["mass_model"]
    grown = thrown ** (1.0 / 3.0) * f["hollow_model"]
    wide = y["hollow"] * grown
    before = given["grains_before"]
    stretch = y["a_over_b"] - before["a_over_b"]
    a_b = np.maximum(f["a_over_b_before"] + stretch * grown**3 * f["stretch_model"], 1.0)
    a_c = np.maximum(f["a_over_c_before"] + y["a_over_c"] - before["a_over_c"], a_b)
    mass, track = volume * rho - mass_left, 1.0 + y["track"] * f["track"] * excess
    a, b, neither = classifier(found)
    reshaped = f["edge"] < 1.0 / (1.0 + np.exp(-(a + b * np.log(wide))))
    momentum = given["impact"]["mass_kg"] * given["impact"]["speed_m_s"]
    cosine, ejecta = given["cosine_track"], given["cosine_ejecta"]
    made: forecast.Samples = {
        "mass": mass, "density": rho, "volume": mass / rho, "beta_normal": 1.0 + excess, "beta_track": track,
        "beta_ejecta": 1.0 + cosine * (track - 1.0) / ejecta, "mass_left": mass_left,
        "a_over_b": a_b, "a_over_c": a_c, "hollow": wide, "deepest": y["deepest"] * f["depth_model"],
        "resurfaced": np.minimum(y["resurfaced"] * grown**2 * f["surface_model"], 1.0),
        "class": np.where(f["neither"] < neither, 2.0, np.where(reshaped, 1.0, 0.0)), "excited": f["excited"],
    }  # fmt: skip
    made["dv_track"] = momentum * cosine * track / mass
    return made | forecast.followed(made, f, momentum, body)
