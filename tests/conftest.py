"""What all tests share: one thread unless a test asks for more, no window for pictures, and no property that is judged
by the time an example takes: a busy machine is no fault of the code. The longest files begin first, so that no worker
waits for one of them at the end."""

import os
from pathlib import Path

import hypothesis
import pytest

TESTS = Path(__file__).parent
LONGEST = (
    "pipeline/test_end_to_end.py", "dem/test_engines.py", "crater/test_stage.py", "matter/test_solids.py",
    "pipeline/test_notebooks.py", "sph/test_ground.py", "crater/test_bodies.py", "handoff/test_stage.py",
    "nbody/test_products.py", "pipeline/test_stop.py", "handoff/test_whole_body.py", "sph/test_boundaries.py",
    "sph/test_state.py", "sph/test_late.py", "pipeline/test_sweep.py",
)  # fmt: skip
"""Forty seconds and more, kernels to be compiled included, the longest first; the notebooks (``.ci/run``) once the
first file has compiled what they run."""

# files of tests need not survive a loss of power; processes that are killed lose nothing by it
os.fsync = lambda handle: None

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")

hypothesis.settings.register_profile(
    "unhurried", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("unhurried")


@pytest.fixture(scope="session")
def run_case():
    """``run_case(case, *options, out=None)``: the command in this process, with one thread and its runs in ``out``, by
    default the folder ``runs`` of the case: the exit code, and the run's folder (None where there is none)."""
    from pipeline import cli

    def run(case: Path, *options: str, out: Path | None = None) -> tuple[int, Path | None]:
        out = out or Path(case) / "runs"
        words = ["run_case", str(case), "--out", str(out), "--threads", "1", *options]
        with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as ended:
            patch.setattr("sys.argv", words)
            cli.run_case()
        return int(ended.value.code or 0), next(out.glob("[!.]*-*"), None)

    return run


def pytest_collection_modifyitems(items):
    """Files of LONGEST before all others, which keep their order."""
    order = {TESTS / name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path, len(order)))
