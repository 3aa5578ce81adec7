"""The last word of a run: what was measured, each number with its stage, time and definition, and the published
numbers beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from crater.results import column_labels
from matter.files import archive
from matter.wording import readable
from matter.wording.crater_measures import TABLE
from pipeline.case import stages


def table(run: Path) -> str:
    """The measures of a finished run; without a crater what is left of the body, an empty text on flat ground."""
    path = stages.folder(run, "crater") / "measures.json"
    if not path.is_file():
        from sph.outcome import fragments

        return "\n".join(fragments.outcome_lines(stages.folder(run, "sph")))
    measures = archive.read_json(path)
    columns = column_labels.columns(measures)
    rows = [("", [label.title for label, _ in columns]), ("", [label.when for label, _ in columns])]
    without = measures.get("errors_without", "")
    for row in (row for row in TABLE if row.terminal):
        cells = [shown(entry.get(row.name)) for _, entry in columns]
        if any(cells):
            missing = without if any("+-" in cell for cell in cells) else ""
            rows.append((row.words, [*(cell or "--" for cell in cells), missing]))
    width = max(len(words) for words, _ in rows)
    widths = [max(len(cells[k]) for _, cells in rows) + 3 for k in range(len(columns))]
    lines = [
        f"{words:<{width}}"
        + "".join(f"{cell:>{wide}}" for cell, wide in zip(cells, widths))
        + "".join(f"   {words}" for words in cells[len(columns) :] if words)
        for words, cells in rows
    ]
    if verdict := measures.get("soundness", {}).get("not_resolved"):
        lines.insert(0, f"NOT RESOLVED: {verdict}")
    lines += [_errors(columns), *_unsettled(measures)]
    lines += [_published(entry) for entry in measures.get("reference", [])]
    lines += _of_body(measures.get("body", {}))
    lines += _molten(measures.get("shock_phases", {})) + _excavated(measures.get("excavation", {}))
    lines += _heated(measures.get("release", [])) + _melted(measures.get("melt_scaling", {}))
    lines += _settled(measures.get("settled_matter", {}))
    return "\n".join(line for line in [*lines, *_soundness(measures.get("soundness", {}))] if line)


def _errors(columns: list[tuple[column_labels.ColumnLabel, Mapping[str, Any]]]) -> str:
    """What the errors are, and whether they hold the scatter of the whole chain."""
    from crater.measures import chain

    cells = [cell for _, entry in columns for cell in entry.values() if isinstance(cell, Mapping)]
    parts = {part for cell in cells for part in cell.get("sigma_parts") or {}}
    return f"errors: one standard deviation; {chain.KNOWN if chain.PART in parts else chain.UNKNOWN}" if cells else ""


def _unsettled(measures: Mapping[str, Any]) -> list[str]:
    final = measures.get("final", {})
    return [f"no final crater yet: {final.get('settled_reason', '')}"] if final.get("settled") is False else []


def _soundness(facts: Mapping[str, Any]) -> list[str]:
    """One line on the projectile's resolution and the peak pressure, and the cautions."""
    words = []
    if "particles_per_radius" in facts:
        words.append(
            f"projectile: {facts['projectile_particles']} particles, {facts['particles_per_radius']:.2g} per radius"
        )
    if "peak_pressure_Pa" in facts:
        text = f"largest pressure of a particle {readable.amount(facts['peak_pressure_Pa'] * 1e-9, 'GPa', 3)}"
        if "peak_over_planar_limit" in facts:
            limit, speed = readable.amount(facts["planar_limit_Pa"] * 1e-9, "GPa", 3), facts["planar_speed_m_s"] * 1e-3
            text += (
                f", {facts['peak_over_planar_limit']:.2g} times the planar limit ({limit} at the vertical {speed:.4g} "
                f"km/s)"
            )
        words.append(text)
    return ["; ".join(words), *(readable.terminal(f"caution: {caution}") for caution in facts.get("cautions", []))]


def _of_body(facts: Mapping[str, Any]) -> list[str]:
    from crater.bodies import body_report

    return body_report.body_lines(facts)


def _molten(facts: Mapping[str, Any]) -> list[str]:
    from crater.shock import phases

    return phases.shock_melt_lines(facts)


def _excavated(facts: Mapping[str, Any]) -> list[str]:
    from crater.ejecta import excavation

    return [readable.terminal(line) for line in excavation.excavation_lines(facts)]


def _heated(facts: list[Mapping[str, Any]]) -> list[str]:
    from crater.shock import release

    return release.release_lines(facts)


def _melted(facts: Mapping[str, Any]) -> list[str]:
    from crater.scaling import melt

    return melt.melt_lines(facts)


def _settled(facts: Mapping[str, Any]) -> list[str]:
    from crater.shock import settled_matter

    return [readable.terminal(line) for line in settled_matter.settled_lines(facts)]


def _published(entry: dict[str, Any]) -> str:
    """A published number, ours beside it with its moment, and whether it is met; that it is not met is a finding, not
    a failure."""
    scale, unit = _scale(entry["unit"], abs(entry["value"]))
    error = (
        f" +{entry['plus'] * scale:.3g} -{entry['minus'] * scale:.3g}" if "plus" in entry and "minus" in entry else ""
    )
    verdict = "not measured" if entry.get("met") is None else "met" if entry["met"] else "not met"
    ours, at = shown(entry.get("ours")), f" ({entry['at']})" if entry.get("at") else ""
    words = (
        f"published {entry['name']}: {entry['value'] * scale:.4g}{error} {unit} ({entry.get('source', 'no source')})"
    )
    return f"{words}; here{at} {ours or '--'}: {verdict}"


def shown(entry: Any) -> str:
    """``{"value", "sigma", "unit"}`` as ``980 +- 52 km``; empty when there is no value."""
    if not isinstance(entry, Mapping) or not isinstance(entry.get("value"), (int, float)):
        return ""
    sigma = entry.get("sigma")
    return readable.terminal(
        readable.measured(entry["value"], sigma if isinstance(sigma, (int, float)) else None, entry.get("unit", ""))
    )


def _scale(unit: str, value: float) -> tuple[float, str]:
    factor, name = readable.scale(value, unit)
    return factor, readable.terminal(name)
