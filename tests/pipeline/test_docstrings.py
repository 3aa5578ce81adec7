"""Examples in docstrings are true: each ``>>>`` of the rooms is run, and what it prints compared."""

import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline", "bolide")
HAVING = sorted(file for room in ROOMS for file in (ROOT / room).rglob("*.py") if "    >>> " in file.read_text())


def test_there_are_examples():
    assert {"bolide/tables.py", "bolide/values.py"} <= {str(file.relative_to(ROOT)) for file in HAVING}


@pytest.mark.parametrize("file", HAVING, ids=lambda file: str(file.relative_to(ROOT)))
def test_examples_print_what_they_say(file):
    module = importlib.import_module(".".join(file.relative_to(ROOT).with_suffix("").parts))
    result = doctest.testmod(module)
    assert result.attempted > 0 and result.failed == 0
