"""Compiled code: a law that was edited in another file is never served from an old cache."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.lowering import BaseLower

from matter.compilation import jit
from sph.kernels import wendland

ROOT = Path(__file__).resolve().parents[2]
LAW = """\
from matter.compilation.jit import law


@law
def pressure(rho):
    return {factor} * rho
"""
LOOP = """\
import numpy as np

from matter.compilation.jit import kernel
from sph import law_of_test


@kernel
def total(rho):
    s = 0.0
    for i in range(rho.size):
        s += law_of_test.pressure(rho[i])
    return s


print(total(np.ones(4)), total.stats.cache_hits)
"""


@pytest.fixture
def house(small_house):
    """A small copy of the house with a law and a loop."""
    (small_house / "sph" / "loop.py").write_text(LOOP)
    (small_house / "sph" / "law_of_test.py").write_text(LAW.format(factor=2.0))
    return small_house


def result(house: Path) -> tuple[float, bool]:
    """The sum that the loop prints, and whether its machine code came from the cache."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(house),
        "BOLIDE_CACHE": str(house / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    done = subprocess.run(
        [sys.executable, "-P", "-m", "sph.loop"],
        capture_output=True,
        text=True,
        env=environment,
        timeout=120,
        cwd=house,
    )
    assert done.returncode == 0, done.stderr
    value, hits = done.stdout.split(maxsplit=1)
    return float(value), "Counter()" not in hits


def test_an_edited_law_in_another_file_is_compiled_anew(house):
    assert result(house) == (8.0, False)
    assert result(house) == (8.0, True)  # the cache works
    (house / "sph" / "law_of_test.py").write_text(LAW.format(factor=3.0))
    assert result(house) == (12.0, False)  # and does not serve the old law
    (house / "sph" / "untouched.py").write_text("x = 1\n")
    assert result(house) == (12.0, True)  # a file that nothing imports changes nothing


def test_a_law_that_was_edited_after_its_import_is_not_kept_for_the_new_one(house):
    """A process that has the old law in memory when it hashes the new one."""
    edits = "from pathlib import Path\n\nfrom sph import law_of_test\n\n"
    edits += f"Path(law_of_test.__file__).write_text({LAW.format(factor=3.0)!r})\n"
    (house / "sph" / "loop.py").write_text(edits + LOOP)
    assert result(house) == (8.0, False)
    assert result(house) == (12.0, False)


def test_the_key_follows_every_import_and_the_numba_version(tmp_path, monkeypatch):
    monkeypatch.setattr(jit, "HOUSE", tmp_path)
    (tmp_path / "sph" / "eos").mkdir(parents=True)
    for path, text in {
        "sph/loop.py": "from sph.eos import tillotson as law\nimport numpy\n",
        "sph/eos/__init__.py": "",
        "sph/eos/tillotson.py": "import sph.constants\n",
        "sph/constants.py": "G = 6.7e-11\n",
        "sph/other.py": "x = 1\n",
    }.items():
        (tmp_path / path).write_text(text)
    loop = tmp_path / "sph" / "loop.py"
    reached = {path.name for path in jit.reached_sources(loop)}
    assert reached == {"loop.py", "__init__.py", "tillotson.py", "constants.py"}

    def key():
        jit.source_key.cache_clear()
        jit._local_imports.cache_clear()
        jit.reached_sources.cache_clear()
        return jit.source_key(loop)

    first = key()
    (tmp_path / "sph" / "other.py").write_text("x = 2\n")
    assert key() == first
    (tmp_path / "sph" / "constants.py").write_text("G = 6.6743e-11\n")
    second = key()
    assert second != first
    monkeypatch.setattr(numba, "__version__", "0.0.0")
    assert key() != second


def test_threads_are_bounded_by_what_numba_found():
    before = numba.get_num_threads()
    try:
        assert jit.set_threads(1) == 1 == numba.get_num_threads()
        assert jit.set_threads(10**6) == numba.config.NUMBA_NUM_THREADS
        assert jit.set_threads(None) == numba.config.NUMBA_NUM_THREADS
    finally:
        numba.set_num_threads(before)


def test_a_law_is_also_a_python_function():
    @jit.law
    def cube(x):
        return x**3

    assert cube(3.0) == cube.py_func(3.0) == 27.0


def test_a_law_of_the_project_is_compiled_without_wrappers_until_python_calls_it():
    law = wendland.kernel

    @jit.kernel
    def twice(q):
        return 2.0 * law(q, 1.0)

    assert twice(0.5) == 2.0 * law.py_func(0.5, 1.0)
    assert law.targetoptions["no_cpython_wrapper"]
    assert law(0.5, 1.0) == law.py_func(0.5, 1.0)  # without a wrapper this call would end the process


def test_only_what_python_calls_has_a_wrapper_and_none_is_for_c(monkeypatch):
    """Not the body of a parallel loop, which numba compiles as a function of its own."""
    made = []

    def record(name):
        make = getattr(BaseLower, name)

        def recorded(self, *arguments):
            made.append((name, self.fndesc.qualname.rpartition(".")[2]))
            make(self, *arguments)

        monkeypatch.setattr(BaseLower, name, recorded)

    record("create_cpython_wrapper")
    record("create_cfunc_wrapper")

    @jit.parallel_kernel
    def doubled(x, out):
        for i in jit.prange(len(x)):
            out[i] = 2.0 * x[i]

    out = np.empty(100)
    doubled(np.arange(100.0), out)
    assert (out == 2.0 * np.arange(100)).all()
    assert made == [("create_cpython_wrapper", "doubled")]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    jit.cache_root.cache_clear()
    monkeypatch.setenv("BOLIDE_CACHE", str(tmp_path / "kernels"))
    yield tmp_path / "kernels"
    jit.cache_root.cache_clear()


def test_the_folder_of_kernels_is_made_for_its_owner_alone(cache):
    assert jit.cache_root() == cache and cache.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("given", ["", "relative/caches"])
def test_a_cache_folder_that_is_no_place_counts_as_not_given(cache, tmp_path, monkeypatch, given):
    """XDG Base Directory Specification: empty is as if not set, a relative path is to be ignored."""
    monkeypatch.delenv("BOLIDE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", given)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    assert jit.cache_root() == tmp_path / "home" / ".cache" / "bolide" / "kernels"
    assert [path.name for path in tmp_path.iterdir()] == ["home"]


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777])
def test_a_folder_of_kernels_that_others_may_write_to_is_refused(cache, mode):
    cache.mkdir()
    cache.chmod(mode)
    with pytest.raises(PermissionError, match=r"may be written to by other users.*chmod go-w it .*BOLIDE_CACHE"):
        jit.cache_root()


def test_a_folder_of_kernels_of_somebody_else_is_refused(cache, monkeypatch):
    cache.mkdir()
    monkeypatch.setattr(jit.os, "getuid", lambda: cache.stat().st_uid + 1)
    with pytest.raises(PermissionError, match="belongs to another user"):
        jit.cache_root()


def test_without_compilation_all_are_plain_functions():
    code = "from dem.contact import walls; from sph.kernels import wendland as w; "
    code += "print(w.kernel(0.5, 1.0) > 0.0, type(walls.distances))"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.stdout.split(maxsplit=1) == ["True", "<class 'function'>\n"], done.stderr
