"""Overlays, as properties of any case."""

from __future__ import annotations

import copy
import tomllib

import pytest
import tomlkit
from hypothesis import given
from hypothesis import strategies as st

from matter.errors import InputError
from pipeline.case import overlay

names = st.from_regex(r"[a-z_]{1,6}", fullmatch=True)
texts = st.text(st.characters(codec="utf-8", exclude_categories=["C"]))
values = st.one_of(st.integers(-(2**63), 2**63 - 1), st.booleans(), st.floats(allow_nan=False), texts)
tables = st.dictionaries(names, values, max_size=4)
documents = st.recursive(tables, lambda inner: st.dictionaries(names, values | inner, max_size=4), max_leaves=12)
paths = st.lists(names, min_size=1, max_size=4).map(tuple)


def at(document, path):
    for part in path:
        document = document[part]
    return document


@given(documents, documents)
def test_merging_keeps_the_upper_and_what_it_does_not_touch(base, over):
    before = copy.deepcopy((base, over))
    result = overlay.merged(base, over)
    assert (base, over) == before
    assert set(result) == set(base) | set(over)
    for key in result:
        if key not in over:
            assert result[key] == base[key]
        elif not (isinstance(base.get(key), dict) and isinstance(over[key], dict)):
            assert result[key] == over[key]
    assert overlay.merged(result, over) == result


@given(documents)
def test_merging_with_nothing_changes_nothing(document):
    assert overlay.merged(document, {}) == overlay.merged({}, document) == document


@given(documents, paths, values)
def test_an_assignment_is_found_where_it_was_put(document, path, value):
    try:
        result = overlay.assigned(document, path, value)
    except InputError:  # the path leads through a value
        for depth in range(1, len(path)):
            if not isinstance(at(document, path[:depth]), dict):
                return
        raise
    assert at(result, path) == value


@given(paths, values)
def test_a_value_written_as_toml_is_read_back(path, value):
    text = tomlkit.item(value).as_string()
    assert overlay.parsed(f"{'.'.join(path)} = {text}") == (path, tomllib.loads(f"v = {text}")["v"])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("30 min", "30 min"),
        ("", ""),
        ("a=b", "a=b"),
        ("[1, 2]", [1, 2]),
        ("true", True),
        ("'x'", "x"),
        ("1\nother = 2", "1\nother = 2"),
    ],
)
def test_what_is_not_toml_is_text(text, value):
    assert overlay.parsed(f"sph.duration={text}") == (("sph", "duration"), value)


@given(st.text())
def test_no_text_whatever_breaks_the_reader(text):
    try:
        path, _ = overlay.parsed(text)
    except InputError as reason:
        assert "--set" in str(reason)
    else:
        assert path
