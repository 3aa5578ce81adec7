"""The presets of a case that were not asked for: a mistake in one of them is told by ``--check``, not on the day when
it is used."""

from __future__ import annotations

import tomllib

from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.case.read import Case
from pipeline.settings.compose import compose


def faults(case: Case) -> list[str]:
    """A sentence for each preset of the case's file, other than its own, with which the case could not be used."""
    sentences = []
    for name in tomllib.loads(case.file.read_text()).get("preset", {}):
        if name == case.preset:
            continue
        try:
            compose(cases.read(case.file, name))
        except InputError as reason:
            first, *rest = str(reason).splitlines()
            mistakes = "; ".join(" ".join(line.split()) for line in rest) or first
            sentences.append(f"preset {name} cannot be used: {mistakes}")
    return sentences
