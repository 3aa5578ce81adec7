"""The crater in one snapshot (the command ``measure_crater``): with the measurement configuration of its run, or with
the one that is given."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from crater.ground import locate, radial_profile
from crater.measures import chain
from crater.measures.measure import Measures, Quantity, measure
from crater.pages import report
from crater.pictures import plot
from crater.results import measurement_config, tables
from crater.results.measurement_config import MeasurementConfig
from matter.compilation import jit
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.particles import Particles
from matter.wording import drawing

Point = tuple[float, float, float]


def measure_snapshot(
    path: Path,
    datum: str | None = None,
    datum_radius: float | None = None,
    centre: Point | None = None,
    out: Path | None = None,
) -> int:
    """Measure one snapshot of any origin: prints the measures and what they stand on, writes them and pictures to
    ``out``.

    A snapshot of a run is measured on that run's choices and gives its numbers to the last digit. ``datum`` (``plane``
    or ``sphere``), ``datum_radius`` [m] and ``centre`` [m] override them: a sphere keeps the centre and the radius
    that are given and fits the rest to the far field, as for a snapshot that says nothing.
    """
    with jit.one_blas_thread():
        return _measured(Path(path), datum, datum_radius, centre, out)


def _measured(
    path: Path, datum: str | None, datum_radius: float | None, centre: Point | None, out: Path | None
) -> int:
    particles = snapshot.read(path)
    known = measurement_config.of_snapshot(path, particles.attributes)
    folder = archive.check_folder(Path(out) if out is not None else _results_folder(path))
    given = [
        f"--{name}"
        for name, value in (("datum", datum), ("datum-radius", datum_radius), ("centre", centre))
        if value is not None
    ]
    if known is not None and not given:
        measures, said = known.measured(particles, known.ground_before(), str(path)), _said(known)
        measures = chain.with_errors(measures, known.chain)
    else:
        measures = _on_own_datum(particles, known, datum, datum_radius, centre, str(path))
        said = _overridden(known, given)
    folder.mkdir(parents=True, exist_ok=True)
    time = particles.attributes.get("time")
    archive.write_json(folder / "measures.json", _content(measures, path, time, said))
    radial_profile.write_csv(tables.headed(measures, float(time or 0.0), path.name), folder / "profile.csv")
    tables.write_heightmap(measures, folder / "heightmap.h5")
    if drawing.possible("the crater", print):
        plot.draw_one(measures, path.name, folder)
    print(report.as_text(measures))
    print("\n".join(said))
    print(f"written to {folder}")
    return 0


def _results_folder(path: Path) -> Path:
    """Where the results of a snapshot go: beside it, and where it lies in a stage, in which nobody else writes, beside
    that stage."""
    name = f"{path.stem}_crater"
    stage = path.parent
    made = any((stage / mark).is_file() for mark in archive.STAGE_MARKS)
    return stage.parent / f"{stage.name}_{name}" if made else stage / name


def _content(measures: Measures, path: Path, time: Any, said: list[str]) -> dict[str, Any]:
    """``measures.json`` of one snapshot: under ``final``, though one snapshot cannot tell whether its crater is at
    rest."""
    entry = {
        **measures.as_dict(), "time_s": Quantity(float(time or 0.0), 0.0, "s").as_dict(), "from": path.name,
        "settled": False,
        "state": "one snapshot", "settled_reason": "one snapshot cannot tell whether the crater is at "
                                                   "rest", "datum": measurement_config.datum_facts(measures.datum),
    }  # fmt: skip
    return {"final": entry, "transient": {}, "reference": [], "single_snapshot": True, "stands_on": said}


def _on_own_datum(
    particles: Particles,
    known: MeasurementConfig | None,
    datum: str | None,
    radius: float | None,
    centre: Point | None,
    what: str,
) -> Measures:
    """Measures over a datum that is given or fitted to the far field; the rest of the choices as the run had them,
    where there was one."""
    frame = particles.attributes.get("frame")
    kind = datum or ("sphere" if radius or centre or frame == "sphere" else "plane")
    if kind not in ("plane", "sphere"):
        raise InputError(f"--datum {kind!r} is not known: take plane or sphere")
    if kind == "sphere" and centre is None and frame == "sphere":
        centre = (0.0, 0.0, 0.0)
    search = known.search if known is not None else locate.WIDE_SEARCH
    return measure(particles, kind, None, search, centre=centre, datum_radius=radius, what=what)


def _said(known: MeasurementConfig) -> list[str]:
    lines = [f"measured as its run does: {known.words()}"]
    lines.append(f"{chain.KNOWN if known.chain else chain.UNKNOWN}")
    return lines + [f"not at hand: {what}; the numbers are not quite those of the run" for what in known.unknown]


def _overridden(known: MeasurementConfig | None, given: list[str]) -> list[str]:
    if known is None:
        how = f"{', '.join(given)} given" if given else "datum fitted to the far field"
        return [f"the snapshot does not say how its run measured: {how}, nothing is taken to be in flight"]
    return [
        f"not measured as its run does: {', '.join(given)} given, so heights are over that datum alone and not "
        f"against the ground before the impact "
        f"(run: {known.datum.kind}{f' of radius {known.datum.radius:.7g} m' if known.datum.is_sphere else ''}, "
        f"{known.datum.source})"
    ]
