"""What a case leaves open and several stages share, filled in from what it says: stages, extent of flat ground,
expected crater, kind of ground.

    [case] title      the case's name
    [case] stages     nbody where the case has its table; sph; bed, handoff, dem where
                      the case has one of their tables, or where there is weight and strength does not hold the crater
                      (loose grains would let it slump), in no liquid and no body that breaks as a whole; crater, but
                      of a body that breaks. On an ellipsoid or mesh: sph, crater, and of the others those whose table
                      the case has
    [[target.layers]] name: its material; thickness of the lowest of flat ground: down to 2.2 expected diameters,
                      which is also its half width unless given
    [impact]          expected_transient_diameter by scaling laws (``pipeline.case.expected_crater``)
    [crater]          ground: what the laws of strength of the uppermost layer say
    [target] arrival  latitude, longitude, azimuth, [impact] angle_from_vertical (``pipeline.case.arrival``)

2.2 diameters leave 1.4 (2.8 crater radii) inside the quiet layer at the coarsest grading of
``sph.planning.resolution``. What only one stage needs is that stage's own default. A document with mistakes is left as
it is: ``pipeline.settings.checking`` tells them.
"""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from matter.case.body import SOLIDS, Impact, Target
from matter.case.quantity import REQUIRED
from matter.errors import InputError
from pipeline.case import arrival, stages
from pipeline.case.complaints import Complaint

EXTENT = 2.2
"""Depth and half width of flat ground over the expected diameter."""
FROM_ENCOUNTERS = {"speed": "15 km/s", "angle_from_vertical": "45 deg"}
"""A case with the stage nbody may leave these of [impact] to it; until that is done, checks and predictions use the
placeholders."""
DIAMETER = ("impact", "expected_transient_diameter")
_GRAINS = ("bed", "handoff", "dem")


def completed(document: dict[str, Any], name: str) -> tuple[dict[str, Any], dict[str, Any] | None, list[Complaint]]:
    """The document with what it leaves open, the same without what depends on the impact (None where nothing does),
    and what cannot be filled."""
    document = {**document, "case": {"title": name, **_table(document, "case")}}
    if not isinstance(document.get("target"), dict) or not isinstance(document.get("impact"), dict):
        return document, None, []
    document["target"] = _named(document["target"])
    document, against = arrival.filled(document)
    if against:
        return document, None, against
    try:
        crater = expected(document)
    except InputError as reason:
        return document, None, [Complaint(("sph", "materials"), str(reason))]
    except (ValidationError, TypeError, AttributeError, KeyError):
        crater = None
    except ValueError as reason:
        return document, None, [Complaint(DIAMETER, str(reason))]
    document["case"].setdefault("stages", list(_chain(document, crater)))
    full = document if crater is None else _filled(document, crater)
    return full, None if full == document else document, []


def _table(document: dict[str, Any], name: str) -> dict[str, Any]:
    return document[name] if isinstance(document.get(name), dict) else {}


def _named(target: dict[str, Any]) -> dict[str, Any]:
    layers = target.get("layers")
    if not isinstance(layers, list) or not all(isinstance(layer, dict) for layer in layers):
        return target
    return {
        **target,
        "layers": [
            {"name": layer["material"], **layer} if isinstance(layer.get("material"), str) else layer
            for layer in layers
        ],
    }


def _open_bottom(target: dict[str, Any]) -> bool:
    layers = target.get("layers")
    return (
        target.get("shape", "sphere") not in ("sphere", *SOLIDS)
        and isinstance(layers, list)
        and bool(layers)
        and "thickness" not in layers[0]
    )


def expected(document: dict[str, Any]) -> Any:
    """The expected crater, or None where nothing is left open that depends on it. Raises ``ValueError`` where none can
    be expected."""
    target, impact, sph = document["target"], document["impact"], _table(document, "sph")
    asked = any(stage in document for stage in _GRAINS)
    measured = (
        target.get("shape") not in SOLIDS
        and "crater" in document["case"].get("stages", ("crater",))
        and "ground" not in _table(document, "crater")
        and stages.takes("crater", "ground")
    )
    if DIAMETER[1] in impact and not _open_bottom(target) and not measured and ("stages" in document["case"] or asked):
        return None
    from pipeline.case import expected_crater
    from sph.materials.settings import Choice
    from sph.planning import durations

    layers = [
        {"thickness": "1 km", **layer} if k == 0 and _open_bottom(target) else layer
        for k, layer in enumerate(target["layers"])
    ]
    body = Target.model_validate({**target, "layers": layers}, context=REQUIRED)
    shot = Impact.model_validate({**FROM_ENCOUNTERS, DIAMETER[1]: "1 m", **impact}, context=REQUIRED)
    choices = {
        name: Choice.model_validate(value, context=REQUIRED) for name, value in sph.get("materials", {}).items()
    }
    rows = durations.chosen(body, shot, choices)
    strong, breaks = sph.get("strength", True) is True, sph.get("damage", True) is True
    try:
        return expected_crater.of_case(
            body, shot, rows, strong, breaks, shot.expected_transient_diameter if DIAMETER[1] in impact else None
        )
    except InputError as reason:
        raise ValueError(str(reason)) from None


def _filled(document: dict[str, Any], crater: Any) -> dict[str, Any]:
    """The document with expected diameter, thickness of the lowest layer and kind of ground by the expected crater,
    where it leaves them open."""
    document, impact, target = dict(document), dict(document["impact"]), dict(document["target"])
    if DIAMETER[1] not in impact:
        impact[DIAMETER[1]] = f"{float(f'{crater.diameter:.2g}')!r} m"
    if _open_bottom(target):
        above = Target.model_validate(
            {**target, "layers": [{"thickness": "1 km", **target["layers"][0]}, *target["layers"][1:]]},
            context=REQUIRED,
        )
        rest = above.radius - above.layers[0].thickness
        thickness = max(EXTENT * crater.diameter - rest, 0.5 * EXTENT * crater.diameter)
        target["layers"] = [
            {**target["layers"][0], "thickness": f"{float(f'{thickness:.2g}')!r} m"},
            *target["layers"][1:],
        ]
    if (
        "ground" not in _table(document, "crater")
        and target.get("shape") not in SOLIDS
        and "crater" in document["case"]["stages"]
        and stages.takes("crater", "ground")
    ):
        document["crater"] = {**_table(document, "crater"), "ground": crater.ground.kind}
    return {**document, "impact": impact, "target": target}


def _chain(document: dict[str, Any], crater: Any) -> tuple[str, ...]:
    solid = document["target"].get("shape") in SOLIDS
    wanted = {"sph", "crater"}
    if "nbody" in document:
        wanted.add("nbody")
    if solid:
        wanted.update(stage for stage in _GRAINS if stage in document)
    elif any(stage in document for stage in _GRAINS) or (crater is not None and _collapses(crater)):
        wanted.update(_GRAINS)
    elif crater is not None and crater.breaks:
        wanted.discard("crater")
    return tuple(stage for stage in stages.ORDER if stage in wanted)


def _collapses(crater: Any) -> bool:
    """Whether loose grains end the crater: weight acts and strength does not hold it; a cavity in water closes by
    waves, which grains do not make, and a body that breaks has none."""
    from dem.contact.settings import LIQUIDS

    return crater.gravity > 0.0 and not (crater.held or crater.breaks or crater.material in LIQUIDS)
