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


def test_what_takes_energy_or_pushes_or_no_longer_counts_it_is_no_sign():
    watch.Watch(100.0, pushed=False).energy(rows(50.0, -500.0), late=False)
    watch.Watch(100.0, pushed=True).energy(rows(50.0, 140.0), late=False)
    watch.Watch(100.0, pushed=False).energy(rows(50.0, 1e6), late=True)
    watch.Watch(0.0, pushed=False).energy(rows(50.0, 1e6), late=False)


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
