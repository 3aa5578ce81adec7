"""The stage on an ellipsoid or mesh: what became of the body as a whole, beside its crater."""

from __future__ import annotations

from dataclasses import replace

from crater.bodies import body_findings as bodies
from crater.bodies.body_findings import Body, BodyStage
from crater.measures.measure import Measures
from crater.results.findings import Findings
from crater.settings import Settings
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.solids.body_shape import Shape


def shape_of(settings: Settings) -> Shape:
    """The surface of the body of a case. Raises ``InputError`` where it cuts itself."""
    return Shape(settings.target.placed, settings.target.axes)


def with_body(findings: Findings) -> Findings:
    """With what became of the body in the shock stage and in the grains; as they are on other ground."""
    setting = findings.setting
    if setting.shape is None:
        return findings
    facts = archive.read_json(findings.inputs / "2_sph" / "target.json")
    body = bodies.body_of(findings.settings, setting.shape, facts, setting.event.mass)
    found: list[BodyStage] = []
    reasons: dict[str, str] = {}
    for stage, of in (("sph", _shock), ("dem", _grains)):
        try:
            found += of(findings, body)
        except InputError as reason:
            reasons[f"body ({stage})"] = str(reason)
    return replace(findings, body=tuple(found), flight_reasons={**findings.flight_reasons, **reasons})


def _shock(findings: Findings, body: Body) -> list[BodyStage]:
    if findings.shock is None:
        return []
    first = snapshot.series(findings.inputs / "2_sph")[0]
    late = findings.shock.last
    return [bodies.of_stage(body, "sph", first, findings.shock.end_path, _measures(late))]


def _grains(findings: Findings, body: Body) -> list[BodyStage]:
    if findings.grains is None or findings.setting.patch is not None:
        return []
    last = findings.inputs / "5_dem" / f"last{snapshot.SUFFIX}"
    bed = findings.inputs / "3_bed" / f"bed{snapshot.SUFFIX}"
    return [bodies.of_stage(body, "dem", bed, last, _measures(findings.grains.last))]


def _measures(last: object) -> Measures | None:
    return getattr(last, "measures", None)
