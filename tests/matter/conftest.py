"""A small copy of the house, for tests that edit sources."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

MATTER = Path(__file__).parents[2] / "matter"


@pytest.fixture
def small_house(tmp_path) -> Path:
    """The floor's compiled-code policy, and an empty room ``sph``."""
    (tmp_path / "matter" / "compilation").mkdir(parents=True)
    (tmp_path / "sph").mkdir()
    (tmp_path / "sph" / "__init__.py").write_text("")
    for name in (
        "__init__.py",
        *(f"compilation/{m}.py" for m in ("__init__", "jit", "kernel_cache", "law_dispatcher")),
    ):
        shutil.copyfile(MATTER / name, tmp_path / "matter" / name)
    return tmp_path
