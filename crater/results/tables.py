"""The stage's files: ``measures.json``, ``compare.json``, profiles, time series, height map, ejecta."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from crater.bodies import body_findings as bodies
from crater.ejecta import catalogue, size_classes
from crater.ground import radial_profile
from crater.measures.measure import Measures, Quantity
from crater.results import handover, measurement_config, series
from crater.results.findings import LATE_SHOCK, Findings, final_entry, missing_errors, time_of
from matter.files import archive, snapshot
from matter.wording.crater_measures import MOMENTS

CATALOGUE = "ejecta.h5"
"""The ejecta, one row a particle (``crater.ejecta.catalogue``)."""
BODY_MAP = "height_map.vtkhdf"
"""How the surface of an ellipsoid or mesh changed (``crater.bodies.body_findings.write_map``)."""
PROFILES = {"volume": "profile_transient.csv", "depth": "profile_transient_depth.csv"}
"""Files that hold the profile of the transient crater, by the maximum at which it is taken."""


def measures_json(findings: Findings) -> dict[str, Any]:
    """The content of ``measures.json``."""
    transient = _transient(findings)
    default = transient.get("at_maximum_volume", {"reason": findings.reasons.get("transient", "not measured")})
    final: dict[str, Any] = {"reason": findings.reasons.get("final", "not measured")}
    last, late, shock, ejected = findings.final, findings.late_sph, findings.shock, findings.ejected
    if last is not None:
        final = {**last.measures.as_dict(), **final_entry(last), **_position(findings, last)}
    content: dict[str, Any] = {
        "transient": {**default, **transient},
        "final": final,
        "reference": findings.compared.reference,
        "measured_with": {stage: chosen.as_dict(findings.inputs) for stage, chosen in findings.configs.items()},
    }
    if engine := _engine_of(findings.inputs / "5_dem" / "stage_report.json"):
        content["engine"] = engine
    content["errors_without"] = missing_errors(findings)
    parts = {
        "soundness": findings.soundness,
        "shock_phases": shock is not None and shock.molten.get("parts") and shock.molten,
        "release": shock is not None and list(shock.heat),
        "melt_scaling": shock is not None and shock.melt,
        "shock_decay": shock is not None and shock.decay,
        "leaving": ejected.leaving,
        "ejecta": ejected.faster_than,
        "launch": ejected.launch,
        "fates": ejected.fates,
        "excavation": ejected.excavation,
        "settled_matter": findings.settled_matter,
        "handover": handover.facts(*findings.handed_over, findings.inputs),
    }
    content |= {name: part for name, part in parts.items() if part}
    if findings.ballistic is not None:
        content["ballistic"] = findings.ballistic.as_dict()
    if findings.body:
        stages = {stage.stage: stage.as_dict(findings.inputs) for stage in findings.body}
        content["body"] = {**stages, "final": findings.body[-1].stage}
    if late is not None:
        content["late_sph"] = {**late.measures.as_dict(), "time_s": Quantity(late.time, 0.0, "s").as_dict()}
    return content


def _transient(findings: Findings) -> dict[str, Any]:
    """The crater at each of its ``MOMENTS``."""
    found: dict[str, Any] = {}
    for key in MOMENTS:
        moment = findings.transient.get(key)
        if moment is not None and moment.measures is not None:
            found[f"at_maximum_{key}"] = {
                **moment.measures.as_dict(),
                "time_s": time_of(findings, moment).as_dict(),
                "stage": moment.stage,
                "growing": key in findings.growing,
                **_position(findings, moment),
            }
    return found


def _position(findings: Findings, moment: Any) -> dict[str, Any]:
    """Where a crater was measured: its snapshot and its datum."""
    return {
        "datum": measurement_config.datum_facts(moment.measures.datum),
        "snapshot": moment.path.relative_to(findings.inputs).as_posix(),
    }


def _engine_of(report: Path) -> dict[str, Any]:
    """Which program stepped the grains, and the deviations that the case accepted from it; empty for this project's
    own stepping."""
    if not report.is_file():
        return {}
    engine = archive.read_json(report).get("engine", {})
    return {name: engine[name] for name in ("name", "deviations") if name in engine}


def write_tables(findings: Findings, out: Path) -> None:
    """Every file but the pictures and the page."""
    archive.write_json(out / "measures.json", measures_json(findings))
    archive.write_json(
        out / "compare.json",
        {
            "scaling": findings.compared.scaling,
            "published": findings.compared.reference,
            "late_stage_sph_against_dem": findings.compared.late_difference,
        },
    )
    if findings.moments:
        series.write_csv(findings.moments, out / "time_series.csv")
    if findings.shock is not None and findings.ejected.catalogue is not None:
        ground, end = findings.setting, snapshot.read(findings.shock.end_path)
        sizes = size_classes.columns(findings.ejected.sizes)
        words = {"size_classes": list(size_classes.CLASSES)} if sizes else {}
        found, path = findings.ejected.catalogue, out / CATALOGUE
        catalogue.write(found, end, ground.datum, ground.gravity, path, sizes, words)
    last, late = findings.final, findings.late_sph
    if late is not None:
        radial_profile.write_csv(headed(late.measures, late.time, LATE_SHOCK), out / "profile_sph.csv")
    for key, name in PROFILES.items():
        moment = findings.transient.get(key)
        if moment is not None and moment.measures is not None:
            radial_profile.write_csv(headed(moment.measures, moment.time, f"transient, maximum {key}"), out / name)
    if findings.body:
        bodies.write_map(findings.body[-1], out / BODY_MAP)
    if findings.ballistic is not None:
        radial_profile.write_csv(findings.ballistic.profile, out / "profile_ballistic.csv")
    if last is not None:
        radial_profile.write_csv(headed(last.measures, last.time, last.origin), out / "profile.csv")
        write_heightmap(last.measures, out / "heightmap.h5")


def headed(measures: Measures, time: float, what: str) -> radial_profile.Profile:
    """The profile with what it is of, and when, in its header."""
    old = measures.profile
    return radial_profile.Profile(
        old.radius, old.height, old.p16, old.p84, old.count, {"of": what, "time_s": f"{time:.6g}", **old.header}
    )


def write_heightmap(measures: Measures, path: Path) -> None:
    """Heights on (distance, azimuth) cells and on the single columns, with their positions in the frame of the
    snapshot."""
    ground = measures.ground
    columns = ground.columns
    ring = columns.ring
    azimuth = (np.arange(columns.sectors) + 0.5) * 2.0 * np.pi / columns.sectors
    arrays = {
        "distance": (columns.distance, "m", "distance from the crater's axis along the datum"),
        "azimuth": (azimuth, "rad", "azimuth of the sectors, 0 along +x"),
        "columns/distance": (columns.distance[ring], "m", "distance of the single columns"),
        "columns/azimuth": (columns.azimuth, "rad", "azimuth of the single columns"),
        "columns/height": (ground.rays, "m", "height of the colour field's half level"),
    }
    for name, cells in ground.methods.items():
        arrays[f"height/{name}"] = (cells, "m", f"height by the method '{name}' (rings, sectors)")
    attributes = {
        "datum": ground.datum.kind,
        "datum_radius_m": ground.datum.radius,
        "datum_centre_m": np.asarray(ground.datum.centre),
    }
    archive.write(path, arrays, {**attributes, "axes": np.asarray(ground.datum.axes)})
