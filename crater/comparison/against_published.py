"""The crater beside scaling laws and beside the published numbers of its case."""

from __future__ import annotations

from typing import Any

import numpy as np

from crater.comparison.difference import profile_difference
from crater.measures.measure import Measures, Quantity
from crater.results import column_labels
from crater.results.findings import Compared, Findings, final_entry, time_of
from crater.scaling import crater_size as scaling
from crater.settings import Published
from matter.case import quantity
from matter.errors import InputError
from matter.wording.crater_measures import TIME, unit_of

PUBLISHED_AT = "depth"
"""The transient crater that published numbers are of is that at the first maximum of this."""


def compared(findings: Findings) -> Compared:
    """Scaling laws, published numbers, and the late stage in SPH against that in grains."""
    laws, reasons = {}, {}
    if findings.setting.shape is not None:
        reasons["scaling"] = "the scaling laws here are those of large flat ground"
    elif findings.setting.gravity > 0.0:
        laws = _by_scaling(findings)
    else:
        reasons["scaling"] = "the scaling laws here are those of the gravity regime, and this run has no gravity"
    reference = tuple(_verdict(findings, published) for published in findings.settings.reference)
    shock, grains = findings.late_sph, findings.settled_grains
    difference = None
    if shock is not None and grains is not None:
        try:
            difference = _late_difference(shock.measures, grains.measures)
        except InputError as reason:  # grains so coarse that their hollow has no column near its axis
            reasons["late_difference"] = str(reason)
    return Compared(laws, reference, difference, reasons)


def _by_scaling(findings: Findings) -> dict[str, Any]:
    """Diameters by every law, the range of those that are usual for the ground, final diameters and the time of
    formation."""
    event, laws = findings.setting.event, scaling.GROUNDS[findings.settings.ground]
    icy = findings.settings.target.layers[-1].material.startswith("ice")
    complex_above = scaling.simple_to_complex(event.gravity, icy)
    sizes = scaling.diameters(event)
    usual = [sizes[name] for name in laws]
    volume = scaling.holsapple_volume(event, *scaling.VOLUMES[findings.settings.ground])
    return {
        "diameter_m": sizes,
        "range_m": [min(usual), max(usual)],
        "range_of": list(laws),
        "final_rim_diameter_m": {name: scaling.final_from_transient(sizes[name], complex_above) for name in laws},
        "formation_time_s": scaling.formation_time(volume, event.gravity),
    }


def _late_difference(shock: Measures, grains: Measures) -> dict[str, Any]:
    """The two late stages: profiles inside 1.5 rim radii of the larger crater, the largest difference with its
    position, depth and diameter with their ratio. Raises ``InputError`` where the profiles have too few radii in
    common."""
    difference = profile_difference(shock.profile, grains.profile, rim=_larger_rim(shock, grains))
    for name in ("depth_m", "diameter_apparent_m"):
        pair = [measures[name].value for measures in (shock, grains)]
        known = pair[0] is not None and pair[1] is not None and pair[1] != 0.0
        difference[name] = {"sph": pair[0], "dem": pair[1], "sph_over_dem": pair[0] / pair[1] if known else None}  # type: ignore[operator]
    return difference


def _larger_rim(*craters: Measures) -> float | None:
    """The larger rim radius [m]; where no rim could be stated, the larger apparent radius; None where there is
    neither."""
    for name in ("diameter_rim_m", "diameter_apparent_m"):
        sizes = [0.5 * measures[name].value for measures in craters if measures[name].value is not None]  # type: ignore[operator]
        if sizes:
            return max(sizes)
    return None


def _verdict(findings: Findings, published: Published) -> dict[str, Any]:
    """Ours beside a published number; met when they agree within both errors (published and ours) in quadrature."""
    value, plus, minus = (quantity.parse(text) for text in (published.value, published.plus, published.minus))
    ours = _ours(findings, published)
    row: dict[str, Any] = {
        "name": f"{published.of} {published.quantity}",
        "at": _moment(findings, published),
        "value": value,
        "plus": plus,
        "minus": minus,
        "unit": ours.unit,
        "source": published.source,
        "note": published.note,
        "ours": ours.as_dict(),
    }
    if ours.value is None:
        return {**row, "met": None, "why": ours.reason}
    difference = ours.value - value
    allowed = float(np.hypot(plus if difference > 0 else minus, ours.sigma or 0.0))
    return {
        **row,
        "met": bool(abs(difference) <= allowed),
        "difference_over_error": difference / allowed if allowed > 0 else None,
    }


def _moment(findings: Findings, published: Published) -> str:
    """At which moment ours is taken: ``first maximum of depth, 6.0 min, SPH``."""
    if published.of == "final":
        if findings.final is None:
            return "end"
        return column_labels.final(final_entry(findings.final)).line.replace("final", "end", 1)
    moment = findings.transient.get(PUBLISHED_AT)
    if moment is None:
        return f"first maximum of {PUBLISHED_AT}"
    if PUBLISHED_AT in findings.growing:
        return column_labels.transient([PUBLISHED_AT], moment.time, moment.stage, [PUBLISHED_AT]).line
    method = column_labels.METHODS.get(moment.stage, moment.stage)
    return f"first maximum of {PUBLISHED_AT}, {column_labels.when(moment.time, method)}"


def _ours(findings: Findings, published: Published) -> Quantity:
    missing = unit_of(published.quantity)
    if published.of == "final":
        last = findings.final
        if last is None:
            return Quantity(None, None, missing, findings.reasons.get("final", "not measured"))
        return Quantity(last.time, 0.0, "s") if published.quantity == TIME else last.measures[published.quantity]
    moment = findings.transient.get(PUBLISHED_AT)
    if moment is None or moment.measures is None:
        return Quantity(
            None, None, missing, findings.reasons.get("transient", f"no maximum of {PUBLISHED_AT} in the series")
        )
    return time_of(findings, moment) if published.quantity == TIME else moment.measures[published.quantity]
