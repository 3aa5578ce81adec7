"""The ledger of a handoff: every limit of the acceptance list with its value and verdict.

Limits from the project's acceptance list for handoffs (seed: Zhang et al., 2022, LPSC; Ballouz et al. 2019 for what
goes wrong). "Raw" counts before the global correction. Pressure, overlaps and elastic energy count as the excess over
the undisturbed state at the same depth: a bed that carries its own weight would break the bare numbers by that alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from handoff.source.cavity import RESOLVED_RADIUS
from matter.errors import InputError
from matter.files import archive


class Limit(NamedTuple):
    """``limit`` is the largest allowed value (of the size |value|), or the smallest where ``least``."""

    limit: float
    unit: str = "1"
    least: bool = False
    meaning: str = ""


def _needs(*variants: str) -> str:
    """The command that makes the runs a row needs."""
    return "needs further runs: inspect_handoff RUN --sensitivity" + "".join(
        f" --only {name}" for name in ("base", *variants)
    )


SENSITIVITY = "final_D_change_on_t_handoff_x2"
"""The row that says how the final crater depends on the time of the handoff."""
SCATTER = 3.0
"""Standard errors of the cut through whole grains that the cavity's volume may be off by."""

LIMITS: dict[str, Limit] = {
    "mass_total_rel": Limit(1e-12, meaning="mass of bed and ejecta against the source, after the rescale"),
    "mass_raw_rel": Limit(1e-2, meaning="the same before any rescale"),
    "momentum_linear_raw_rel": Limit(1e-2, meaning="|dp| / sum m|v| before the correction"),
    "momentum_angular_raw_rel": Limit(2e-2, meaning="|dL| / sum m|r||v| before the correction"),
    "correction_max_dv_over_rms_v": Limit(0.05, meaning="largest change of velocity by the correction"),
    "momentum_linear_rel_after": Limit(1e-10, meaning="|dp| / sum m|v| after the correction"),
    "momentum_angular_rel_after": Limit(1e-10, meaning="|dL| / sum m|r||v| after the correction"),
    "momentum_local_rel": Limit(0.05, meaning="largest |dp| / sum m|v| among octants and 8 radial shells, raw"),
    "kinetic_energy_change_min": Limit(-0.1, least=True, meaning="kinetic energy lost to averaging"),
    "kinetic_energy_change_max": Limit(0.01, meaning="kinetic energy must not be created"),
    "kinetic_energy_compact_change": Limit(
        0.1,
        meaning="gained or lost by the compact matter alone: ejecta, which grains take over as they are, may hold "
        "nearly all",
    ),
    "velocity_field_L2": Limit(0.05, meaning="mass weighted, over cells, where |v| > 5 % of the largest"),
    "velocity_direction_deg_mean": Limit(5.0, "deg", meaning="mean angle between the two fields in the same cells"),
    "overlap_max_over_r": Limit(0.01, meaning="largest overlap over the smaller radius, excess"),
    "overlap_energy_over_KE": Limit(1e-3, meaning="energy stored in overlaps, excess"),
    "overlap_release_speed_over_median_flow": Limit(0.01, meaning="delta sqrt(k/m), excess"),
    "bulk_density_rel": Limit(0.03, meaning="rms difference, coarse grained at 5 r"),
    "cavity_hausdorff_over_r": Limit(
        1.0,
        meaning="99 % of the surface of the source and of that of the carved bed lie within this distance of the "
        "other; the acceptance list allows the largest distance 1.5",
    ),
    "cavity_volume_rel": Limit(
        0.02, meaning="or three standard errors of a cut through whole grains, where that is more"
    ),
    "cavity_depth_rel": Limit(
        0.02, meaning="mean depth inside half the radius; or as many standard errors of the same cut"
    ),
    "cavity_rim_over_r": Limit(
        0.1, meaning="mean height from the cavity's edge to 1.6 radii; or as many standard errors of the same cut"
    ),
    "cavity_radius_over_r_DEM_min": Limit(RESOLVED_RADIUS, least=True, meaning="the cavity must be resolved"),
    "ejecta_mass_curve_rel": Limit(0.02, meaning="largest difference of M(>v) above the speed limit"),
    "residual_pressure_over_bulk_modulus": Limit(
        1e-3,
        meaning="no shock left in the domain, excess, mean over a kernel's support; or rho g R / K of the cavity, "
        "where that is more",
    ),
    "elastic_over_kinetic_energy": Limit(
        0.01,
        meaning="strain energy of the source that is discarded, excess, over the kinetic energy of compact matter; or "
        "what rho g R stores, where that is more",
    ),
    "t_handoff_over_T_crater_max": Limit(0.1, meaning="T = 0.8 sqrt(V^(1/3) / g)"),
    "bed_residual_speed_over_sqrt_g_r": Limit(1e-3, meaning="before the imprint"),
    "final_D_change_on_t_handoff_x2": Limit(0.05, meaning=_needs("time_x0.5", "time_x2")),
    "final_d_change_on_t_handoff_x2": Limit(0.1, meaning=_needs("time_x0.5", "time_x2")),
    "final_D_change_on_vcut_x2": Limit(0.05, meaning=_needs("speed_limit_x0.5", "speed_limit_x2")),
    "final_D_change_on_alpha_x1.5": Limit(0.03, meaning=_needs("alpha_x0.67", "alpha_x1.5")),
    "control_no_impact_run_drift_over_r": Limit(0.05, meaning=_needs("control_uncarved")),
}


CELLS = 1.25
"""Scatter of a cut through a random bed over that through equal cubes. Measured in draws of cloud and bed: 1.2 to 1.3
for the volume at 7 and at 10.6 grains per radius, 1.27 for the floor's depth at 15."""


def volume_scatter(spacing: float, radius: float, depth: float, volume: float) -> float:
    """Standard error of a carved cavity's relative volume that comes of cutting a bed through whole grains ``spacing``
    [m] apart.

    Each of the A / d^2 cells on the cavity's surface is kept or taken out as a whole: where the surface lies in a cell
    is a matter of chance, so that each leaves an error of d^3 / sqrt(12), and all of them d^2 sqrt(A / 12). A: a
    paraboloid of ``radius`` and ``depth`` [m]; relative to ``volume`` [m^3]. Cells of a random bed differ in size and
    lie askew: ``CELLS`` times as much.
    """
    area = math.pi * radius / (6.0 * depth**2) * ((radius**2 + 4.0 * depth**2) ** 1.5 - radius**3)
    return CELLS * spacing**2 * math.sqrt(area / 12.0) / volume


def height_scatter(spacing: float, area: float) -> float:
    """Standard error [m] of the mean height of a surface of an ``area`` [m^2] cut through whole grains ``spacing`` [m]
    apart: that of its volume, d^2 sqrt(A / 12), over the area, times ``CELLS``."""
    return CELLS * spacing**2 / math.sqrt(12.0 * area)


def volume_limit(spacing: float, radius: float, depth: float, volume: float) -> float:
    """Limit on ``cavity_volume_rel``: the acceptance list's, or ``SCATTER`` standard errors of the cut where grains
    are coarse. Arguments as above."""
    return max(LIMITS["cavity_volume_rel"].limit, SCATTER * volume_scatter(spacing, radius, depth, volume))


WAIVABLE = ("t_handoff_over_T_crater_max", "residual_pressure_over_bulk_modulus", "elastic_over_kinetic_energy")
VERDICTS = ("pass", "fail", "waived", "not_measured", "not_applicable")
_KEYS = ("name", "value", "limit", "verdict", "unit", "note")


def check_waivers(waive: Mapping[str, str]) -> None:
    """Raise ``ValueError`` for a waiver of an unknown or binding limit, or one without a reason."""
    for name, reason in waive.items():
        if name not in LIMITS:
            raise ValueError(f"unknown ledger row {name!r}; only {', '.join(WAIVABLE)} may be waived")
        if name not in WAIVABLE:
            raise ValueError(f"{name} is binding; only {', '.join(WAIVABLE)} may be waived")
        if not reason.strip():
            raise ValueError(f"the waiver of {name} gives no reason")


@dataclass
class Ledger:
    """Rows in the order in which they were entered; ``waive`` maps a limit's name to the reason why it does not
    bind."""

    waive: Mapping[str, str] = field(default_factory=dict)
    rows: list[dict[str, Any]] = field(default_factory=list)

    def measure(self, name: str, value: float, note: str = "", bound: float | None = None) -> None:
        """Enter a measured value against its limit; ``bound`` instead where the limit follows the resolution."""
        limit = LIMITS[name] if bound is None else LIMITS[name]._replace(limit=bound)
        value = float(value)
        if not math.isfinite(value):
            verdict = "fail"
        elif limit.least:
            verdict = "pass" if value >= limit.limit else "fail"
        else:
            verdict = "pass" if value <= limit.limit else "fail"
        reason = self.waive.get(name)
        if verdict == "fail" and reason is not None:
            verdict, note = "waived", f"waived: {reason}" + (f"; {note}" if note else "")
        self._enter(name, value, limit.limit, verdict, limit.unit, note or limit.meaning)

    def amend(
        self, name: str, value: float | None, note: str, limit: float | None = None, unit: str | None = None
    ) -> None:
        """Measure a row that further runs belong to, replacing what stood there; None: not applicable.

        ``limit`` and ``unit`` replace the list's own where the row is measured in another way, which the note has to
        say.
        """
        self.rows = [row for row in self.rows if row["name"] != name]
        if value is None:
            self.skip(name, "not_applicable", note)
        elif limit is None:
            self.measure(name, value, note)
        else:
            self._enter(
                name,
                float(value),
                limit,
                "pass" if math.isfinite(value) and value <= limit else "fail",
                unit or "1",
                note,
            )

    def skip(self, name: str, verdict: str, note: str) -> None:
        """Enter a limit that was not measured or does not apply."""
        self._enter(name, None, LIMITS[name].limit, verdict, LIMITS[name].unit, note)

    def state(self, name: str, value: float | str, unit: str = "1", note: str = "") -> None:
        """Enter a value that has no limit."""
        self._enter(name, value, None, "not_applicable", unit, note)

    def complete(self) -> None:
        """Enter every limit that has no row yet as not measured."""
        present = {row["name"] for row in self.rows}
        for name, limit in LIMITS.items():
            if name not in present:
                self.skip(name, "not_measured", limit.meaning)

    def _enter(self, name, value, limit, verdict, unit, note) -> None:
        if verdict not in VERDICTS:
            raise ValueError(f"unknown verdict {verdict!r}")
        self.rows.append(
            {"name": name, "value": value, "limit": limit, "verdict": verdict, "unit": unit, "note": note}
        )

    def __getitem__(self, name: str) -> dict[str, Any]:
        return next(row for row in self.rows if row["name"] == name)

    @property
    def failures(self) -> list[str]:
        """Names of the rows that fail."""
        return [row["name"] for row in self.rows if row["verdict"] == "fail"]

    @property
    def criteria(self) -> list[dict[str, Any]]:
        """The rows that have a limit."""
        return [row for row in self.rows if row["limit"] is not None]

    @property
    def quantities(self) -> list[dict[str, Any]]:
        """The rows that have none: what was handed over."""
        return [row for row in self.rows if row["limit"] is None]

    def worst(self) -> dict[str, Any] | None:
        """The unwaived row that is furthest beyond its limit, or, where all hold, nearest to it; None where nothing
        was measured.

        Rows that only rounding fills (limits below 1e-9) count when they fail.
        """
        judged = [
            row
            for row in self.criteria
            if row["verdict"] == "fail" or (row["verdict"] == "pass" and abs(row["limit"]) > 1e-9)
        ]
        return max(judged, key=_fraction_of_limit, default=None)

    def write(self, path: Path) -> None:
        """Write ``ledger.json``; a value that is not finite becomes text."""
        rows = [{**row, "value": _plain(row["value"])} for row in self.rows]
        archive.write_text(path, json.dumps(rows, indent=1))


def _fraction_of_limit(row: Mapping[str, Any]) -> float:
    """How much of its limit a measured row takes: above 1 beyond it, negative when far on the good side."""
    try:
        value = float(row["value"])
    except (TypeError, ValueError):
        return math.inf
    limit, least = float(row["limit"]), row["name"] in LIMITS and LIMITS[row["name"]].least
    if not math.isfinite(value):
        return math.inf
    if least and limit > 0.0:
        return limit / value if value > 0.0 else math.inf
    return value / limit


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def read(path: Path) -> Ledger:
    """A ledger from its file. Raises ``InputError`` when there is none, or it is damaged: a ledger without rows would
    judge nothing."""
    if not path.is_file():
        raise InputError(f"no ledger at {path}: has the handoff run?")
    rows = archive.read_json(path, list)
    if not rows:
        raise InputError(f"{path} is damaged: it has no rows")
    for number, row in enumerate(rows, 1):
        if not isinstance(row, dict) or not set(_KEYS) <= set(row) or not _sound(row):
            raise InputError(
                f"{path} is damaged: row {number} should hold {', '.join(_KEYS)}, each of its kind, with a verdict "
                f"out of {', '.join(VERDICTS)}"
            )
    return Ledger(rows=rows)


def _sound(row: Mapping[str, Any]) -> bool:
    """Whether the values of a row from a file are of their kinds."""
    texts = all(isinstance(row[name], str) for name in ("name", "verdict", "unit", "note"))
    limit, value = row["limit"], row["value"]
    bounded = limit is None or (_is_number(limit) and (row["verdict"] not in ("pass", "fail") or limit != 0.0))
    measured = row["verdict"] not in ("pass", "fail") or value is None or isinstance(value, str) or _is_number(value)
    return texts and row["verdict"] in VERDICTS and bounded and measured and not isinstance(value, (dict, bool))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
