"""A kernel runs the same machine code in the process that compiles it and in those that load it, and closures are
found again."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dem.grains import forces
from matter.compilation import kernel_cache

ROOT = Path(__file__).resolve().parents[2]
# pair sums of an elastic body, as in the shock stage: long enough for the optimiser to arrange them otherwise when it
# sees them a second time
PAIRS = """\
import hashlib
import sys

import numpy as np

from matter.compilation.jit import law, parallel_kernel, prange


@law
def slope(q):
    return -(2.0 - q) ** 2 * 0.75 if q > 1.0 else -3.0 * q + 2.25 * q * q


@law
def pressure(rho, u):
    e = rho / 2700.0
    m = e - 1.0
    return (0.5 + 1.5 / (u / (4.87e8 * e * e) + 1.0)) * rho * u + 26.7e9 * m + 26.7e9 * m * m


@parallel_kernel(fastmath=True)
def rates(x, v, rho, u, h, S, out, first, col):
    for i in prange(x.shape[0]):
        ax, ay, az, du = 0.0, 0.0, 0.0, 0.0
        own = pressure(rho[i], u[i]) / (rho[i] * rho[i])
        for k in range(first[i], first[i + 1]):
            j = col[k]
            dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
            r2 = dx * dx + dy * dy + dz * dz
            r = np.sqrt(r2)
            q = r / h[i]
            if q < 2.0 and r > 0.0:
                g = slope(q) / (h[i] ** 4 * r)
                other = pressure(rho[j], u[j]) / (rho[j] * rho[j])
                w = dx * (v[i, 0] - v[j, 0]) + dy * (v[i, 1] - v[j, 1]) + dz * (v[i, 2] - v[j, 2])
                mu = h[i] * w / (r2 + 0.01 * h[i] * h[i])
                pi = 0.0
                if w < 0.0:
                    pi = (-1.0 * 3e3 * mu + 2.0 * mu * mu) / (0.5 * (rho[i] + rho[j]))
                sxx = S[i, 0] / (rho[i] * rho[i]) + S[j, 0] / (rho[j] * rho[j])
                sxy = S[i, 1] / (rho[i] * rho[i]) + S[j, 1] / (rho[j] * rho[j])
                sxz = S[i, 2] / (rho[i] * rho[i]) + S[j, 2] / (rho[j] * rho[j])
                t = own + other + pi
                ax += g * (-t * dx + sxx * dx + sxy * dy + sxz * dz)
                ay += g * (-t * dy + sxy * dx - sxx * dy + sxz * dz)
                az += g * (-t * dz + sxz * dx + sxy * dy)
                du += 0.5 * t * g * w
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = ax, ay, az, du


r = np.random.default_rng(1)
n = 500
x, v, S = r.uniform(0, 10, (n, 3)), r.normal(size=(n, 3)), r.normal(size=(n, 3)) * 1e7
rho, u, h, out = 2700 * r.uniform(0.9, 1.1, n), 1e6 * r.uniform(size=n), np.full(n, 2.0), np.empty((n, 4))
rates(x, v, rho, u, h, S, out, np.arange(0, n * 40 + 1, 40), r.integers(0, n, n * 40))
print(hashlib.sha256(out.tobytes()).hexdigest(), sum(rates.stats.cache_hits.values()))
"""
CLOSURES = """\
import sys

from matter.compilation.jit import kernel


def make(factor):
    @kernel
    def scaled(x):
        return factor * x

    @kernel
    def twice_scaled(x):
        return 2.0 * scaled(x)

    return twice_scaled


loops = [make(float(text)) for text in sys.argv[1:]]
print(*(loop(1.0) for loop in loops), sum(sum(loop.stats.cache_hits.values()) for loop in loops))
"""


@pytest.fixture
def house(small_house):
    """A small copy of the house with the two scripts."""
    for name, text in {"pairs.py": PAIRS, "closures.py": CLOSURES}.items():
        (small_house / "sph" / name).write_text(text)
    return small_house


def printed(house: Path, module: str, *arguments: str) -> list[str]:
    """Words that a module prints, run in a process of its own with the cache of this house."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(house),
        "BOLIDE_CACHE": str(house / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    command = [sys.executable, "-P", "-m", module, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120, cwd=house)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_the_process_that_compiles_and_one_that_loads_end_in_the_same_bits(house):
    (compiled, no_hit), (loaded, hit) = printed(house, "sph.pairs"), printed(house, "sph.pairs")
    assert (no_hit, hit) == ("0", "1")
    assert compiled == loaded


def test_closures_are_found_again_and_told_apart(house):
    files = lambda: sorted(path.name for path in (house / "cache").rglob("*.nbc"))  # noqa: E731
    assert printed(house, "sph.closures", "2") == ["4.0", "0"]
    assert printed(house, "sph.closures", "3") == ["6.0", "0"]
    kept = files()
    assert printed(house, "sph.closures", "3", "2", "2") == ["6.0", "4.0", "4.0", "3"]
    assert files() == kept  # nothing was compiled


def names_within(loop) -> set[str]:
    """Names that a compiled closure, or any closure that it calls, reads from the function around it."""
    own = dict(zip(loop.py_func.__code__.co_freevars, loop.py_func.__closure__ or (), strict=True))
    called = [names_within(cell.cell_contents) for cell in own.values() if hasattr(cell.cell_contents, "py_func")]
    return set(own).union(*called)


def test_the_content_of_a_closure_is_that_of_its_scheme():
    def content(**flags):
        return kernel_cache.content_of(forces.pair_loop.__wrapped__(forces.Scheme(**flags)).py_func, str)

    assert content() == content()
    assert len({content(), content(normal=1), content(offset=1), content(cohesion=1)}) == 4
    # a flag that only closures within read
    one, other = (forces.pair_loop.__wrapped__(forces.Scheme(tangential=kind)) for kind in (0, 1))
    assert "scheme" not in one.py_func.__code__.co_freevars and "scheme" in names_within(one)
    assert kernel_cache.content_of(one.py_func, str) != kernel_cache.content_of(other.py_func, str)
