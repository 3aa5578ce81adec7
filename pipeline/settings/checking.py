"""A case's tables checked against the settings of their stages: the settings that are right, and all complaints at
once."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from pydantic import BaseModel, ValidationError

from dem.trials import angle_of_friction
from matter.case import at_rest
from matter.case.at_rest import AtRest
from matter.case.body import FLAT, SOLIDS, Impact, Model, Target
from matter.case.identity_fields import following
from matter.case.quantity import REQUIRED
from matter.errors import InputError
from pipeline.case import outside, overlay, stages
from pipeline.case.case_table import CaseTable
from pipeline.case.complaints import Complaint, complaints, dotted, names_at, short, unknown
from pipeline.case.left_open import FROM_ENCOUNTERS
from pipeline.case.plain import plain
from pipeline.case.read import Case, read
from pipeline.case.toml_lines import KeyPath

_MOST_ROWS, _LONGEST_ROW = 30, 1000
# filled in where the rest is in order (``pipeline.case.left_open``), and what stands in for it where it is not
FOLLOWS: dict[KeyPath, str] = {
    ("impact", "expected_transient_diameter"): "1 m",
    ("target", "layers", 0, "thickness"): "1 km",
    ("target", "layers", 0, "name"): "ground",
}


def settings_of(case: Case, wanted: tuple[str, ...] = stages.ORDER) -> dict[str, Model]:
    """The settings of every stage whose module exists, by its name, of what the case itself says.

    ``wanted`` are the stages that are to run: a missing module is an error for these only. Raises ``InputError`` with
    every complaint.
    """
    if case.holds_a_sweep_alone:
        raise InputError(
            f"{case.file} holds a sweep alone: run_case {case.file} --sweep runs it, --sweep --check says what"
        )
    settings, faults = _composed(case, wanted)
    if faults:
        raise InputError(listed(case, faults, wanted))
    return settings


def _composed(case: Case, wanted: tuple[str, ...]) -> tuple[dict[str, Model], list[Complaint]]:
    """The settings that are right, and every complaint."""
    settings: dict[str, Model] = {}
    faults = [*case.complaints, *_forgotten(case)]
    document = case.document
    if not case.pinned:  # what is forgotten is said once, and not again by every stage
        document = {**document, "impact": {**FROM_ENCOUNTERS, **document["impact"]}}
    faults += _tables(document)
    faults += _checked(CaseTable, document.get("case", {}), ("case",))[1]
    shared = {name: document[name] for name in stages.SHARED_TABLES if name in document}
    for name, model in (("target", Target), ("impact", Impact)):
        if name in shared:
            faults += _checked(model, shared[name], (name,))[1]
    if not any(
        complaint.path[:2] == ("case", "stages") for complaint in faults
    ):  # a stage's name that is misspelt is one mistake
        idle = [stage for stage in stages.ORDER if stage in document and stage not in case.stages]
        faults += [Complaint((stage,), f"[case] stages does not include {stage}") for stage in idle]
    faults += outside.faults(case.outside, stages.OUTSIDE)
    for stage in case.stages:
        try:
            model = stages.load(stage).Settings
        except InputError as reason:
            if stage in wanted and stage not in case.outside:
                faults.append(Complaint((stage,), str(reason)))
            continue
        table = document.get(stage, {})
        if not isinstance(table, dict):
            continue  # already complained about
        if "contact" in model.model_fields:
            document = _one_friction(document, settings.get("sph"))
        payload, moved = _payload(model, document.get(stage, {}), shared, document)
        if "densities" in model.model_fields:
            payload["densities"] = _own_densities(settings.get("sph"))
        if stage == "dem" and (bed := settings.get("bed")) is not None and "target" in payload:
            payload["target"] = _ground(bed, payload["target"])
        if "pinned" in model.model_fields:
            payload["pinned"] = case.pinned
        if "until" in model.model_fields and (latest := _end_of_collapse(document)):
            payload["until"] = latest
            moved["until"] = ("dem", "latest_time")
        model_settings, wrong = _checked(model, payload, (stage,), moved)
        wrong += _said_in_vain(model, table, stage)
        if stage in case.outside:  # it will not run: misspelt keys still count, missing ones do not
            wrong = [complaint for complaint in wrong if complaint.message != "is missing"]
        faults += wrong
        if model_settings is not None:
            settings[stage] = model_settings
    if not faults:
        faults += outside.no_ground(case.outside, settings)
    first = [fault for fault in faults if not (fault.message == "is missing" and fault.path in FOLLOWS)]
    if not first and faults and (stood_in := _stood_in(case)) is not None:
        first = _composed(stood_in, wanted)[1]
    return settings, first or faults


def _end_of_collapse(document: dict[str, Any]) -> Any:
    """``[dem] latest_time`` of an ellipsoid or mesh: what comes back to it until then is followed in the collapse, and
    the handoff has to know."""
    return overlay.at(document, "dem.latest_time") if overlay.at(document, "target.shape") in SOLIDS else None


def _stood_in(case: Case) -> Case | None:
    """The case with stand-ins for all that could not be filled in, which is no mistake of its own: then its
    cause is told. None where nothing is left open."""
    document = case.document
    for path, value in FOLLOWS.items():
        if overlay.at(document, ".".join(map(str, path))) is None:
            document = overlay.assigned(document, path, value)
    return None if document == case.document else replace(case, document=document)


def _forgotten(case: Case) -> list[Complaint]:
    """What a case has to say itself, for nothing else would be right: how the projectile hits, unless encounters find
    it; and how heavy flat ground is."""
    target, impact = (case.document.get(name) for name in stages.SHARED_TABLES)
    faults = []
    missing = [key for key in FROM_ENCOUNTERS if isinstance(impact, dict) and key not in impact]
    if "nbody" not in case.stages:
        faults = [
            Complaint(("impact", key), f'is missing, "{example}" for example (or let encounters find it: [nbody])')
            for key, example in FROM_ENCOUNTERS.items()
            if key in missing
        ]
    elif len(missing) == 1 and "nbody" not in case.outside:
        [given] = (key for key in FROM_ENCOUNTERS if key not in missing)
        words = f"the encounters of [nbody] find it together with {missing[0]}: give both, or leave both out"
        faults = [Complaint(("impact", given), words)]
    if isinstance(target, dict) and target.get("shape") in FLAT and "gravity" not in target:
        words = 'is missing: flat ground needs it, "9.81 m/s^2" for example ("0 m/s^2" where none acts)'
        faults.append(Complaint(("target", "gravity"), words))
    return faults


def _tables(document: dict[str, Any]) -> list[Complaint]:
    valid = ["case", *stages.SHARED_TABLES, *stages.ORDER, "sweep", "inverse", "preset"]
    faults = []
    for name, value in document.items():
        if name not in valid:
            faults.append(Complaint((name,), unknown((name,), valid, "table")))
        elif not isinstance(value, dict):
            faults.append(Complaint((name,), f"is a table: write [{name}]"))
    return faults


def _payload(
    model: type[BaseModel], table: dict[str, Any], shared: dict[str, Any], document: dict[str, Any]
) -> tuple[dict[str, Any], dict[str, KeyPath]]:
    """A stage's own table with the shared tables that its settings declare, and where those stand in the document."""
    payload, moved = dict(table), dict[str, KeyPath]()
    for name in stages.SHARED_TABLES:
        if name in model.model_fields and name in shared and name not in table:
            payload[name], moved[name] = shared[name], (name,)
    dem = document.get("dem")
    if "contact" in model.model_fields and "contact" not in table and isinstance(dem, dict) and "contact" in dem:
        payload["contact"], moved["contact"] = dem["contact"], ("dem", "contact")
    for name, field_info in model.model_fields.items():
        # a table that gives some keys of a field changes these keys of its default, not the others
        if isinstance(field_info.default, BaseModel) and isinstance(payload.get(name), dict):
            payload[name] = overlay.merged(plain(field_info.default), payload[name])
    return payload, moved


def _ground(bed: Any, target: Any) -> Any:
    """The ``target`` for the stages of grains: flat ground where their ``bed`` is a patch of a body's."""
    return plain(stages.load("bed").ground(bed)) if getattr(bed, "on_patch", False) else target


def _one_friction(document: dict[str, Any], sph: Any) -> dict[str, Any]:
    """The document, its grains with the friction angle of the ground of the shock stage where it says nothing else of
    their friction; the nearest angle that was measured of such grains where the ground's lies outside."""
    contact = document.get("dem", {}).get("contact", {}) if isinstance(document.get("dem"), dict) else None
    shell = contact.get("shell", {}) if isinstance(contact, dict) else None
    if not getattr(sph, "strength", False) or not isinstance(shell, dict):
        return document
    if not isinstance(contact, dict) or "friction_angle" in contact or {"friction", "shape"} & set(shell):
        return document
    if (soil := sph.chosen_materials().loose(sph.target.layers[-1].material)) is None:
        return document
    reached = min(max(math.degrees(soil.friction_angle), angle_of_friction.LEAST), angle_of_friction.STEEPEST)
    return overlay.assigned(document, ("dem", "contact", "friction_angle"), f"{reached:.12g} deg")


def _own_densities(sph: Any) -> dict[str, AtRest]:
    """What ``[sph.materials]`` makes denser or lighter, for the stages that do not read it."""
    return at_rest.own(sph.chosen_materials().at_rest) if sph is not None else {}


def _said_in_vain(model: type[Model], table: dict[str, Any], stage: str) -> list[Complaint]:
    """Keys that a case may not say, for they follow from others."""
    against = []
    for *outer, name in following(model):
        if overlay.at(table, ".".join((*outer, name))) is not None:
            hidden = {*following(model), *((shared,) for shared in stages.SHARED_TABLES)}
            names = [known for known in names_at(model, tuple(outer)) if (*outer, known) not in hidden]
            against.append(Complaint((stage, *outer, name), unknown((stage, *outer, name), names)))
    return against


def _checked(
    model: type[Model], payload: Any, key_path: KeyPath, moved: dict[str, KeyPath] | None = None
) -> tuple[Model | None, list[Complaint]]:
    try:
        return model.model_validate(payload, context=REQUIRED), []
    except ValidationError as error:
        faults = []
        for path, message in complaints(model, error):
            first = path[0] if path else None
            origin = moved[str(first)] if moved and first in moved else (*key_path, *path[:1])
            if message == "is missing" and len(path) == 1 and first in stages.SHARED_TABLES:
                origin = (str(first),)
            faults.append(Complaint((*origin, *path[1:]), message))
        return None, faults


def listed(case: Case, faults: list[Complaint], wanted: tuple[str, ...]) -> str:
    """All complaints in the order of the file, then those about options; those of composing for the ``wanted`` stages
    blame an option that causes them."""
    rows = []
    faults = list(dict.fromkeys(faults))
    blamed = _blamed(case, faults, wanted) if wanted else {}
    for complaint in faults:
        path, message = complaint
        origin = blamed.get(complaint) or (case.origin(path) if path else "")
        line = origin.rpartition(":")[2]
        rows.append(
            (
                int(line) if line.isdigit() else 10**9,
                f"  {origin}  {dotted(path)}: {message}" if path else f"  {message}",
            )
        )
    rows.sort(key=lambda row: row[0])
    texts, said = [], set()
    for _, text in rows[:_MOST_ROWS]:
        words, _, names = text.partition(" (known: ")
        texts.append(short(words if names in said else text, _LONGEST_ROW))
        said.add(names)  # names that are known are told once
    if len(rows) > _MOST_ROWS:
        texts.append(f"  and {len(rows) - _MOST_ROWS} more")
    return f"{case.file} cannot be used, {len(rows)} error{'s' if len(rows) > 1 else ''}:\n" + "\n".join(texts)


def _blamed(case: Case, faults: list[Complaint], wanted: tuple[str, ...]) -> dict[Complaint, str]:
    """The options at fault for complaints about other keys: those without which a complaint would not be there."""
    blamed: dict[Complaint, str] = {}
    for number, assignment in enumerate(case.overrides):
        try:
            key = overlay.parsed(assignment)[0]
            without = _composed(
                read(case.file, case.preset, case.overrides[:number] + case.overrides[number + 1 :], case.size), wanted
            )[1]
        except InputError:
            continue  # that option has a complaint of its own
        for complaint in faults:
            if complaint.path and complaint not in without:
                blamed[complaint] = (
                    f"{blamed[complaint]}, --set {dotted(key)}" if complaint in blamed else f"--set {dotted(key)}"
                )
    return blamed
