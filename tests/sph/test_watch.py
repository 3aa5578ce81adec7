"""A run that has gone wrong is stopped with a diagnosis; one that goes well never is."""

from __future__ import annotations

import pytest

from matter.errors import UnphysicalState
from sph.stepping import watch


def rows(*totals: float) -> list[dict[str, float | str]]:
    return [{"time_s": float(k), "total_J": total} for k, total in enumerate(totals)]


def test_energy_from_nowhere_is_named_with_its_time():
    look = watch.Watch(100.0, pushed=False)
    look.energy(rows(50.0, 55.0, 59.0), late=False)
    with pytest.raises(
        UnphysicalState, match=r"at 2 s the total energy is 0\.12 times the projectile's.*at 1 s 0\.05"
    ):
        look.energy(rows(50.0, 55.0, 62.0), late=False)
    with pytest.raises(UnphysicalState, match="nan times"):
        look.energy(rows(50.0, float("nan")), late=True)


@pytest.mark.parametrize(
    ("scale", "pushed", "total", "late", "stops"),
    [
        (100.0, False, 62.0, False, True),
        (100.0, False, -500.0, False, False),  # a layer takes energy
        (100.0, False, 140.0, False, True),
        (100.0, True, 140.0, False, False),  # an edge does work
        (100.0, True, 160.0, False, True),
        (100.0, False, 1e6, True, False),  # of the late medium internal energy does not count
        (0.0, False, 1e6, False, False),  # no projectile to compare with
    ],
)
def test_a_gain_stops_unless_work_is_done_or_energy_does_not_count(scale, pushed, total, late, stops):
    look, stopped = watch.Watch(scale, pushed=pushed), False
    try:
        look.energy(rows(50.0, total), late=late)
    except UnphysicalState:
        stopped = True
    assert stopped == stops


def test_a_step_that_collapses_and_stays_there():
    look = watch.Watch(1.0, pushed=False)
    look.step(1.0, 0.0, "sound")
    for _ in range(watch.IN_A_ROW - 1):
        look.step(1e-6, 1.0, "energy")
    with pytest.raises(UnphysicalState, match=r"fallen to 1e-06 s at 1 s.*limited by energy"):
        look.step(1e-6, 1.0, "energy")


def test_single_short_steps_up_to_an_output_do_not_count():
    look = watch.Watch(1.0, pushed=False)
    for k in range(3 * watch.IN_A_ROW):
        look.step(1e-9 if k % 2 else 1.0, float(k), "output")
        assert look.short == k % 2
