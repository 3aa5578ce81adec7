"""The settings of each stage from a case: what it says, and the chain errors that its ``expected.toml`` knows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import replace

from matter.case.body import Model
from matter.case.identity_fields import identity_fields
from pipeline.case import outside, stages
from pipeline.case.read import Case
from pipeline.settings import checking, expected
from pipeline.store import provenance


def compose(case: Case, wanted: Iterable[str] = stages.ORDER) -> dict[str, Model]:
    """The settings of every stage whose module exists, by its name.

    ``wanted`` are the stages that are to run: a missing module is an error for these only. Raises ``InputError`` with
    every complaint.
    """
    return checking.settings_of(_with_chain(case), tuple(wanted))


def _with_chain(case: Case) -> Case:
    """The case with the chain errors of its crater (``pipeline.settings.expected``), where it is one that was measured
    and names none itself."""
    table = case.document.get("crater", {})
    if (
        "crater" not in case.stages
        or not isinstance(table, dict)
        or "chain" in table
        or not stages.takes("crater", "chain")
    ):
        return case
    errors = expected.chain_of(case)
    return replace(case, document={**case.document, "crater": {**table, "chain": errors}}) if errors else case


def hash8(case: Case) -> str:
    """Eight digits that name a run folder: a hash of the composed values that decide results, and of files from
    elsewhere by content; never of what was typed.

    Raises ``InputError`` with every complaint about the case.
    """
    settings = checking.settings_of(case, case.stages)
    values = {
        stage: identity_fields(settings[stage])
        for stage in case.stages
        if stage in settings and stage not in case.outside
    }
    files = {
        stage: [provenance.file_sha256(path) for path in outside.taken(stage, file)]
        + [text for text in [outside.ground(stage, file, settings.get(stage))] if text]
        for stage, file in case.outside.items()
    }
    return hashlib.sha256(json.dumps([values, files], sort_keys=True).encode()).hexdigest()[:8]
