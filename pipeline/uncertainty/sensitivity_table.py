"""What the variants of a handoff came to (``pipeline.uncertainty.sensitivity.compare``), as rows of the ledger and as
a table."""

from __future__ import annotations

import math
from typing import Any

from matter.wording.crater_measures import BY_NAME, RATIOS, UNITS

DEEP, STILL = 5.0, 0.1
"""The carved bed at rest: grains deeper than ``DEEP`` radii below the carved surface shall move less than ``STILL``
radii."""
DEEPEST = "dem_depth_most_m"
ROWS = {  # ledger row -> measure, variants
    "final_D_change_on_t_handoff_x2": ("D", ("time_x0.5", "time_x2")),
    "final_d_change_on_t_handoff_x2": ("d", ("time_x0.5", "time_x2")),
    "final_D_change_on_vcut_x2": ("D", ("speed_limit_x0.5", "speed_limit_x2")),
    "final_D_change_on_alpha_x1.5": ("D", ("alpha_x0.67", "alpha_x1.5")),
}
_COLUMNS = {**{name: f"{BY_NAME[name].symbol} [m]" for name in RATIOS if UNITS[name] == "m"}, DEEPEST: "deepest [m]"}


def enter(comparison: dict[str, Any], book) -> None:
    """Fill the rows of a ledger that need further runs; a change counts as the larger of the two that its variants
    show."""
    rows = comparison["rows"]
    for name, (measure, wanted) in ROWS.items():
        there = [rows[variant] for variant in wanted if variant in rows]
        if not there:
            continue
        missing = [variant for variant in wanted if variant not in rows]
        key = (
            "depth_m"
            if measure == "d"
            else next((k for k in RATIOS[:2] if all(row[f"{k}_change"] is not None for row in there)), None)
        )
        changes = [row[f"{key}_change"] for row in there] if key else []
        said = ", ".join(f"{variant} {_with_error(rows[variant], key)}" for variant in wanted if variant in rows)
        cut = f"; not made: {', '.join(missing)}" if missing else ""
        if key and all(change is not None for change in changes):
            book.amend(name, max(abs(change) for change in changes), f"{key}: {said}{cut}")
        elif all(row["profile_rms_m"] is not None for row in there):
            worst = max(row["profile_rms_m"] for row in there)
            book.amend(
                name,
                worst,
                f"no crater left to measure: RMS difference of the profiles{cut}",
                limit=comparison["allowed_rms_m"],
                unit="m",
            )
        else:
            book.amend(name, None, f"no final crater could be measured in {' or '.join(wanted)}")
    if (still := comparison["controls"].get("control_uncarved")) is not None:
        note = (
            f"bed carved at the datum, {still['from_s']:.4g} to {still['to_s']:.4g} s: {still['grains']} grains, mean "
            f"{still['drift_mean_over_r']:.2g} r"
        )
        book.amend("control_no_impact_run_drift_over_r", still["drift_most_over_r"], note)


def _percent(change: float | None) -> str:
    return "--" if change is None or not math.isfinite(change) else f"{100.0 * change:+.1f} %"


def _with_error(row: dict[str, Any], key: str | None) -> str:
    """A change with its error over the beds, where there are several."""
    error = row.get(f"{key}_change_error")
    return _percent(row.get(f"{key}_change")) + (
        f" (+- {100.0 * error:.1f} % over {row['beds']} beds)" if error is not None else ""
    )


def text(comparison: dict[str, Any]) -> str:
    """The comparison as a table for a terminal."""
    head = (
        f"{'variant':<18}{'t [s]':>9}{'v limit':>9}{'alpha':>7}"
        + "".join(f"{title:>16}{'change':>9}{'+-':>7}" for title in _COLUMNS.values())
        + f"{'RMS [m]':>10}"
    )
    lines = [head]
    for name, row in comparison["rows"].items():
        cells = "".join(
            f"{_shown(row[key]):>16}{_percent(row[f'{key}_change']):>9}{_error(row, key):>7}" for key in _COLUMNS
        )
        given = f"{row['time_s']:>9.4g}{row['speed_limit_m_s']:>9.4g}{row['alpha_spacings']:>7.3g}"
        lines.append(f"{name:<18}{given}{cells}{_shown(row['profile_rms_m']):>10}")
    for name, row in comparison["controls"].items():
        lines.append(
            f"{name}: {row['grains']} grains, {row['from_s']:.4g} to {row['to_s']:.4g} s: largest displacement "
            f"{row['drift_most_over_r']:.3g} r (mean "
            f"{row['drift_mean_over_r']:.2g} r); {row['deep_grains']} deeper than {DEEP:g} r: "
            f"{_shown(row['deep_drift_most_over_r'])} r, {row['deep_beyond']} "
            f"beyond {STILL:g} r; energy rose by {row['energy_rise_rel']:.1e} of its size (history.csv resolves 1e-10)"
        )
    if comparison["missing"]:
        lines.append(f"not made: {', '.join(comparison['missing'])}")
    return "\n".join(lines)


def _error(row: dict[str, Any], key: str) -> str:
    error = row.get(f"{key}_change_error")
    return "" if error is None else f"{100.0 * error:.1f}"


def _shown(value: float | None) -> str:
    return "--" if value is None else f"{value:.4g}"
