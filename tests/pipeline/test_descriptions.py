"""Every key of a case file says what it means: the settings themselves are the reference that ``run_case --describe`` prints."""

from __future__ import annotations

import typing
from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from pipeline import stages
from pipeline.case import CaseTable


def models(annotation: object) -> Iterator[type[BaseModel]]:
    """The models named in an annotation, and those that they hold."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            yield from models(field.annotation)
    for inner in typing.get_args(annotation):
        yield from models(inner)


@pytest.mark.parametrize("table", ["case", *stages.ORDER])
def test_every_key_is_described(table):
    top = CaseTable if table == "case" else stages.load(table).Settings
    for model in set(models(top)):
        for name, field in model.model_fields.items():
            text = (field.description or "").strip()
            sentence = len(text) > 8 and (text.startswith("``") or text[0].isupper()) and text.endswith(".")
            assert sentence, f"{model.__module__}.{model.__name__}.{name}: {text!r}"
