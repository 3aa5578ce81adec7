"""What became of the ejecta in the field of their body and its companions, on the crater's page: a section that
``fly_ejecta`` fills after the run, from the masses that it found (``ejecta_fates.json``)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from matter.errors import InputError
from matter.files import archive
from matter.wording import page, readable

TEMPLATE = "crater/pages/templates/ejecta_fates.html.j2"


def slot(content: str = "") -> str:
    """The placeholder of the section on a new page, and the marks around it later."""
    return page.render(TEMPLATE, "slot", content=content)


def section(found: Mapping[str, Any]) -> str:
    """The section as HTML: masses of target and projectile by fate; when, how far and how fast, of what hits."""
    flight = found["flown"]
    rows = []
    for name, mass in found["target_kg"].items():
        ends, both = found["ends"].get(name, {}), (mass, found["projectile_kg"][name])
        rows.append(
            [
                name,
                *(readable.amount(value, "kg", 3) if value else "none" for value in both),
                _span(ends.get("time_s"), _long),
                _span(ends.get("distance_m"), readable.length),
                _span(ends.get("speed_m_s"), lambda value: readable.amount(value, "m/s", 3)),
            ]
        )
    way = ", ".join(
        f"{word} {math.degrees(flight[key]):.4g} deg"
        for word, key in (("latitude", "latitude_rad"), ("longitude", "longitude_rad"), ("azimuth", "azimuth_rad"))
    )
    duration, closure = _long(flight["duration_s"]), f"{max(found['closure'], 1e-16):.0e}"
    return page.render(TEMPLATE, "section", found=found, rows=rows, duration=duration, way=way, closure=closure)


def _long(seconds: float) -> str:
    """A time of flight in words: minutes, hours, days."""
    for unit, length in (("days", 86400.0), ("h", 3600.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.3g} {unit}"
    return readable.clock(seconds)


def _span(tenths: Sequence[float] | None, words: Callable[[float], str]) -> str:
    """Half, in brackets a tenth and nine tenths."""
    if not tenths:
        return ""
    low, half, high = map(words, tenths)
    return f"{half} ({low} to {high})"


def show(report: Path, found: Mapping[str, Any]) -> None:
    """Put the section on the page ``report``, instead of an earlier one; on a page without a slot for it at its end.

    Raises ``InputError`` where there is no page.
    """
    if not report.is_file():
        raise InputError(f"{report} is missing: the fates are not on the page of the run")
    text, whole, end = report.read_text(encoding="utf-8"), slot(section(found)), page.render(page.PARTS, "end")
    old = re.compile(re.escape(slot("|")).replace(r"\|", ".*?"), re.DOTALL)
    if old.search(text):
        text = old.sub(lambda _: whole, text, count=1)
    else:
        text = text.replace(end, f"{whole}\n{end}", 1)
    archive.write_text(report, text)
